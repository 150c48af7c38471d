"""Reading and writing of image and video files; a file appears whole or not at all."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from cagefield.errors import CagefieldError, DatasetError
from cagefield.files.atomic import replaced_file
from cagefield.files.safe_open import check_regular
from cagefield.images.color_conversion import has_alpha, rgb_converter
from cagefield.images.image_formats import (
    EFFICIENT_FORMATS,
    apply_rotation,
    needs_rotation,
    open_decoder,
)
from cagefield.images.render_result import to_uint8
from cagefield.images.video import open_encoder
from cagefield.typing import UInt8

MAX_IMAGE_PIXELS = 100 << 20
"""Maximum pixels of an image that is read: a file of kilobytes may have any number of them."""

MAX_FILE_BYTES = 1 << 30
"""Maximum bytes of an image file that is read: some decoders take all of it into memory."""

_MAX_PIXELS_PER_BYTE, _ALWAYS_READ_PIXELS = 1100, 1 << 18
"""Maximum pixels per byte of a file (deflate's best of 8 bits a pixel); fewer pixels are always accepted."""

_MAX_EFFICIENT_PIXELS_PER_BYTE = 16 * _MAX_PIXELS_PER_BYTE
"""Maximum pixels per byte of HEIF and AVIF: flat blocks of 64 x 64 pixels take a fraction of a bit."""

_TILE_PIXELS = 1 << 16

DECODING_ERRORS = (
    OSError, SyntaxError, ValueError, LookupError, TypeError, AttributeError, OverflowError, EOFError,
    RuntimeError, ZeroDivisionError, struct.error, zlib.error, Image.DecompressionBombError,
)  # fmt: skip
"""Exceptions that Pillow raises for damaged images."""


def error_reason(error: Exception) -> str:
    """Reason of a decoder's error as one line of at most 200 characters."""
    return " ".join(str(error).split())[:200]


def check_pixels(image: Image.Image, size: int | None = None) -> None:
    """Accept an opened image, of which only the header is read, of at most MAX_IMAGE_PIXELS.

    Its pixels must be possible in a file of `size` bytes, too. Raises ValueError.
    """
    count = image.width * image.height
    if count > MAX_IMAGE_PIXELS:
        raise ValueError(
            f"{image.width} x {image.height} pixels, at most {MAX_IMAGE_PIXELS >> 20} million are read; "
            f"shrink it"
        )
    max_pixels_per_byte = (
        _MAX_EFFICIENT_PIXELS_PER_BYTE if image.format in EFFICIENT_FORMATS else _MAX_PIXELS_PER_BYTE
    )
    if size is not None and count > max(_ALWAYS_READ_PIXELS, max_pixels_per_byte * size):
        raise ValueError(f"{image.width} x {image.height} pixels in {size} bytes; it is damaged or cut off")


@contextmanager
def open_image_file(path: Path) -> Iterator[Image.Image]:
    """Image of a file, of which the header is read, with at most MAX_IMAGE_PIXELS.

    Pixels are as stored: EXIF's orientation is not applied, the rotation of HEIF and AVIF is.

    Raises ValueError for more pixels, DECODING_ERRORS for a file that is no image, and DatasetError for an
    image whose decoder is not installed.
    """
    check_regular(path, MAX_FILE_BYTES)
    with path.open("rb") as file, open_decoder(file) as image:
        check_pixels(image, path.stat().st_size)
        yield apply_rotation(image) if needs_rotation(image) else image


def load_pixels(image: Image.Image) -> None:
    """Decode an opened image. Raises DECODING_ERRORS, and ValueError where the size is not the header's."""
    header_size = image.size
    image.load()
    if image.size != header_size:
        raise ValueError(
            f"{image.size[0]} x {image.size[1]} pixels, its header says {header_size[0]} x {header_size[1]}"
        )


def iterate_tiles(width: int, height: int, multiple: int = 1) -> Iterator[tuple[int, int, int, int]]:
    """Boxes (x, y, end x, end y) that cover an image, of some ten thousand pixels each.

    Images are converted tile by tile, so that large ones take no more memory. The sides of tiles are
    multiples of `multiple`, except at the right and at the bottom.
    """
    across = max(multiple, _TILE_PIXELS // multiple // multiple * multiple)
    down = max(multiple, _TILE_PIXELS // min(width, across) // multiple * multiple)
    for y in range(0, height, down):
        for x in range(0, width, across):
            yield x, y, min(x + across, width), min(y + down, height)


def read_image(path: str | os.PathLike[str]) -> UInt8:
    """Pixels [H,W,3], or [H,W,4] with straight alpha where the file has transparency.

    Files of other depths, modes and color profiles are converted (see `color_conversion`); pixels come as
    stored, EXIF orientation is not applied (camera poses refer to the stored pixels). Raises DatasetError for
    a file that is missing or no image.
    """
    path = Path(path)
    try:
        with open_image_file(path) as image:
            convert = rgb_converter(image)
            load_pixels(image)
            pixels = np.empty((image.height, image.width, 4 if has_alpha(image) else 3), np.uint8)
            for box in iterate_tiles(image.width, image.height):
                x, y, end_x, end_y = box
                pixels[y:end_y, x:end_x] = np.asarray(convert(image.crop(box)))
            return pixels
    except FileNotFoundError as error:
        raise DatasetError(f"{path}: there is no such image") from error
    except DatasetError:
        raise
    except DECODING_ERRORS as error:
        raise DatasetError(f"{path}: not a readable image ({error_reason(error)})") from error


def _pixels(image: NDArray[Any], channels: tuple[int, ...] = (1, 3, 4)) -> UInt8:
    """Pixels uint8 [H,W] or [H,W,C] of an image in uint8 or floats of [0,1]."""
    image = np.asarray(image)
    depth = 1 if image.ndim == 2 else image.shape[-1] if image.ndim == 3 else 0
    if depth not in channels or image.size == 0:
        raise CagefieldError(f"an image must be [H,W,C] with C in {list(channels)}, not {list(image.shape)}")
    if image.dtype != np.uint8 and not np.issubdtype(image.dtype, np.floating):
        raise CagefieldError(f"an image must be uint8, or floats in [0, 1], not {image.dtype}")
    return np.ascontiguousarray(to_uint8(image))


def write_png(path: str | os.PathLike[str], image: NDArray[Any]) -> None:
    """Write uint8 or float [H,W], [H,W,1|3|4] as a PNG. Raises CagefieldError for other shapes, suffixes."""
    path = Path(path)
    if path.suffix.lower() != ".png":
        raise CagefieldError(f"{path}: write_png writes .png files")
    pixels = _pixels(image)
    if pixels.ndim == 3 and pixels.shape[-1] == 1:
        pixels = pixels[..., 0]
    with replaced_file(path) as temporary:
        Image.fromarray(pixels).save(temporary, format="PNG")


@contextmanager
def video_writer(
    path: str | os.PathLike[str], shape: tuple[int, int], fps: float = 24.0, *, quality: int = 18
) -> Iterator[Callable[[NDArray[Any]], None]]:
    """Function that adds one RGB frame [H,W,3] (uint8 or float) of `shape` (H, W) to an H.264 file.

    The file is there once the context ends, and not at all where it ends with an error. Odd sizes are
    extended by repeating the last row or column: yuv420p, which every player shows, has even ones. `quality`
    is x264's CRF, 0 (lossless) to 51.

    Raises CagefieldError for a suffix other than .mp4, and for frames of another size; OSError, which names
    the file, where it cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() != ".mp4":
        raise CagefieldError(f"{path}: a video's name ends in .mp4")
    if not fps > 0 or not 0 <= quality <= 51:
        raise CagefieldError(f"fps must be positive and quality in [0, 51], not fps={fps}, quality={quality}")
    height, width = shape
    pad = ((0, height % 2), (0, width % 2), (0, 0))
    count = 0
    with (
        replaced_file(path) as temporary,
        open_encoder(temporary, (width + width % 2, height + height % 2), fps, quality) as encode,
    ):

        def add(frame: NDArray[Any]) -> None:
            nonlocal count
            pixels = _pixels(frame, (3,))
            if pixels.shape[:2] != shape:
                raise CagefieldError(
                    f"frame {count} is {list(pixels.shape)}; all frames must be {[height, width, 3]}"
                )
            encode(np.pad(pixels, pad, mode="edge").tobytes())
            count += 1

        yield add


def write_video(
    path: str | os.PathLike[str], frames: Iterable[NDArray[Any]], fps: float = 24.0, *, quality: int = 18
) -> None:
    """Write RGB frames [H,W,3] (uint8 or float) as a video; see `video_writer`.

    Raises CagefieldError for no frames, frames of different sizes, or a suffix other than .mp4.
    """
    source = iter(frames)
    first = next(source, None)
    if first is None:
        raise CagefieldError(f"{path}: a video needs at least one frame")
    height, width = _pixels(first, (3,)).shape[:2]
    with video_writer(path, (height, width), fps, quality=quality) as add:
        add(first)
        for frame in source:
            add(frame)


def side_by_side(*images: NDArray[Any], gap: int = 4) -> UInt8:
    """Image uint8 of RGB images [H,W,3] in one row, white between them and below shorter ones."""
    if not images:
        raise CagefieldError("side_by_side needs at least one image")
    columns = [_pixels(image, (3,)) for image in images]
    height = max(column.shape[0] for column in columns)
    width = sum(column.shape[1] for column in columns) + gap * (len(columns) - 1)
    row = np.full((height, width, 3), 255, np.uint8)
    left = 0
    for column in columns:
        row[: column.shape[0], left : left + column.shape[1]] = column
        left += column.shape[1] + gap
    return row
