"""Batches of splats between readers and writers, so that a file never has to fit in memory.

Units and axes of a table are those of 3DGS' PLY: log scales, quaternions (w, x, y, z), opacities in [0, 1],
harmonics [n, (degree+1)^2, 3], x right, y down, z forward (see `axes`).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields.splat_field import NO_OFFSET, Offset, SplatField
from cagefield.files.temporary_folders import TemporaryFolder
from cagefield.formats.splats.morton import morton_codes
from cagefield.typing import AnyArray, Float32

BATCH_SPLATS = 1 << 18
"""Number of splats per batch."""

MIN_VISIBLE_OPACITY = 0.02
"""Minimum opacity of a visible splat; files without visible splats are refused."""

MIN_LOG_SCALE, MAX_LOG_SCALE = -30.0, 30.0
"""Limits of log scales: smaller ones are clamped, splats with larger ones are invalid."""

OnProgress = Callable[[float], None]
_SHAPE_FLOATS = 11
"""Floats of a splat beside its harmonics."""


@dataclass(frozen=True, eq=False)
class SplatBatch:
    """Batch of splats: means [n,3], log scales [n,3], quaternions [n,4], opacities [n], sh [n,K,3]."""

    means: AnyArray
    log_scales: AnyArray
    quaternions: AnyArray
    opacities: AnyArray
    sh: AnyArray

    def __len__(self) -> int:
        return len(self.means)

    def to_rows(self) -> Float32:
        """Splats as rows [n, 11 + 3K]."""
        parts = (self.means, self.log_scales, self.quaternions, self.opacities[:, None])
        return np.concatenate(
            [*(part.astype(np.float32) for part in parts), self.sh.reshape(len(self), -1)],
            axis=1,
            dtype=np.float32,
        )

    @classmethod
    def from_rows(cls, rows: Float32) -> SplatBatch:
        """Splats of rows [n, 11 + 3K]."""
        sh = rows[:, _SHAPE_FLOATS:].reshape(len(rows), -1, 3)
        return cls(rows[:, :3], rows[:, 3:6], rows[:, 6:10], rows[:, 10], sh)

    def take(self, index: AnyArray | slice) -> SplatBatch:
        """Splats of an index or a mask."""
        return SplatBatch(*(getattr(self, name)[index] for name in self.__dataclass_fields__))

    def pad_harmonics(self, sh_degree: int) -> SplatBatch:
        """Splats with harmonics up to a degree, padded with 0."""
        lacking = (sh_degree + 1) ** 2 - self.sh.shape[1]
        return replace(self, sh=np.pad(self.sh, ((0, 0), (0, lacking), (0, 0)))) if lacking else self


@dataclass(frozen=True)
class SplatSource:
    """Open splat file; each call of `batches` iterates over its splats from the start.

    `axes` are stated by the file or prescribed by its format. `end` is the offset of the first unread byte,
    None where unknown. `is_double`: coordinates exceed the precision of float32.
    """

    path: Path
    count: int
    sh_degree: int
    axes: str
    batches: Callable[[], Iterator[SplatBatch]]
    antialiased: bool = False
    discs: bool = False
    end: int | None = None
    is_double: bool = False


class SplatTable(Protocol):
    """Splats that a writer may iterate over repeatedly."""

    @property
    def count(self) -> int: ...
    @property
    def sh_degree(self) -> int: ...
    @property
    def antialiased(self) -> bool: ...
    @property
    def discs(self) -> bool: ...
    @property
    def offset(self) -> Offset:
        """Difference between the source file's coordinates and those of `batches`."""

    def batches(self) -> Iterator[SplatBatch]:
        """Batches in the stored order."""

    def sorted_batches(self) -> Iterator[SplatBatch]:
        """Batches in Morton order, in which neighbors have similar values."""


@dataclass(frozen=True, eq=False)
class FieldTable:
    """Splats of a field."""

    field: SplatField

    @property
    def count(self) -> int:
        return len(self.field)

    @property
    def sh_degree(self) -> int:
        return self.field.sh_degree

    @property
    def antialiased(self) -> bool:
        return self.field.antialiased

    @property
    def discs(self) -> bool:
        return self.field.discs

    @property
    def offset(self) -> Offset:
        return self.field.offset

    def batches(self) -> Iterator[SplatBatch]:
        return self._in_order(None)

    def sorted_batches(self) -> Iterator[SplatBatch]:
        means = self.field.means
        return self._in_order(np.argsort(morton_codes(means, means.min(axis=0), means.max(axis=0))))

    def _in_order(self, order: NDArray[np.int64] | None) -> Iterator[SplatBatch]:
        f = self.field
        whole = SplatBatch(f.means, f.log_scales, f.quaternions, f.opacities, f.sh)
        for first in range(0, self.count, BATCH_SPLATS):
            rows_of_batch = slice(first, first + BATCH_SPLATS)
            yield whole.take(rows_of_batch if order is None else order[rows_of_batch])


class Spool:
    """Splats in a temporary file, row by row, so that memory does not grow with their number."""

    def __init__(
        self, folder: Path, sh_degree: int, antialiased: bool, discs: bool = False, offset: Offset = NO_OFFSET
    ) -> None:
        self.sh_degree, self.antialiased, self.discs = sh_degree, antialiased, discs
        self.offset = offset
        self.count = 0
        self._folder, self._path = folder, folder / "splats"
        self._width = _SHAPE_FLOATS + 3 * (sh_degree + 1) ** 2
        self._low, self._high = np.full(3, np.inf), np.full(3, -np.inf)
        self._out = self._path.open("wb")

    def append(self, batch: SplatBatch) -> None:
        """Append a batch."""
        if len(batch):
            self._out.write(batch.to_rows().tobytes())
            self.count += len(batch)
            self._low = np.minimum(self._low, batch.means.min(axis=0))
            self._high = np.maximum(self._high, batch.means.max(axis=0))

    def batches(self) -> Iterator[SplatBatch]:
        self._out.flush()
        return (SplatBatch.from_rows(rows) for rows in self._rows(self._path))

    def sorted_batches(self) -> Iterator[SplatBatch]:
        """Batches in Morton order: partitioned into files of about BATCH_SPLATS splats, each then sorted."""
        self._out.flush()
        codes = np.concatenate([self._codes(rows) for rows in self._rows(self._path)])
        parts = -(-self.count // BATCH_SPLATS)
        codes.sort()
        edges = codes[np.arange(1, parts) * self.count // parts]
        del codes
        files = [(self._folder / f"part{n}").open("w+b") for n in range(parts)]
        try:
            for rows in self._rows(self._path):
                part = np.searchsorted(edges, self._codes(rows), side="right")
                for n in np.unique(part):
                    files[n].write(rows[part == n].tobytes())
            for file in files:
                file.seek(0)
                rows = np.frombuffer(file.read(), np.float32).reshape(-1, self._width)
                file.truncate(0)
                rows = rows[np.argsort(self._codes(rows), kind="stable")]
                for first in range(0, len(rows), BATCH_SPLATS):
                    yield SplatBatch.from_rows(rows[first : first + BATCH_SPLATS])
        finally:
            for file in files:
                file.close()

    def close(self) -> None:
        """Close the file for writing."""
        self._out.close()

    def _codes(self, rows: Float32) -> NDArray[np.uint64]:
        return morton_codes(rows[:, :3], self._low, self._high)

    def _rows(self, path: Path) -> Iterator[Float32]:
        with path.open("rb") as file:
            while len(values := np.fromfile(file, np.float32, BATCH_SPLATS * self._width)):
                yield values.reshape(-1, self._width)


@contextmanager
def spool_splats(
    source: SplatSource,
    batches: Iterable[SplatBatch],
    sh_degree: int,
    on_progress: OnProgress,
    offset: Offset = NO_OFFSET,
) -> Iterator[Spool]:
    """Temporary file with the splats of the batches, removed at the end of the context."""
    with TemporaryFolder("splats") as folder:
        spool = Spool(folder, sh_degree, source.antialiased, source.discs, offset)
        try:
            for batch in batches:
                spool.append(batch)
                on_progress(spool.count / max(source.count, 1))
            yield spool
        finally:
            spool.close()


def drop_invalid(source: SplatSource, batches: Iterable[SplatBatch]) -> Iterator[SplatBatch]:
    """Valid splats of a file's batches; a warning counts the others.

    Raises:
        FieldError: no valid splat.
    """
    invalid = valid = clipped = 0
    for batch in batches:
        log_scales = np.maximum(batch.log_scales, MIN_LOG_SCALE)
        with np.errstate(over="ignore", invalid="ignore"):
            norm = np.linalg.norm(batch.quaternions.astype(np.float64), axis=1, keepdims=True)
            # Some programs write the identity as a quaternion of length 0.
            quaternions = np.where(
                norm > 0.0, batch.quaternions / np.maximum(norm, 1e-300), (1.0, 0.0, 0.0, 0.0)
            )
            keep: NDArray[np.bool_] = np.asarray((log_scales <= MAX_LOG_SCALE).all(axis=1))
            for values in (batch.means, log_scales, quaternions, batch.opacities, batch.sh):
                finite = np.isfinite(values.astype(np.float32))
                keep &= finite.all(axis=tuple(range(1, values.ndim)))
        opacities = np.clip(batch.opacities, 0.0, 1.0)
        clipped += int((keep & (opacities != batch.opacities)).sum())
        cleaned_batch = SplatBatch(batch.means, log_scales, quaternions, opacities, batch.sh)
        invalid, valid = invalid + int((~keep).sum()), valid + int(keep.sum())
        yield cleaned_batch if keep.all() else cleaned_batch.take(keep)
    if not valid:
        raise FieldError(f"{source.path}: it holds no splat that can be shown; export the file again")
    if invalid:
        warnings.warn(
            f"{source.path}: {invalid} of {invalid + valid} splats hold no numbers and are left out",
            stacklevel=2,
        )
    if clipped:
        warnings.warn(
            f"{source.path}: {clipped} of {valid} opacities lie outside [0, 1] and are clipped", stacklevel=2
        )
