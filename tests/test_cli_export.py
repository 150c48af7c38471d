"""Scenes exported as splats, meshes and points: what is written, and what is refused in one line."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.edits import Edit, EditStack
from cagefield.edits.edit_files import save_edits
from cagefield.edits.kernel_map import KernelMap
from cagefield.errors import CagefieldError, EditError
from cagefield.exporting import (
    MAX_IMAGE_SIDE_PX,
    MOST_HELD_OUT,
    MOST_VIEWS,
    PIXELS_PER_VOXEL,
    cages_of,
    fitting_cameras,
    inside,
    upright,
    upright_turn,
)
from cagefield.fields.splat_decimation import decimate_splats
from cagefield.fields.splat_field import SplatField
from cagefield.files.ply import read_ply
from cagefield.formats.splats.splat_files import read_splats
from cagefield.geometry.cage import Cage
from cagefield.rendering.edited_field import EditedField, edited_bounds
from cagefield.rendering.splats.bake_splats import baked_splats
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.scene.import_splats import axis_of, import_splats, nearest_up
from cagefield.scene.scene import Scene
from cagefield.server.render_worker.edited_splats import EditedSplats, write_edited
from commands import printed, refused
from scenes import ball_field, ball_scene
from splat_scenes import assert_same_splats, ball_of_splats, random_splats, splat_scene
from tiers import nightly_after_first

INNER = Cage.box((0, 0, 0), 1.3)
MOVED = Edit.move(INNER, name="ball").translate((0.25, 0, 0))
COPIED = Edit.copy(INNER, name="copy").translate((0, 3, 0))


def saved(scene: Scene, folder: Path, *edits: Edit) -> Path:
    """The folder of a scene with edits."""
    scene.with_edits(EditStack(edits)).save(folder)
    return folder


def center(file: Path) -> np.ndarray:
    """The mean position of a PLY's vertices."""
    vertex = read_ply(file).elements["vertex"]
    return np.stack([vertex[axis] for axis in "xyz"], axis=1).mean(axis=0)


# ---- splats of splats ----


def test_edits_are_baked_into_splats(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    scene = saved(splat_scene(), tmp_path / "scene", MOVED)
    said = printed(capsys, "export", scene, "-o", tmp_path / "out.ply", "--up", "y-down")
    written, expected = read_splats(tmp_path / "out.ply"), baked_splats(ball_of_splats(), EditStack([MOVED]))
    assert f"{len(expected)} splats, SH degree 0; edits baked in" in said
    assert f"written to {tmp_path / 'out.ply'}" in said
    # The cage cuts some in two; what moves has moved.
    mass = written.opacities * np.exp(written.log_scales.sum(axis=1))
    assert np.average(written.means, axis=0, weights=mass) == pytest.approx([0.25, 0.0, 0.0], abs=0.06)
    np.testing.assert_allclose(written.means, expected.means, atol=1e-6)
    np.testing.assert_allclose(written.opacities, expected.opacities, atol=1e-6)


def test_a_scene_without_edits_is_written_as_it_is(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    scene = saved(splat_scene(), tmp_path / "scene")
    said = printed(capsys, "export", scene, "-o", tmp_path / "out.ply", "--up", "y-down")
    assert "without edits" in said and "turned" not in said
    written, expected = read_splats(tmp_path / "out.ply"), ball_of_splats()
    for name in ("means", "log_scales", "quaternions", "sh"):
        np.testing.assert_allclose(getattr(written, name), getattr(expected, name), atol=1e-6)


@pytest.mark.parametrize("selection", ["copy", "file", "{center: [0, 3, 0], size: 1.4}"])
def test_a_selection_is_what_a_cage_holds_after_the_edits(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, selection: str
) -> None:
    scene = saved(splat_scene(), tmp_path / "scene", COPIED)
    if selection == "file":
        selection = str(tmp_path / "copy.yaml")
        save_edits(EditStack([COPIED]), selection)
    options = ("--selection", selection, "--up", "y-down")
    said = printed(capsys, "export", scene, "-o", tmp_path / "out.ply", *options)
    assert said.startswith("600 splats")
    means = read_splats(tmp_path / "out.ply").means
    # Radius .5 around (0, 3, 0); without the selection there are 1200 splats.
    np.testing.assert_allclose(np.linalg.norm(means - np.array([0, 3, 0]), axis=1), 0.5, atol=1e-5)
    printed(capsys, "export", scene, "-o", tmp_path / "all.ply")
    assert len(read_splats(tmp_path / "all.ply")) == 1200


def test_selections_that_mean_nothing_are_refused() -> None:
    stack = EditStack([MOVED])
    assert cages_of("ball", stack) == (MOVED.deformed,)
    with pytest.raises(EditError, match=r'"bell" is no edit of the scene \("ball"\); give an edit\'s name'):
        cages_of("bell", stack)
    with pytest.raises(EditError, match="a cage needs center and size"):
        cages_of("{center: [0, 0, 0]}", stack)
    with pytest.raises(EditError, match="cannot be read"):
        cages_of("nowhere.yaml", stack)
    with pytest.raises(CagefieldError, match="the selection holds nothing"):
        inside((INNER,), np.full((3, 3), 5.0))
    far = Cage.box((5, 5, 5), 1.0)
    assert inside((INNER, far), np.array([[0, 0, 0], [5, 5, 5], [3, 3, 3]])).tolist() == [True, True, False]


# ---- upright ----


def test_the_editors_download_merges_splats_beyond_a_number(tmp_path: Path) -> None:
    folder = saved(splat_scene(), tmp_path / "scene")
    content = EditedSplats(scene=str(folder), name="scene", form="ply", splats=200)
    write_edited(content, str(tmp_path / "x.ply"))
    scene = Scene.open(folder)
    assert isinstance(scene.field, SplatField)
    expected = upright(decimate_splats(scene.field, 200), scene.up)
    assert_same_splats(read_splats(tmp_path / "x.ply"), expected, rtol=1e-5, atol=1e-5)
    assert len(expected) == 200


def test_quarter_turns_bring_every_axis_upright() -> None:
    for name in ("y-down", "y-up", "z-up", "z-down", "x-up", "x-down"):
        up = axis_of(name)
        R = upright_turn(up)
        np.testing.assert_array_equal(R @ up, (0, -1, 0))
        np.testing.assert_array_equal(R @ R.T, np.eye(3))
        assert np.linalg.det(R) == pytest.approx(1.0)
        tilted = up + np.array([0.2, -0.3, 0.25])
        np.testing.assert_array_equal(upright_turn(tilted), R)
        assert nearest_up(tilted) == name
    np.testing.assert_array_equal(upright_turn((0, -1, 0)), np.eye(3))


@pytest.mark.parametrize(
    ("ending", "least"), [(".ply", 100.0), (".glb", 100.0), (".spz", 36.0), (".sog", 50.0)]
)
def test_a_scene_with_z_up_stands_upright_in_files(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, ending: str, least: float
) -> None:
    # Splats of all shapes and colors, more of them below: turned with their harmonics, or pictures differ.
    # Harmonics that are not turned give 21 to 24 dB; what .spz and .sog round off comes to 40 and 60.
    field = random_splats(60, degree=2)
    field = field.take(np.argsort(field.means[:, 2])[:45])
    scene = dataclasses.replace(splat_scene(), field=field)
    folder, out = saved(scene, tmp_path / "scene"), tmp_path / f"out{ending}"
    said = printed(capsys, "export", folder, "-o", out)
    assert "turned upright from z-up; --up y-down keeps the scene's coordinates" in said
    read = read_splats(out)
    # The editor's download is the same file.
    write_edited(
        EditedSplats(scene=str(folder), name="scene", form=ending[1:]), str(tmp_path / f"page{ending}")
    )
    assert (tmp_path / f"page{ending}").read_bytes() == out.read_bytes()
    R = np.eye(4)
    R[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]  # (x, y, z) becomes (x, -z, y)
    for camera in scene.cameras["train"]:
        camera = camera.resized(96, 64)
        got = SplatRenderer(read).render(camera.with_c2w(R @ camera.c2w))
        expected = SplatRenderer(field).render(camera)
        assert got is not None and expected is not None
        assert -10.0 * np.log10(np.square(got.rgb - expected.rgb).mean() + 1e-12) > least
    # Imported, it stands as before: what was low is low on the cameras' pictures.
    imported = import_splats(read)
    up = dataclasses.replace(scene, cameras=imported.cameras).up
    np.testing.assert_allclose(up, (0, -1, 0), atol=1e-6)
    assert read.means @ up == pytest.approx(-read.means[:, 1], abs=1e-5)
    assert np.median(read.means @ up) == pytest.approx(np.median(field.means[:, 2]), abs=0.01)
    # Again into a file: y is down now, and nothing is turned.
    again = saved(dataclasses.replace(scene, field=read, cameras=imported.cameras), tmp_path / "again")
    assert "turned" not in printed(capsys, "export", again, "-o", tmp_path / "again.ply")
    np.testing.assert_array_equal(read_splats(tmp_path / "again.ply").means, read.means)


# ---- splats of voxels ----


@pytest.mark.nightly
def test_splats_are_fitted_to_voxels_and_their_edits(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    scene = dataclasses.replace(ball_scene(), field=ball_field(200.0, 25), cameras={})
    folder = saved(scene, tmp_path / "scene", MOVED)
    said = printed(
        capsys, "export", folder, "-o", tmp_path / "out.ply", "--steps", 60, "--splats", 800
    )  # fmt: skip
    assert "PSNR against the voxels" in said and "from cameras that were held out" in said
    splats = read_splats(tmp_path / "out.ply")
    assert 300 < len(splats) <= 800
    # The ball, moved: of radius .5 and up to an edge of .083 more, and what splats are wide.
    low, high = np.quantile(splats.means, (0.02, 0.98), axis=0)
    np.testing.assert_allclose(0.5 * (low + high)[:2], (0.25, 0), atol=0.04)
    np.testing.assert_allclose((high - low)[:2], 1.0, atol=0.12)
    assert float(said.split("held out ")[1].split(" dB")[0]) > 25.0


def test_cameras_are_the_scenes_or_stand_around_it() -> None:
    scene = ball_scene()
    train, held_out = fitting_cameras(scene)
    assert (len(train), len(held_out)) == (3, 2)
    own = scene.cameras["train"][0]
    distance = np.linalg.norm(own.origin)
    # Pixels of PIXELS_PER_VOXEL voxels at the middle; more where the camera's own are finer.
    pixel = distance / train[0].fx
    assert pixel == pytest.approx(PIXELS_PER_VOXEL * scene.field.sample_spacing, rel=0.02)
    assert train[0].width / train[0].height == pytest.approx(own.width / own.height, rel=0.02)
    fine = dataclasses.replace(scene, cameras={"train": tuple(c.resized(1200, 800) for c in train)})
    train, held_out = fitting_cameras(fine)
    assert max(train[0].width, train[0].height) == MAX_IMAGE_SIDE_PX and (len(train), len(held_out)) == (3, 1)
    train, held_out = fitting_cameras(dataclasses.replace(scene, cameras={}))
    assert len(train) + len(held_out) == 48 and not {*train} & {*held_out}
    many = dataclasses.replace(scene, cameras={"train": own_ring(own, 500), "test": own_ring(own, 90)})
    assert tuple(map(len, fitting_cameras(many))) == (MOST_VIEWS, MOST_HELD_OUT)


def own_ring(camera: Camera, count: int) -> tuple[Camera, ...]:
    """So many cameras at one place."""
    return (camera,) * count


def test_what_edits_take_out_of_the_box_is_seen_from_around() -> None:
    scene = ball_scene().with_edits(EditStack([COPIED]))
    bounds = edited_bounds(scene.field.bounds, scene.edits)
    np.testing.assert_allclose(bounds, [[-1, -1, -1], [1, 3.65, 1]])
    train, _ = fitting_cameras(scene)
    assert len(train) == 3 + 48
    corners = np.array(np.meshgrid(*bounds.T)).reshape(3, -1).T
    for camera in train[3:]:
        pixels, depth = camera.project(corners)
        assert (depth > 0).all() and (pixels >= 0).all() and (pixels < (camera.width, camera.height)).all()


# ---- meshes and points ----


def test_an_edited_field_is_the_field_where_it_was_taken_from() -> None:
    field, chance = ball_field(), np.random.default_rng(0)
    edited = EditedField(
        field, KernelMap(EditStack([MOVED])), edited_bounds(field.bounds, EditStack([MOVED]))
    )
    points = chance.uniform(-1, 1, (4000, 3)).astype(np.float32)
    along = np.tile(np.float32([0, 0, 1]), (4000, 1))
    sigma, rgb = edited(points, along)
    expected, color = field(points - np.array([0.25, 0, 0]), along)
    held, left = MOVED.deformed.contains(points.astype(float)), INNER.contains(points.astype(float))
    np.testing.assert_allclose(sigma[held], expected[held], rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(rgb[held], color[held], atol=1e-3)
    assert (sigma[left & ~held] == 0).all() and (sigma[held] > 0).any()


@pytest.mark.parametrize("kind", nightly_after_first(["voxels", "splats"]))
def test_meshes_have_the_edits_in_them(capsys: pytest.CaptureFixture[str], tmp_path: Path, kind: str) -> None:
    pytest.importorskip("skimage", reason="needs scikit-image")
    scene = ball_scene() if kind == "voxels" else splat_scene()
    folder = saved(scene, tmp_path / "scene", MOVED)
    said = printed(capsys, "export", folder, "-o", tmp_path / "out.ply", "--as", "mesh", "--resolution", 48)
    assert "triangles" in said and "vertices with colors" in said
    np.testing.assert_allclose(center(tmp_path / "out.ply"), (0.25, 0, 0), atol=0.03)
    vertex = read_ply(tmp_path / "out.ply").elements["vertex"]
    positions = np.stack([vertex[axis] for axis in "xyz"], axis=1)
    assert np.abs(np.linalg.norm(positions - [0.25, 0, 0], axis=1) - 0.5).max() < 0.15
    assert (vertex["red"] > vertex["green"]).mean() > 0.99


def test_a_selected_part_of_a_mesh(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    pytest.importorskip("skimage", reason="needs scikit-image")
    folder = saved(ball_scene(), tmp_path / "scene")
    half = "{center: [1, 0, 0], size: 2}"
    printed(capsys, "export", folder, "-o", tmp_path / "half.ply", "--as", "mesh", "--selection", half)
    vertex = read_ply(tmp_path / "half.ply").elements["vertex"]
    assert vertex["x"].min() >= 0.0 and vertex["x"].max() > 0.4 and vertex["y"].min() < -0.3
    printed(capsys, "export", folder, "-o", tmp_path / "whole.glb", "--as", "mesh")
    assert (tmp_path / "whole.glb").read_bytes()[:4] == b"glTF"


def test_points_lie_on_the_surface(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    folder = saved(splat_scene(), tmp_path / "scene", MOVED)
    said = printed(capsys, "export", folder, "-o", tmp_path / "p.ply", "--as", "points", "--splats", 500)
    assert "500 points with normals and colors" in said
    vertex = read_ply(tmp_path / "p.ply").elements["vertex"]
    points = np.stack([vertex[axis] for axis in "xyz"], axis=1) - (0.25, 0, 0)
    radius = np.linalg.norm(points, axis=1)
    # Mean depth through splats that overlap: within a tenth of the ball's radius.
    assert np.quantile(np.abs(radius - 0.5), 0.9) < 0.05
    normals = np.stack([vertex[axis] for axis in ("nx", "ny", "nz")], axis=1)
    assert np.abs(np.einsum("ni,ni->n", normals, points / radius[:, None])).mean() > 0.9


def test_up_is_the_cameras(tmp_path: Path) -> None:
    np.testing.assert_allclose(ball_scene().up, (0, 0, 1))
    np.testing.assert_allclose(dataclasses.replace(ball_scene(), cameras={}).up, (0, 0, 1))


# ---- refusals ----


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (("-o", "x.obj", "--as", "mesh"), "a mesh is written as .ply or .glb"),
        (("-o", "x.glb", "--as", "points"), "points are written as .ply"),
        (("-o", "x.xyz"), "x.xyz"),
        (("-o", "x.ply", "--as", "points", "--up", "z-up"), "--axes, --up and --spz-version are for splats"),
        (("-o", "x.ply", "--spz-version", "4"), "versions are for .spz files; leave --spz-version out"),
        (("-o", "x.ply", "--splats", "7"), "--splats is 7; it must be from 100 to 10000000"),
        (("-o", "x.ply", "--selection", "arm"), 'selection "arm" is no edit of the scene'),
    ],
)
def test_what_cannot_be_written_is_one_line_before_anything_is_computed(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    options: tuple[str, ...],
    line: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    saved(ball_scene(), tmp_path / "scene")
    assert line in refused(capsys, "export", "scene", *options)
    assert [entry.name for entry in tmp_path.iterdir()] == ["scene"]


def test_a_file_that_is_there_stays(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    folder = saved(splat_scene(), tmp_path / "scene")
    (tmp_path / "out.ply").write_text("mine")
    assert "exists already" in refused(capsys, "export", folder, "-o", tmp_path / "out.ply")
    assert (tmp_path / "out.ply").read_text() == "mine"
    printed(capsys, "export", folder, "-o", tmp_path / "out.ply", "--overwrite")
    assert len(read_splats(tmp_path / "out.ply")) == 600
