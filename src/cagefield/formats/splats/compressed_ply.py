"""Compressed PLY of PlayCanvas: 16 bytes per splat, quantized between limits shared by chunks of 256 splats.

An element "chunk" per 256 splats has the min and max of x y z, of the logarithms of the scales and,
in files of 18 columns, of the colors; "vertex" with packed_position (11, 10, 11 bits), packed_rotation (the
index of the largest component in 2 bits, the other three in 10 each), packed_scale (11, 10, 11) and
packed_color (8 each, opacity last); where there are harmonics, "sh" with f_rest_* in 8 bits each.

Source: the PlayCanvas manual, "Compressed PLY"; playcanvas/splat-transform,
src/lib/writers/compressed-chunk.ts.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields import sh as spherical_harmonics
from cagefield.files.atomic import replaced_file
from cagefield.files.ply import Columns, PlyTable, open_ply
from cagefield.formats.splats.axes import PLY_AXES
from cagefield.formats.splats.splat_ply import (
    column_names,
    harmonics_from_columns,
    render_mode_comment,
    render_mode_from_comments,
    sh_degree_from_columns,
    stack_columns,
    warn_about_ignored,
)
from cagefield.formats.splats.splat_table import (
    BATCH_SPLATS,
    MIN_LOG_SCALE,
    OnProgress,
    SplatBatch,
    SplatSource,
    SplatTable,
)
from cagefield.typing import AnyArray

SPLATS_PER_CHUNK = 256
"""Number of splats per chunk."""

_PACKED_COLUMNS = ("packed_position", "packed_rotation", "packed_scale", "packed_color")
_LIMIT_COLUMNS = [
    f"{end}_{stem}{part}" for stem, parts in (("", "xyz"), ("scale_", "xyz"), ("", "rgb")) for end in ("min",
    "max") for part in parts ]  # fmt: skip


def open_compressed_ply(path: Path) -> SplatSource:
    """Open compressed PLY file.

    Raises:
        FieldError: missing file, another kind of PLY, or a damaged file.
    """
    comments, tables = open_ply(path)
    nothing = PlyTable(0, (), lambda first, last: {})
    vertex, chunk, harmonics = (tables.get(name, nothing) for name in ("vertex", "chunk", "sh"))
    missing = [name for name in _PACKED_COLUMNS if name not in vertex.columns]
    missing += [name for name in _LIMIT_COLUMNS[:12] if name not in chunk.columns]
    if missing:
        raise FieldError(f"{path}: a compressed file that lacks {', '.join(missing)}; export it again")
    if chunk.count != -(-vertex.count // SPLATS_PER_CHUNK):
        raise FieldError(
            f"{path}: {chunk.count} chunks for {vertex.count} splats, expected "
            f"{-(-vertex.count // SPLATS_PER_CHUNK)}; export it again"
        )
    if harmonics.columns and harmonics.count != vertex.count:
        raise FieldError(f"{path}: its harmonics are not those of {vertex.count} splats; export it again")
    degree = sh_degree_from_columns(path, harmonics.columns)
    warn_about_ignored(path, vertex, _PACKED_COLUMNS, ("chunk", "sh"))

    def batches() -> Iterator[SplatBatch]:
        for first in range(0, vertex.count, BATCH_SPLATS):
            last = first + BATCH_SPLATS
            chunks = chunk.rows(first // SPLATS_PER_CHUNK, -(-last // SPLATS_PER_CHUNK))
            yield _unpack_batch(vertex.rows(first, last), chunks, harmonics.rows(first, last), degree)

    end = max(table.end for table in (vertex, chunk, harmonics))
    return SplatSource(
        path, vertex.count, degree, PLY_AXES, batches, *render_mode_from_comments(comments), end=end
    )


def write_compressed_ply(path: Path, table: SplatTable, on_progress: OnProgress = lambda _: None) -> None:
    """Write the splats in Morton order, complete or not at all; chunks have 18 columns."""
    above = 3 * ((table.sh_degree + 1) ** 2 - 1)
    header = ["ply", "format binary_little_endian 1.0", "comment written by cagefield"]
    header += render_mode_comment(table)
    header += [
        f"element chunk {-(-table.count // SPLATS_PER_CHUNK)}",
        *(f"property float {name}" for name in _LIMIT_COLUMNS),
    ]
    header += [f"element vertex {table.count}", *(f"property uint {name}" for name in _PACKED_COLUMNS)]
    if above:
        header += [f"element sh {table.count}"]
        header += [f"property uchar {name}" for name in column_names("f_rest_", above)]
    with (
        replaced_file(path) as temporary,
        temporary.open("wb") as out,
        tempfile.TemporaryFile() as vertices,
        tempfile.TemporaryFile() as rest,
    ):
        out.write("\n".join([*header, "end_header", ""]).encode())
        done = 0
        for batch in _whole_chunks(table.sorted_batches()):
            limits, packed = _pack_batch(batch)
            out.write(limits.astype("<f4").tobytes())
            vertices.write(packed.astype("<u4").tobytes())
            if above:
                values = batch.sh[:, 1:].transpose(0, 2, 1).reshape(len(batch), above)
                rest.write(np.clip((values / 8.0 + 0.5) * 256.0, 0, 255).astype(np.uint8).tobytes())
            done += len(batch)
            on_progress(done / table.count)
        for file in (vertices, rest):
            file.seek(0)
            while part := file.read(1 << 24):
                out.write(part)


def _whole_chunks(batches: Iterable[SplatBatch]) -> Iterator[SplatBatch]:
    """Batches regrouped to whole chunks, except the last."""
    rest_rows: list[AnyArray] = []
    for batch in batches:
        rows = np.concatenate([*rest_rows, batch.to_rows()])
        whole = len(rows) // SPLATS_PER_CHUNK * SPLATS_PER_CHUNK
        if whole:
            yield SplatBatch.from_rows(rows[:whole])
        rest_rows = [rows[whole:]]
    if rest_rows and len(rest_rows[0]):
        yield SplatBatch.from_rows(rest_rows[0])


def _pack_batch(batch: SplatBatch) -> tuple[AnyArray, NDArray[np.uint32]]:
    """(limits [chunks,18], packed values [n,4]) of whole chunks."""
    starts = np.arange(0, len(batch), SPLATS_PER_CHUNK)
    row = np.arange(len(batch)) // SPLATS_PER_CHUNK
    colors = batch.sh[:, 0].astype(np.float64) * spherical_harmonics.C0 + 0.5
    columns, shares = [], []
    for values in (
        batch.means.astype(np.float32).astype(np.float64),
        np.clip(batch.log_scales, -20.0, 20.0).astype(np.float64),
        colors.astype(np.float32).astype(np.float64),
    ):
        low, high = np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)
        columns += [low, high]
        size = np.where(high > low, high - low, 1.0)
        shares.append((values - low[row]) / size[row])
    position, scale = (_pack_bits(share, (11, 10, 11)) for share in shares[:2])
    rgba = _pack_bits(np.concatenate([shares[2], batch.opacities[:, None]], axis=1), (8, 8, 8, 8))
    return np.concatenate(columns, axis=1), np.stack(
        [position, _encode_smallest_three(batch.quaternions), scale, rgba], axis=1
    )


def _pack_bits(shares: AnyArray, widths: Sequence[int]) -> NDArray[np.uint32]:
    """Bit fields of shares [n,fields] in [0,1], the first field highest."""
    packed = np.zeros(len(shares), np.uint32)
    for values, width in zip(shares.T, widths, strict=True):
        most = (1 << width) - 1
        packed = packed << np.uint32(width) | np.clip(values * most + 0.5, 0, most).astype(np.uint32)
    return packed


_OTHER_COMPONENTS = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])
"""Indices of the other components, by the index of the largest."""


def _encode_smallest_three(quaternions: AnyArray) -> NDArray[np.uint32]:
    q = quaternions.astype(np.float64)
    largest = np.abs(q).argmax(axis=1)
    q = q * np.where(np.take_along_axis(q, largest[:, None], axis=1) < 0.0, -1.0, 1.0)
    others = np.take_along_axis(q, _OTHER_COMPONENTS[largest], axis=1)
    return largest.astype(np.uint32) << np.uint32(30) | _pack_bits(others / np.sqrt(2.0) + 0.5, (10, 10, 10))


def _unpack_batch(vertex: Columns, chunk: Columns, harmonics: Columns, degree: int) -> SplatBatch:
    position, rotation, scale, color = (vertex[name].astype(np.uint32) for name in _PACKED_COLUMNS)
    row = np.arange(len(position)) // SPLATS_PER_CHUNK
    rgba = _unpack_bits(color, (24, 8), (16, 8), (8, 8), (0, 8))
    rgb = (
        _dequantize(chunk, "", "rgb", row, rgba[:, :3])
        if set(_LIMIT_COLUMNS[12:]) <= chunk.keys()
        else rgba[:, :3]
    )
    rest = {
        name: 8.0 * (np.where(values == 255, 1.0, np.where(values == 0, 0.0, (values + 0.5) / 256.0)) - 0.5)
        for name, values in ((name, values.astype(np.float64)) for name, values in harmonics.items())
    }
    return SplatBatch(
        _dequantize(chunk, "", "xyz", row, _unpack_bits(position, (21, 11), (11, 10), (0, 11))),
        _dequantize(chunk, "scale_", "xyz", row, _unpack_bits(scale, (21, 11), (11, 10), (0, 11))),
        _decode_smallest_three(rotation),
        rgba[:, 3],
        harmonics_from_columns((rgb - 0.5) / spherical_harmonics.C0, rest, degree),
    )


def _unpack_bits(values: NDArray[np.uint32], *fields: tuple[int, int]) -> AnyArray:
    """Bit fields (shift, width) of integers [n] as [n,fields] in [0,1]."""
    return np.stack(
        [(values >> shift & (1 << width) - 1) / ((1 << width) - 1) for shift, width in fields], axis=1
    )


def _dequantize(chunk: Columns, stem: str, parts: Iterable[str], row: AnyArray, share: AnyArray) -> AnyArray:
    """Values [n,3] at shares [n,3] between their chunk's minimum and maximum.

    A scale of 0 has the logarithm -inf, which is clamped first: nothing interpolates between -inf and a
    number.
    """
    low, high = (stack_columns(chunk, [f"{end}_{stem}{part}" for part in parts]) for end in ("min", "max"))
    if stem:
        low, high = (np.maximum(limit, MIN_LOG_SCALE) for limit in (low, high))
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(low[row] * (1.0 - share) + high[row] * share)


def _decode_smallest_three(packed: NDArray[np.uint32]) -> AnyArray:
    """Quaternions [n,4] (w x y z) from three components, sqrt(2) (0..1 - .5), and the largest's index."""
    others = (_unpack_bits(packed, (20, 10), (10, 10), (0, 10)) - 0.5) * np.sqrt(2.0)
    largest = (packed >> 30).astype(np.int64)
    quaternions = np.empty((len(packed), 4))
    np.put_along_axis(quaternions, _OTHER_COMPONENTS[largest], others, axis=1)
    rest_rows = np.sqrt(np.maximum(0.0, 1.0 - (others**2).sum(axis=1)))
    np.put_along_axis(quaternions, largest[:, None], rest_rows[:, None], axis=1)
    return quaternions
