"""Vertices that no photo shows: the closed form of their set, and inpainting from the surfaces around."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import spsolve

from cagefield.cameras.camera import Camera
from cagefield.compute import devices
from cagefield.fields.frusta import in_frusta
from cagefield.fields.voxel_field import VoxelField
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from cagefield.training.voxels import inpainting
from cagefield.training.voxels.inpainting import (
    DIFFUSION_LENGTH_VOXELS,
    FILL_DEPTH_VOXELS,
    FILL_OPTICAL_DEPTH,
    MAX_RELATIVE_RESIDUAL,
    NORMAL_CONDUCTIVITY,
    fill_unseen,
)
from cagefield.training.voxels.vertex_visibility import MIN_TRANSMITTANCE, invisible_vertices

devices.start()

N = 41
BOUNDS = np.array([[-1.0] * 3, [1.0] * 3])
VOXEL = 2.0 / (N - 1)


def grid() -> np.ndarray:
    axis = np.linspace(-1.0, 1.0, N)
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)


def field_of(density: np.ndarray, color: np.ndarray, degree: int = 1) -> VoxelField:
    """The field with density [N,N,N] and the same color coefficients [N,N,N,3] in all directions."""
    vertices = np.flatnonzero(density.reshape(-1) > 0)
    sh = np.zeros((len(vertices), (degree + 1) ** 2, 3), np.float32)
    sh[:, 0] = color.reshape(-1, 3)[vertices]
    return VoxelField(BOUNDS, density.shape, vertices, density.reshape(-1)[vertices], sh)


def dense(field: VoxelField) -> tuple[np.ndarray, np.ndarray]:
    """(density [N,N,N], constant color coefficients [N,N,N,3])."""
    density, color = np.zeros(N**3, np.float32), np.zeros((N**3, 3), np.float32)
    density[field.vertices], color[field.vertices] = field.density, field.sh[:, 0]
    return density.reshape(N, N, N), color.reshape(N, N, N, 3)


def ring(count: int = 12, height: float = 2.0) -> list[Camera]:
    angles = 2 * np.pi * np.arange(count) / count
    return [
        Camera.look_at((3 * np.cos(a), 3 * np.sin(a), height), (0, 0, 0), width=96, height=96, fov_x=0.8)
        for a in angles
    ]


@pytest.mark.parametrize("sigma", [8.0, 20.0])
def test_behind_a_wall_photos_show_as_deep_as_its_light_comes(sigma: float) -> None:
    p = grid()
    density = np.where(p[..., 0] <= 0.5, sigma, 0.0).astype(np.float32)
    # Head-on rays: T = exp(-sigma depth) falls under the least at depth = -ln(least) / sigma. The wall's
    # front is a ramp of one voxel beyond 0.5, which counts as half a voxel.
    camera = Camera.look_at((12.0, 0, 0), (0, 0, 0), width=160, height=160, fov_x=0.18, up=(0, 0, 1))
    hidden = invisible_vertices(field_of(density, np.zeros((N, N, N, 3))), [camera])
    shown_to = 0.5 + 0.5 * VOXEL + np.log(MIN_TRANSMITTANCE) / sigma
    middle = hidden[:, N // 2, N // 2]
    x = np.linspace(-1, 1, N)
    # A cell that is crossed shows its 8 vertices: the edge is one voxel behind the closed form, at most two.
    assert not middle[x > shown_to - VOXEL + 1e-6].any()
    assert middle[x < shown_to - 2.5 * VOXEL].all()


def test_all_is_unseen_from_a_camera_that_looks_away() -> None:
    density = np.ones((N, N, N), np.float32)
    away = Camera.look_at((3, 0, 0), (6, 0, 0), width=16, height=16, fov_x=0.5)
    field = field_of(density, np.zeros((N, N, N, 3)))
    assert invisible_vertices(field, [away]).all()
    assert not invisible_vertices(field, ring())[-1, N // 2].any()


@pytest.fixture(scope="module")
def ball() -> tuple[VoxelField, np.ndarray]:
    """A ball, hollow as a trained one, and what is unseen of it: its color runs from red to blue along x."""
    p = grid()
    r = np.linalg.norm(p, axis=-1)
    density = np.where((r < 0.7) & (r > 0.55), 3.0 / VOXEL, 0.0).astype(np.float32)
    share = (p[..., :1] + 1) / 2
    color = share * np.array([1.0, 0.0, -1.0]) + (1 - share) * np.array([-1.0, 0.0, 1.0])
    field = field_of(density, color.astype(np.float32))
    return field, invisible_vertices(field, ring())


def test_what_was_seen_stays_and_photos_show_the_same(ball) -> None:
    field, hidden = ball
    after = fill_unseen(field, hidden)
    (before_density, before_color), (density, color) = dense(field), dense(after)
    np.testing.assert_array_equal(density[~hidden], before_density[~hidden])
    np.testing.assert_array_equal(color[~hidden], before_color[~hidden])
    for camera in ring(3):
        one, two = (
            np.asarray(VoxelRenderer(f).render(camera, background="white").rgb) for f in (field, after)
        )
        # Inpainted vertices lie behind a transmittance of less than MIN_TRANSMITTANCE.
        assert np.abs(one - two).max() < MIN_TRANSMITTANCE
        assert np.abs(one - two).mean() < 0.005


def test_it_is_opaque_to_its_depth_and_no_deeper(ball) -> None:
    field, hidden = ball
    density, _ = dense(fill_unseen(field, hidden))
    r = np.linalg.norm(grid(), axis=-1)
    inside = hidden & (r < 0.5)
    assert inside.any()
    # Rays end at 0.65, one voxel into the shell; the nearest vertex there may be a cell's diagonal off.
    near = inside & (r > 0.65 - (FILL_DEPTH_VOXELS - 3) * VOXEL)
    assert near.any()
    np.testing.assert_allclose(density[near], FILL_OPTICAL_DEPTH / VOXEL, rtol=1e-6)
    far = inside & (r < 0.55 - (FILL_DEPTH_VOXELS + 1) * VOXEL)
    assert far.any()
    assert (density[far] == 0).all()


def test_colors_go_on_from_the_surfaces_and_stay_between_them(ball) -> None:
    field, hidden = ball
    after = fill_unseen(field, hidden)
    density, color = dense(after)
    new = hidden & (density > 0) & (np.linalg.norm(grid(), axis=-1) < 0.55)
    given = field.sh[:, 0]
    assert (color[new] >= given.min(axis=0) - 1e-3).all()
    assert (color[new] <= given.max(axis=0) + 1e-3).all()
    x = grid()[..., 0]
    right, left = new & (x > 0.3), new & (x < -0.3)
    # The shell there is (x + 1)/2 of the way from blue to red: above 0.25 right, under -0.25 left.
    assert color[right, 0].min() > 0.25
    assert color[left, 0].max() < -0.25
    at = np.searchsorted(after.vertices, np.flatnonzero(new))
    assert (after.sh[at, 1:] == 0).all()


def test_under_a_block_the_ground_goes_on() -> None:
    p = grid()
    ground = p[..., 2] <= -0.5
    block = (np.abs(p[..., :2]).max(axis=-1) <= 0.3) & (p[..., 2] > -0.5) & (p[..., 2] <= 0.3)
    density = np.where(ground | block, 3.0 / VOXEL, 0.0).astype(np.float32)
    color = np.where(ground[..., None], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]).astype(np.float32)
    hidden = invisible_vertices(field_of(density, color), ring())
    # What a training leaves where no photo looks.
    color[hidden] = [-1.0, -1.0, 2.0]
    field = field_of(density, color)
    _, after = dense(fill_unseen(field, hidden))
    k = int(np.argmin(np.abs(np.linspace(-1, 1, N) + 0.5))) - 1
    under = hidden[:, :, k] & (np.abs(p[:, :, k, :2]).max(axis=-1) < 0.25)
    assert under.any()
    green, red = after[:, :, k][under][:, 1], after[:, :, k][under][:, 0]
    # Two planes meet here: the ground's, and those of the block's sides, which end at it.
    assert (green > red).all()
    assert green.mean() > 0.7


def test_colors_stay_between_the_surfaces_where_the_solver_runs_out_of_steps(
    ball, monkeypatch: pytest.MonkeyPatch
) -> None:
    field, hidden = ball
    whole = fill_unseen(field, hidden)
    swept = inpainting.jacobi_sweeps
    calls = []
    # Each sweep carries colors one voxel on: FILL_DEPTH_VOXELS sweeps reach every inpainted vertex.
    monkeypatch.setattr(inpainting, "MAX_SOLVER_STEPS", FILL_DEPTH_VOXELS + 2)
    monkeypatch.setattr(inpainting, "jacobi_sweeps", lambda *system: calls.append(1) or swept(*system))
    short = fill_unseen(field, hidden)
    assert len(calls) == 3  # each of the three axes
    np.testing.assert_array_equal(short.vertices, whole.vertices)
    np.testing.assert_array_equal(short.density, whole.density)
    at = np.searchsorted(whole.vertices, np.flatnonzero(hidden & (dense(whole)[0] > 0)))
    color, given = short.sh[at, 0], field.sh[:, 0]
    assert (color >= given.min(axis=0) - 1e-6).all() and (color <= given.max(axis=0) + 1e-6).all()
    assert not np.array_equal(color, whole.sh[at, 0])
    # It is the surfaces' colors, not gray: as they run, red comes with x and blue goes.
    x = grid().reshape(-1, 3)[whole.vertices[at], 0]
    assert color[x > 0.3, 0].min() > 0.25 and color[x < -0.3, 0].max() < -0.25


def block(n: int = 16) -> tuple[sparse.csr_matrix, np.ndarray]:
    """The system (pull, diagonal) of a block that nothing holds but its sources: no eigenvalue is smaller."""
    number = np.arange(n**3).reshape(n, n, n)
    pull = sparse.csr_matrix((n**3, n**3))
    for axis, share in enumerate(DIFFUSION_LENGTH_VOXELS**2 * np.array([1.0, 1.0, NORMAL_CONDUCTIVITY])):
        a, b = inpainting.neighbor_pairs(number, number, axis)
        pull += sparse.csr_matrix((np.full(len(a), share), (a, b)), pull.shape)
    return pull, 1.0 + np.asarray(pull.sum(axis=1))[:, 0]


def test_the_bound_on_the_steps_holds_where_the_system_is_hardest(monkeypatch: pytest.MonkeyPatch) -> None:
    pull, diagonal = block()
    source = np.zeros((len(diagonal), 2))
    source[0] = 1.0, -0.5

    def never(*system):
        raise AssertionError("not solved within the bound")

    monkeypatch.setattr(inpainting, "MAX_SOLVER_STEPS", 111)
    monkeypatch.setattr(inpainting, "jacobi_sweeps", never)
    found = inpainting.solve_diffusion(pull, diagonal, source)
    direct = spsolve((sparse.diags(diagonal) - pull).tocsc(), source[:, 0])
    # No eigenvalue is under 1, so the error is at most the residual.
    assert np.linalg.norm(found - direct[:, None] * source[0]) < MAX_RELATIVE_RESIDUAL * np.linalg.norm(
        source[0]
    )


def test_a_solution_cut_short_mixes_its_sources_and_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    pull, diagonal = block()
    source = np.zeros((len(diagonal), 2))
    source[0], source[-1] = (1.0, 1.0), (1.0, 0.0)  # weights, and weights times colors 1 and 0
    monkeypatch.setattr(inpainting, "MAX_SOLVER_STEPS", 40)
    weight, color = inpainting.solve_diffusion(pull, diagonal, source).T
    # The corners are 45 voxels apart; 40 steps of conjugate gradients stop short with a color of 1.00005.
    assert (weight > 0).all()
    assert (color >= 0).all() and (color <= weight).all()
    assert color[0] > 0.99 * weight[0] and color[-1] < 0.01 * weight[-1]


def test_nothing_unseen_and_nothing_solid_leave_the_field_as_it_is(ball) -> None:
    field, _ = ball
    assert fill_unseen(field, np.zeros(field.resolution, bool)) is field
    mist = field_of(np.full((N, N, N), 1e-4, np.float32), np.zeros((N, N, N, 3), np.float32))
    assert fill_unseen(mist, np.ones((N, N, N), bool)) is mist


def test_as_many_cameras_as_asked_have_a_point_in_their_picture() -> None:
    # All look along +x: two from the left of the origin, one from the right of it.
    eyes = ((-3.0, 0, 0), (-3.0, 0.1, 0), (4.0, 0, 0))
    targets = ((0.0, 0, 0), (0, 0.1, 0), (9.0, 0, 0))
    cameras = [
        Camera.look_at(eye, at, width=20, height=20, fov_x=0.5) for eye, at in zip(eyes, targets, strict=True)
    ]
    points = np.array([[0.0, 0, 0], [6.0, 0, 0], [0, 5.0, 0], [-2.5, 0.05, 0]])
    assert [in_frusta(cameras, points, min_views=n).tolist() for n in (1, 2, 3)] == [
        [True, True, False, True],
        [True, True, False, True],
        [False, True, False, False],
    ]
    assert in_frusta(cameras, points, near=1.0).tolist() == [True, True, False, False]
