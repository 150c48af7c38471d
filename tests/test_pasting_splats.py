"""Pastes of splats: what is rendered, baked and exported is what the other scene's splats are, moved."""

from __future__ import annotations

import dataclasses
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.completion.splat_patch import build_splat_patch
from cagefield.edits import Edit, EditStack, PreparedEdit, PreparedStack
from cagefield.edits.operations import Rotate
from cagefield.errors import EditError
from cagefield.exporting import edited_splats
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.splat_files import write_splats
from cagefield.geometry.cage import Cage
from cagefield.images.metrics import psnr
from cagefield.pages.page_splat_edits import decode_page_splat_edits
from cagefield.pages.page_splats import decode_page_splats, page_order
from cagefield.pages.scene_page import ScenePage
from cagefield.rendering.splats.bake_splats import baked_splats
from cagefield.rendering.splats.raster_splats import changed_splats, deformed_splats
from cagefield.rendering.splats.reference_raster_splats import deformed_splats_reference
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.scene.scene import Scene
from splat_rooms import LIGHT, cage, room
from splat_scenes import random_splats, splat_scene
from test_completion_splats import seen

BY = (3.2, 0.4, -0.2)
CAMERA = Camera.look_at((1.6, -8.0, 2.0), (1.6, 0.0, 0.0), width=96, height=64, fov_x=0.8)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The scenes `ball`, of degree 0, and `heap`, of degree 2, and the file heap.ply."""
    root = tmp_path_factory.mktemp("splats")
    splat_scene().save(root / "ball")
    heap = random_splats(60, seed=3)
    Scene(heap).save(root / "heap")
    write_splats(heap, root / "heap.ply")
    return root


def pasted(source: str = "../heap", size: float = 4.0) -> Edit:
    edit = Edit.paste(source, Cage.box((0.0, 0.0, 0.0), size), name="heap").replace(relight="none")
    return edit.scale(0.6).then(Rotate((30.0, 0.0, 50.0))).translate(BY)


def with_heap(folder: Path, *edits: Edit) -> Scene:
    return Scene.open(folder / "ball").with_edits(EditStack(edits))


def by_hand(heap: SplatField, edit: Edit) -> SplatField:
    """A field's splats moved by an edit of their own scene."""
    return baked_splats(
        heap, EditStack([Edit.move(edit.inner, operations=edit.operations, relight=edit.relight)])
    )


@pytest.mark.parametrize("source", ["../heap", "../heap.ply"])
def test_a_paste_is_the_picture_of_both(folder: Path, source: str) -> None:
    """Rasterised as one: as the ball's splats and the heap's, moved by hand."""
    ball, heap = Scene.open(folder / "ball").field, Scene.open(folder / "heap").field
    assert isinstance(ball, SplatField) and isinstance(heap, SplatField)
    there = by_hand(heap, pasted())
    sh = np.concatenate([np.pad(ball.sh, ((0, 0), (0, 8), (0, 0))), there.sh])
    both = SplatField(
        *(
            np.concatenate([getattr(ball, n), getattr(there, n)])
            for n in ("means", "log_scales", "quaternions", "opacities")
        ),
        sh,
        bounds=ball.bounds,
    )
    wanted = SplatRenderer(both).render(CAMERA)
    found = with_heap(folder, pasted(source)).render(CAMERA)
    bare = with_heap(folder).render(CAMERA)
    assert wanted is not None
    assert psnr(found.rgb, wanted.rgb) > 55.0 > psnr(bare.rgb, wanted.rgb) + 25.0


def test_what_is_made_is_the_oracles(folder: Path) -> None:
    """With an edit before and one after, copies of a paste, and two pastes of one scene."""
    before = Edit.move(Cage.box((0.3, 0.0, 0.0), 0.6)).translate((0.0, 0.0, 1.0))
    after = Edit.copy(Cage.box(BY, 1.0)).translate((0.0, 1.5, 0.0))
    again = pasted().translate((0.0, -2.5, 0.0))
    scene = with_heap(folder, before, pasted(), after, again)
    edits = scene.prepared_edits
    splats = scene.rendered_field
    assert isinstance(splats, SplatSet)
    joined = splats.with_pastes(edits)
    assert joined is splats.with_pastes(edits) is joined.with_pastes(edits) is not splats
    for preserve in (True, False):
        found = deformed_splats(splats, edits, preserve_opacity=preserve)
        wanted = deformed_splats_reference(scene.field, edits, preserve_opacity=preserve)  # type: ignore[arg-type]
        assert len(found) == len(wanted) > 650
        one, other = (np.lexsort(s.means.T.round(4)) for s in (found, wanted))
        for name in ("means", "covariances", "opacities", "sh"):
            a, b = getattr(found, name)[one], getattr(wanted, name)[other]
            np.testing.assert_allclose(a, b, atol=2e-4, err_msg=name)


def test_a_paste_hides_nothing_and_its_cage_cuts(folder: Path) -> None:
    heap, ball = Scene.open(folder / "heap").field, Scene.open(folder / "ball").field
    assert isinstance(heap, SplatField) and isinstance(ball, SplatField)
    shown = edited_splats(with_heap(folder, Edit.paste("../heap", Cage.box((0.0, 0.0, 0.0), 0.8))))
    reds = np.isclose(shown.sh[:, 0, 0], ball.sh[0, 0, 0], atol=1e-6)
    assert reds.sum() == len(ball)
    came = shown.means[~reds]
    # Those through a face are there in part, which lies inside of it.
    few = (np.abs(heap.means).max(axis=1) < 0.4).sum()
    assert len(came) > few > 0 and np.abs(came).max() < 0.4


def test_a_page_has_what_is_pasted(folder: Path) -> None:
    """The field's file holds its colors, without opacity; the edits' file shows it."""
    scene = with_heap(folder, pasted())
    page = ScenePage.build(scene, "t")
    held = decode_page_splats(page.files["field"]).field
    edits = decode_page_splat_edits(page.files["edits"])
    assert len(held) == 660 and held.sh_degree == 2
    splats = scene.rendered_field
    assert isinstance(splats, SplatSet)
    splats = splats.with_pastes(scene.prepared_edits)
    field, order = splats.field, page_order(splats.field)
    ours = order >= 600
    assert (held.opacities[ours] == 0.0).all() and (held.opacities[~ours] > 0.5).all()
    assert edits.hidden[ours].all() and not edits.hidden[~ours].any()
    changed = changed_splats(splats, scene.prepared_edits)
    assert len(edits.sources) == 60 and (np.sort(order[edits.sources]) == np.arange(600, 660)).all()
    place = np.argsort(order)[changed.sources]
    means = changed.splats.means[np.argsort(place, kind="stable")]
    np.testing.assert_allclose(edits.means + field.center, means, atol=1e-3)


def test_surroundings_get_a_shadow(tmp_path: Path) -> None:
    """A box pasted onto a bare floor shades it, nearly as one that was there."""
    Scene(room(True)).save(tmp_path / "box")
    bare = Scene(room(False), folder=tmp_path / "floor")
    edit = Edit.paste("../box", cage()).translate((-0.5, 0.25, 0.0))
    (ready,) = bare.with_edits(EditStack([edit.replace(relight="none")])).prepared_edits
    truth = seen(room(True, by=(-0.5, 0.25)), EditStack())
    patch = build_splat_patch(bare.field, EditStack(), edit, LIGHT, pasted=ready.pasted)  # type: ignore[arg-type]
    shaded = replace(ready, patch=patch)
    plain, both = (psnr(seen(bare.field, PreparedStack([e])), truth) for e in (ready, shaded))  # type: ignore[arg-type]
    assert both > plain + 3.0


def test_what_an_earlier_edit_was_filled_with_stays_beside_a_paste(tmp_path: Path) -> None:
    """Fills are copies of the scene's own splats, which have the same rows with pasted ones behind them."""
    Scene(room(True)).save(tmp_path / "box")
    scene = Scene(room(True), folder=tmp_path / "floor")
    gone = Edit.delete(cage())
    gone = PreparedEdit(gone, build_splat_patch(scene.field, EditStack(), gone, LIGHT))  # type: ignore[arg-type]
    far = Edit.paste("../box", cage()).replace(relight="none").translate((9.0, 0.0, 0.0))
    (far,) = scene.with_edits(EditStack([far])).prepared_edits
    alone, both = (seen(scene.field, PreparedStack(edits)) for edits in ([gone], [gone, far]))  # type: ignore[arg-type]
    assert psnr(both, alone) > 60.0 > psnr(seen(scene.field, PreparedStack([far])), alone) + 20.0  # type: ignore[arg-type]


def test_a_patch_over_a_paste_belongs_to_the_scenes_field(tmp_path: Path) -> None:
    """Its rows are those of every set of the scene, whatever else is pasted."""
    Scene(room(True)).save(tmp_path / "box")
    scene = Scene(room(True), folder=tmp_path / "floor")
    far = Edit.paste("../box", cage()).replace(relight="none").translate((9.0, 0.0, 0.0))
    below = scene.with_edits(EditStack([far])).prepared_edits
    gone = Edit.delete(cage())
    patch = build_splat_patch(scene.rendered_field, below, gone, LIGHT)  # type: ignore[arg-type]
    assert patch.field is scene.field and len(patch.sources) > 50
    shown = PreparedStack([*below, PreparedEdit(gone, patch)])
    alone = PreparedStack([PreparedEdit(gone, build_splat_patch(scene.field, EditStack(), gone, LIGHT))])  # type: ignore[arg-type]
    assert psnr(seen(scene.field, shown), seen(scene.field, alone)) > 60.0  # type: ignore[arg-type]


def test_kinds_that_do_not_go_together(folder: Path, tmp_path: Path) -> None:
    from scenes import ball_scene

    ball_scene().save(tmp_path / "voxels")
    with pytest.raises(EditError, match="cagefield export"):
        with_heap(folder, pasted(str(tmp_path / "voxels"))).render(CAMERA)
    scene = Scene.open(folder / "ball")
    discs = dataclasses.replace(scene, field=dataclasses.replace(scene.field, discs=True))
    with pytest.raises(EditError, match="discs"):
        discs.with_edits(EditStack([pasted()])).render(CAMERA)
    with pytest.raises(EditError, match="as part of a Scene"):
        deformed_splats(scene.field, EditStack([pasted()]))  # type: ignore[arg-type]
    with pytest.raises(EditError, match="holds nothing"):
        with_heap(folder, pasted().replace(inner=Cage.box((50.0, 0.0, 0.0), 1.0))).render(CAMERA)
