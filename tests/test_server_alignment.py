"""Scale, up direction and aligned pastes in the editor: messages, undo, files, downloads; no browser."""

from __future__ import annotations

import asyncio
import dataclasses
import functools
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cagefield.cameras.camera import turntable
from cagefield.edits import EditStack, MoveCorner, Paste
from cagefield.errors import CagefieldError, EditError, SceneError
from cagefield.exporting.similarity import transform_field
from cagefield.geometry.point_alignment import Similarity
from cagefield.pages import page_nodes, scene_page
from cagefield.pages.scene_page import ScenePage
from cagefield.scene.alignment import Alignment
from cagefield.scene.scene import Scene
from cagefield.server.editor.pasting import points_at_rest, source_points
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.session import Session
from cagefield.server.protocol.client_messages import page_messages
from cagefield.server.render_worker.edited_splats import EditedPage
from cagefield.server.render_worker.renderer_cache import RendererCache
from cagefield.server.render_worker.task_handlers import TaskHandlers
from cagefield.server.web.alignment_handlers import change_alignment
from scenes import ball_scene
from splat_scenes import splat_scene

TURN = Rotation.from_euler("xyz", (10.0, -25.0, 130.0), degrees=True).as_matrix()
TRUE = Similarity(1.7, TURN, np.array([0.4, -2.0, 3.0]))
TILTED = np.array([0.0, 0.1, 1.0]) / np.sqrt(1.01)


class Answering:
    """A coordinator whose questions are answered in this process, and a page that keeps its notices."""

    def __init__(self, path: Path) -> None:
        scene = Scene.open(path, whole=True)
        self.store = SceneStore(scene, path)
        self.session = Session(self.store.document(), scene.field.bounds, scene.field.sample_spacing)
        self.handlers = TaskHandlers(RendererCache(scene))
        self.notices: list[str] = []
        self.up = self.session.document.up or (0.0, 0.0, 1.0)

    async def ask(self, make: Callable[[int], Any]) -> Any:
        result: Any = self.handlers.do(make(1), lambda _: False)
        return result.value

    def notice(self, level: str, text: str) -> None:
        self.notices.append(text)

    def send(self, kind: str, **values: Any) -> None:
        message: Any = page_messages.validate_python({"type": kind, **values})
        coordinator: Any = self
        asyncio.run(change_alignment(coordinator, coordinator, message))


@pytest.fixture
def pasted(tmp_path: Path) -> Path:
    """A scene that pastes `other`: its own splats under the inverse of TRUE, put somewhere else."""
    scene = dataclasses.replace(splat_scene(), edits=EditStack())
    scene.save(tmp_path / "scene")
    back = np.eye(4)
    back[:3, :3] = TRUE.rotation.T / TRUE.scale
    back[:3, 3] = -back[:3, :3] @ TRUE.translation
    splats: Any = scene.field
    field = transform_field(dataclasses.replace(splats, bounds=None), back)
    dataclasses.replace(scene, field=field, cameras={}).save(tmp_path / "other")
    paste = Scene.open(tmp_path / "scene").paste("../other", name="other")
    Scene.open(tmp_path / "scene").with_edits(EditStack([paste])).save(tmp_path / "scene", overwrite=True)
    return tmp_path / "scene"


def pairs_of(edit: Paste, means: np.ndarray) -> list[dict[str, list[float]]]:
    """Pairs as a page clicks them: where splats of the other scene stand, and where they belong."""
    own = (means - TRUE.translation) @ TRUE.rotation / TRUE.scale
    A, b = edit.map_between(edit.deformed, edit.inner).affine  # type: ignore[misc]
    return [
        {"pasted": (A @ point + b).tolist(), "scene": goal.tolist()}
        for point, goal in zip(own, means, strict=True)
    ]


def test_the_up_direction_is_undone_saved_and_restored(tmp_path: Path) -> None:
    ball_scene().save(tmp_path / "ball")
    editor = Answering(tmp_path / "ball")
    session, store = editor.session, editor.store
    assert session.document.up is None
    editor.send("up_change", by="points", points=[[0, 0, 0], [1, 0, 0], [0, 1, -0.1]])
    np.testing.assert_allclose(np.array(session.document.up), TILTED)
    editor.send("scale_change", meters_per_unit=0.5)
    session.undo()
    session.undo()
    assert session.document.up is None and session.saved
    session.redo()
    store.autosave(session)
    recovered = SceneStore(Scene.open(tmp_path / "ball"), tmp_path / "ball").recovered()
    assert recovered is not None and recovered.up == session.document.up
    store.save(session)
    # The saved values are the known ones: the next save finds no change by another program.
    assert Scene.open(tmp_path / "ball").alignment.direction == session.document.up
    session.set_scale(2.0)
    store.save(session)
    assert session.history.names == ("Open", "Up direction", "Scale in meters")
    editor.send("up_change", by="cameras")
    store.save(session)
    assert Scene.open(tmp_path / "ball").alignment.up is None


def test_another_programs_up_direction_is_taken_at_a_save_and_a_conflict_said_once(tmp_path: Path) -> None:
    path = tmp_path / "ball"
    ball_scene().save(path)
    editor = Answering(path)
    dataclasses.replace(Scene.open(path), alignment=Alignment(up=TILTED)).save_manifest(path)
    editor.store.save(editor.session)
    np.testing.assert_allclose(np.array(editor.session.document.up), TILTED)
    dataclasses.replace(Scene.open(path), alignment=Alignment(up=np.array([1.0, 0.0, 0.0]))).save_manifest(
        path
    )
    editor.session.set_up((0.0, 1.0, 0.0))
    with pytest.raises(SceneError, match="the up direction here"):
        editor.store.save(editor.session)
    editor.store.save(editor.session)
    assert Scene.open(path).alignment.direction == (0.0, 1.0, 0.0)


def test_three_points_and_no_less_make_a_plane(tmp_path: Path) -> None:
    ball_scene().save(tmp_path / "ball")
    editor = Answering(tmp_path / "ball")
    with pytest.raises(CagefieldError, match="takes three points, not 2"):
        editor.send("up_change", by="points", points=[[0, 0, 0], [1, 0, 0]])
    with pytest.raises(SceneError):
        editor.send("up_change", by="points", points=[[0, 0, 0], [1, 1, 1], [2, 2, 2]])
    with pytest.raises(CagefieldError, match="no plane is nearly level"):
        editor.send("up_change", by="floor")
    assert editor.session.history.names == ("Open",)


@pytest.mark.parametrize("noise", [0.0, 0.03])
def test_pairs_align_a_paste_and_undo_takes_that_back(pasted: Path, noise: float) -> None:
    editor = Answering(pasted)
    session = editor.session
    before = session.document.entry(1).edit
    assert isinstance(before, Paste)
    field: Any = Scene.open(pasted).field
    means = field.means
    rows = [int(np.argmax(means @ direction)) for direction in np.vstack([np.eye(3), -np.eye(3)[:1]])]
    pairs = pairs_of(before, means[rows])
    for k, pair in enumerate(pairs):
        pair["scene"][k % 3] += noise
    editor.send("align_paste", edit=1, pairs=pairs, refine=noise > 0.0, match_colors=noise > 0.0)
    edit = session.document.entry(1).edit
    error = np.abs(edit.deformed.corners - TRUE.transform_points(edit.inner.corners)).max()
    # The surfaces are the same splats: rough pairs are corrected.
    assert error < (1e-6 if noise == 0.0 else 0.5 * noise)
    assert edit.grading.is_neutral or noise > 0.0
    assert editor.notices[-1].startswith("aligned: pairs") and ("surfaces" in editor.notices[-1]) == (
        noise > 0
    )
    assert session.history.names[-1] == "Align of other"
    session.undo()
    assert session.document.entry(1).edit is before
    session.redo()
    editor.store.save(session)
    saved = Scene.open(pasted).edits[0]
    np.testing.assert_allclose(saved.deformed.corners, edit.deformed.corners, atol=1e-9)


def test_pairs_that_miss_the_paste_change_nothing(pasted: Path) -> None:
    editor = Answering(pasted)
    edit = editor.session.document.entry(1).edit
    assert isinstance(edit, Paste)
    field: Any = Scene.open(pasted).field
    pairs = pairs_of(edit, field.means[[0, 40, 80]])
    far = [*pairs[:1], {"pasted": [99.0, 0.0, 0.0], "scene": [0.0, 0.0, 0.0]}, *pairs[2:]]
    with pytest.raises(EditError, match='pair 2: its first point is not on what edit "other" pastes'):
        editor.send("align_paste", edit=1, pairs=far)
    with pytest.raises(EditError, match="was changed meanwhile"):
        editor.session.align(1, edit.translate((0.1, 0.0, 0.0)), edit)
    assert editor.session.history.names == ("Open",)


def test_points_of_a_carried_paste_go_back_to_rest() -> None:
    carrier = np.column_stack([2.0 * TURN, [1.0, -2.0, 0.5]])
    points = np.random.default_rng(0).normal(size=(5, 3))
    np.testing.assert_allclose(points_at_rest(carrier, points @ (2.0 * TURN).T + carrier[:, 3]), points)
    assert points_at_rest(None, points) is points


def test_points_on_a_bent_paste_are_found_by_its_own_map(pasted: Path) -> None:
    edit = Scene.open(pasted).edits[0]
    assert isinstance(edit, Paste)
    bent = edit.then(MoveCorner(7, (0.05, 0.1, 0.0)))
    inside = bent.inner.corners.mean(axis=0) + 0.2 * np.random.default_rng(1).uniform(-1, 1, (6, 3)) * np.ptp(
        bent.inner.corners, axis=0
    )
    _, there, _ = bent.map_between(bent.inner, bent.deformed).inverse(inside)
    np.testing.assert_allclose(source_points(bent, there), inside, atol=1e-9)


@pytest.mark.parametrize("levels", [False, True])
def test_a_page_for_download_is_the_exported_one(
    tmp_path: Path, levels: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the document's up direction and scale, not of the folder's."""
    small = functools.partial(page_nodes.encode_page_nodes, coarse=100, node=60)
    monkeypatch.setattr(scene_page, "encode_page_nodes", small)
    cameras = {"test": turntable((0, 0, 0), 3.0, 2, elevation=0.3, width=64, height=48, fov_x=0.8)}
    scene = dataclasses.replace(splat_scene(), cameras=cameras, edits=EditStack())
    scene.save(tmp_path / "scene")
    content = EditedPage(
        scene=str(tmp_path / "scene"),
        name="scene",
        alignment=Alignment(0.5, TILTED),
        levels=levels,
        budget=400 if levels else None,
    )
    assert content.file_name == ("scene.page.zip" if levels else "scene.html")
    out = tmp_path / "out" / content.file_name
    content.write(str(out))
    aligned = dataclasses.replace(Scene.open(tmp_path / "scene"), alignment=Alignment(0.5, TILTED))
    page = ScenePage.build(aligned, "scene", levels=levels, budget=400 if levels else None)
    if levels:
        with zipfile.ZipFile(out) as archive:
            found = {name.removeprefix("scene/"): archive.read(name) for name in archive.namelist()}
        assert found == page.folder()
    else:
        assert out.read_text() == page.one_file()
        assert '"meters_per_unit": 0.5' in out.read_text()
