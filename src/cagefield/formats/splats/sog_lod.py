"""Finest level of PlayCanvas' streamed SOG: a tree of levels of detail over several SOG files.

lod-meta.json: `filenames`, each a meta.json in its own folder or a .sog; `tree`, whose nodes have
`children`, or `lods`, the rows {file, offset, count} of a leaf by level (0 is the finest); `environment`, a
SOG of the surroundings, or null.

Source: playcanvas/splat-transform, src/lib/writers/write-lod.ts.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.errors import FieldError
from cagefield.files import json_text
from cagefield.files.safe_open import UnreadableError, read_text, real_path
from cagefield.formats.splats.axes import PLY_AXES
from cagefield.formats.splats.detection import LOD_META, META
from cagefield.formats.splats.sog import open_sog
from cagefield.formats.splats.splat_table import SplatBatch, SplatSource

_MAX_META_BYTES = 64 << 20
_MAX_SPLATS = 1 << 31


@dataclass(frozen=True, eq=False)
class _File:
    """SOG file, and its rows to read as ascending half-open ranges."""

    path: Path
    ranges: tuple[tuple[int, int], ...]

    @property
    def count(self) -> int:
        return sum(last - first for first, last in self.ranges)


def open_sog_lod(path: Path) -> SplatSource:
    """Open finest level of a streamed SOG, from its folder or its lod-meta.json.

    Raises:
        FieldError: missing, damaged or inconsistent files.
    """
    folder = path if path.is_dir() else path.parent
    meta = folder / LOD_META if path.is_dir() else path
    try:
        return _source(path, folder, json_text.loads(read_text(meta, _MAX_META_BYTES)))
    except FieldError:
        raise
    except UnreadableError as error:
        raise FieldError(f"{path}: {error}") from None
    except KeyError as error:
        raise _damaged(path, f"it has no {error.args[0]!s:.60}") from None
    except (ValueError, TypeError, IndexError, AttributeError, OverflowError, OSError) as error:
        raise _damaged(path, " ".join(str(error).split())[:120] or type(error).__name__) from None


def _source(path: Path, folder: Path, meta: dict[str, Any]) -> SplatSource:
    names, (ranges, coarser) = meta["filenames"], _finest(meta["tree"])
    files = [
        _File(_inside(folder, names[number]), _disjoint(found)) for number, found in sorted(ranges.items())
    ]
    if len({file.path for file in files}) < len(files):
        raise ValueError("two of its files have one name")
    degree, antialiased = 0, False
    for file in files:
        source = open_sog(file.path)
        if file.ranges[-1][1] > source.count:
            raise ValueError(
                f"{file.path.parent.name} has {source.count} splats, {file.ranges[-1][1]} are named"
            )
        degree, antialiased = max(degree, source.sh_degree), antialiased or source.antialiased
    if meta.get("environment"):
        around = _inside(folder, meta["environment"])
        source = open_sog(around)
        files.append(_File(around, ((0, source.count),)))
        degree = max(degree, source.sh_degree)
    count = sum(file.count for file in files)
    if not 0 < count <= _MAX_SPLATS:
        raise ValueError(f"its finest level has {count} splats")
    if coarser:
        warnings.warn(
            f"{path}: the finest level is read, {count} splats; left out: {coarser} of coarser levels",
            stacklevel=3,
        )

    def batches() -> Iterator[SplatBatch]:
        for file in files:
            yield from _rows(file, degree)

    return SplatSource(path, count, degree, PLY_AXES, batches, antialiased)


def _finest(tree: dict[str, Any]) -> tuple[dict[int, list[tuple[int, int]]], int]:
    """(row ranges of the finest level by file index, number of rows of other levels)."""
    ranges, coarser, pending = dict[int, list[tuple[int, int]]](), 0, [tree]
    while pending:
        node = pending.pop()
        pending.extend(node.get("children") or [])
        lods = {int(level): part for level, part in (node.get("lods") or {}).items()}
        for level, part in lods.items():
            number, offset, count = (int(part[name]) for name in ("file", "offset", "count"))
            if min(number, offset, count) < 0:
                raise ValueError(f"a leaf names {count} rows from {offset} on of file {number}")
            if level > min(lods):
                coarser += count
            elif count:
                ranges.setdefault(number, []).append((offset, offset + count))
    return ranges, coarser


def _disjoint(ranges: list[tuple[int, int]]) -> tuple[tuple[int, int], ...]:
    ranges = sorted(ranges)
    for (_, last), (first, _) in pairwise(ranges):
        if first < last:
            raise ValueError(f"two leaves share row {first} of a file")
    return tuple(ranges)


def _inside(folder: Path, name: Any) -> Path:
    """File of a relative name, within the folder."""
    if not isinstance(name, str):
        raise ValueError(f"{name!r:.60} is no name of a file")
    path = real_path(folder / name.replace("\\", "/"))
    if not path.is_relative_to(real_path(folder)):
        raise ValueError(f"{name:.60} lies in another folder")
    if path.is_dir():
        path = path / META
    if not path.is_file():
        raise ValueError(f"it lacks {name:.80}, put it beside")
    return path


def _rows(file: _File, degree: int) -> Iterator[SplatBatch]:
    """Batches of a file's ranges, with harmonics up to a degree."""
    at = 0
    for batch in open_sog(file.path).batches():
        keep = np.zeros(len(batch), np.bool_)
        for first, last in file.ranges:
            keep[max(first - at, 0) : max(last - at, 0)] = True
        at += len(batch)
        yield (batch if keep.all() else batch.take(keep)).pad_harmonics(degree)


def _damaged(path: Path, why: str) -> FieldError:
    return FieldError(f"{path}: no streamed SOG that can be read: {why}; copy or export it again")
