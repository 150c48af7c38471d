"""Robust weights: regions that contradict the other photos count for little, blurred texture counts."""

from __future__ import annotations

import numpy as np

from cagefield.rendering.splats.kernels.projection import TILE_PX
from cagefield.rendering.splats.rasterizer import tiled, untiled
from cagefield.training.splats.robust_weights import (
    MIN_BLOCK_WEIGHT,
    MIN_RESIDUAL_SCALE,
    SCALE_MEDIANS,
    RobustWeights,
)

DOWN, ACROSS = 4, 6
SIZE = ACROSS * TILE_PX, DOWN * TILE_PX
ONES = np.ones(3, np.float32)


def weights_of(difference: np.ndarray, valid: np.ndarray | None = None, visits: int = 3) -> np.ndarray:
    """Weights [H,W] of a photo with these residuals [H,W,3], among three photos with small ones."""
    rng = np.random.default_rng(0)
    robust = RobustWeights([(DOWN, ACROSS)] * 4)
    for _ in range(visits):
        for n in range(3):
            robust.add(n, tiled(rng.normal(0, 0.01, difference.shape).astype(np.float32)), ONES, None)
        robust.add(3, tiled(difference.astype(np.float32)), ONES, valid)
    robust.update_scale()
    found = np.ones((DOWN * ACROSS, TILE_PX * TILE_PX), np.float32)
    robust.scale_weights(3, found)
    return untiled(found[:, None], *SIZE)[..., 0]


def test_an_outlier_counts_for_little_and_the_rest_for_all():
    difference = np.zeros((SIZE[1], SIZE[0], 3))
    difference[20:44, 30:60] = 0.4
    found = weights_of(difference)
    assert found[20:44, 30:60].max() == np.float32(MIN_BLOCK_WEIGHT)
    far = np.ones(found.shape, bool)
    far[8:56, 16:72] = False
    assert found[far].min() > 0.99


def test_fine_texture_that_the_field_lacks_keeps_its_weight():
    rng = np.random.default_rng(1)
    difference = 0.15 * rng.choice([-1.0, 1.0], (SIZE[1], SIZE[0], 1)).repeat(3, axis=2)
    # A block's mean of 64 signs is .15 / 8 wide, in 3 channels .03: half the scale, a weight of .6.
    assert np.median(weights_of(difference)) > 0.4
    assert np.median(weights_of(np.full_like(difference, 0.15))) == np.float32(MIN_BLOCK_WEIGHT)


def test_masked_pixels_say_nothing():
    difference = np.zeros((SIZE[1], SIZE[0], 3))
    difference[:, :32] = 0.5
    valid = np.ones((SIZE[1], SIZE[0], 1), bool)
    valid[:, :32] = False
    assert weights_of(difference, tiled(valid)[:, 0]).min() > 0.99


def test_the_scale_follows_the_usual_residual():
    robust = RobustWeights([(DOWN, ACROSS)])
    robust.update_scale()
    assert robust.scale == MIN_RESIDUAL_SCALE
    robust.add(0, np.full((DOWN * ACROSS, 3, TILE_PX * TILE_PX), 0.05, np.float32), ONES, None)
    robust.update_scale()
    assert np.isclose(robust.scale, SCALE_MEDIANS * 0.05 * 3**0.5, rtol=1e-5)


def test_a_photo_that_was_not_seen_has_full_weights():
    robust = RobustWeights([(DOWN, ACROSS)])
    found = np.ones((DOWN * ACROSS, TILE_PX * TILE_PX), np.float32)
    robust.scale_weights(0, found)
    assert found.min() == 1.0
