"""Splat files by their names: one way to read, write and convert all of them.

| ending | format | read | written |
| --- | --- | --- | --- |
| .ply | 3DGS, and what follows it | yes | yes |
| .compressed.ply | PlayCanvas | yes | yes |
| .spz | Niantic, versions 1 to 4 | yes | 3, or 4 |
| .sog, a folder with meta.json | PlayCanvas, versions 1 and 2 | yes | 2, as one file |
| .splat | antimatter15 | yes | yes |
| .ksplat | mkkellogg | yes | no |
| .glb | KHR_gaussian_splatting | yes | yes |
| .ckpt | nerfstudio's splatfacto | yes | no |
"""

from __future__ import annotations

import dataclasses
import itertools
import math
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from cagefield import sh as spherical_harmonics
from cagefield.devices import lacking_memory
from cagefield.errors import FieldError
from cagefield.fields.splat import SplatField
from cagefield.formats.splat_axes import PLY, Axes, with_axes
from cagefield.formats.splat_compressed_ply import open_compressed_ply, write_compressed_ply
from cagefield.formats.splat_gltf import GLTF_AXES, open_splat_gltf, write_splat_gltf
from cagefield.formats.splat_ksplat import open_ksplat
from cagefield.formats.splat_nerfstudio import is_splatfacto, open_splatfacto
from cagefield.formats.splat_ply import open_splat_ply, write_splat_ply
from cagefield.formats.splat_rows import open_splat_rows, write_splat_rows
from cagefield.formats.splat_sog import META, open_sog
from cagefield.formats.splat_sog_writer import write_sog
from cagefield.formats.splat_spz import SPZ_AXES, open_spz
from cagefield.formats.splat_spz_writer import Version as SpzVersion
from cagefield.formats.splat_spz_writer import write_spz
from cagefield.formats.splat_table import (
    VISIBLE,
    FieldTable,
    OnProgress,
    SplatBatch,
    SplatSource,
    SplatTable,
    cleaned,
    spooled,
)
from cagefield.ply import open_ply
from cagefield.regular_files import check_regular

READABLE = (".ply", ".compressed.ply", ".spz", ".sog", ".splat", ".ksplat", ".glb", ".ckpt", META)
WRITABLE = (".ply", ".compressed.ply", ".spz", ".sog", ".splat", ".glb")

_OPEN: dict[str, Callable[[Path], SplatSource]] = {
    ".spz": open_spz,
    ".sog": open_sog,
    ".splat": open_splat_rows,
    ".ksplat": open_ksplat,
    ".glb": open_splat_gltf,
    ".ckpt": open_splatfacto,
}
_WRITE: dict[str, tuple[Callable[[Path, SplatTable, OnProgress], None], Axes]] = {
    ".ply": (write_splat_ply, PLY),
    ".compressed.ply": (write_compressed_ply, PLY),
    ".spz": (write_spz, SPZ_AXES),
    ".sog": (write_sog, PLY),
    ".splat": (write_splat_rows, PLY),
    ".glb": (write_splat_gltf, GLTF_AXES),
}

_MOST_DEGREE = {".compressed.ply": 3, ".sog": 3, ".glb": 3, ".splat": 0}
"""Degree of the harmonics that a format can hold, where it is less than what a field can."""


def ending_of(path: Path) -> str:
    """The ending that says a file's format, such as ".compressed.ply"; "" where it is none of them."""
    name = path.name.lower()
    if path.is_dir() or name == META:
        return META
    return max((ending for ending in READABLE if name.endswith(ending)), key=len, default="")


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
    for batch in _batches(source, found, axes):
        parts = (batch.means, batch.log_scales, batch.quaternions, batch.opacities, batch.sh)
        for array, part in zip(arrays, parts, strict=True):
            array[done : done + len(batch)] = part
        done += len(batch)
        on_progress(done / count)
    for array in arrays:
        array.setflags(write=False)  # a field copies what may be written to
    means, log_scales, quaternions, opacities, sh = (array[:done] for array in arrays)
    return SplatField(
        means, log_scales, quaternions, opacities, sh, antialiased=source.antialiased, discs=source.discs
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
    with spooled(
        found, _batches(found, found.batches(), axes), degree, lambda share: on_progress(0.4 * share)
    ) as table:
        rest: OnProgress = lambda share: on_progress(0.4 + 0.6 * share)  # noqa: E731
        return table.count, _write(table, Path(target), target_axes, rest, spz_version)


def open_splats(path: Path) -> SplatSource:
    """The open file of splats; its values are read when its batches are.

    Raises:
        FieldError: no such file, a format that is not known, a file that is damaged.
    """
    if not path.exists():
        raise FieldError(f"{path}: no such file; give a file of splats ({', '.join(READABLE[:-1])})")
    ending = ending_of(path)
    if ending == META:
        return open_sog(path)
    try:
        check_regular(path)
    except OSError as error:
        raise FieldError(f"{path}: cannot be read ({error.strerror or error})") from None
    if ending.endswith(".ply"):
        _, tables = open_ply(path)
        packed = "vertex" in tables and "packed_position" in tables["vertex"].columns
        return (open_compressed_ply if packed else open_splat_ply)(path)
    if ending not in _OPEN:
        raise FieldError(f"{path}: no format of splats that is known; these are: {', '.join(READABLE)}")
    return _OPEN[ending](path)


def holds_splats(path: Path) -> bool:
    """Whether a file is one of splats, by its ending; a checkpoint, by what it holds."""
    ending = ending_of(path)
    return is_splatfacto(path) if ending == ".ckpt" else bool(ending)


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

    def batches(self) -> Iterator[SplatBatch]:
        return (self._of(batch) for batch in self.table.batches())

    def sorted_batches(self) -> Iterator[SplatBatch]:
        return (self._of(batch) for batch in self.table.sorted_batches())

    def _of(self, batch: SplatBatch) -> SplatBatch:
        kept = dataclasses.replace(batch, sh=batch.sh[:, : (self.sh_degree + 1) ** 2])
        return with_axes(kept, PLY, self.axes)
