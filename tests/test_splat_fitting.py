"""Splats fitted to a field's own pictures."""

from __future__ import annotations

import numpy as np
import pytest

from cagefield.cameras.camera import Camera, turntable
from cagefield.edits import Edit, EditStack
from cagefield.errors import CagefieldError
from cagefield.fields.baking import bake
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.cage import Cage
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.images.metrics import psnr
from cagefield.images.render_result import RenderResult
from cagefield.rendering.renderers import renderer_of
from cagefield.training.splats.fit_splats import (
    FREE_BLOCK_PIXELS,
    INITIAL_OPACITY,
    MIN_DEPTH_STEP_PIXELS,
    MIN_SURFACE_OPACITY,
    THICKNESS_SPACINGS,
    WIDTH_SPACINGS,
    SurfacePoints,
    build_surface_splats,
    fit_splats,
    free_distances,
    rotations_from_z,
    sample_surface,
)
from cagefield.training.splats.plane_sweep import FREE_DISTANCE_SHARE
from cagefield.training.splats.splat_config import SplatConfig
from scenes import ball_field

BOX = np.array([[-1.0] * 3, [1.0] * 3])
RADIUS, EDGE = 0.5, 2.0 / 32
CAMERAS = tuple(
    camera
    for elevation in (-0.7, 0.1, 0.8)
    for camera in turntable((0, 0, 0), 3.0, 6, elevation=elevation, width=64, height=48, fov_x=0.7)
)
HELD_OUT = turntable((0, 0, 0), 3.0, 4, elevation=0.45, width=64, height=48, fov_x=0.7)
BALL = ball_field(density=200.0, resolution=33)
"""Its surface is where its vertices end: from RADIUS to an edge beyond."""


def picture(
    depth: float | np.ndarray, opacity: float | np.ndarray, shape: tuple[int, int] = (8, 8)
) -> RenderResult:
    """A gray picture of depths and opacities, its normals along z."""
    normals = np.broadcast_to((0.0, 0.0, 1.0), (*shape, 3))
    gray = np.full((*shape, 3), 0.5)
    return RenderResult(gray, np.broadcast_to(opacity, shape), np.broadcast_to(depth, shape), normals)


# ---- surfaces ----


def test_turns_take_z_to_the_normal() -> None:
    chance = np.random.default_rng(0)
    normals = chance.normal(size=(200, 3))
    normals = np.concatenate([normals, np.eye(3), -np.eye(3), [[1e-9, 0.0, -1.0]]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    turned = rotation_matrices(rotations_from_z(normals).astype(np.float64))[:, :, 2]
    np.testing.assert_allclose(turned, normals, atol=2e-6)  # float32 quaternions


def test_the_surface_that_cameras_see_is_the_balls() -> None:
    surface = sample_surface(renderer_of(BALL), CAMERAS, 3000)
    distance = np.linalg.norm(surface.positions, axis=1)
    # Density rises within the edge outside the last vertex; vertices end up to an edge within the radius.
    assert distance.min() > RADIUS - EDGE and distance.max() < RADIUS + EDGE
    outwards = surface.positions / distance[:, None]
    # The ball is a staircase of edges an eighth of its radius long.
    assert np.einsum("ni,ni->n", surface.normals, outwards).mean() > 0.9
    # Colors fade to gray in the edge outside, where the field stores nothing; their hue stays.
    share = (surface.rgb[:, :1] - 0.5) / 0.4
    np.testing.assert_allclose(surface.rgb - 0.5, share * (0.4, -0.3, -0.4), atol=1e-3)
    assert share.min() > 0.0
    octants = {tuple(row) for row in (surface.positions > 0).tolist()}
    assert len(octants) == 8 and len(surface) == 3000


def test_pixels_at_a_step_in_depth_are_on_no_surface() -> None:
    camera = Camera.look_at((0, 0, 5), (0, 0, 0), up=(0, 1, 0), width=8, height=8, fov_x=1.0)
    pixel = 2.0 / camera.fx
    slope = 2.0 + np.arange(8) * (0.4 * MIN_DEPTH_STEP_PIXELS * pixel)
    step = np.where(np.arange(8) < 4, 2.0, 2.0 + 2.0 * MIN_DEPTH_STEP_PIXELS * pixel)
    assert len(SurfacePoints.from_render(picture(slope[None], 1.0), camera)) == 64
    # A column on each side has the step among its neighbors.
    assert len(SurfacePoints.from_render(picture(step[None], 1.0), camera)) == 48
    # Next to nothing at all there is no step.
    assert (
        len(SurfacePoints.from_render(picture(2.0, np.where(np.arange(8) < 4, 1.0, 0.0)[None]), camera)) == 32
    )
    assert len(SurfacePoints.from_render(picture(2.0, MIN_SURFACE_OPACITY - 0.01), camera)) == 0


def test_a_surface_needs_normals_and_something_to_see() -> None:
    camera = CAMERAS[0]
    plain = RenderResult(np.zeros((48, 64, 3)), np.ones((48, 64)), np.ones((48, 64)))
    with pytest.raises(CagefieldError, match="render with normals=True"):
        SurfacePoints.from_render(plain, camera)
    elsewhere = Camera.look_at((0, 0, 9), (0, 0, 12), up=(0, 1, 0), width=16, height=16, fov_x=0.5)
    with pytest.raises(CagefieldError, match="no camera shows a surface"):
        sample_surface(renderer_of(BALL), [elsewhere], 100)


def test_first_splats_lie_flat_on_the_surface() -> None:
    axis = np.arange(20) * 0.1
    positions = np.stack([*np.meshgrid(axis, axis), np.zeros((20, 20))], axis=-1).reshape(-1, 3)
    normals = np.tile(np.float32([0, 0, 1]), (400, 1))
    rgb = np.tile(np.float32([0.7, 0.3, 0.2]), (400, 1))
    field = build_surface_splats(SurfacePoints(positions, normals, rgb), 1).to_field(True, BOX, False)
    inner = ((positions > 0.05) & (positions < 1.85))[:, :2].all(axis=1)
    # The three nearest on a grid are one spacing away, at its rims too.
    expected = np.broadcast_to(
        0.1 * np.array([WIDTH_SPACINGS, WIDTH_SPACINGS, THICKNESS_SPACINGS]), (int(inner.sum()), 3)
    )
    np.testing.assert_allclose(np.exp(field.log_scales[inner]), expected, rtol=1e-5)
    np.testing.assert_allclose(field.opacities, INITIAL_OPACITY, rtol=1e-5)
    np.testing.assert_allclose(0.5 + 0.28209479177387814 * field.sh[:, 0], rgb, atol=1e-6)
    assert (field.sh[:, 1:] == 0).all()


def test_empty_space_ends_before_the_nearest_solid_pixel_of_a_square() -> None:
    depth, opacity = np.full((9, 12), 5.0), np.ones((9, 12))
    depth[1, 2] = 3.0
    opacity[2, 5] = 0.5
    opacity[:, 8:], depth[:, 8:] = 0.0, np.inf
    distances, known = free_distances(picture(depth, opacity, (9, 12)))
    assert FREE_BLOCK_PIXELS == 4 and distances.shape == (2, 3)
    np.testing.assert_allclose(
        distances,
        np.float32([[3 * FREE_DISTANCE_SHARE, 0, 0], [5 * FREE_DISTANCE_SHARE, 5 * FREE_DISTANCE_SHARE, 0]]),
    )
    np.testing.assert_array_equal(known, [[1, 0, 0], [1, 1, 0]])


# ---- the fit ----


def score(field: SplatField, reference: object, cameras: tuple[Camera, ...]) -> float:
    """Mean PSNR of splats against another renderer's pictures, over white."""
    renderer = renderer_of(field)
    return float(
        np.mean(
            [
                psnr(renderer.render(c, background="white").rgb, reference.render(c, background="white").rgb)  # type: ignore[attr-defined, union-attr]
                for c in cameras
            ]
        )
    )


def test_fitted_splats_look_like_the_field_from_cameras_that_were_held_out() -> None:
    reference = renderer_of(BALL)
    config = SplatConfig(steps=150, splats=1500, sh_degree=0, dropout=0.0)
    told: list[str] = []
    result = fit_splats(
        reference, CAMERAS, HELD_OUT, BOX, config, on_stage=lambda stage, done, note: told.append(stage)
    )
    begun = build_surface_splats(sample_surface(reference, CAMERAS, 900), 0).to_field(True, BOX, False)
    before, after = score(begun, reference, HELD_OUT), score(result.field, reference, HELD_OUT)
    assert after > before + 3.0 and after > 30.0
    # Pictures have 8 bits, which is beyond what these splats show.
    assert result.test_psnr == pytest.approx(after, abs=0.2)
    assert len(result.field) <= 1500 and set(told) == {"Rendering", "Fitting"}
    assert told.index("Fitting") == len(CAMERAS) + len(HELD_OUT)


def test_edits_are_in_what_is_fitted() -> None:
    inner = Cage.box((0, 0, 0), 1.3)
    moved = Edit.move(inner).translate((0.5, 0.0, 0.0))
    reference = renderer_of(BALL, EditStack([moved]))
    result = fit_splats(
        reference, CAMERAS, (), BOX, SplatConfig(steps=40, splats=600, sh_degree=0, dropout=0.0)
    )
    weights = result.field.opacities
    np.testing.assert_allclose(
        np.average(result.field.means, axis=0, weights=weights), (0.5, 0, 0), atol=0.05
    )
    assert np.isnan(result.test_psnr)


def test_an_unbounded_field_is_fitted_over_black() -> None:
    near, far = ball_field(density=200.0, resolution=33), np.array([[-0.4] * 3, [0.4] * 3])
    voxels = bake(near, 64, bounds=far, sh_degree=0, contracted=True)
    assert voxels.unbounded
    reference = renderer_of(voxels)
    config = SplatConfig(steps=150, splats=1500, sh_degree=0, dropout=0.0)
    result = fit_splats(reference, CAMERAS, HELD_OUT, far, config, unbounded=True)
    assert result.field.unbounded and result.test_psnr > 25.0
    # Black is no splat.
    assert (np.linalg.norm(result.field.means, axis=1) < 2.0 * RADIUS).mean() > 0.9


def test_no_cameras_are_refused() -> None:
    with pytest.raises(CagefieldError, match="no camera"):
        fit_splats(renderer_of(BALL), (), (), BOX, SplatConfig(steps=1, splats=100))
