"""Writer of splats as Niantic's SPZ, versions 3 and 4; `spz` documents the streams."""

from __future__ import annotations

import gzip
import struct
import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Any, Literal

import numpy as np
import zstandard
from numpy.typing import NDArray

from cagefield.files.atomic import replaced_file
from cagefield.formats.splats.splat_table import OnProgress, SplatBatch, SplatTable
from cagefield.formats.splats.spz import ANTIALIASED, COLOR_SCALE, MAGIC, NEW_HEADER, OLD_HEADER
from cagefield.typing import AnyArray

Version = Literal[3, 4]
"""Writable versions. Spark 2.2 reads 3 and not 4; splat-transform reads both."""

MAX_FRACTION_BITS = 12
"""Maximum number of fractional bits of positions."""

_DEGREE_1_STEP, _HIGHER_DEGREE_STEP = 8, 16
"""Quantization steps of harmonics of degree 1 and of higher degrees, as in Niantic's writer."""


def write_spz(
    path: Path, table: SplatTable, on_progress: OnProgress = lambda _: None, version: Version = 3
) -> None:
    """Write splats in SPZ's axes, in Morton order: version 3, compressed by gzip, or 4, by Zstandard.

    Positions have 12 fractional bits, fewer for large coordinates: half a step is 1.2e-4 units.
    """
    with ExitStack() as stack:
        columns = [stack.enter_context(tempfile.TemporaryFile()) for _ in range(6)]
        fraction = _fraction_bits(table)
        done = 0
        for batch in table.sorted_batches():
            for file, values in zip(columns, _encode(batch, fraction), strict=True):
                file.write(values.tobytes())
            done += len(batch)
            on_progress(0.6 * done / table.count)
        flags = ANTIALIASED if table.antialiased else 0
        sizes = [file.tell() for file in columns]
        for file in columns:
            file.seek(0)
        with replaced_file(path) as temporary, temporary.open("wb") as out:
            if version == 3:
                with gzip.GzipFile(fileobj=out, mode="wb", filename="", mtime=0) as packed:
                    packed.write(OLD_HEADER.pack(MAGIC, 3, table.count, table.sh_degree, fraction, flags, 0))
                    for number, file in enumerate(columns):
                        _copy(file, packed)
                        on_progress(0.6 + 0.4 * (number + 1) / 6)
                return
            used = [(file, size) for file, size in zip(columns, sizes, strict=True) if size]
            head = (MAGIC, 4, table.count, table.sh_degree, fraction, flags, len(used), NEW_HEADER.size, b"")
            out.write(NEW_HEADER.pack(*head) + bytes(16 * len(used)))
            entries = []
            for number, (file, size) in enumerate(used):
                begin = out.tell()
                zstandard.ZstdCompressor(level=12).copy_stream(file, out, size=size)
                entries.append((out.tell() - begin, size))
                on_progress(0.6 + 0.4 * (number + 1) / len(used))
            out.seek(NEW_HEADER.size)
            out.write(b"".join(struct.pack("<QQ", *entry) for entry in entries))


def _copy(source: IO[bytes], target: Any) -> None:
    while part := source.read(1 << 22):
        target.write(part)


def _fraction_bits(table: SplatTable) -> int:
    most = max(float(np.abs(batch.means).max()) for batch in table.batches())
    return int(np.clip(np.floor(np.log2((2**23 - 1) / max(most, 1e-30))), 0, MAX_FRACTION_BITS))


def _encode(batch: SplatBatch, fraction: int) -> tuple[AnyArray, ...]:
    fixed = np.clip(np.round(batch.means.astype(np.float64) * 2.0**fraction), -(2**23), 2**23 - 1)
    positions = fixed.astype("<i4").view(np.uint8).reshape(len(batch), 3, 4)[:, :, :3]
    colors = batch.sh[:, 0].astype(np.float64) * (COLOR_SCALE * 255.0) + 0.5 * 255.0
    rest = batch.sh[:, 1:].astype(np.float64).reshape(len(batch), -1)
    steps = np.full(rest.shape[1], _HIGHER_DEGREE_STEP)
    steps[:9] = _DEGREE_1_STEP
    rest = np.round(rest * 128.0) + 128.0
    rest = np.floor((rest + steps / 2) / steps) * steps
    return (
        positions,
        _bytes(batch.opacities.astype(np.float64) * 255.0),
        _bytes(colors),
        _bytes((batch.log_scales.astype(np.float64) + 10.0) * 16.0),
        _encode_smallest_three(batch.quaternions),
        _bytes(rest),
    )


def _bytes(values: AnyArray) -> NDArray[np.uint8]:
    return np.clip(np.round(values), 0, 255).astype(np.uint8)


def _encode_smallest_three(quaternions: AnyArray) -> NDArray[np.uint32]:
    xyzw = quaternions.astype(np.float64)[:, [1, 2, 3, 0]]
    largest = np.abs(xyzw).argmax(axis=1)
    negated = np.take_along_axis(xyzw, largest[:, None], axis=1) < 0.0
    xyzw = np.where(negated, -xyzw, xyzw)
    packed = largest.astype(np.uint32)
    for axis in range(4):
        here = largest != axis
        size = np.clip(np.round(np.abs(xyzw[:, axis]) * np.sqrt(2.0) * 511.0), 0, 511).astype(np.uint32)
        value = size | (xyzw[:, axis] < 0.0).astype(np.uint32) << np.uint32(9)
        packed = np.where(here, packed << np.uint32(10) | value, packed)
    return packed.astype("<u4")
