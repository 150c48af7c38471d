"""PlayCanvas' SOG, versions 1 and 2: images of quantized values, one pixel per splat, in a folder or a zip.

meta.json names lossless WebP images and the meaning of their values:

    means_l, means_u   low and high bytes of 16 bits between mins and maxs of sign(v) ln(1 + |v|)
    quats              the smallest three (c / 255 - .5) sqrt(2), and 252 + the index of the largest (w x y z)
    scales, sh0        version 2: indices into a codebook of 256 values; version 1: between mins and maxs. The
                       opacity is sh0's fourth channel: in [0, 1], or in version 1 a logit
    shN                labels (16 bits) into a palette of harmonics; centroid n has its K coefficients at
                       (n % 64) K .. of row n // 64, values as those of sh0, in one codebook

Splats are in Morton order, in PLY's axes.

Source: the PlayCanvas manual, "The SOG Format"; playcanvas/splat-transform, read-sog.ts and read-sog-v1.ts.
"""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from cagefield.errors import FieldError
from cagefield.files import json_text
from cagefield.files.safe_open import UnreadableError, check_regular, read_bytes
from cagefield.formats.splats.axes import PLY_AXES
from cagefield.formats.splats.detection import META
from cagefield.formats.splats.splat_table import BATCH_SPLATS, SplatBatch, SplatSource
from cagefield.images.image_files import check_pixels
from cagefield.typing import AnyArray

PALETTE_WIDTH_CENTROIDS = 64
"""Number of centroids per row of the palette."""

_MAX_META_BYTES = 1 << 24
_MAX_IMAGE_BYTES = 1 << 30
"""Maximum size of an image file, which is read whole."""

_MAX_SPLATS_PER_BYTE, _MIN_SPLAT_LIMIT = 4, 1 << 16
"""Maximum number of splats per image byte, beyond 65,536 splats; real files need 8 bytes per splat."""

_MAX_PALETTE_PIXELS = (1 << 16) * 24
"""Maximum number of palette pixels: labels have 16 bits, a centroid at most 24 harmonics above degree 0."""

_DEGREES = {3: 1, 8: 2, 15: 3, 24: 4}  # harmonics above degree 0 -> degree

Images = Callable[[str], bytes]


def open_sog(path: Path) -> SplatSource:
    """Open SOG: a .sog file, a folder with meta.json, or that meta.json.

    Raises:
        FieldError: missing, damaged or inconsistent files.
    """
    if path.is_dir() or path.suffix.lower() == ".json":
        folder, meta = (path, META) if path.is_dir() else (path.parent, path.name)
        return _open(path, lambda name: _from_folder(folder, meta if name == META else name))
    try:
        check_regular(path)
        archive = zipfile.ZipFile(path)
    except UnreadableError as error:
        raise FieldError(f"{path}: {error}") from None
    except (zipfile.BadZipFile, NotImplementedError, OSError):
        raise FieldError(f"{path}: no SOG file, it is no zip that can be read; copy it again") from None
    with archive:
        held = {PurePosixPath(name).name: name for name in archive.namelist()}

        def from_zip(name: str) -> bytes:
            info = archive.getinfo(held[name])
            # Images do not compress in a zip; meta.json does.
            if info.file_size > min(_MAX_IMAGE_BYTES, _MAX_META_BYTES + 4 * info.compress_size):
                raise ValueError(f"{name} is much larger than it should be")
            return archive.read(info)

        return _open(path, from_zip)


def _from_folder(folder: Path, name: str) -> bytes:
    if PurePosixPath(name).name != name:
        raise ValueError(f"{name} lies in another folder")
    try:
        return read_bytes(folder / name, _MAX_IMAGE_BYTES)
    except FileNotFoundError:
        raise ValueError(f"it has no {name}") from None


def _open(path: Path, content: Images) -> SplatSource:
    try:
        meta = json_text.loads(content(META))
        return _source(path, meta, content)
    except FieldError:
        raise
    except KeyError as error:
        raise _damaged(path, f"it has no {error.args[0]!s:.60}") from None
    except (
        ValueError,
        TypeError,
        IndexError,
        OSError,
        EOFError,
        AttributeError,
        OverflowError,
        RecursionError,
        NotImplementedError,
        RuntimeError,
        zipfile.BadZipFile,
        zlib.error,
        Image.DecompressionBombError,
    ) as error:
        raise _damaged(path, " ".join(str(error).split())[:120] or type(error).__name__) from None


def _source(path: Path, meta: dict[str, Any], content: Images) -> SplatSource:
    old = "version" not in meta
    if not old and meta["version"] != 2:
        raise FieldError(f"{path}: SOG of version {meta['version']}; 1 and 2 are read")
    count = int(meta["means"]["shape"][0] if old else meta["count"])
    if count < 1:
        raise ValueError(f"it says that it holds {count} splats")
    means = meta["means"]["files"]
    size = sum(len(content(name)) for name in means)
    if count > max(_MIN_SPLAT_LIMIT, _MAX_SPLATS_PER_BYTE * size):
        raise ValueError(f"it says that it holds {count} splats, their places have {size} bytes")

    def image(name: str, channels: int) -> NDArray[np.uint8]:
        return _pixels(content(name), name, channels, count)

    low, high = (image(name, 3)[:count] for name in means)
    quats = image(meta["quats"]["files"][0], 4)[:count]
    scales = image(meta["scales"]["files"][0], 3)[:count]
    sh0 = image(meta["sh0"]["files"][0], 4)[:count]
    mins, maxs = (np.array(meta["means"][end], np.float64).reshape(3) for end in ("mins", "maxs"))
    scale_of = _dequantizer(meta["scales"], old)
    color_of = _dequantizer(meta["sh0"], old, 3)
    palette, labels = _palette(meta["shN"], content, count, old) if meta.get("shN") else (None, None)
    degree = 0 if palette is None else _DEGREES[palette.shape[1]]

    def batches() -> Iterator[SplatBatch]:
        for first in range(0, count, BATCH_SPLATS):
            here = slice(first, first + BATCH_SPLATS)
            share = (low[here] + 256.0 * high[here]) / 65535.0
            coded = mins + (maxs - mins) * share
            alpha = sh0[here, 3] / 255.0
            if old:
                ends = [float(meta["sh0"][end][3]) for end in ("mins", "maxs")]
                alpha = 1.0 / (1.0 + np.exp(-(ends[0] + (ends[1] - ends[0]) * alpha)))
            dc = color_of(sh0[here, :3])[:, None]
            rest = [] if palette is None or labels is None else [palette[labels[here]]]
            with np.errstate(over="ignore"):
                means = np.sign(coded) * np.expm1(np.abs(coded))
            yield SplatBatch(
                means, scale_of(scales[here]), _decode_smallest_three(quats[here]), alpha,
                np.concatenate([dc, *rest], axis=1),
            )  # fmt: skip

    return SplatSource(path, count, degree, PLY_AXES, batches, bool(meta.get("antialias", False)))


def _dequantizer(
    part: dict[str, Any], old: bool, channels: int = 3
) -> Callable[[NDArray[np.uint8]], AnyArray]:
    """Function from an image's bytes [n,channels] to values."""
    if not old:
        codebook = np.array(part["codebook"], np.float64).reshape(256)
        return lambda values: codebook[values]
    mins, maxs = (np.array(part[end], np.float64).reshape(-1) for end in ("mins", "maxs"))
    low, high = (np.broadcast_to(end, channels) if end.size == 1 else end[:channels] for end in (mins, maxs))
    return lambda values: low + (high - low) * (values / 255.0)


def _palette(
    part: dict[str, Any], content: Images, count: int, old: bool
) -> tuple[AnyArray, NDArray[np.int64]]:
    """(harmonics [P,K,3] of the palette, labels [N] into it)."""
    centroids, labels = part["files"]
    bytes_of = _pixels(content(labels), labels, 2, count)[:count].astype(np.int64)
    label = bytes_of[:, 0] + 256 * bytes_of[:, 1]
    pixels = _pixels(content(centroids), centroids, -3, 1, _MAX_PALETTE_PIXELS)
    height, width = pixels.shape[:2]
    above = width // PALETTE_WIDTH_CENTROIDS
    if above not in _DEGREES or width % PALETTE_WIDTH_CENTROIDS:
        raise ValueError(f"{centroids} is {width} pixels wide")
    palette = _dequantizer(part, old)(pixels.reshape(-1, 3)).reshape(
        height * PALETTE_WIDTH_CENTROIDS, above, 3
    )
    if label.max() >= len(palette):
        raise ValueError(f"{labels} names a centroid that is not there")
    return palette.astype(np.float32), label


def _pixels(
    content: bytes, name: str, channels: int, least: int, most: int | None = None
) -> NDArray[np.uint8]:
    """Pixels [n,channels] of an image with at least `least` pixels; [height,width,3] for channels -3."""
    most = 2 * least + (1 << 16) if most is None else most
    with Image.open(io.BytesIO(content)) as image:
        check_pixels(image)
        size = image.width * image.height
        if not least <= size <= most:
            raise ValueError(f"{name} has {size} pixels for {least} splats")
        mode = "RGBA" if channels == 4 else "RGB"
        if mode == "RGB" and image.mode == "RGBA":
            pixels = np.asarray(image)[:, :, :3]
        else:
            pixels = np.asarray(image.convert(mode))
    return pixels[:, :, :3] if channels == -3 else pixels.reshape(size, -1)[:, :channels]


def _decode_smallest_three(pixels: NDArray[np.uint8]) -> AnyArray:
    """Quaternions [n,4] (w x y z) of pixels [n,4]."""
    others = (pixels[:, :3] / 255.0 - 0.5) * np.sqrt(2.0)
    largest = np.clip(pixels[:, 3].astype(np.int64) - 252, 0, 3)
    places = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])[largest]
    quaternions = np.zeros((len(pixels), 4))
    np.put_along_axis(quaternions, places, others, axis=1)
    left = np.sqrt(np.maximum(0.0, 1.0 - (others**2).sum(axis=1)))
    np.put_along_axis(quaternions, largest[:, None], left[:, None], axis=1)
    return quaternions


def _damaged(path: Path, why: str) -> FieldError:
    return FieldError(f"{path}: no SOG that can be read: {why}; copy or export it again")
