"""Splats read from files, written to them and converted: one way for all formats of `splat_opening`."""

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
from cagefield.files.memory import lacking_memory
from cagefield.formats.splats.antimatter15_splat import write_splat_rows
from cagefield.formats.splats.axes import PLY, Axes, signs, with_axes
from cagefield.formats.splats.compressed_ply import write_compressed_ply
from cagefield.formats.splats.gltf import GLTF_AXES
from cagefield.formats.splats.gltf_writer import write_splat_gltf
from cagefield.formats.splats.open_splats import ending_of, open_splats
from cagefield.formats.splats.sog_writer import write_sog
from cagefield.formats.splats.splat_ply import write_splat_ply
from cagefield.formats.splats.splat_table import (
    VISIBLE,
    FieldTable,
    OnProgress,
    SplatBatch,
    SplatSource,
    SplatTable,
    cleaned,
    spooled,
)
from cagefield.formats.splats.spz import SPZ_AXES
from cagefield.formats.splats.spz_writer import Version as SpzVersion
from cagefield.formats.splats.spz_writer import write_spz

WRITABLE = (".ply", ".compressed.ply", ".spz", ".sog", ".splat", ".glb")

_WRITE: dict[str, tuple[Callable[[Path, SplatTable, OnProgress], None], Axes]] = {
    ".ply": (write_splat_ply, PLY),
    ".compressed.ply": (write_compressed_ply, PLY),
    ".spz": (write_spz, SPZ_AXES),
    ".sog": (write_sog, PLY),
    ".splat": (write_splat_rows, PLY),
    ".glb": (write_splat_gltf, GLTF_AXES),
}

_HOLD_OFFSET = (".ply", ".glb")
"""Formats whose coordinates are double, or have a translation that is."""

MAX_ROUNDING = 0.01
"""Rounding of coordinates to float32, in sizes of the splats, that is let be."""

_MOST_DEGREE = {".compressed.ply": 3, ".sog": 3, ".glb": 3, ".splat": 0}
"""Degree of the harmonics that a format can hold, where it is less than what a field can."""


def read_splats(
    path: str | Path, axes: Axes | None = None, on_progress: OnProgress = lambda _: None
) -> SplatField:
    """The splats of a file, in PLY's axes (x right, y down, z forwards).

    `axes` are those that the file is in, where it is wrong or silent about them. Splats with a value that is
    no number are left out with one warning.

    Raises:
        FieldError: no such file, a format that is not known, a file that is damaged or holds no splat that is
            visible.
    """
    return read_opened(open_fitting(Path(path)), axes, on_progress)


def open_fitting(path: Path) -> SplatSource:
    """The open file of splats. Raises FieldError as `open_splats`, and for more than memory can hold."""
    source = open_splats(path)
    needed = 4 * source.count * sum(map(math.prod, _shapes(source)))
    if (lacking := lacking_memory(needed)) is not None:
        raise FieldError(f"{path}: its {source.count} splats are too many: {lacking}")
    return source


def _shapes(source: SplatSource) -> tuple[tuple[int, ...], ...]:
    """The shapes of a splat's values."""
    degree = min(source.sh_degree, spherical_harmonics.MAX_DEGREE)
    return ((3,), (3,), (4,), (), ((degree + 1) ** 2, 3))


def read_opened(
    source: SplatSource, axes: Axes | None = None, on_progress: OnProgress = lambda _: None
) -> SplatField:
    """The splats of an open file, as `read_splats` has them. Raises FieldError where none is visible."""
    count = source.count
    found = _with_visible(source)  # before memory is taken for all of them
    arrays = [np.empty((count, *shape), np.float32) for shape in _shapes(source)]
    done = 0
    offset, shifted = _near_origin(source, _batches(source, found, axes))
    for batch in shifted:
        parts = (batch.means, batch.log_scales, batch.quaternions, batch.opacities, batch.sh)
        for array, part in zip(arrays, parts, strict=True):
            array[done : done + len(batch)] = part
        done += len(batch)
        on_progress(done / count)
    for array in arrays:
        array.setflags(write=False)  # a field copies what may be written to
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
    """Writes the splats of a field in PLY's axes as the format of the path's ending, whole or not at all.

    `axes` are those to write in place of the format's own; `spz_version` that of an .spz file, else 3.

    Raises:
        FieldError: a format that cannot be written, a version for another format, a field without splats.
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
    """(number of splats, degree of their harmonics) that went from one file into another, by a temporary one.

    Memory does not grow with their number, but for a byte or two each in images and codes.

    Raises:
        FieldError: as `read_splats` and `write_splats`.
    """
    writer_of(Path(target), spz_version)
    found = open_splats(Path(source))
    degree = min(found.sh_degree, spherical_harmonics.MAX_DEGREE)
    offset, batches = _near_origin(found, _batches(found, found.batches(), axes))
    with spooled(found, batches, degree, lambda share: on_progress(0.4 * share), offset) as table:
        rest: OnProgress = lambda share: on_progress(0.4 + 0.6 * share)  # noqa: E731
        return table.count, _write(table, Path(target), target_axes, rest, spz_version)


def writer_of(
    path: Path, spz_version: SpzVersion | None = None
) -> tuple[Callable[[Path, SplatTable, OnProgress], None], Axes]:
    """(what writes the format of a path's ending, its axes).

    Raises:
        FieldError: a format that is not written, or a version of .spz for another one.
    """
    ending = ending_of(path)
    if ending not in _WRITE:
        raise FieldError(f"{path}: no format of splats that is written; these are: {', '.join(WRITABLE)}")
    if spz_version is None:
        return _WRITE[ending]
    if ending != ".spz":
        raise FieldError(f"{path}: versions are for .spz files; leave --spz-version out")
    return partial(write_spz, version=spz_version), SPZ_AXES


def _with_visible(source: SplatSource) -> Iterator[SplatBatch]:
    """A file's batches, which are gone through once more where the first holds nothing that is visible.

    Raises:
        FieldError: none does.
    """
    batches = source.batches()
    first = next(batches, None)
    if first is not None and not _transparent(first):
        return itertools.chain((first,), batches)
    if first is not None and all(map(_transparent, batches)):
        raise FieldError(f"{source.path}: the file holds no splat that is visible; export it again")
    return source.batches()


def _transparent(batch: SplatBatch) -> bool:
    return bool((batch.opacities < VISIBLE).all())


def _batches(source: SplatSource, batches: Iterator[SplatBatch], axes: Axes | None) -> Iterator[SplatBatch]:
    """The splats that can be shown, in PLY's axes, with harmonics of a degree that a field may have."""
    most = spherical_harmonics.MAX_DEGREE
    if source.sh_degree > most:
        warnings.warn(
            f"{source.path}: its harmonics have degree {source.sh_degree}; those above {most} are left out",
            stacklevel=3,
        )
    kept = (min(source.sh_degree, most) + 1) ** 2
    for batch in cleaned(source, batches):
        cut = dataclasses.replace(batch, sh=batch.sh[:, :kept])
        yield with_axes(cut, axes or source.axes, PLY)


def _near_origin(source: SplatSource, batches: Iterator[SplatBatch]) -> tuple[Offset, Iterator[SplatBatch]]:
    """(offset, the splats less it): none, unless float32 would round coordinates that are doubles too much.

    Too much is MAX_ROUNDING of the size of most splats, in the first batch.
    """
    first = next(batches, None)
    if first is None or not source.is_double or not len(first):
        return NO_OFFSET, itertools.chain(() if first is None else (first,), batches)
    means = first.means.astype(np.float64)
    rounding = np.quantile(np.abs(means - means.astype(np.float32)).max(axis=1), 0.99)
    size = np.exp(np.median(np.median(first.log_scales, axis=1)))
    middle = np.round(np.median(means, axis=0)) + 0.0
    if rounding <= MAX_ROUNDING * size or not middle.any():
        return NO_OFFSET, itertools.chain((first,), batches)
    x, y, z = middle.tolist()
    warnings.warn(
        f"{source.path}: its coordinates are far from the origin; {_shown((x, y, z))} is taken off, kept, "
        "and added where a .ply or .glb is exported",
        stacklevel=3,
    )
    shifted = (
        dataclasses.replace(batch, means=batch.means - middle) for batch in itertools.chain((first,), batches)
    )
    return (x, y, z), shifted


def _shown(offset: Offset) -> str:
    return "(" + ", ".join(f"{value:.15g}" for value in offset) + ")"


def _write(
    table: SplatTable,
    path: Path,
    axes: Axes | None,
    on_progress: OnProgress,
    spz_version: SpzVersion | None,
) -> int:
    """Writes the splats; the degree of the harmonics that the format could hold."""
    write, own = writer_of(path, spz_version)
    degree = min(table.sh_degree, _MOST_DEGREE.get(ending_of(path), table.sh_degree))
    if degree < table.sh_degree:
        warnings.warn(
            f"{path}: {ending_of(path)} holds harmonics of degree {degree} at most; those above are left out",
            stacklevel=3,
        )
    if table.discs and not ending_of(path).endswith(".ply"):
        warnings.warn(
            f"{path}: {ending_of(path)} cannot say that splats are discs (2DGS): they are written flat",
            stacklevel=3,
        )
    if any(table.offset) and ending_of(path) not in _HOLD_OFFSET:
        warnings.warn(
            f"{path}: {ending_of(path)} holds coordinates as float32: they are without the offset "
            f"{_shown(table.offset)}, in PLY's axes; .ply and .glb have it",
            stacklevel=3,
        )
    write(path, _Written(table, axes or own, degree), on_progress)
    return degree


@dataclasses.dataclass(frozen=True, eq=False)
class _Written:
    """A table in a format's axes, with harmonics of the degree that it holds."""

    table: SplatTable
    axes: str
    sh_degree: int

    @property
    def count(self) -> int:
        return self.table.count

    @property
    def antialiased(self) -> bool:
        return self.table.antialiased

    @property
    def discs(self) -> bool:
        return self.table.discs

    @property
    def offset(self) -> Offset:
        x, y, z = (signs(PLY, self.axes) * np.array(self.table.offset) + 0.0).tolist()
        return x, y, z

    def batches(self) -> Iterator[SplatBatch]:
        return (self._of(batch) for batch in self.table.batches())

    def sorted_batches(self) -> Iterator[SplatBatch]:
        return (self._of(batch) for batch in self.table.sorted_batches())

    def _of(self, batch: SplatBatch) -> SplatBatch:
        kept = dataclasses.replace(batch, sh=batch.sh[:, : (self.sh_degree + 1) ** 2])
        return with_axes(kept, PLY, self.axes)
