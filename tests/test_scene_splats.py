"""Scenes of splats: files, pictures, edits, exact pictures, and the voxels that are made of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import cagefield
from cagefield import Cage, Edit, EditStack, Scene, load_dataset
from cagefield.cameras.camera import Camera
from cagefield.errors import FieldError
from cagefield.fields.baking import _Grid, bake, enclosing_mask, widen_splats
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.images.metrics import psnr
from cagefield.procedural import make_scene
from cagefield.rendering.renderers import renderer_of
from scenes import ball_field, ball_scene
from splat_scenes import assert_same_splats, ball_of_splats, random_splats, splat_scene

LIFT = Edit.move(Cage.box((0, 0, 0), 1.2)).translate((0, 0, 0.4))


def test_the_file_says_which_kind_of_field_it_holds(tmp_path: Path) -> None:
    scene = splat_scene().with_edits(EditStack([LIFT]))
    scene.save(tmp_path / "splats")
    ball_scene().save(tmp_path / "voxels")
    opened = Scene.open(tmp_path / "splats")
    assert isinstance(opened.field, SplatField) and cagefield.SplatField is SplatField
    assert_same_splats(opened.field, scene.field, atol=1e-7)
    assert opened.edits == scene.edits and opened.cameras == scene.cameras
    assert isinstance(Scene.open(tmp_path / "voxels").field, VoxelField)


def test_kinds_that_scenes_do_not_hold_are_refused(tmp_path: Path) -> None:
    from safetensors.numpy import load_file, save_file

    splat_scene().save(tmp_path / "scene")
    file = tmp_path / "scene" / "field.safetensors"
    save_file(load_file(file), file, metadata={"kind": "HashField", "version": "1"})
    with pytest.raises(FieldError, match=r"field\.safetensors: kind is 'HashField'"):
        Scene.open(tmp_path / "scene")
    file.write_bytes(file.read_bytes()[:100])
    with pytest.raises(FieldError, match=r"not a readable field file .*truncated"):
        Scene.open(tmp_path / "scene")


def test_pictures_are_the_rasterizers() -> None:
    scene = splat_scene()
    camera = scene.cameras["test"][0]
    frame = scene.render(camera, normals=True)
    expected = renderer_of(scene.field).render(camera, background="white", normals=True)
    np.testing.assert_array_equal(frame.rgb, expected.rgb)
    assert frame.normals is not None and frame.opacity[8, 12] > 0.99
    # A ball of radius .5 at distance 3.
    assert frame.depth[8, 12] == pytest.approx(2.5, abs=0.05)
    np.testing.assert_array_equal(frame.rgb[0, 0], (1, 1, 1))
    assert scene.render(camera, background="none").background is None


def test_edits_move_splats_and_share_the_field() -> None:
    scene = splat_scene()
    camera = Camera.look_at((0, -3, 0), (0, 0, 0), width=48, height=48, fov_x=0.8)
    before = scene.render(camera)
    edited = scene.with_edits(EditStack([LIFT]))
    after = edited.render(camera)
    assert edited.renderer.field is scene.renderer.field
    rows = [np.average(np.arange(48), weights=frame.opacity.sum(axis=1)) for frame in (before, after)]
    assert rows[0] - rows[1] == pytest.approx(0.4 / 3 * 24 / np.tan(0.4), abs=0.5)
    np.testing.assert_array_equal(edited.with_edits(EditStack([])).render(camera).rgb, before.rgb)


def test_exact_pictures_leave_lattices_out() -> None:
    inner = Cage.box((0.0, 0.0, 0.3), 0.5)
    coarse = (
        Edit.continuous(inner, inner.grown(0.6), lattice=6).rotate((0.0, 0.0, 0.9)).translate((0.1, 0.0, 0.1))
    )
    camera = splat_scene().cameras["test"][0].resized(96, 64)
    quick = splat_scene().with_edits(EditStack([coarse]))
    exact = splat_scene().with_edits(EditStack([coarse.replace(lattice=None)]))
    np.testing.assert_array_equal(quick.render(camera, exact=True).rgb, exact.render(camera).rgb)
    assert np.abs(exact.render(camera).rgb - splat_scene().render(camera).rgb).max() > 0.3
    (error,) = quick.lattice_errors()
    worst, mean = coarse.lattice_error()
    width = quick.field.sample_spacing
    assert (error.worst, error.mean) == pytest.approx((worst / width, mean / width))


@dataclass(frozen=True)
class Result:
    field: SplatField
    gains: np.ndarray
    background: tuple[float, float, float] = (0.2, 0.4, 0.6)


def test_a_trained_scene_has_gains_and_the_background_that_was_fitted(tmp_path: Path) -> None:
    dataset = load_dataset(make_scene("plant", tmp_path / "photos", views=3, size=16, test_views=1))
    gains = np.array([[0.9, 1.0, 1.1], [1.0, 1.0, 1.0], [1.1, 1.0, 0.9]], np.float32)
    scene = Scene.trained(Result(random_splats(), gains), dataset)
    np.testing.assert_array_equal(np.array(scene.gains, np.float32), gains)
    assert scene.background == (0.2, 0.4, 0.6) and [*scene.cameras] == ["train", "test", "val"]
    assert Scene.trained(Result(random_splats(), np.ones((3, 3))), dataset).gains == ()


def test_voxels_of_splats_show_what_the_splats_show() -> None:
    scene = splat_scene()
    baked = Scene.baked(scene.field, scene.cameras, resolution=96)
    assert isinstance(baked.field, VoxelField) and baked.original is None and not baked.field.contracted
    for camera in scene.cameras["test"]:
        camera = camera.resized(240, 160)
        shown, expected = baked.render(camera), scene.render(camera)
        # A white picture scores 11 dB. Measured 33 dB, 27 at half the resolution and 35 at 160; the rest is
        # the silhouette. (Pictures of a few pixels differ: every splat gets the rasterizer's filter there.)
        assert psnr(np.clip(shown.rgb, 0, 1), np.clip(expected.rgb, 0, 1)) > 31.0
        assert shown.opacity.mean() == pytest.approx(expected.opacity.mean(), rel=0.02)
        # Single splats between which little is left stand in the way: some of the far side shines through.
        middle = (slice(65, 95), slice(105, 135))
        assert shown.opacity[middle].mean() > 0.95
        assert np.median(shown.depth[middle]) == pytest.approx(np.median(expected.depth[middle]), abs=0.1)


@pytest.mark.nightly
def test_voxels_of_unbounded_splats_reach_beyond_their_box() -> None:
    ball = ball_of_splats()
    far = SplatField(
        np.concatenate([ball.means, 8.0 * ball.means / 0.5]),
        np.concatenate([ball.log_scales, ball.log_scales + np.log(16.0)]),
        np.concatenate([ball.quaternions] * 2),
        np.concatenate([ball.opacities] * 2),
        np.concatenate([ball.sh, -ball.sh]),
        bounds=ball.bounds,
        unbounded=True,
    )
    scene = replace(splat_scene(), field=far)
    baked = Scene.baked(far, scene.cameras, resolution=112, unbounded=True)
    assert baked.field.contracted
    camera = scene.cameras["test"][0].resized(240, 160)
    shown, expected = baked.render(camera), scene.render(camera)
    # The wall around the ball, 8 away from the middle, is of the opposite color.
    corner = (slice(0, 40), slice(0, 40))
    assert np.median(expected.depth[corner]) > 8.0 and expected.opacity[corner].mean() > 0.9
    assert shown.opacity[corner].mean() > 0.9
    means = [np.median(frame.rgb[corner], axis=(0, 1)) for frame in (shown, expected)]
    np.testing.assert_allclose(*means, atol=0.1)
    assert psnr(np.clip(shown.rgb, 0, 1), np.clip(expected.rgb, 0, 1)) > 20.0


def test_wider_splats_cover_more_with_less() -> None:
    field = SplatField(
        np.zeros((2, 3)),
        np.log([[0.3, 0.4, 0.01], [0.02, 0.01, 0.03]]),
        np.array([[1.0, 0, 0, 0], [1.0, 0.2, -0.4, 0.7]]),
        np.array([0.8, 0.6]),
        np.zeros((2, 1, 3)),
    )
    widths = np.stack([np.zeros((3, 3)), np.diag([0.04, 0.02, 0.1]) @ np.ones((3, 3))])
    wide = widen_splats(field, widths)
    plain, blurred = covariances_of(field), covariances_of(wide)
    np.testing.assert_allclose(blurred, plain + widths @ widths.transpose(0, 2, 1), rtol=1e-4, atol=1e-8)
    assert wide.opacities[0] == pytest.approx(0.8, rel=1e-5)
    # Shadows along the thinnest axis, by projection onto the other two.
    axes = rotation_matrices(field.quaternions.astype(float))[1][:, [0, 2]]
    shadows = [np.sqrt(np.linalg.det(axes.T @ C @ axes)) for C in (plain[1], blurred[1])]
    assert wide.opacities[1] == pytest.approx(0.6 * shadows[0] / shadows[1], rel=1e-4)


def test_splats_around_a_camera_are_no_veil_in_voxels() -> None:
    scene = splat_scene()
    eye = scene.cameras["test"][0].origin
    turned = np.array([[0.8, 0.1, -0.3, 0.5]])
    veil = SplatField(
        eye[None] + 0.4 * rotation_matrices(turned / np.linalg.norm(turned))[0][:, 0],
        np.log([[0.25, 0.2, 0.05]]), turned, np.array([0.9]), np.full((1, 1, 3), 2.0),
    )  # fmt: skip
    # 0.4 away along the axis of scale 0.25: 1.6 standard deviations
    np.testing.assert_array_equal(enclosing_mask(veil, eye[None]), [True])
    np.testing.assert_array_equal(enclosing_mask(veil, eye[None] + [[3.0, 0, 0]]), [False])
    farther = replace(veil, log_scales=np.log([[0.15, 0.2, 0.05]]))
    np.testing.assert_array_equal(enclosing_mask(farther, eye[None]), [False])
    both = SplatField(
        *(
            np.concatenate([getattr(scene.field, name), getattr(veil, name)])
            for name in ("means", "log_scales", "quaternions", "opacities", "sh")
        ),
        bounds=[[-4.0] * 3, [4.0] * 3],
    )
    eyes = np.array([camera.origin for camera in scene.cameras["test"]])
    # Without the veil only the ball is left, and the box closes around it.
    assert np.abs(bake(both, 32, eyes=eyes).bounds).max() < 1.0
    assert np.abs(bake(both, 32).bounds).max() > 2.0


def covariances_of(field: SplatField) -> np.ndarray:
    axes = (
        rotation_matrices(field.quaternions.astype(float)) * np.exp(field.log_scales.astype(float))[:, None]
    )
    return axes @ axes.transpose(0, 2, 1)


def test_steps_of_a_contracted_grid_are_the_derivative_of_its_positions() -> None:
    grid = _Grid.contracting(np.array([[-1.0, -2.0, 0.0], [1.0, 2.0, 3.0]]), 65)
    vertices = np.array([[32.0, 30.0, 33.0], [60.3, 20.0, 40.0], [10.0, 3.2, 50.0], [20.0, 30.0, 62.5]])
    steps = grid.steps_at(grid.positions(vertices).astype(float))
    for axis in range(3):
        h = 1e-2 * np.eye(3)[axis]
        slope = (grid.positions(vertices + h).astype(float) - grid.positions(vertices - h)) / 2e-2
        # float32 positions up to 20, differences of a hundredth of a step
        np.testing.assert_allclose(steps[:, :, axis], slope, rtol=2e-3, atol=1e-3)


def test_a_scene_of_voxels_is_rendered_as_before() -> None:
    scene = ball_scene()
    camera = scene.cameras["test"][0]
    expected = renderer_of(ball_field()).render(camera, background="white")
    np.testing.assert_array_equal(scene.render(camera).rgb, expected.rgb)
