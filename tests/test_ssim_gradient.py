"""The derivative of structural similarity, held against differences of the metric."""

from __future__ import annotations

import numpy as np
import pytest

from cagefield.images.metrics import SSIM_WINDOW_PIXELS as METRIC_WINDOW
from cagefield.images.metrics import ssim
from cagefield.rendering.splats.rasterizer import tiled, untiled
from cagefield.training.splats.kernels.ssim import MOMENT_PLANES, WINDOW_PIXELS, add_ssim_gradient

WEIGHT, GAIN, BEHIND = 0.3, np.array([0.9, 1.0, 1.2], np.float32), np.array([0.2, 0.5, 0.7], np.float32)


def loss(picture: np.ndarray, photo: np.ndarray) -> float:
    """WEIGHT times half the sum of 1 - SSIM over windows that fit and channels."""
    windows = 3 * (picture.shape[0] - WINDOW_PIXELS + 1) * (picture.shape[1] - WINDOW_PIXELS + 1)
    return 0.5 * WEIGHT * windows * (1.0 - ssim(picture.astype(np.float64) * GAIN, photo))


def moment_slopes(picture: np.ndarray, target: np.ndarray) -> np.ndarray:
    """The kernel's derivative [H,W,3], added to ones and taken off again."""
    height, width = picture.shape[:2]
    slopes = np.ones_like(tiled(picture))
    every = np.ones((len(slopes), slopes.shape[2]), np.float32)
    add_ssim_gradient(
        tiled(picture), tiled(target), GAIN, BEHIND, every, WEIGHT,
        np.full((3, MOMENT_PLANES, height, width), np.nan, np.float32),
        np.full((3, 3, height, width), np.nan, np.float32),
        np.full((3, 2, height, width), np.nan, np.float32), slopes,
    )  # fmt: skip
    return untiled(slopes, width, height) - 1.0


@pytest.mark.parametrize("alpha", [False, True])
def test_the_derivative_is_that_of_the_metric(alpha):
    chance = np.random.default_rng(3)
    picture = chance.random((27, 38, 3)).astype(np.float32)
    target = chance.integers(0, 256, (27, 38, 4 if alpha else 3)).astype(np.uint8)
    photo = target[..., :3] / 255.0
    if alpha:
        share = target[..., 3:] / 255.0
        photo = photo * share + BEHIND * (1.0 - share)
    found = moment_slopes(picture, target)
    assert METRIC_WINDOW == WINDOW_PIXELS
    for y, x, ch in ((0, 0, 0), (0, 20, 1), (13, 18, 2), (26, 37, 0), (5, 33, 1), (20, 16, 2)):
        nearby = [picture.astype(np.float64) for _ in range(2)]
        for one, step in zip(nearby, (1e-4, -1e-4), strict=True):
            one[y, x, ch] += step
        expected = (loss(nearby[0], photo) - loss(nearby[1], photo)) / 2e-4
        assert found[y, x, ch] == pytest.approx(expected, rel=2e-3, abs=2e-6)


def test_a_picture_that_is_the_photo_stays():
    photo = np.random.default_rng(4).integers(0, 256, (32, 24, 3)).astype(np.uint8)
    assert np.abs(moment_slopes((photo / np.float32(255)) / GAIN, photo)).max() < 2e-5
