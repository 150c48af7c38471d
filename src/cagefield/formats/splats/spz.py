"""Niantic's SPZ, versions 1 to 4: one quantized, compressed stream per quantity.

Version 1 to 3: gzip of a header of 16 bytes (magic "NGSP", version, count, degree of the harmonics, bits of
the fraction, flags, a reserved byte) and the concatenated streams. Version 4: a header of 32 bytes, a
table of contents, and one Zstandard frame per stream. Streams:

    positions   3 x 24-bit fixed point (version 1: 3 x float16)
    opacities   uint8, in [0, 1]
    colors      3 x uint8: f_dc = (u / 255 - .5) / .15
    scales      3 x uint8: log scale = u / 16 - 10
    rotations   versions 1, 2: x y z as uint8, u / 127.5 - 1, w >= 0; 3, 4: the smallest three, 9 bits and a
                sign each, and the index of the largest (x y z w)
    harmonics   uint8, (u - 128) / 128, coefficient by coefficient, rgb inner

Axes are "rub", unless the extension SPZ_ADOBE_coordinate_system says otherwise. Extensions follow the
streams in versions 1 to 3, and precede the table of contents in version 4.

Source: nianticlabs/spz, src/cc/load-spz.cc and README.md.
"""

from __future__ import annotations

import gzip
import struct
import tempfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, BinaryIO, cast

import numpy as np
import zstandard
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.files.safe_open import open_regular
from cagefield.formats.splats.axes import AXES, Axes
from cagefield.formats.splats.splat_table import SplatBatch, SplatSource
from cagefield.typing import AnyArray

SPZ_AXES: Axes = "rub"
MAGIC = b"NGSP"
OLD_HEADER, NEW_HEADER = struct.Struct("<4sIIBBBB"), struct.Struct("<4sIIBBBBI12s")
ANTIALIASED, _EXTENSIONS = 1, 2
_COORDINATES = 0xADBE0003
_MAX_EXTENSION_BYTES = 1 << 20
COLOR_SCALE = 0.15
_MAX_DEFLATE_RATIO = 1040
"""Maximum compression ratio; Deflate compresses at most 1032 bytes into one."""

_SMALL_BYTES, _MAX_USUAL_RATIO = 1 << 20, 100
"""Maximum compression ratio of larger contents; real splats compress to about a half."""

_CHUNK_BYTES = 1 << 19
"""Bytes decompressed at a time, so that a truncated file is refused with little memory."""

_DECODED_SPLATS = 1 << 12
"""Splats decoded at a time, 600 bytes each."""

# Coordinate systems of the extension, by number.
_SYSTEMS = (None, "ldb", "rdb", "lub", "rub", "ldf", "rdf", "luf", "ruf")


def open_spz(path: Path) -> SplatSource:
    """Open .spz file, decompressed into a temporary file.

    Raises:
        FieldError: no SPZ file, an unknown version, or a damaged file.
    """
    with open_regular(path) as file:
        return open_spz_stream(path, file, path.stat().st_size)


def open_spz_stream(path: Path, file: BinaryIO, size: int) -> SplatSource:
    """Splats of a .spz file's content, `size` bytes of an open `file`; `path` names it in messages.

    Raises:
        FieldError: as `open_spz`.
    """
    start = file.read(NEW_HEADER.size)
    if start[:4] == MAGIC:
        return _open_version_4(path, file, start, size)
    file.seek(0)
    try:
        with gzip.open(file) as stream:
            return _open_gzip_version(path, stream, size)
    except (OSError, EOFError, zlib.error):
        raise _damaged(path, "it is no gzip that can be read to its end") from None


def _open_gzip_version(path: Path, stream: IO[bytes] | gzip.GzipFile, size: int) -> SplatSource:
    header = stream.read(OLD_HEADER.size)
    if len(header) < OLD_HEADER.size or header[:4] != MAGIC:
        raise _damaged(path, "it does not begin as SPZ does")
    _, version, count, degree, fraction, flags, _ = OLD_HEADER.unpack(header)
    if not 1 <= version <= 3:
        raise FieldError(f"{path}: SPZ of version {version}; 1 to 4 are read")
    widths = _widths(path, version, count, degree, size)
    spool = _spool()
    remaining = sum(widths) * count
    while remaining:
        part = stream.read(min(remaining, _CHUNK_BYTES))
        if not part:
            raise _damaged(path, f"it ends {remaining} bytes early")
        spool.write(part)
        remaining -= len(part)
    axes = SPZ_AXES
    if flags & _EXTENSIONS:
        axes = _axes_from_extensions(stream.read(_MAX_EXTENSION_BYTES), axes)
    return _source(path, spool, widths, version, count, degree, fraction, flags, axes)


def _open_version_4(path: Path, file: BinaryIO, start: bytes, whole: int) -> SplatSource:
    if len(start) < NEW_HEADER.size:
        raise _damaged(path, "its header is cut off")
    _, version, count, degree, fraction, flags, streams, contents, _ = NEW_HEADER.unpack(start)
    if version != 4:
        # Uncompressed files of versions 1 to 3.
        file.seek(0)
        return _open_gzip_version(path, file, whole)
    widths = _widths(path, version, count, degree, whole)
    axes = SPZ_AXES
    if flags & _EXTENSIONS:
        axes = _axes_from_extensions(
            file.read(min(max(0, contents - NEW_HEADER.size), _MAX_EXTENSION_BYTES)), axes
        )
    file.seek(contents)
    table = file.read(16 * streams)
    expected = [width * count for width in widths if width]
    raw = [size for _, size in struct.iter_unpack("<QQ", table)] if len(table) == 16 * streams else []
    if raw != expected:
        raise _damaged(
            path, f"its streams have {_format_sizes(raw)} bytes, expected {_format_sizes(expected)}"
        )
    spool, at = _spool(), contents + len(table)
    for packed, size in struct.iter_unpack("<QQ", table):
        remaining = size
        try:
            with zstandard.ZstdDecompressor().stream_reader(
                cast(Any, _FileRange(file, at, packed))
            ) as reader:
                while remaining and (part := reader.read(min(remaining, _CHUNK_BYTES))):
                    spool.write(part)
                    remaining -= len(part)
        except zstandard.ZstdError:
            remaining = max(remaining, 1)
        if remaining:
            raise _damaged(path, "one of its streams cannot be decompressed")
        at += packed
        if at > whole:
            raise _damaged(path, "its streams end after the file")
    return _source(path, spool, widths, version, count, degree, fraction, flags, axes)


class _FileRange:
    """Read-only view of a byte range of a file."""

    def __init__(self, file: BinaryIO, begin: int, size: int) -> None:
        self._file, self._at, self._left = file, begin, size

    def read(self, size: int = -1) -> bytes:
        self._file.seek(self._at)
        part = self._file.read(min(size if size >= 0 else 1 << 20, self._left))
        self._at += len(part)
        self._left -= len(part)
        return part


def _axes_from_extensions(extensions: bytes, axes: Axes) -> Axes:
    """Axes stated by the extension records of type (uint32), length (uint32) and content."""
    at = 0
    while at + 8 <= len(extensions):
        kind, length = struct.unpack_from("<II", extensions, at)
        if kind == _COORDINATES and length >= 1 and at + 8 < len(extensions):
            number = extensions[at + 8]
            said = _SYSTEMS[number] if number < len(_SYSTEMS) else None
            return said if said in AXES else axes  # type: ignore[return-value]
        at += 8 + length
    return axes


def _widths(path: Path, version: int, count: int, degree: int, size: int) -> tuple[int, ...]:
    """Bytes per splat of each stream. Raises FieldError where the file is too small for `count` splats."""
    if degree > 4:
        raise _damaged(path, f"harmonics of degree {degree}; at most 4 exist")
    rotation = 3 if version < 3 else 4
    widths = (6 if version == 1 else 9, 1, 3, 3, rotation, 3 * ((degree + 1) ** 2 - 1))
    total = sum(widths) * count
    if (
        not count
        or total > _MAX_DEFLATE_RATIO * size
        or (total > _SMALL_BYTES and total > _MAX_USUAL_RATIO * size)
    ):
        raise _damaged(path, f"it says that it holds {count} splats")
    return widths


def _spool() -> IO[bytes]:
    """Temporary file, in memory while it is small; closed together with the source."""
    return cast(IO[bytes], tempfile.SpooledTemporaryFile(max_size=1 << 22))


def _source(
    path: Path,
    spool: IO[bytes],
    widths: tuple[int, ...],
    version: int,
    count: int,
    degree: int,
    fraction: int,
    flags: int,
    axes: Axes,
) -> SplatSource:
    begins = np.concatenate([[0], np.cumsum(widths)]) * count

    def column(number: int, first: int, last: int) -> NDArray[np.uint8]:
        spool.seek(int(begins[number]) + first * widths[number])
        return np.frombuffer(spool.read((last - first) * widths[number]), np.uint8).reshape(last - first, -1)

    def batches() -> Iterator[SplatBatch]:
        for first in range(0, count, _DECODED_SPLATS):
            last = min(first + _DECODED_SPLATS, count)
            positions, alpha, colors, scales, rotations, rest = (
                column(number, first, last) if widths[number] else np.zeros((last - first, 0), np.uint8)
                for number in range(6)
            )
            sh = np.concatenate([(colors / 255.0 - 0.5) / COLOR_SCALE, (rest - 128.0) / 128.0], axis=1)
            yield SplatBatch(
                positions.view("<f2").astype(np.float64)
                if version == 1
                else _decode_fixed_point(positions, fraction),
                scales / 16.0 - 10.0,
                _decode_first_three(rotations)
                if version < 3
                else _decode_smallest_three(rotations.view("<u4")[:, 0]),
                alpha[:, 0] / 255.0,
                sh.reshape(last - first, -1, 3),
            )

    return SplatSource(path, count, degree, axes, batches, bool(flags & ANTIALIASED))


def _decode_fixed_point(positions: NDArray[np.uint8], fraction: int) -> AnyArray:
    """Values [n,3] of 24-bit fixed point numbers [n,9]."""
    whole = np.zeros((len(positions), 3, 4), np.uint8)
    whole[:, :, 1:] = positions.reshape(-1, 3, 3)
    return (whole.view("<i4")[:, :, 0] >> 8) / 2.0**fraction


def _decode_first_three(rotations: NDArray[np.uint8]) -> AnyArray:
    xyz = rotations / 127.5 - 1.0
    w = np.sqrt(np.maximum(0.0, 1.0 - (xyz**2).sum(axis=1)))
    return np.concatenate([w[:, None], xyz], axis=1)


def _decode_smallest_three(packed: NDArray[np.uint32]) -> AnyArray:
    """Quaternions [n,4] (w x y z) of packed integers [n]."""
    largest = (packed >> 30).astype(np.int64)
    xyzw = np.zeros((len(packed), 4))
    rest = packed.astype(np.uint32)
    for axis in (3, 2, 1, 0):
        here = largest != axis
        value = (rest & 511) / 511.0 * np.sqrt(0.5) * np.where(rest >> 9 & 1, -1.0, 1.0)
        xyzw[here, axis] = value[here]
        rest = np.where(here, rest >> 10, rest)
    np.put_along_axis(
        xyzw, largest[:, None], np.sqrt(np.maximum(0.0, 1.0 - (xyzw**2).sum(axis=1)))[:, None], axis=1
    )
    return xyzw[:, [3, 0, 1, 2]]


def _damaged(path: Path, why: str) -> FieldError:
    return FieldError(f"{path}: no SPZ file that can be read: {why}; copy or export it again")


def _format_sizes(sizes: list[int]) -> str:
    return str(sizes[:8])[:150]
