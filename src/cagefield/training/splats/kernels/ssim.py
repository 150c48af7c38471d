"""Gradient of structural similarity (SSIM) by an image's pixels (Numba).

The loss is half the sum of 1 - SSIM over channels and over windows within the image: with n windows, n (1 -
`images.metrics.ssim`) / 2, which is the oracle of this module's gradient.

Source: Wang et al., "Image quality assessment: from error visibility to structural similarity" (2004),
equation 13; the derivative worked out here.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.numba_cache import FAST
from cagefield.compute.parallel_kernels import parallel_njit
from cagefield.rendering.splats.kernels.projection import TILE_PX
from cagefield.typing import Float32

WINDOW_PIXELS = 11
"""Side of a window; its Gaussian has a standard deviation of 1.5."""

MOMENT_PLANES = 5
"""Planes per channel between the passes: means of image, photo, their squares, their product."""

_HALF = WINDOW_PIXELS // 2
_OFFSETS = np.arange(WINDOW_PIXELS) - _HALF
_GAUSSIAN = np.exp(-0.5 * (_OFFSETS / 1.5) ** 2)
WINDOW_WEIGHTS = (_GAUSSIAN / _GAUSSIAN.sum()).astype(np.float32)
C1, C2 = np.float32(0.01**2), np.float32(0.03**2)


def add_ssim_gradient(
    color: Float32,
    target: NDArray[np.uint8],
    gain: NDArray[Any],
    background: NDArray[Any],
    weights: Float32,
    weight: float,
    moments: Float32,
    moment_slopes: Float32,
    pixels: Float32,
    slopes: Float32,
) -> None:
    """Add `weight` times the loss's derivative by the image (before its gain) to `slopes`.

    color and slopes [tiles,3,AREA]; target [tiles, 3 or 4, AREA] uint8 with straight alpha over the
    background; gain and background [3]. Where `weights` [tiles,AREA] are 0 the photo counts as equal to the
    image. moments [3,MOMENT_PLANES,H,W], moment_slopes [3,3,H,W] and pixels [3,2,H,W] are scratch.
    """
    _write_moments(color, target, gain, background, weights, pixels, moments)
    _write_moment_slopes(moments, moment_slopes)
    _add_slopes(moment_slopes, pixels, weight, gain, slopes)


def _rows(*args: Any) -> int:
    """Rows of the scratch image that is the last argument, of all channels."""
    return int(args[-1].shape[0] * args[-1].shape[2])


@parallel_njit(_rows, **FAST)
def _write_moments(begin, end, color, target, gain, background, weights, pixels, moments):
    """Writes image and photo into `pixels`, and their sums along the rows of windows into `moments`."""
    height, width = moments.shape[2], moments.shape[3]
    across = (width + TILE_PX - 1) // TILE_PX
    alpha = target.shape[1] == 4
    for row in range(begin, end):
        ch, y = row // height, row % height
        first = (y // TILE_PX) * across
        line = (y % TILE_PX) * TILE_PX
        x = pixels[ch, 0, y]
        p = pixels[ch, 1, y]
        for tile in range(across):
            for i in range(min(TILE_PX, width - tile * TILE_PX)):
                at = line + i
                photo = np.float32(target[first + tile, ch, at]) * np.float32(1 / 255)
                if alpha:
                    share = np.float32(target[first + tile, 3, at]) * np.float32(1 / 255)
                    photo = photo * share + background[ch] * (np.float32(1) - share)
                shown = gain[ch] * color[first + tile, ch, at]
                x[tile * TILE_PX + i] = shown
                p[tile * TILE_PX + i] = photo if weights[first + tile, at] > np.float32(0) else shown
        out = moments[ch, :, y]
        out[:] = np.float32(0)
        for k in range(WINDOW_PIXELS):
            w = WINDOW_WEIGHTS[k]
            for i in range(width - 2 * _HALF):
                a, b = x[i + k], p[i + k]
                out[0, _HALF + i] += w * a
                out[1, _HALF + i] += w * b
                out[2, _HALF + i] += w * a * a
                out[3, _HALF + i] += w * b * b
                out[4, _HALF + i] += w * a * b


@parallel_njit(_rows, **FAST)
def _write_moment_slopes(begin, end, moments, moment_slopes):
    """Writes the loss's derivatives by the moments, summed along the rows of windows."""
    height, width = moments.shape[2], moments.shape[3]
    sums, by = np.empty((MOMENT_PLANES, width), np.float32), np.empty((3, width), np.float32)
    for row in range(begin, end):
        ch, y = row // height, row % height
        result = moment_slopes[ch, :, y]
        result[:] = np.float32(0)
        if y < _HALF or y >= height - _HALF:
            continue
        sums[:] = np.float32(0)
        for k in range(WINDOW_PIXELS):
            w = WINDOW_WEIGHTS[k]
            for j in range(MOMENT_PLANES):
                source = moments[ch, j, y + k - _HALF]
                for i in range(width):
                    sums[j, i] += w * source[i]
        by[:] = np.float32(0)
        for i in range(_HALF, width - _HALF):
            mx, my = sums[0, i], sums[1, i]
            a1 = np.float32(2) * mx * my + C1
            a2 = np.float32(2) * (sums[4, i] - mx * my) + C2
            b1 = mx * mx + my * my + C1
            b2 = sums[2, i] - mx * mx + sums[3, i] - my * my + C2
            per = np.float32(1) / (b1 * b2)
            similarity = a1 * a2 * per
            by_square = -similarity / b2
            by_product = np.float32(2) * a1 * per
            by[0, i] = (
                np.float32(2) * my * a2 * per
                - np.float32(2) * mx * (similarity / b1 + by_square)
                - my * by_product
            )
            by[1, i] = by_square
            by[2, i] = by_product
        for k in range(WINDOW_PIXELS):
            w = WINDOW_WEIGHTS[k]
            for j in range(3):
                for i in range(width - 2 * _HALF):
                    result[j, i + k] += w * by[j, _HALF + i]


@parallel_njit(lambda moment_slopes, *_: _rows(moment_slopes), **FAST)
def _add_slopes(begin, end, moment_slopes, pixels, weight, gain, slopes):
    """Adds the loss's derivatives by the image."""
    height, width = moment_slopes.shape[2], moment_slopes.shape[3]
    across = (width + TILE_PX - 1) // TILE_PX
    total = np.empty((3, width), np.float32)
    for row in range(begin, end):
        ch, y = row // height, row % height
        total[:] = np.float32(0)
        for k in range(max(0, _HALF - y), min(WINDOW_PIXELS, height - y + _HALF)):
            w = WINDOW_WEIGHTS[k]
            for j in range(3):
                source = moment_slopes[ch, j, y + k - _HALF]
                for i in range(width):
                    total[j, i] += w * source[i]
        first = (y // TILE_PX) * across
        line = (y % TILE_PX) * TILE_PX
        scale = np.float32(-0.5) * np.float32(weight) * gain[ch]
        for tile in range(across):
            for i in range(min(TILE_PX, width - tile * TILE_PX)):
                at = tile * TILE_PX + i
                g = total[0, at] + np.float32(2) * pixels[ch, 0, y, at] * total[1, at]
                slopes[first + tile, ch, line + i] += scale * (g + pixels[ch, 1, y, at] * total[2, at])
