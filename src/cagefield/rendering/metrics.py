"""Image differences as the NeRF literature reports them; images are uint8, or floats of [0,1]."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate1d

from cagefield.errors import CagefieldError
from cagefield.typing import AnyArray, Mask

WINDOW, WINDOW_SIGMA = 11, 1.5
K1, K2 = 0.01, 0.03


def _pair(first: AnyArray, second: AnyArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    first, second = np.asarray(first), np.asarray(second)
    if first.shape != second.shape or first.size == 0:
        raise CagefieldError(
            f"images must have the same, non-empty shape, not {list(first.shape)} and {list(second.shape)}"
        )
    floats = [np.asarray(x, np.float64) / (255.0 if x.dtype == np.uint8 else 1.0) for x in (first, second)]
    return floats[0], floats[1]


def mse(first: AnyArray, second: AnyArray, valid: Mask | None = None) -> float:
    """Mean squared difference over all pixels and channels, or the `valid` pixels [H,W]; NaN without any."""
    a, b = _pair(first, second)
    if valid is not None:
        a, b = a[valid], b[valid]
    return float(np.mean((a - b) ** 2)) if a.size else float("nan")


def psnr(first: AnyArray, second: AnyArray, valid: Mask | None = None) -> float:
    """Peak signal-to-noise ratio in dB: -10 log10(mse); inf for equal images, NaN without valid pixels."""
    error = mse(first, second, valid)
    return float("inf") if error == 0 else float(-10.0 * np.log10(error))


def ssim(first: AnyArray, second: AnyArray, valid: Mask | None = None) -> float:
    """Mean structural similarity of [H,W] or [H,W,C] images: 1 for equal images.

    11x11 Gaussian window with standard deviation 1.5, only where it fits the image; K1 = .01, K2 = .03,
    range 1; mean over pixels and channels. With `valid` [H,W] the mean is over these pixels alone, NaN where
    the window fits around none; the window itself takes in the others too. Raises CagefieldError for images
    smaller than the window.
    Source: Wang et al., "Image quality assessment: from error visibility to structural similarity" (2004),
    equations 13 to 16, and the authors' ssim_index.
    """
    a, b = _pair(first, second)
    if a.ndim not in (2, 3) or min(a.shape[:2]) < WINDOW:
        raise CagefieldError(f"ssim needs images of at least {WINDOW}x{WINDOW} pixels, not {list(a.shape)}")
    offsets = np.arange(WINDOW) - WINDOW // 2
    kernel = np.exp(-0.5 * (offsets / WINDOW_SIGMA) ** 2)
    kernel /= kernel.sum()

    def blur(image: NDArray[np.float64]) -> NDArray[np.float64]:
        edge = WINDOW // 2
        smooth = correlate1d(correlate1d(image, kernel, axis=0), kernel, axis=1)
        inner: NDArray[np.float64] = smooth[edge:-edge, edge:-edge]
        return inner

    mean_a, mean_b = blur(a), blur(b)
    # a variance below zero is rounding
    var_a = np.maximum(blur(a * a) - mean_a**2, 0.0)
    var_b = np.maximum(blur(b * b) - mean_b**2, 0.0)
    covariance = blur(a * b) - mean_a * mean_b
    c1, c2 = K1**2, K2**2
    luminance = (2 * mean_a * mean_b + c1) / (mean_a**2 + mean_b**2 + c1)
    structure = (2 * covariance + c2) / (var_a + var_b + c2)
    similarity = luminance * structure
    if valid is not None:
        similarity = similarity[valid[WINDOW // 2 : -(WINDOW // 2), WINDOW // 2 : -(WINDOW // 2)]]
    return float(np.mean(similarity)) if similarity.size else float("nan")
