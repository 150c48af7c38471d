"""Pastes from another scene: the same picture as of a scene that has the thing, in every renderer."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from cagefield.cameras.camera import Camera, turntable
from cagefield.completion.pasting.paste_content import content_box
from cagefield.completion.patch_stages import PatchStage
from cagefield.completion.surfaces.block_extraction import extract_block
from cagefield.edits import Edit, EditStack, PreparedStack, dump_edits, parse_edits
from cagefield.edits.operations import Rotate, Scale
from cagefield.errors import EditError, EditFileError, SceneError
from cagefield.fields.analytic import AnalyticField, GaussianBlob, UniformSphere
from cagefield.fields.baking import bake
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.images.metrics import psnr
from cagefield.rendering.reference_renderer import render_sampled
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from cagefield.scene.scene import Scene
from tiers import nightly_after_first

THING = AnalyticField(
    [
        GaussianBlob((0.0, 0.0, 0.0), 0.16, 30.0, (0.8, 0.3, 0.3)),
        GaussianBlob((0.4, 0.1, 0.1), 0.1, 40.0, (0.3, 0.6, 0.3)),
        GaussianBlob((0.1, 0.4, -0.1), 0.08, 60.0, (0.4, 0.4, 0.7)),
    ],
    view_slope=[[0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, -0.2]],
)
PLACE = AnalyticField([GaussianBlob((-0.7, 0.0, 0.0), 0.2, 25.0, (0.5, 0.6, 0.8))])
TURN, BY = (20.0, -35.0, 70.0), (1.6, -0.2, 0.2)


def cage(size: float = 1.5) -> Cage:
    """Around the thing."""
    return about_origin(Cage.box((0.15, 0.15, 0.0), size))


def about_origin(cage: Cage) -> Cage:
    """The cage, turned and scaled about the origin."""
    return Cage(cage.corners, pivot=np.zeros(3))


@dataclass(frozen=True)
class Together:
    """The place, and the thing scaled by s, turned and moved, as opaque as it was."""

    scale: float
    bounds: NDArray[np.float64]
    kept: bool = True
    by: tuple[float, float, float] = BY

    def __call__(self, p: NDArray[np.float32], d: NDArray[np.float32]) -> tuple[NDArray[np.float32], ...]:
        R = Rotation.from_euler("XYZ", TURN, degrees=True).as_matrix()
        own, color = PLACE(p, d)
        there = ((p.astype(np.float64) - self.by) @ R / self.scale).astype(np.float32)
        sigma, rgb = THING(there, (d.astype(np.float64) @ R).astype(np.float32))
        sigma = sigma / self.scale if self.kept else sigma
        total = np.maximum(own + sigma, 1e-9)
        mixed = (own / total)[:, None] * color + (sigma / total)[:, None] * rgb
        return own + sigma, mixed.astype(np.float32)


def view(width: int = 72) -> Camera:
    """From the side, of both of them."""
    return Camera.look_at((0.9, -6.0, 1.2), (0.9, 0.0, 0.0), width=width, height=width // 2, fov_x=0.7)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the scenes `thing` (SH degree 1), `flat` (degree 0) and `place`."""
    root = tmp_path_factory.mktemp("pasting")
    bounds = np.array([[-0.7, -0.7, -0.8], [1.0, 1.0, 0.8]])
    cameras = {"train": turntable((0, 0, 0), 3.0, 3, elevation=0.4, width=24, height=24, fov_x=0.8)}
    for name, degree in (("thing", 1), ("flat", 0)):
        Scene(bake(THING, 56, bounds=bounds, sh_degree=degree), cameras=cameras).save(root / name)
    Scene(bake(PLACE, 60, bounds=[[-1.4] * 3, [1.4] * 3], sh_degree=1), cameras=cameras).save(root / "place")
    return root


def pasted(scale: float, **changes: object) -> Edit:
    """The thing where `Together` has it."""
    edit = Edit.paste("../thing", cage(), name="thing").replace(relight="none", **changes)
    return edit.scale(scale).then(Rotate(TURN)).translate(BY)


def db(a: NDArray[np.floating], b: NDArray[np.floating]) -> float:
    return float(psnr(a, b))


@pytest.mark.parametrize(("scale", "kept"), [(1.0, True), (0.5, False), (1.4, True)])
def test_a_paste_is_the_picture_of_a_scene_that_has_the_thing(folder: Path, scale: float, kept: bool) -> None:
    """Scaled and turned, colors seen from where they are seen; baked voxels are 47 to 55 dB off."""
    scene = replace(Scene.open(folder / "place"), preserve_opacity=kept)
    scene = scene.with_edits(EditStack([pasted(scale)]))
    far = np.array([[-2.0] * 3, [3.4] * 3])
    truth = render_sampled(Together(scale, far, kept), view(), samples=400)
    found = scene.render(view())
    without = scene.with_edits(EditStack()).render(view())
    assert db(found.rgb, truth.rgb) > 44.0 > db(without.rgb, truth.rgb) + 15.0
    print(
        "TRUTH",
        scale,
        kept,
        db(found.rgb, truth.rgb),
        db(without.rgb, truth.rgb),
        db(found.opacity, truth.opacity),
    )
    assert db(found.opacity, truth.opacity) > 44.0


@pytest.mark.parametrize("kept", nightly_after_first([True, False]))
def test_what_the_cage_covers_is_seen_beside_the_thing(folder: Path, kept: bool) -> None:
    """The cage reaches over the place's blob, which the thing does not touch."""
    by = (0.3, -0.2, 0.1)
    edit = pasted(1.2).replace(operations=pasted(1.2).operations[:-1]).translate(by)
    assert edit.deformed.contains(np.array([[-0.7, 0.0, 0.0]])).all()
    scene = replace(Scene.open(folder / "place"), preserve_opacity=kept)
    truth = render_sampled(Together(1.2, np.array([[-2.0] * 3, [3.4] * 3]), kept, by), view(), samples=400)
    found = scene.with_edits(EditStack([edit])).render(view())
    assert db(found.rgb, truth.rgb) > 38.0 and db(found.opacity, truth.opacity) > 38.0
    # While it is dragged, its cage is all its own; what it was put over before is known.
    patcher = scene.patcher
    (dragged,) = patcher.prepare(
        [edit.translate((0.1, 0.0, 0.0))], stage=PatchStage.INPAINTED, preserve_opacity=kept
    )
    (again,) = patcher.prepare(
        [edit.translate((0.2, 0.0, 0.0))], stage=PatchStage.INPAINTED, preserve_opacity=kept
    )
    (still,) = patcher.prepare([edit], stage=PatchStage.INPAINTED, preserve_opacity=kept)
    (settled,) = patcher.prepare([edit], preserve_opacity=kept)
    assert dragged.part is again.part and settled.part is not dragged.part
    assert still.part is not None and (still.part is settled.part or still.part is dragged.part)


def test_vertices_are_copied_as_they_are(folder: Path) -> None:
    """Where a voxel becomes a voxel: what V shows at a vertex of the other scene is what that stores."""
    scene, other = Scene.open(folder / "place"), Scene.open(folder / "thing").field
    assert isinstance(other, VoxelField)
    small = Edit.paste("../thing", Cage.box((0.1, 0.1, 0.0), 0.8)).translate((0.6, 0.0, 0.0))
    (edit,) = scene.with_edits(EditStack([small.replace(relight="none")])).prepared_edits
    assert edit.part is not None and edit.part.resolution == scene.field.resolution
    block = extract_block(other, EditStack(), np.array([[-0.2, -0.2, -0.3], [0.4, 0.4, 0.3]]))
    every = np.ones(block.shape, bool)
    at = block.positions(every) + np.array([0.6, 0.0, 0.0])
    mapped = PreparedStack([edit]).to_canonical(at)
    assert (mapped.layer == 1).all()
    stretch = np.cbrt(np.linalg.det(mapped.jacobian))
    sigma, _ = edit.part(mapped.points, np.tile((0.0, 0.0, 1.0), (len(at), 1)))
    np.testing.assert_allclose(sigma * stretch, np.maximum(block.density.reshape(-1), 0.0), atol=2e-3)


@pytest.mark.parametrize("contracted", [False, True])
def test_kernel_and_oracle_show_the_same(folder: Path, contracted: bool) -> None:
    scene = Scene.open(folder / "place")
    field = scene.field
    assert isinstance(field, VoxelField)
    if contracted:
        # Nothing lies beyond the box of interest, which the oracle samples evenly.
        at = np.stack(np.unravel_index(field.vertices, field.resolution), axis=1)
        kept = (np.abs(at - 29.5) < 14.0).all(axis=1)
        parts = (part[kept] for part in (field.vertices, field.density, field.sh))
        field = VoxelField(0.5 * field.bounds, field.resolution, *parts, contracted=True)
        scene = replace(scene, field=field)
    after = Edit.copy(Cage.box(BY, 1.2))
    stack = scene.with_edits(
        EditStack([pasted(0.7), after.translate((-0.8, 0.0, 1.1)).replace(relight="none")])
    ).prepared_edits
    frame = VoxelRenderer(field, stack, step=0.25).render(view(40), background="black")
    source = field.__call__ if contracted else field
    oracle = render_sampled(source, view(40), near=4.0, far=8.5, samples=500, edits=stack, background="black")
    assert frame is not None and oracle.opacity.max() > 0.9
    assert db(frame.rgb, oracle.rgb) > 38.0 and db(frame.opacity, oracle.opacity) > 38.0


def test_the_other_scene_is_pasted_as_it_is_edited(folder: Path, tmp_path: Path) -> None:
    """Its edits are done, those that stretch keep opacity, and so are pastes of its own."""
    thing = Scene.open(folder / "thing")
    grown = Edit.move(cage(1.6), fill="none", relight="none").scale(1.4)
    thing.with_edits(EditStack([grown])).save(tmp_path / "grown")
    scene = Scene.open(folder / "place")
    wide = about_origin(Cage.box((0.15, 0.15, 0.0), 2.2))
    once = Edit.paste(str(tmp_path / "grown"), wide).replace(relight="none").scale(0.5 / 1.4)
    empty = replace(Scene.open(folder / "flat"), folder=None).with_edits(EditStack())
    nested = replace(empty, field=replace(empty.field, density=0.0 * empty.field.density))
    inner = Edit.paste(str(tmp_path / "grown"), wide).replace(relight="none").scale(0.6)
    nested.with_edits(EditStack([inner])).save(tmp_path / "nested")
    size = Cage.box((0.0, 0.0, 0.0), 1.3)
    twice = Edit.paste(str(tmp_path / "nested"), size).replace(relight="none").scale(0.5 / 1.4 / 0.6)
    pictures = [
        scene.with_edits(EditStack([edit.then(Rotate(TURN)).translate(BY)])).render(view())
        for edit in (pasted(0.5).replace(operations=(Scale.from_factors(0.5),)), once, twice)
    ]
    # Content that was enlarged first lies between the vertices of a coarser grid.
    assert db(pictures[0].opacity, pictures[1].opacity) > 32.0
    assert db(pictures[1].opacity, pictures[2].opacity) > 28.0
    assert db(pictures[0].rgb, pictures[1].rgb) > 32.0


@pytest.mark.nightly
def test_degrees_of_color_that_differ(folder: Path) -> None:
    """Of a flat scene there is no view dependence to show, into a flat one none is shown."""
    place = Scene.open(folder / "place")
    onto = replace(place, field=replace(place.field, sh=place.field.sh[:, :1]))
    for scene, source in ((place, "../flat"), (onto, "../thing")):
        edit = pasted(1.0, source=source)
        found = scene.with_edits(EditStack([edit])).render(view())
        full = place.with_edits(EditStack([pasted(1.0)])).render(view())
        assert db(found.opacity, full.opacity) > 45.0
        assert 18.0 < db(found.rgb, full.rgb) < 34.0


@pytest.mark.nightly
def test_surroundings_get_a_shadow(tmp_path: Path) -> None:
    """As of a copy: the floor beside the thing is darker with relight, and nothing else is."""
    from test_completion import FLOOR, cameras, room

    Scene(room(True), cameras={"train": cameras()}).save(tmp_path / "box")
    scene = Scene(room(True), cameras={"train": cameras()}, folder=tmp_path / "room")
    box = Cage.box((0.1, 0.0, -0.2), (0.52, 0.52, 0.58))
    edit = Edit.paste("../box", box).translate((-0.8, 0.0, 0.01))
    pictures = {}
    for relight in ("none", "occlusion"):
        shown = scene.with_edits(EditStack([edit.replace(relight=relight)]))
        for x, y in ((-0.7, -0.29), (-0.7, 0.8)):
            camera = Camera.look_at((x, y, 1.5), (x, y + 1e-3, FLOOR), width=3, height=3, fov_x=0.01)
            pictures[relight, y] = shown.render(camera).rgb.mean()
    assert pictures["occlusion", -0.29] < 0.85 * pictures["none", -0.29]
    assert abs(pictures["occlusion", 0.8] - pictures["none", 0.8]) < 0.01
    # While it is dragged it casts none, and keeps what it shows.
    (moving,) = scene.patcher.prepare([edit], stage=PatchStage.INPAINTED)
    (settled,) = scene.patcher.prepare([edit])
    assert moving.under is None and settled.under is not None


def test_what_is_pasted_is_read_once(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = Scene.open(folder / "thing")
    scene = replace(scene, folder=folder / "elsewhere")
    opened = []
    real = Scene.open.__func__  # type: ignore[attr-defined]
    monkeypatch.setattr(Scene, "open", classmethod(lambda cls, path: opened.append(path) or real(cls, path)))
    parts = {
        id(scene.patcher.prepare([pasted(1.0).translate((x, 9.0, 0.0))])[0].part) for x in (0.0, 0.1, 0.2)
    }
    assert len(opened) == len(parts) == 1
    twice = scene.patcher.prepare([pasted(1.0).translate((0.0, y, 0.0)) for y in (9.0, -9.0)])
    assert len(opened) == 1 and twice[0].part is twice[1].part and len(set(twice.places)) == 1


def test_files_keep_pastes_and_scenes_their_sources(folder: Path, tmp_path: Path) -> None:
    edit = pasted(1.2)
    text = dump_edits(EditStack([edit]))
    assert "source: ../thing" in text and "keep_source" not in text and "adjustment" not in text
    assert parse_edits(text) == EditStack([edit])
    by_hand = parse_edits("edits:\n  - {source: ../thing, inner: {center: [0, 0, 0], size: 1}}")
    assert by_hand[0] == Edit.paste("../thing", Cage.box((0.0, 0.0, 0.0), 1.0))
    scene = Scene.open(folder / "place").with_edits(EditStack([edit]))
    scene.save(tmp_path / "far" / "away")
    moved = Scene.open(tmp_path / "far" / "away")
    source = moved.edits[0].source
    assert source is not None and not Path(source).is_absolute() and source != "../thing"
    assert (tmp_path / "far" / "away" / source).resolve() == (folder / "thing").resolve()
    np.testing.assert_array_equal(moved.render(view()).rgb, scene.render(view()).rgb)
    absolute = edit.replace(source=str(folder / "thing"))
    scene.with_edits(EditStack([absolute])).save(tmp_path / "other")
    assert Scene.open(tmp_path / "other").edits[0].source == str(folder / "thing")


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (
            "{source: ../a, inner: {center: [0, 0, 0], size: 1}, adjustment: continuous}",
            "outer cage|for copies",
        ),
        ("{source: ../a, inner: {center: [0, 0, 0], size: 1}, keep_source: false}", "source is for copies"),
        ("{source: ../a, inner: {center: [0, 0, 0], size: 1}, delete: true}", "source is for copies"),
        ("{source: '', inner: {center: [0, 0, 0], size: 1}}", "source must be the path"),
        ('{source: "a\\u0007b", inner: {center: [0, 0, 0], size: 1}}', "control character"),
    ],
)
def test_what_no_paste_can_be(text: str, problem: str) -> None:
    with pytest.raises(EditFileError, match=problem):
        parse_edits(f"edits:\n  - {text}")


def test_a_scene_that_is_not_there_is_one_clear_line(folder: Path, tmp_path: Path) -> None:
    scene = Scene.open(folder / "place")

    def problem(source: Path | str, cage: Cage = cage()) -> str:  # noqa: B008
        edit = Edit.paste(source, cage, name="thing")
        shown = scene.with_edits(EditStack([edit]))
        with pytest.raises(EditError) as found:
            shown.render(view())
        assert "\n" not in str(found.value) and 'edit "thing"' in str(found.value)
        # What hides it shows the rest.
        shown.with_edits(EditStack([edit.replace(enabled=False)])).render(view())
        return str(found.value)

    assert "nothing is at" in problem("../gone") and "enabled: false" in problem("../gone")
    (tmp_path / "bare").mkdir()
    assert "a folder without a scene" in problem(tmp_path / "bare")
    assert "that is the scene itself" in problem("../place")
    (tmp_path / "noise.ply").write_bytes(b"no splats")
    assert "cannot be read" in problem(tmp_path / "noise.ply")
    assert "holds nothing" in problem("../thing", Cage.box((40.0, 0.0, 0.0), 1.0))
    Scene.open(folder / "thing").save(tmp_path / "torn")
    (tmp_path / "torn" / "field.safetensors").write_bytes(b"torn")
    assert "cannot be read" in problem(tmp_path / "torn")
    from splat_scenes import splat_scene

    splat_scene().save(tmp_path / "splats")
    assert "cagefield bake" in problem(tmp_path / "splats")
    with pytest.raises(EditError, match="as part of a Scene"):
        VoxelRenderer(scene.field, EditStack([pasted(1.0)]))  # type: ignore[arg-type]
    with pytest.raises(EditError, match="as part of a Scene"):
        EditStack([pasted(1.0)]).to_canonical(np.array([BY]))
    with pytest.raises(SceneError):
        Scene.open(folder / "gone")


def test_scenes_do_not_paste_each_other_in_a_circle(folder: Path, tmp_path: Path) -> None:
    for one, other in (("a", "b"), ("b", "a")):
        edit = Edit.paste(tmp_path / other, cage()).replace(relight="none")
        Scene.open(folder / "thing").with_edits(EditStack([edit])).save(tmp_path / one)
    with pytest.raises(EditError, match="in a circle"):
        Scene.open(tmp_path / "a").render(view())


def test_a_scene_that_changed_is_read_again(folder: Path, tmp_path: Path) -> None:
    Scene.open(folder / "thing").save(tmp_path / "thing")
    edit = Edit.paste(str(tmp_path / "thing"), cage()).replace(relight="none").translate(BY)
    scene = Scene.open(folder / "place").with_edits(EditStack([edit]))
    first = scene.prepared_edits[0].part
    assert scene.prepared_edits[0].part is first
    thing = Scene.open(tmp_path / "thing")
    gone = Edit.delete(Cage.box((0.4, 0.1, 0.1), 0.3)).replace(fill="none", relight="none")
    thing.with_edits(EditStack([gone])).save(tmp_path / "thing", overwrite=True)
    second = scene.prepared_edits[0].part
    assert first is not None and second is not None and second.density.sum() < 0.99 * first.density.sum()


def test_half_of_a_paste_is_none() -> None:
    from cagefield.edits.partial_edit import partial_edit

    edit = pasted(1.0)
    assert partial_edit(edit, 0.4) is None and partial_edit(edit, 0.6) is edit


def test_the_box_of_what_a_field_holds(folder: Path) -> None:
    box = content_box(Scene.open(folder / "thing").field)
    # Solid: an optical depth of .3 a voxel, 10 a unit.
    assert (box[0] > (-0.4, -0.4, -0.4)).all() and (box[1] < (0.7, 0.7, 0.4)).all()
    assert (box[0] < (-0.15, -0.15, -0.15)).all() and (box[1] > (0.5, 0.45, 0.15)).all()


def test_points_of_the_own_field_stay() -> None:
    """A paste takes nothing of the field along, and hides nothing."""
    edit = pasted(0.5)
    points = np.array([[0.0, 0.0, 0.0], BY, [-0.9, 0.4, 0.1]])
    mapped = EditStack([edit]).to_deformed(points)
    assert not mapped.hidden.any()
    np.testing.assert_array_equal(mapped.points, points)


@pytest.mark.nightly
def test_a_ball_of_one_color_keeps_its_opacity(tmp_path: Path) -> None:
    """Along the middle of a ball, the optical depth is that of the ball, whatever its size."""
    ball = AnalyticField([UniformSphere((0, 0, 0), 0.4, 2.0, (0.5, 0.5, 0.5))])
    Scene(bake(ball, 48, bounds=[[-0.5] * 3, [0.5] * 3], sh_degree=0)).save(tmp_path / "ball")
    scene = replace(Scene.open(tmp_path / "ball"), folder=tmp_path / "elsewhere")
    edit = Edit.paste("../ball", Cage.box((0, 0, 0), 0.95)).replace(relight="none")
    camera = Camera.look_at((3.0, -6.0, 0.0), (3.0, 0.0, 0.0), width=3, height=3, fov_x=0.01)
    for scale in (0.4, 1.0, 3.0):
        shown = scene.with_edits(EditStack([edit.scale(scale).translate((3.0, 0.0, 0.0))]))
        assert abs(shown.render(camera).opacity[1, 1] - (1.0 - np.exp(-1.6))) < 0.01
