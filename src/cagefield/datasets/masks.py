"""Masks [H,W] of the valid pixels of a photo: reading, resampling, shrinking."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from cagefield.errors import DatasetError
from cagefield.images.image_files import read_image

Excluded = Literal["black", "white"]
BoolArray = npt.NDArray[np.bool_]

MIN_VALID_VALUE = 128
"""Minimum 8-bit value of a valid pixel in a mask with black exclusions."""


def read_mask(path: Path, excluded: Excluded) -> BoolArray:
    """Valid pixels [H,W] of a mask file at its own size.

    "black": valid from MIN_VALID_VALUE on, in the mean of the channels (nerfstudio, COLMAP); "white": valid
    where every channel is 0 (Instant-NGP's dynamic masks). The alpha channel is ignored.

    Raises DatasetError where the file is missing or no image.
    """
    pixels = read_image(path)[..., :3]
    if excluded == "white":
        return np.asarray(~pixels.any(axis=2))
    return np.asarray(pixels.mean(axis=2, dtype=np.float32) >= MIN_VALID_VALUE)


def resample_mask(valid: BoolArray, width: int, height: int, path: Path) -> BoolArray:
    """Mask [height,width] resampled by nearest neighbors.

    Raises DatasetError where its aspect differs; see `check_aspect`.
    """
    check_aspect(valid, width, height, path)
    mask_height, mask_width = valid.shape
    if (mask_width, mask_height) == (width, height):
        return valid
    rows = ((np.arange(height) + 0.5) * mask_height / height).astype(np.intp)
    columns = ((np.arange(width) + 0.5) * mask_width / width).astype(np.intp)
    return valid[rows[:, None], columns]


def check_aspect(valid: BoolArray, width: int, height: int, path: Path) -> None:
    """Raise DatasetError where the mask has another aspect than its photo, by more than rounding."""
    mask_height, mask_width = valid.shape
    scale_x, scale_y = width / mask_width, height / mask_height
    if abs(width - scale_y * mask_width) > max(1.0, scale_y) and abs(height - scale_x * mask_height) > max(
        1.0, scale_x
    ):
        raise DatasetError(
            f"{path}: the mask is {mask_width}x{mask_height}, its photo {width}x{height}; make a mask of the "
            "photo's size or aspect"
        )


def shrink_mask(valid: BoolArray, factor: int) -> BoolArray:
    """Mask of the blocks of `factor` x `factor` pixels: valid where all pixels of a block are.

    Columns and rows left over at the right and bottom are dropped, as of photos.
    """
    if factor == 1:
        return valid
    height, width = valid.shape[0] // factor, valid.shape[1] // factor
    blocks = valid[: height * factor, : width * factor].reshape(height, factor, width, factor)
    return np.asarray(blocks.all(axis=(1, 3)))
