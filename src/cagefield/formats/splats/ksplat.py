"""Reader of mkkellogg's .ksplat: sections of splats in three levels of compression.

A header of 4096 bytes, a header of 1024 bytes per possible section, and the sections: lengths of the partial
buckets, centers of the buckets, splats. Level 0 holds float32 without buckets; levels 1 and 2 hold positions
as uint16 around their bucket's center, scales and rotations (w x y z) as float16. Harmonics are float32,
float16, or uint8 between two limits; within a degree all of red, then green, then blue.

Source: mkkellogg/GaussianSplats3D, src/loaders/SplatBuffer.js.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields import sh as spherical_harmonics
from cagefield.files.safe_open import open_regular, read_array
from cagefield.formats.splats.axes import PLY_AXES
from cagefield.formats.splats.splat_table import BATCH_SPLATS, SplatBatch, SplatSource
from cagefield.typing import AnyArray

_HEADER_BYTES, _SECTION_BYTES = 4096, 1024
_HARMONIC_FLOATS = {0: 0, 1: 9, 2: 24, 3: 45}


@dataclass(frozen=True)
class _Section:
    count: int
    degree: int
    bucket_size: int
    full_buckets: int
    block: float
    scale_range: int
    lengths_at: int
    lengths: int
    centers_at: int
    centers: int
    center_bytes: int
    splats_at: int


def open_ksplat(path: Path) -> SplatSource:
    """Open .ksplat file.

    Raises:
        FieldError: an unknown version or level, or a damaged file.
    """
    with open_regular(path) as file:
        head = file.read(_HEADER_BYTES)
        if len(head) < _HEADER_BYTES:
            raise _damaged(path, "its header is cut off")
        major, minor = head[0], head[1]
        (sections,) = struct.unpack_from("<I", head, 4)
        (level,) = struct.unpack_from("<H", head, 20)
        limits = struct.unpack_from("<ff", head, 36)
        if (major, minor) < (0, 1) or major > 1 or level > 2:
            raise FieldError(f"{path}: .ksplat of version {major}.{minor}, level {level}, is not known")
        if _HEADER_BYTES + sections * _SECTION_BYTES > path.stat().st_size:
            raise _damaged(path, f"it says that it has {sections} sections")
        heads = file.read(sections * _SECTION_BYTES)
    row = {degree: _row(level, degree) for degree in _HARMONIC_FLOATS}
    found, at = [], _HEADER_BYTES + sections * _SECTION_BYTES
    for number in range(sections):
        section, size = _section(
            path, heads[number * _SECTION_BYTES : (number + 1) * _SECTION_BYTES], at, row
        )
        at += size
        if at > path.stat().st_size:
            raise _damaged(path, f"section {number} ends after the file")
        found.append(section)
    degree = max((section.degree for section in found), default=0)
    if limits[0] >= limits[1]:
        limits = (-1.5, 1.5)

    def batches() -> Iterator[SplatBatch]:
        for section in found:
            yield from _batches(path, section, row[section.degree], level, degree, limits)

    return SplatSource(path, sum(section.count for section in found), degree, PLY_AXES, batches, end=at)


def _row(level: int, degree: int) -> np.dtype[np.void]:
    number, place, sh = ("<f4", "<f4", "<f4") if level == 0 else ("<f2", "<u2", "<f2" if level == 1 else "u1")
    parts = [("mean", place, (3,)), ("scale", number, (3,)), ("rotation", number, (4,)), ("rgba", "u1", (4,))]
    return np.dtype([*parts, ("sh", sh, (_HARMONIC_FLOATS[degree],))])


def _section(path: Path, head: bytes, at: int, row: dict[int, np.dtype[np.void]]) -> tuple[_Section, int]:
    """(section at byte `at`, its size in bytes)."""
    count, most, bucket_size, buckets = struct.unpack_from("<IIII", head, 0)
    (block,) = struct.unpack_from("<f", head, 16)
    (center_bytes,) = struct.unpack_from("<H", head, 20)
    scale_range, _, full, partial = struct.unpack_from("<IIII", head, 24)
    (degree,) = struct.unpack_from("<H", head, 40)
    if degree not in row or count > most:
        raise _damaged(path, f"a section says {count} splats of degree {degree}")
    lengths, centers = 4 * partial, center_bytes * buckets
    size = lengths + centers + most * row[degree].itemsize
    section = _Section(
        count, degree, bucket_size, full, block, scale_range or 32767, at, partial,
        at + lengths, buckets, center_bytes, at + lengths + centers,
    )  # fmt: skip
    return section, size


def _batches(
    path: Path,
    section: _Section,
    row: np.dtype[np.void],
    level: int,
    degree: int,
    limits: tuple[float, float],
) -> Iterator[SplatBatch]:
    lengths = read_array(path, "<u4", section.lengths, offset=section.lengths_at).astype(np.int64)
    ends = section.full_buckets * section.bucket_size + np.cumsum(lengths)
    raw = read_array(path, np.uint8, section.centers * section.center_bytes, offset=section.centers_at)
    centers = np.zeros((0, 3))
    if section.centers and section.center_bytes >= 12:
        centers = raw.reshape(section.centers, -1)[:, :12].copy().view("<f4").astype(np.float64)
    for first in range(0, section.count, BATCH_SPLATS):
        rows = read_array(
            path,
            row,
            min(BATCH_SPLATS, section.count - first),
            offset=section.splats_at + first * row.itemsize,
        )
        means = rows["mean"].astype(np.float64)
        if level:
            number = np.arange(first, first + len(rows))
            full = section.full_buckets * section.bucket_size
            bucket = np.where(
                number < full,
                number // max(1, section.bucket_size),
                section.full_buckets + np.searchsorted(ends, number, side="right"),
            )
            if len(bucket) and bucket.max() >= len(centers):
                raise _damaged(path, "a splat lies in a bucket that is not there")
            step = 0.5 * section.block / section.scale_range
            means = (means - section.scale_range) * step + centers[bucket]
        yield _batch(rows, means, level, section.degree, degree, limits)


def _batch(
    rows: NDArray[np.void], means: AnyArray, level: int, own: int, degree: int, limits: tuple[float, float]
) -> SplatBatch:
    rgba = rows["rgba"] / 255.0
    rest = rows["sh"].astype(np.float64)
    if level == 2:
        rest = limits[0] + (limits[1] - limits[0]) * rest / 255.0
    sh = np.zeros((len(rows), (degree + 1) ** 2, 3))
    sh[:, 0] = (rgba[:, :3] - 0.5) / spherical_harmonics.C0
    for l in range(1, own + 1):  # noqa: E741
        begin, end = l * l, (l + 1) * (l + 1)
        part = rest[:, 3 * (begin - 1) : 3 * (end - 1)].reshape(len(rows), 3, end - begin)
        sh[:, begin:end] = part.transpose(0, 2, 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        log_scales = np.log(rows["scale"].astype(np.float64))
    return SplatBatch(means, log_scales, rows["rotation"].astype(np.float64), rgba[:, 3], sh)


def _damaged(path: Path, why: str) -> FieldError:
    return FieldError(f"{path}: no .ksplat that can be read: {why}; copy or export it again")
