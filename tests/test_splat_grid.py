"""Splats on a grid against the mixture that searches the splats of each point."""

from __future__ import annotations

import numpy as np
import pytest

from cagefield.fields.splat_field import SplatField
from cagefield.fields.splat_grid import SplatGrid

COUNT = (17, 9, 24)
EDGE = 0.05


def random_splats(count: int, log_scale: tuple[float, float], seed: int) -> SplatField:
    """Splats in and around the grid of the tests, of random shapes; some too transparent to be seen."""
    rng = np.random.default_rng(seed)
    high = EDGE * (np.array(COUNT) - 1.0)
    quaternions = rng.normal(size=(count, 4))
    return SplatField(
        rng.uniform(-0.3, high + 0.3, (count, 3)).astype(np.float32),
        rng.uniform(*log_scale, (count, 3)).astype(np.float32),
        (quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)).astype(np.float32),
        rng.choice([5e-4, 0.02, 0.4, 1.0], count).astype(np.float32),
        rng.normal(0.0, 1.0, (count, 4, 3)).astype(np.float32),
        bounds=np.array([[-1.0, -1.0, -1.0], [2.0, 2.0, 2.0]]),
    )


@pytest.mark.parametrize("log_scale", [(-5.0, -3.0), (-3.0, -1.0), (-1.0, 1.5)])
def test_values_are_those_of_the_mixture(log_scale):
    splats = random_splats(150, log_scale, 3)
    low = np.array([0.01, -0.02, 0.03])
    grid = SplatGrid(splats, low, EDGE, COUNT)
    points = (low + EDGE * np.argwhere(np.ones(COUNT, bool))).astype(np.float32)
    constant = SplatField(
        splats.means,
        splats.log_scales,
        splats.quaternions,
        splats.opacities,
        splats.sh[:, :1],
        bounds=splats.bounds,
    )
    # A vertex within rounding of a splat's end has the splat or not: its density there is below 1e-3 of
    # the least one along a ray through its mean.
    density = grid.density()
    np.testing.assert_allclose(density.reshape(-1), splats.grid_sigma(points), rtol=2e-3, atol=2e-2)
    mask = density > 0.5
    assert mask.sum() > 20
    up = np.tile(np.float32([0.0, 0.0, 1.0]), (int(mask.sum()), 1, 1))
    expected = constant.mixture.evaluate(points[mask.reshape(-1)], up)[1][:, 0]
    np.testing.assert_allclose(grid.colors(mask), expected, atol=2e-3)


def test_a_grid_without_splats_is_empty():
    splats = random_splats(5, (-4.0, -3.0), 0)
    far = SplatGrid(splats, np.array([50.0, 0.0, 0.0]), EDGE, COUNT)
    assert not far.density().any()
    assert not far.colors(np.ones(COUNT, bool)).any()
    assert far.colors(np.zeros(COUNT, bool)).shape == (0, 3)
    none = SplatGrid(splats.take(np.zeros(5, bool)), np.zeros(3), EDGE, COUNT)
    assert not none.density().any()
