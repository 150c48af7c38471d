"""How far an edited field is from the truth, against how far the unedited field is from its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.cameras.camera import Camera
from cagefield.images.metrics import mse, psnr, ssim
from cagefield.typing import AnyArray

CHANGED = 4 / 255
"""A pixel is changed where a channel of the truth differs by more than this: above rounding and noise."""


@dataclass(frozen=True)
class Figures:
    """Means over views in dB; the `there_` ones pool the pixels that the edit changes in truth.

    unedited, edited      PSNR and SSIM of the unedited field against the unedited truth, of the edited field
                          against the edited truth
    there_if_left         what an edit that does nothing would reach on the changed pixels
    changed               share of all pixels that are changed, with the margin around them
    """

    unedited: float
    edited: float
    unedited_ssim: float
    edited_ssim: float
    there_unedited: float
    there_edited: float
    there_if_left: float
    changed: float

    @property
    def lost(self) -> float:
        """PSNR lost by editing."""
        return self.unedited - self.edited

    @property
    def there_lost(self) -> float:
        """PSNR lost by editing, on the changed pixels; NaN where there are none."""
        return self.there_unedited - self.there_edited


def compare(
    unedited: AnyArray, edited: AnyArray, unedited_truth: AnyArray, edited_truth: AnyArray
) -> Figures:
    """The figures of one edit, from pictures of the same views."""
    there = changed_pixels(unedited_truth, edited_truth)
    return Figures(
        unedited=mean_psnr(unedited, unedited_truth),
        edited=mean_psnr(edited, edited_truth),
        unedited_ssim=_mean_ssim(unedited, unedited_truth),
        edited_ssim=_mean_ssim(edited, edited_truth),
        there_unedited=pooled_psnr(unedited, unedited_truth, there),
        there_edited=pooled_psnr(edited, edited_truth, there),
        there_if_left=pooled_psnr(unedited, edited_truth, there),
        changed=float(there.mean()),
    )


def changed_pixels(before: AnyArray, after: AnyArray) -> NDArray[np.bool_]:
    """Mask [V,H,W] of the pixels that differ by more than CHANGED, and those within a 100th of the width."""
    difference = np.abs(floats(after) - floats(before)).max(axis=-1) > CHANGED
    reach = max(1, round(difference.shape[2] / 100))
    spread: NDArray[np.bool_] = ndimage.maximum_filter(difference, size=(1, 2 * reach + 1, 2 * reach + 1))
    return spread


def pooled_psnr(first: AnyArray, second: AnyArray, mask: NDArray[np.bool_]) -> float:
    """PSNR over the masked pixels of all views together; NaN for an empty mask."""
    if not mask.any():
        return float("nan")
    return psnr(floats(first)[mask], floats(second)[mask])


def mean_psnr(pictures: AnyArray, truth: AnyArray, where: NDArray[np.bool_] | None = None) -> float:
    """Mean over views of the PSNR, of the pixels in the mask `where` [V,H,W] if one is given.

    inf only where all views are equal to the truth. A view without a pixel in the mask is passed over.
    """
    masks = np.ones(pictures.shape[:3], bool) if where is None else where
    errors = np.array(
        [mse(floats(a)[m], floats(b)[m]) for a, b, m in zip(pictures, truth, masks, strict=True) if m.any()]
    )
    if not errors.any():
        return float("inf")
    # A view that is exactly right counts as one that is right to half an 8-bit level.
    return float(np.mean(-10.0 * np.log10(np.maximum(errors, (0.5 / 255) ** 2 / 3))))


def floats(pictures: AnyArray) -> NDArray[np.float32]:
    """The pictures as floats in [0,1]."""
    if pictures.dtype == np.uint8:
        return pictures.astype(np.float32) / np.float32(255.0)
    return np.clip(pictures, 0.0, 1.0).astype(np.float32)


def supersampled(draw: Callable[[Camera], NDArray[Any]], camera: Camera, rays: int) -> NDArray[np.float32]:
    """A picture [H,W,3] clipped to [0,1], each pixel the mean of rays x rays that are drawn."""
    height, width = camera.height, camera.width
    fine = np.clip(draw(camera.resized(width * rays, height * rays)), 0.0, 1.0)
    mean: NDArray[np.float32] = fine.reshape(height, rays, width, rays, 3).mean((1, 3), dtype=np.float32)
    return mean


def stacked(pictures: Sequence[NDArray[Any]]) -> AnyArray:
    """Pictures [H,W,3], one for each view, as one array."""
    return np.stack(pictures)


def _mean_ssim(pictures: AnyArray, truth: AnyArray) -> float:
    return float(np.mean([ssim(floats(a), floats(b)) for a, b in zip(pictures, truth, strict=True)]))
