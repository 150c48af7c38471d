"""Elements deleted by mask: in sessions, scene folders, pictures, downloads; the field stays whole."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.edits import Edit, EditStack
from cagefield.errors import CagefieldError, EditError, SceneError
from cagefield.exporting import edited_splats
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.splat_files import read_splats
from cagefield.geometry.cage import Cage
from cagefield.pages.page_splat_edits import decode_page_splat_edits
from cagefield.pages.page_splats import page_order
from cagefield.scene.removed_elements import Removal
from cagefield.scene.scene import Scene
from cagefield.selection.element_selection import Selection
from cagefield.selection.field_elements import elements_of_field
from cagefield.selection.selection_cages import cage_around, outer_cage_of_shape
from cagefield.selection.selection_files import dump_selection, parse_selection
from cagefield.server.editor.document import Document
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.session import Session
from cagefield.server.render_worker.edited_splats import EditedSplats, write_edited
from cagefield.server.render_worker.page_files import PageFiles
from cagefield.server.render_worker.refinement import Refinement
from cagefield.server.render_worker.renderer_cache import RendererCache
from cagefield.server.render_worker.tasks import EditsDone, PageEditsTask, Shown, values_of
from cagefield.server.render_worker.view import Display
from scenes import ball_field
from splat_scenes import BALL_RADIUS, ball_and_floor

CAMERA = Camera.look_at((0.0, -3.0, 0.9), (0, 0, 0), width=96, height=64, fov_x=0.8)
BOUNDS = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])


def ball_of(scene: Scene) -> Selection:
    """The elements of the ball."""
    positions = elements_of_field(scene.field).positions
    return Selection.from_mask(np.linalg.norm(positions, axis=1) < 1.2 * BALL_RADIUS)


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    Scene(ball_and_floor(), cameras={"test": (CAMERA,)}).save(tmp_path / "ball")
    return tmp_path / "ball"


def opened(scene: Path) -> tuple[SceneStore, Session]:
    store = SceneStore(Scene.open(scene, whole=True), scene)
    return store, Session(store.document(), BOUNDS, 0.01)


def test_the_selection_is_deleted_undone_and_restored() -> None:
    s = Session(Document(), BOUNDS, 0.01)
    with pytest.raises(EditError, match="nothing is selected"):
        s.remove_elements()
    with pytest.raises(EditError, match="nothing is deleted"):
        s.restore_elements()
    s.select_elements("Select", Selection.from_mask(np.array([True, False, False, True])))
    assert s.saved
    s.remove_elements()
    assert s.document.selection is None and not s.saved
    assert s.document.removed.mask.tolist() == [True, False, False, True]
    # Deleted elements cannot be selected again.
    s.select_elements("Invert", Selection.from_mask(np.array([True, True, False, False])))
    assert s.document.selection.mask.tolist() == [False, True, False, False]
    s.remove_elements()
    assert s.document.removed.count == 3
    s.select_elements("Select", Selection.from_mask(np.ones(4, bool)))
    with pytest.raises(EditError, match="is all of the field"):
        s.remove_elements()
    s.restore_elements()
    assert s.document.removed is None and s.history.names[-1] == "Restore deleted"
    s.undo()
    assert s.document.removed.count == 3


def test_saved_elements_are_gone_for_all_readers_and_come_back_in_the_editor(scene: Path) -> None:
    store, s = opened(scene)
    field, ball = (scene / "field.safetensors").read_bytes(), ball_of(store.scene)
    s.select_elements("Select", ball)
    s.remove_elements()
    store.autosave(s)
    assert opened(scene)[0].recovered() == s.document.saved_part
    store.save(s)
    assert s.saved and (scene / "field.safetensors").read_bytes() == field
    rest = Scene.open(scene)
    assert len(rest.field) == ball.total - ball.count == len(edited_splats(rest))
    assert np.linalg.norm(rest.field.means, axis=1).min() > BALL_RADIUS
    assert len(Scene.open(scene, whole=True).field) == ball.total
    # A copy holds the whole field too, and what is deleted.
    rest.with_edits(EditStack([])).save(scene.parent / "copy")
    assert opened(scene.parent / "copy")[1].document.removed == ball
    _, again = opened(scene)
    assert again.document.removed == ball and again.saved
    again.restore_elements()
    store.save(again)
    assert len(Scene.open(scene).field) == ball.total


def test_pictures_picks_and_downloads_are_of_what_is_left(scene: Path, tmp_path: Path) -> None:
    whole = Scene.open(scene, whole=True)
    ball = ball_of(whole)
    renderers = RendererCache(whole)
    turned = Edit.continuous(Cage.box((0, 0, 0), 0.5), Cage.box((0, 0, 0), 1.2)).rotate((0, 0, 0.4))
    for edits in ((), (turned,)):
        shown = Shown(values_of(edits), removed=ball)
        found = renderers.still(shown, CAMERA, Display()).rgb
        oracle = Scene(whole.field.take(~ball.mask), EditStack(edits), whole.cameras)
        expected = RendererCache(oracle).still(Shown(values_of(edits)), CAMERA, Display()).rgb
        np.testing.assert_array_equal(found, expected)
    assert not np.allclose(renderers.still(Shown(()), CAMERA, Display()).rgb, found, atol=0.1)
    write_edited(
        EditedSplats(scene=str(scene), name="scene", form="ply", removed=ball),
        str(tmp_path / "out" / "rest.ply"),
    )
    assert len(read_splats(tmp_path / "out" / "rest.ply")) == ball.total - ball.count


def test_pages_hide_deleted_splats_beside_what_edits_change(scene: Path) -> None:
    whole = Scene.open(scene, whole=True)
    assert isinstance(whole.field, SplatField)
    ball = ball_of(whole)
    half = Selection.from_mask(ball.mask & (whole.field.means[:, 0] > 0.0))
    pages = PageFiles(RendererCache(whole))
    raised = Edit.continuous(Cage.box((0, 0, 0), 0.7), Cage.box((0, 0, 0), 1.4)).translate((0, 0, 0.1))
    raised = raised.replace(relight="none")
    for edits in ((), (raised,)):
        shown = Shown(values_of(edits), removed=half)
        done = pages.edits(PageEditsTask(1, shown, Refinement.DRAFT, (), 0), lambda: False)
        assert isinstance(done, EditsDone)
        found = decode_page_splat_edits(done.content)
        order = page_order(whole.field)
        assert found.hidden[half.mask[order]].all() and not half.mask[order][found.sources].any()
        # The oracle: the file of a scene that never had the deleted splats.
        oracle = dataclasses.replace(whole, field=whole.field.take(~half.mask), edits=EditStack(edits))
        alone = PageFiles(RendererCache(oracle))
        done = alone.edits(PageEditsTask(1, Shown(values_of(edits)), Refinement.DRAFT, (), 0), lambda: False)
        assert isinstance(done, EditsDone)
        expected = decode_page_splat_edits(done.content)
        assert found.hidden.sum() - half.count == expected.hidden.sum()
        there = np.sort(found.means + whole.field.center, axis=0)
        np.testing.assert_allclose(there, np.sort(expected.means + oracle.field.center, axis=0), atol=1e-6)
    assert len(expected.means) > 100
    voxels = PageFiles(RendererCache(Scene(ball_field())))
    some = Selection.from_mask(np.arange(len(elements_of_field(ball_field()))) < 3)
    with pytest.raises(CagefieldError, match="the server draws the others"):
        voxels.edits(PageEditsTask(1, Shown((), removed=some), Refinement.DRAFT, (), 0), lambda: False)


def test_voxels_lose_the_vertices_of_deleted_cells(tmp_path: Path) -> None:
    scene = Scene(ball_field())
    elements = elements_of_field(scene.field)
    half = Selection.from_mask(elements.positions[:, 0] > 0)
    Scene(scene.field, removal=Removal(scene.field, half)).save(tmp_path / "half")
    rest = Scene.open(tmp_path / "half").field
    p = np.array([[0.2, 0, 0], [-0.2, 0, 0]], np.float32)
    sigma, _ = rest(p, np.tile(np.float32([0, 0, 1]), (2, 1)))
    assert sigma[0] == 0.0 and sigma[1] > 0.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"version": 2}, "version 2, expected 1"),
        ({"removed": 3}, "has total, count and mask"),
        ({"removed": {"total": 9, "count": 12, "mask": ""}}, "12 of 9 elements is not possible"),
        ({"removed": {"total": 9, "count": 2, "mask": "?"}}, "mask cannot be read"),
    ],
)
def test_damaged_files_are_named_with_the_cure(scene: Path, change: dict, message: str) -> None:  # type: ignore[type-arg]
    (scene / "removed.json").write_text(json.dumps({"version": 1, "removed": None, **change}))
    with pytest.raises(SceneError, match=rf"removed\.json: .*{message}.*; remove the file to restore"):
        Scene.open(scene)


def test_deleted_elements_of_another_field_are_an_error(scene: Path) -> None:
    other = {"version": 1, "removed": dump_selection(Selection.from_mask(np.array([True, False])))}
    (scene / "removed.json").write_text(json.dumps(other))
    with pytest.raises(SceneError, match="of a field of 2 elements, this one has 1376; remove the file"):
        Scene.open(scene)


def test_selections_in_files_are_bounded_and_checked() -> None:
    mask = np.random.default_rng(1).random(1001) < 0.3
    value = dump_selection(Selection.from_mask(mask))
    assert (parse_selection(value, 1001).mask == mask).all()
    for change, message in (({"count": 5}, "its count is 5"), ({"total": 2001}, "bytes, 251 are needed")):
        with pytest.raises(CagefieldError, match=message):
            parse_selection({**value, **change})
    with pytest.raises(CagefieldError, match="1001 elements, this one has 7"):
        parse_selection(value, 7)


def test_cages_of_all_shapes_hold_the_selection() -> None:
    points = np.random.default_rng(2).uniform((-1, -0.4, -0.2), (1, 0.4, 0.2), (500, 3))
    box, lattice, mesh = (cage_around(shape, points, 0.05) for shape in ("box", "lattice", "mesh"))
    assert lattice.shape == (5, 3, 2) and len(mesh.handles) <= 512
    np.testing.assert_allclose(lattice.corners, box.corners, atol=1e-12)
    for cage in (box, lattice, mesh):
        edit = Edit.continuous(cage, outer_cage_of_shape(cage))
        edit.check()
        assert edit.inner.contains(points).all()
