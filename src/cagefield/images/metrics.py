"""Image metrics of the NeRF literature; images are uint8, or floats of [0,1]."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion, correlate1d

from cagefield.errors import CagefieldError
from cagefield.typing import AnyArray, Mask

SSIM_WINDOW_PIXELS, SSIM_SIGMA_PIXELS = 11, 1.5
SSIM_K1, SSIM_K2 = 0.01, 0.03

MAX_SATURATION_DISTANCE = 0.5 / 255
"""Distance from 0 and from 1 below which a color counts as saturated: half a step of 8 bits."""

MAX_COLOR_FITS = 5
"""Maximum number of fits of a color correction, each without the pixels that the fit before saturates."""


def _to_float_pair(first: AnyArray, second: AnyArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    first, second = np.asarray(first), np.asarray(second)
    if first.shape != second.shape or first.size == 0:
        raise CagefieldError(
            f"images must have the same, non-empty shape, not {list(first.shape)} and {list(second.shape)}"
        )
    floats = [np.asarray(x, np.float64) / (255.0 if x.dtype == np.uint8 else 1.0) for x in (first, second)]
    return floats[0], floats[1]


def _validate_mask(valid: Mask | None, shape: tuple[int, ...]) -> Mask | None:
    """Mask [H,W], None where every pixel of images [H,W] or [H,W,C] is valid.

    Raises CagefieldError for a mask of another size, and for one without a valid pixel.
    """
    if valid is None:
        return None
    valid = np.asarray(valid, bool)
    if valid.shape != shape[:2]:
        raise CagefieldError(
            f"a mask of images {list(shape)} must be {list(shape[:2])}, not {list(valid.shape)}"
        )
    if not valid.any():
        raise CagefieldError("no pixel of the mask is valid; images are compared on at least one")
    return None if valid.all() else valid


def mse(first: AnyArray, second: AnyArray, valid: Mask | None = None) -> float:
    """Mean squared difference over all channels of all pixels, or of those of a mask [H,W]."""
    a, b = _to_float_pair(first, second)
    chosen = _validate_mask(valid, a.shape)
    square = (a - b) ** 2
    return float(np.mean(square if chosen is None else square[chosen]))


def psnr(first: AnyArray, second: AnyArray, valid: Mask | None = None) -> float:
    """Peak signal-to-noise ratio in dB: -10 log10(mse); inf for equal images."""
    error = mse(first, second, valid)
    return float("inf") if error == 0 else float(-10.0 * np.log10(error))


def ssim(first: AnyArray, second: AnyArray, valid: Mask | None = None) -> float:
    """Mean structural similarity of [H,W] or [H,W,C] images: 1 for equal images.

    11x11 Gaussian window with standard deviation 1.5, only where it fits the image; K1 = .01, K2 = .03,
    range 1; mean over pixels and channels. With a mask [H,W]: mean over windows about valid pixels, whose
    weights are those of their valid pixels alone and sum to 1; NaN where no window is about a valid pixel.
    Raises CagefieldError for images smaller than the window.
    Source: Wang et al., "Image quality assessment: from error visibility to structural similarity" (2004),
    equations 13 to 16, and the authors' ssim_index.
    """
    a, b = _to_float_pair(first, second)
    if a.ndim not in (2, 3) or min(a.shape[:2]) < SSIM_WINDOW_PIXELS:
        raise CagefieldError(
            f"ssim needs images of at least {SSIM_WINDOW_PIXELS}x{SSIM_WINDOW_PIXELS} pixels, not "
            f"{list(a.shape)}"
        )
    offsets = np.arange(SSIM_WINDOW_PIXELS) - SSIM_WINDOW_PIXELS // 2
    kernel = np.exp(-0.5 * (offsets / SSIM_SIGMA_PIXELS) ** 2)
    kernel /= kernel.sum()
    edge = SSIM_WINDOW_PIXELS // 2
    valid = _validate_mask(valid, a.shape)

    def inner(image: NDArray[Any]) -> NDArray[Any]:
        return image[edge:-edge, edge:-edge]

    def smooth(image: NDArray[np.float64]) -> NDArray[np.float64]:
        return inner(correlate1d(correlate1d(image, kernel, axis=0), kernel, axis=1))

    if valid is None:
        blur, chosen = smooth, None
    else:
        chosen = inner(valid)
        if not chosen.any():
            return float("nan")
        weight = valid.astype(np.float64).reshape(valid.shape + (1,) * (a.ndim - 2))
        # a window about a valid pixel has at least the weight of its middle
        total = np.maximum(smooth(weight), kernel[edge] ** 2)

        def blur(image: NDArray[np.float64]) -> NDArray[np.float64]:
            return smooth(image * weight) / total

    mean_a, mean_b = blur(a), blur(b)
    # a variance below zero is rounding
    var_a = np.maximum(blur(a * a) - mean_a**2, 0.0)
    var_b = np.maximum(blur(b * b) - mean_b**2, 0.0)
    covariance = blur(a * b) - mean_a * mean_b
    c1, c2 = SSIM_K1**2, SSIM_K2**2
    luminance = (2 * mean_a * mean_b + c1) / (mean_a**2 + mean_b**2 + c1)
    structure = (2 * covariance + c2) / (var_a + var_b + c2)
    similarity = luminance * structure
    return float(np.mean(similarity if chosen is None else similarity[chosen]))


def gradient_ratio(image: AnyArray, photo: AnyArray, valid: Mask | None = None) -> float:
    """Sharpness of an image [H,W] or [H,W,C] against a photo: mean gradient over that of the photo.

    Gradients are central differences of the mean over channels; pixels beside excluded ones are left out. NaN
    where the photo has no gradient.
    """
    a, b = (pixels if pixels.ndim == 2 else pixels.mean(axis=-1) for pixels in _to_float_pair(image, photo))
    chosen = _validate_mask(valid, a.shape)
    inside: Any = slice(None) if chosen is None else binary_erosion(chosen, border_value=1)
    first, second = (float(np.hypot(*np.gradient(image))[inside].sum()) for image in (a, b))
    return first / second if second > 0 else float("nan")


@dataclass(frozen=True)
class ColorFit:
    """Affine map of each channel, clip(gain * color + offset, 0, 1); gain, offset [C]."""

    gain: NDArray[np.float64]
    offset: NDArray[np.float64]

    def __call__(self, image: AnyArray) -> NDArray[np.float32]:
        """Corrected image [H,W,C] in [0,1]."""
        floats, _ = _to_float_pair(image, image)
        return np.clip(floats * self.gain + self.offset, 0, 1).astype(np.float32)


def fit_colors(image: AnyArray, photo: AnyArray, valid: Mask | None = None) -> ColorFit:
    """Least-squares affine map of each channel of an image [H,W,C] to a photo.

    The fit takes valid pixels that are saturated in neither image, nor by the map itself, and is repeated
    until its saturated pixels stay the same (MAX_COLOR_FITS times at most). A channel of one value gets an
    offset alone; one without such pixels is unchanged. Source: `color_correct` of multinerf (evaluation of
    mip-NeRF 360), its quadratic terms left out.
    """
    a, b = _to_float_pair(image, photo)
    chosen = _validate_mask(valid, a.shape)
    a, b = (
        (a.reshape(-1, a.shape[-1]), b.reshape(-1, b.shape[-1])) if chosen is None else (a[chosen], b[chosen])
    )
    gain, offset = np.ones(a.shape[-1]), np.zeros(a.shape[-1])
    for channel in range(a.shape[-1]):
        x, y = a[:, channel], b[:, channel]
        both = _is_unsaturated(x) & _is_unsaturated(y)
        used = both
        for _ in range(MAX_COLOR_FITS):
            if not used.any():
                break
            mean_x, mean_y = x[used].mean(), y[used].mean()
            variance = ((x[used] - mean_x) ** 2).mean()
            slope = ((x[used] - mean_x) * (y[used] - mean_y)).mean() / variance if variance > 1e-12 else 1.0
            gain[channel], offset[channel] = slope, mean_y - slope * mean_x
            before, used = used, both & _is_unsaturated(slope * x + offset[channel])
            if np.array_equal(before, used):
                break
    return ColorFit(gain, offset)


def correct_colors(image: AnyArray, photo: AnyArray, valid: Mask | None = None) -> NDArray[np.float32]:
    """Image [H,W,C] in the photo's colors: each channel by the affine map of `fit_colors`."""
    return fit_colors(image, photo, valid)(image)


def _is_unsaturated(values: NDArray[np.float64]) -> Mask:
    inside: Mask = (values >= MAX_SATURATION_DISTANCE) & (values <= 1 - MAX_SATURATION_DISTANCE)
    return inside
