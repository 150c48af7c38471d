"""Photo files: finding them, their size, and their pixels shrunk by a box filter."""

from __future__ import annotations

import contextlib
import re
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from cagefield.errors import DatasetError
from cagefield.images.color_conversion import describe_conversion, has_alpha, rgb_converter
from cagefield.images.image_files import (
    DECODING_ERRORS,
    error_reason,
    iterate_tiles,
    load_pixels,
    open_image_file,
)
from cagefield.images.image_formats import EFFICIENT_FORMATS

EXTENSIONS = (
    ".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tif", ".tiff", ".heic", ".heif", ".hif", ".avif", ".exr",
)  # fmt: skip
FULL_SIZE_FOLDERS = ("images", "input", "photos", "rgb", "color", "image")
"""Names of folders of full-size photos, in order of preference."""

MAX_DEFAULT_SIDE_PIXELS = 800  # longer side with `downscale=None`


@dataclass(frozen=True)
class Header:
    """Properties of a photo file, read without its pixels."""

    width: int
    height: int
    alpha: bool
    conversion: str | None = None
    """Conversion of its pixels, as `color_conversion.describe_conversion` names it; None for none."""


def find_photo(path: Path) -> Path | None:
    """`path` where it is a file, else the file of that name with an image extension appended, else None."""
    if path.is_file():
        return path
    for extension in EXTENSIONS:
        for spelling in (extension, extension.upper()):
            candidate = path.with_name(path.name + spelling)
            if candidate.is_file():
                return candidate
    return None


def read_header(path: Path) -> Header:
    """Size of the photo, whether it has an alpha channel, and the conversion of its colors.

    Raises DatasetError where it is no image.
    """
    with _open_photo(path) as image:
        return Header(image.width, image.height, has_alpha(image), describe_conversion(image))


def is_cut_out(path: Path) -> bool:
    """Whether the photo has an alpha channel with at least one pixel that is not opaque."""
    return read_header(path).alpha and bool(read_photo(path)[..., 3].min() < 255)


def report_conversions(where: Path, photos: Iterable[Path]) -> None:
    """Warn once for each kind of color conversion, with the number of its photos.

    Raises DatasetError where a photo is no image.
    """
    counts = Counter(filter(None, (read_header(photo).conversion for photo in dict.fromkeys(photos))))
    for conversion, count in counts.items():
        warnings.warn(f"{where}: {count} photo{'s' * (count > 1)} {conversion}", stacklevel=3)


def read_photo(path: Path, factor: int = 1) -> npt.NDArray[np.uint8]:
    """Pixels uint8 [H,W,3], or [H,W,4] with straight alpha: means of `factor` x `factor` pixels of the file.

    Columns and rows left over at the right and bottom are dropped. With alpha, colors are averaged
    premultiplied. Pixels are as stored: EXIF orientation is not applied, since poses refer to stored pixels.

    Raises DatasetError where the file cannot be read.
    """
    with _open_photo(path) as image:
        convert = rgb_converter(image)
        width, height = image.width // factor, image.height // factor
        if min(width, height) < 1:
            raise DatasetError(
                f"{path}: {image.width}x{image.height} pixels are too few to shrink by {factor}; use less"
            )
        pixels = np.empty((height, width, 4 if has_alpha(image) else 3), np.uint8)
        try:
            load_pixels(image)
            for box in iterate_tiles(width * factor, height * factor, factor):
                x, y, end_x, end_y = (side // factor for side in box)
                pixels[y:end_y, x:end_x] = _shrink_pixels(convert(image.crop(box)), factor)
        except DECODING_ERRORS as error:
            cure = "convert it to JPEG" if image.format in EFFICIENT_FORMATS else "replace the file"
            raise DatasetError(
                f"{path}: the image cannot be decoded ({error_reason(error)}); {cure}"
            ) from error
    return pixels


def _shrink_pixels(pixels: Image.Image, factor: int) -> npt.NDArray[np.uint8]:
    """Means of `factor` x `factor` pixels of a part of a photo, whose sides are multiples of `factor`.

    Memory: 40 bytes for each pixel of the part.
    """
    if factor == 1:
        return np.asarray(pixels)
    if pixels.mode == "RGB":
        return np.asarray(pixels.reduce(factor))
    straight = np.asarray(pixels, dtype=np.float32)
    blocks = straight.reshape(pixels.height // factor, factor, pixels.width // factor, factor, 4)
    alpha = blocks[..., 3:].mean(axis=(1, 3))
    premultiplied = (blocks[..., :3] * blocks[..., 3:]).mean(axis=(1, 3))
    rgb = np.divide(premultiplied, alpha, out=np.zeros_like(premultiplied), where=alpha > 0)
    return np.rint(np.concatenate([rgb, alpha], axis=2)).astype(np.uint8)


def photo_folders(root: Path, full_size_name: str = "") -> dict[int, Path]:
    """Photo folders in `root` by factor: {1: images, 2: images_2, 4: images_4, ...}.

    Full-size photos are in the folder `full_size_name`, or in the first of FULL_SIZE_FOLDERS that exists.
    """
    names = [
        name
        for name in ((full_size_name,) if full_size_name else FULL_SIZE_FOLDERS)
        if (root / name).is_dir()
    ]
    folders = {1: root / names[0]} if names else {}
    for folder in sorted(root.glob("images_*")):
        if folder.is_dir() and (number := re.fullmatch(r"images_([1-9]\d*)", folder.name)):
            folders[int(number[1])] = folder
    return folders


def choose_downscale(longer_side: int, downscale: int | None, stored: dict[int, Path] | None = None) -> int:
    """Factor to shrink by: `downscale`, or the least power of two that leaves at most 800 pixels a side.

    `stored` are the factors at which photos exist on disk (see `photo_folders`): the result is a multiple of
    one.

    Raises DatasetError for a factor that is not a whole number from 1, or that no stored folder divides.
    """
    factors = sorted(stored) if stored else [1]
    if downscale is None:
        factor = 1
        while longer_side > MAX_DEFAULT_SIDE_PIXELS * factor or all(factor % f for f in factors):
            factor *= 2
            if factor > longer_side:
                return factors[0]
        return factor
    if isinstance(downscale, bool) or int(downscale) != downscale or not 1 <= downscale <= longer_side:
        raise DatasetError(f"downscale must be a whole number from 1 to {longer_side}, got {downscale}")
    if all(downscale % f for f in factors):
        names = ", ".join(folder.name for folder in (stored or {}).values())
        raise DatasetError(
            f"downscale {downscale} cannot be made from the photos there are ({names}); use one of these"
        )
    return int(downscale)


@contextlib.contextmanager
def _open_photo(path: Path) -> Iterator[Image.Image]:
    with contextlib.ExitStack() as stack:
        try:
            image = stack.enter_context(open_image_file(path))
        except DatasetError:
            raise
        except DECODING_ERRORS as error:
            raise DatasetError(
                f"{path}: not a readable image ({error_reason(error)}); replace the file or remove its frame"
            ) from error
        yield image
