"""Baking a field into voxels: densities, colors, what is stored, what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from cagefield.errors import FieldError
from cagefield.fields import AnalyticField, GaussianBlob, UniformSphere
from cagefield.fields.baking import bake, dilate_mask
from cagefield.fields.contraction import uncontract

TILT = np.array([0.2, -0.1, 0.15])


class Tilted:
    """A blob of density whose color is linear in the view direction: SH of degree 1, exactly."""

    bounds = np.array([[-1.0, -1.0, -0.5], [1.0, 1.0, 0.5]])

    def __call__(self, positions, viewdirs):
        sigma = 30.0 * np.exp(-((positions / (0.3, 0.3, 0.12)) ** 2).sum(axis=1))
        rgb = 0.5 + (viewdirs @ TILT)[:, None] * np.array([1.0, -0.5, 0.7])
        return sigma.astype(np.float32), rgb.astype(np.float32)


def directions(count: int) -> np.ndarray:
    d = np.random.default_rng(5).normal(size=(count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def test_at_its_vertices_a_baked_field_is_the_field() -> None:
    field = Tilted()
    baked = bake(field, 40, opacity=1e-4, sh_degree=1, views=48)
    lower, upper = baked.bounds
    vertices = np.stack(np.unravel_index(baked.vertices, baked.resolution), axis=1)
    positions = lower + vertices / (np.array(baked.resolution) - 1) * (upper - lower)
    toward = directions(len(positions))
    # seen from in front, where a camera may be
    toward *= np.where((toward * -positions / (0.3, 0.3, 0.12)).sum(1) < 0, -1, 1)[:, None]
    expected = field(positions, toward)
    sigma, rgb = baked(positions, toward)
    # float32 positions; a vertex's own weight is 1 to rounding
    np.testing.assert_allclose(sigma, expected[0], rtol=1e-4, atol=1e-4)
    # the ridge takes off a few hundredths of colors that differ by 0.27 from gray
    assert np.abs(rgb - expected[1]).mean() < 0.01
    seen = expected[0] > 1.0
    np.testing.assert_allclose(rgb[seen], expected[1][seen], atol=0.05)


def test_everything_that_absorbs_is_stored_and_little_else() -> None:
    field = AnalyticField([UniformSphere((0.2, 0, 0), 0.4, 20.0, (0.9, 0.1, 0.1))])
    baked = bake(field, 48, bounds=[[-1, -1, -1], [1, 1, 1]])
    # cropped to the ball, with a vertex around it
    assert np.abs(baked.bounds - [[-0.2, -0.4, -0.4], [0.6, 0.4, 0.4]]).max() < 0.1
    assert max(baked.resolution) == 48
    share = len(baked.vertices) / np.prod(baked.resolution)
    # a ball fills 0.52 of its cube, less the margin, plus a shell one vertex thick
    assert 0.45 < share < 0.65
    points = np.random.default_rng(0).uniform(-0.25, 0.25, (200, 3)) * (1, 1, 1) + (0.2, 0, 0)
    points = points[np.linalg.norm(points - (0.2, 0, 0), axis=1) < 0.35]
    np.testing.assert_allclose(baked(points, directions(len(points)))[0], 20.0, rtol=1e-5)


@pytest.mark.nightly
def test_parts_smaller_than_the_first_pass_are_found() -> None:
    ball = UniformSphere((0, 0, 0), 0.5, 20.0, (0.9, 0.1, 0.1))
    # one voxel's edge is 2/127: a ball of that radius lies between the vertices of the first pass
    speck = UniformSphere((0.9, 0.013, 0.0), 0.02, 20.0, (0.1, 0.1, 0.9))
    baked = bake(AnalyticField([ball, speck]), 128, bounds=[[-1, -1, -1], [1, 1, 1]])
    assert baked(np.array([[0.9, 0.013, 0.0]]), np.array([[0.0, 0, 1]]))[0][0] > 5.0


def test_a_contracted_field_reaches_beyond_its_box() -> None:
    far = GaussianBlob((6.0, 0.0, 0.0), 1.0, 3.0, (0.2, 0.8, 0.2))
    near = GaussianBlob((0.0, 0.0, 0.0), 0.3, 9.0, (0.8, 0.2, 0.2))
    field = AnalyticField([near, far])
    baked = bake(field, 97, bounds=[[-1, -1, -1], [1, 1, 1]], contracted=True)
    assert baked.contracted
    vertices = np.stack(np.unravel_index(baked.vertices, baked.resolution), axis=1)
    positions = uncontract(-2 + 4 * vertices / 96)
    assert positions[:, 0].max() > 5.0
    d = directions(len(positions))
    np.testing.assert_allclose(baked(positions, d)[0], field(positions, d)[0], rtol=1e-3, atol=1e-3)


def test_directions_from_the_cameras_decide_where_color_matters() -> None:
    """All cameras on one side: there the fit is close although the color is no low-degree harmonic."""

    class Split(Tilted):
        def __call__(self, positions, viewdirs):
            sigma, _ = super().__call__(positions, viewdirs)
            red = 0.5 + 0.5 * np.tanh(6 * viewdirs[:, 0])
            return sigma, np.stack([red, red, red], 1).astype(np.float32)

    eyes = np.random.default_rng(0).uniform(-0.5, 0.5, (20, 3)) + np.array([8, 0, 0])
    point, toward = np.zeros((1, 3)), np.array([[-1.0, 0.0, 0.0]])
    one_side = bake(Split(), 24, eyes=eyes)(point, toward)[1]
    around = bake(Split(), 24)(point, toward)[1]
    assert np.abs(one_side - 0.0).max() < 0.02 < np.abs(around - 0.0).max()


def test_a_signed_density_keeps_surfaces_where_they_are() -> None:
    """A ramp through 0 at x = 0.513 of a voxel's edge: linear interpolation of signed values is exact."""

    class Ramp(Tilted):
        def signed_density(self, positions, viewdirs):
            return (40.0 * (0.37 - np.abs(positions[:, 0]))).astype(np.float32)

        def __call__(self, positions, viewdirs):
            sigma = np.maximum(self.signed_density(positions, viewdirs), 0.0)
            return sigma, np.full((len(positions), 3), 0.5, np.float32)

    baked = bake(Ramp(), 32, bounds=[[-1, -0.2, -0.2], [1, 0.2, 0.2]])
    # within a voxel's edge of the ramp's end; the peak at 0, where the ramp bends, left out
    x = np.linspace(0.1, 0.45, 60)
    points = np.stack([x, 0 * x, 0 * x], 1)
    expected = np.maximum(40.0 * (0.37 - x), 0)
    np.testing.assert_allclose(baked(points, directions(60))[0], expected, atol=1e-3)


def test_progress_ends_at_one() -> None:
    seen: list[float] = []
    bake(Tilted(), 16, on_progress=seen.append)
    assert seen == sorted(seen) and seen[-1] == 1.0


def test_growing_reaches_all_26_neighbors() -> None:
    mask = np.zeros((5, 5, 5), bool)
    mask[2, 2, 2] = True
    expected = np.zeros((5, 5, 5), bool)
    expected[1:4, 1:4, 1:4] = True
    np.testing.assert_array_equal(dilate_mask(mask), expected)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"resolution": 8}, "resolution is 8; it must be from 16 to 1024"),
        ({"views": 0}, "views must be 1 to 256"),
        ({"opacity": 1.0}, r"opacity in \(0, 1\)"),
        ({"sh_degree": 3}, "sh_degree is 3; it must be from 0 to 2"),
        ({"bounds": [[0, 0, 0], [1, 0, 1]]}, "bounds must be a finite box"),
        ({"bounds": [[2, 2, 2], [3, 3, 3]]}, "the field is empty in"),
    ],
)
def test_impossible_options_are_refused(options, message) -> None:
    with pytest.raises(FieldError, match=message):
        bake(Tilted(), **{"resolution": 16, **options})


def test_a_field_without_bounds_needs_them() -> None:
    with pytest.raises(FieldError, match="give bounds="):
        bake(lambda p, d: (p[:, 0], p), 16)
