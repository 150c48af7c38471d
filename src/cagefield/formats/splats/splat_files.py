"""Reading, writing and conversion of splat files in all formats of `open_splats`."""

from __future__ import annotations

import dataclasses
import itertools
import math
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from cagefield.errors import FieldError
from cagefield.fields import sh as spherical_harmonics
from cagefield.fields.splat_field import NO_OFFSET, Offset, SplatField
from cagefield.files.memory import memory_shortage
from cagefield.formats.splats.antimatter15_splat import write_splat_rows
from cagefield.formats.splats.axes import PLY_AXES, Axes, ConvertedTable, convert_axes
from cagefield.formats.splats.compressed_ply import write_compressed_ply
from cagefield.formats.splats.detection import LOD_META
from cagefield.formats.splats.gltf import GLTF_AXES
from cagefield.formats.splats.gltf_writer import write_splat_gltf
from cagefield.formats.splats.open_splats import format_suffix, open_splats
from cagefield.formats.splats.sog_lod_writer import check_sog_lod, write_sog_lod
from cagefield.formats.splats.sog_writer import write_sog
from cagefield.formats.splats.splat_ply import write_splat_ply
from cagefield.formats.splats.splat_table import (
    MIN_VISIBLE_OPACITY,
    FieldTable,
    OnProgress,
    SplatBatch,
    SplatSource,
    SplatTable,
    drop_invalid,
    spool_splats,
)
from cagefield.formats.splats.spz import SPZ_AXES
from cagefield.formats.splats.spz_writer import Version as SpzVersion
from cagefield.formats.splats.spz_writer import write_spz
from cagefield.formats.splats.usd_stage import USD_AXES
from cagefield.formats.splats.usd_writer import USD_SUFFIXES, check_usd, write_splat_usd

WRITABLE = (".ply", ".compressed.ply", ".spz", ".sog", ".splat", ".glb", *USD_SUFFIXES)

_WRITE: dict[str, tuple[Callable[[Path, SplatTable, OnProgress], None], Axes]] = {
    ".ply": (write_splat_ply, PLY_AXES),
    ".compressed.ply": (write_compressed_ply, PLY_AXES),
    ".spz": (write_spz, SPZ_AXES),
    ".sog": (write_sog, PLY_AXES),
    LOD_META: (write_sog_lod, PLY_AXES),
    ".splat": (write_splat_rows, PLY_AXES),
    ".glb": (write_splat_gltf, GLTF_AXES),
    **dict.fromkeys(USD_SUFFIXES, (write_splat_usd, USD_AXES)),
}

_OFFSET_SUFFIXES = (".ply", ".glb", *USD_SUFFIXES)
"""Formats with coordinates or a translation in double precision."""

MAX_ROUNDING_SIZES = 0.01
"""Maximum rounding of coordinates to float32 without an offset, in splat sizes."""

_MAX_SH_DEGREE = {".compressed.ply": 3, ".sog": 3, LOD_META: 3, ".glb": 3, ".splat": 0}
"""Maximum degree of the harmonics of formats that hold less than a field."""


def read_splats(
    path: str | Path,
    axes: Axes | None = None,
    on_progress: OnProgress = lambda _: None,
    *,
    time_code: float | None = None,
) -> SplatField:
    """SplatField of a splat file, in PLY's axes (x right, y down, z forward).

    `axes` replaces the axes that the file or its format states. `time_code` is one of a USD file's, else its
    first. Splats with non-finite values are left out,
    with one warning.

    Raises:
        FieldError: missing file, unknown format, or a damaged file or one without visible splats.
    """
    return read_source(open_within_memory(Path(path), time_code), axes, on_progress)


def open_within_memory(path: Path, time_code: float | None = None) -> SplatSource:
    """Open splat file. Raises FieldError as `open_splats`, and for splats that exceed the memory."""
    source = open_splats(path, time_code)
    needed = 4 * source.count * sum(map(math.prod, _shapes(source)))
    if (lacking := memory_shortage(needed)) is not None:
        raise FieldError(f"{path}: its {source.count} splats are too many: {lacking}")
    return source


def _shapes(source: SplatSource) -> tuple[tuple[int, ...], ...]:
    """Shapes of a splat's values."""
    degree = min(source.sh_degree, spherical_harmonics.MAX_DEGREE)
    return ((3,), (3,), (4,), (), ((degree + 1) ** 2, 3))


def read_source(
    source: SplatSource, axes: Axes | None = None, on_progress: OnProgress = lambda _: None
) -> SplatField:
    """SplatField of an open file, as `read_splats`. Raises FieldError where no splat is visible."""
    count = source.count
    opened = _check_visible(source)  # before the allocation of all arrays
    arrays = [np.empty((count, *shape), np.float32) for shape in _shapes(source)]
    done = 0
    offset, shifted = _shift_to_origin(source, _prepare_batches(source, opened, axes))
    for batch in shifted:
        parts = (batch.means, batch.log_scales, batch.quaternions, batch.opacities, batch.sh)
        for array, part in zip(arrays, parts, strict=True):
            array[done : done + len(batch)] = part
        done += len(batch)
        on_progress(done / count)
    for array in arrays:
        array.setflags(write=False)  # a field copies writable arrays
    means, log_scales, quaternions, opacities, sh = (array[:done] for array in arrays)
    return SplatField(
        means,
        log_scales,
        quaternions,
        opacities,
        sh,
        antialiased=source.antialiased,
        discs=source.discs,
        offset=offset,
    )


def write_splats(
    field: SplatField,
    path: str | Path,
    axes: Axes | None = None,
    on_progress: OnProgress = lambda _: None,
    spz_version: SpzVersion | None = None,
) -> None:
    """Write a field's splats, in PLY's axes, in the format of the path's suffix, whole or not at all.

    `axes` replaces the format's axes; `spz_version` is the version of a .spz file, else 3.

    Raises:
        FieldError: a format without writer, a version for another format, or a field without splats.
    """
    if not len(field):
        raise FieldError(f"{path}: there are no splats to write")
    _write(FieldTable(field), Path(path), axes, on_progress, spz_version)


def convert_splats(
    source: str | Path,
    target: str | Path,
    *,
    axes: Axes | None = None,
    target_axes: Axes | None = None,
    on_progress: OnProgress = lambda _: None,
    spz_version: SpzVersion | None = None,
) -> tuple[int, int]:
    """(number of splats, SH degree) converted from one file to another.

    Splats pass through a temporary file: memory does not grow with their number, but for a byte or two each
    in images and codes.

    Raises:
        FieldError: as `read_splats` and `write_splats`.
    """
    find_writer(Path(target), spz_version)
    opened = open_splats(Path(source))
    degree = min(opened.sh_degree, spherical_harmonics.MAX_DEGREE)
    offset, batches = _shift_to_origin(opened, _prepare_batches(opened, opened.batches(), axes))
    with spool_splats(opened, batches, degree, lambda share: on_progress(0.4 * share), offset) as table:
        rest: OnProgress = lambda share: on_progress(0.4 + 0.6 * share)  # noqa: E731
        return table.count, _write(table, Path(target), target_axes, rest, spz_version)


def find_writer(
    path: Path, spz_version: SpzVersion | None = None
) -> tuple[Callable[[Path, SplatTable, OnProgress], None], Axes]:
    """(writer of the format of a path's suffix, its axes).

    Raises:
        FieldError: a format without writer, or a .spz version for another format.
    """
    ending = format_suffix(path)
    if ending in USD_SUFFIXES:
        check_usd(path)
    if ending == LOD_META:
        check_sog_lod(path)
    if ending not in _WRITE:
        raise FieldError(
            f"{path}: no format of splats that is written; these are: "
            f"{', '.join((*WRITABLE, f'FOLDER/{LOD_META}'))}"
        )
    if spz_version is None:
        return _WRITE[ending]
    if ending != ".spz":
        raise FieldError(f"{path}: versions are for .spz files; leave --spz-version out")
    return partial(write_spz, version=spz_version), SPZ_AXES


def _check_visible(source: SplatSource) -> Iterator[SplatBatch]:
    """Batches of a file with a visible splat; rereads the file where the first batch has none.

    Raises:
        FieldError: no batch has a visible splat.
    """
    batches = source.batches()
    first = next(batches, None)
    if first is not None and not _is_transparent(first):
        return itertools.chain((first,), batches)
    if first is not None and all(map(_is_transparent, batches)):
        raise FieldError(f"{source.path}: the file holds no splat that is visible; export it again")
    return source.batches()


def _is_transparent(batch: SplatBatch) -> bool:
    return bool((batch.opacities < MIN_VISIBLE_OPACITY).all())


def _prepare_batches(
    source: SplatSource, batches: Iterator[SplatBatch], axes: Axes | None
) -> Iterator[SplatBatch]:
    """Valid splats in PLY's axes, with harmonics up to a field's maximum degree."""
    max_degree = spherical_harmonics.MAX_DEGREE
    if source.sh_degree > max_degree:
        warnings.warn(
            f"{source.path}: its harmonics have degree {source.sh_degree}; "
            f"those above {max_degree} are left out",
            stacklevel=3,
        )
    coefficients = (min(source.sh_degree, max_degree) + 1) ** 2
    for batch in drop_invalid(source, batches):
        cut = dataclasses.replace(batch, sh=batch.sh[:, :coefficients])
        yield convert_axes(cut, axes or source.axes, PLY_AXES)


def _shift_to_origin(
    source: SplatSource, batches: Iterator[SplatBatch]
) -> tuple[Offset, Iterator[SplatBatch]]:
    """(offset, batches less the offset); a zero offset unless float32 rounds doubles too much.

    The limit is MAX_ROUNDING_SIZES times the median splat size of the first batch.
    """
    first = next(batches, None)
    if first is None or not source.is_double or not len(first):
        return NO_OFFSET, itertools.chain(() if first is None else (first,), batches)
    means = first.means.astype(np.float64)
    rounding = np.quantile(np.abs(means - means.astype(np.float32)).max(axis=1), 0.99)
    size = np.exp(np.median(np.median(first.log_scales, axis=1)))
    middle = np.round(np.median(means, axis=0)) + 0.0
    if rounding <= MAX_ROUNDING_SIZES * size or not middle.any():
        return NO_OFFSET, itertools.chain((first,), batches)
    x, y, z = middle.tolist()
    warnings.warn(
        f"{source.path}: its coordinates are far from the origin; "
        f"{_format_offset((x, y, z))} is taken off, kept, "
        "and added where a .ply, .glb or USD is exported",
        stacklevel=3,
    )
    shifted = (
        dataclasses.replace(batch, means=batch.means - middle) for batch in itertools.chain((first,), batches)
    )
    return (x, y, z), shifted


def _format_offset(offset: Offset) -> str:
    return "(" + ", ".join(f"{value:.15g}" for value in offset) + ")"


def _write(
    table: SplatTable,
    path: Path,
    axes: Axes | None,
    on_progress: OnProgress,
    spz_version: SpzVersion | None,
) -> int:
    """Write the splats; returns the degree of the written harmonics."""
    write, format_axes = find_writer(path, spz_version)
    if format_suffix(path) in USD_SUFFIXES and axes not in (None, USD_AXES):
        raise FieldError(f"{path}: USD has y up and is written in the axes {USD_AXES}; leave other axes out")
    degree = min(table.sh_degree, _MAX_SH_DEGREE.get(format_suffix(path), table.sh_degree))
    if degree < table.sh_degree:
        warnings.warn(
            f"{path}: {format_suffix(path)} holds harmonics of degree {degree} at most; "
            f"those above are left out",
            stacklevel=3,
        )
    if table.discs and not format_suffix(path).endswith(".ply"):
        warnings.warn(
            f"{path}: {format_suffix(path)} cannot say that splats are discs (2DGS): they are written flat",
            stacklevel=3,
        )
    if any(table.offset) and format_suffix(path) not in _OFFSET_SUFFIXES:
        warnings.warn(
            f"{path}: {format_suffix(path)} holds coordinates as float32: they are without the offset "
            f"{_format_offset(table.offset)}, in PLY's axes; .ply, .glb and USD have it",
            stacklevel=3,
        )
    write(path, ConvertedTable(table, axes or format_axes, degree), on_progress)
    return degree
