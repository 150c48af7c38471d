"""Writer of splats as PlayCanvas' streamed SOG: levels of detail, cut into leaves that a viewer chooses from.

Level 0 has all splats. Each further level has a quarter of those of the level before, decimated leaf by leaf
(`fields.splat_decimation`), until a level has COARSE_SPLATS at most. Leaves come of halving the splats along
the longest side of their box. The splats of a leaf are consecutive rows, in Morton order, of one SOG of their
level; `sog_lod` documents lod-meta.json.

Source: playcanvas/splat-transform, src/lib/writers/write-lod.ts.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields.splat_decimation import decimate_splats
from cagefield.fields.splat_field import SplatField
from cagefield.files.atomic import recover_folder, replaced_folder
from cagefield.files.memory import memory_shortage
from cagefield.files.safe_open import real_path
from cagefield.formats.splats.detection import LOD_META, META
from cagefield.formats.splats.sog_writer import sog_files
from cagefield.formats.splats.splat_table import FieldTable, OnProgress, SplatBatch, SplatTable
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.typing import Array

LEAF_SPLATS = 65_536
"""Maximum number of splats of a leaf in the finest level."""

FILE_SPLATS = 262_144
"""Number of splats from which on a level goes on in another file."""

COARSE_SPLATS = 60_000
"""Maximum number of splats of the coarsest level, but for a splat of each leaf."""

LEVEL_FACTOR = 4
"""Ratio of the numbers of splats of two levels: half the spacing on a surface."""

COPIES = 3
"""Copies of all splats in memory: the field, its levels and a file."""

_COLUMNS = ("means", "log_scales", "quaternions", "opacities", "sh")


@dataclass
class _File:
    """A SOG of one level: leaves one after the other."""

    name: str
    leaves: list[SplatField] = field(default_factory=list)

    @property
    def count(self) -> int:
        return sum(map(len, self.leaves))


@dataclass(frozen=True, eq=False)
class _OrderedTable(FieldTable):
    """Splats whose order is that of the file."""

    def sorted_batches(self) -> Iterator[SplatBatch]:
        return self.batches()


def check_sog_lod(path: Path) -> None:
    """Passes where a streamed SOG may be written: `path` is a lod-meta.json in a folder of its own.

    Raises:
        FieldError: another name, the working folder, or a folder with other files and no streamed SOG.
    """
    if path.name != LOD_META:
        raise FieldError(f"{path}: the file of a streamed SOG is named {LOD_META}; give FOLDER/{LOD_META}")
    folder = real_path(path.parent)
    if folder == real_path(Path()):
        raise FieldError(
            f"{path}: a streamed SOG is a folder of files, which takes its place as a whole; "
            f"give NEW_FOLDER/{LOD_META}"
        )
    recover_folder(folder, lambda left: (left / LOD_META).is_file())
    if folder.is_dir() and any(folder.iterdir()) and not (folder / LOD_META).is_file():
        raise FieldError(
            f"{path}: a streamed SOG is a folder of files, and {path.parent} has others; "
            f"give NEW_FOLDER/{LOD_META}"
        )


def write_sog_lod(path: Path, table: SplatTable, on_progress: OnProgress = lambda _: None) -> None:
    """Write the splats as a streamed SOG: `path` is its lod-meta.json, beside it a folder for each file.

    The folder appears whole or not at all; other files of an older streamed SOG's folder stay. All splats are
    in memory.

    Raises:
        FieldError: as `check_sog_lod`, or more splats than memory holds.
    """
    check_sog_lod(path)
    floats = 11 + 3 * (table.sh_degree + 1) ** 2
    if (lacking := memory_shortage(4 * floats * COPIES * table.count)) is not None:
        raise FieldError(f"{path}: levels of {table.count} splats are too many: {lacking}")
    splats = _field_of(table)
    files: list[_File] = []
    leaves = leaf_rows(splats.means, LEAF_SPLATS)
    nodes: list[dict[str, Any]] = []
    levels = level_count(len(splats))
    for number, rows in enumerate(leaves):
        nodes.append(_leaf(splats, rows, levels, files))
        on_progress(0.6 * (number + 1) / len(leaves))
    counts = [sum(node["lods"][str(level)]["count"] for node in nodes) for level in range(levels)]
    meta = {
        "version": 1,
        "asset": {"generator": "cagefield"},
        "count": sum(counts),
        "counts": counts,
        "lodLevels": levels,
        "filenames": [f"{file.name}/{META}" for file in files],
        "tree": _tree(nodes),
    }
    folder = real_path(path.parent)
    former = [meta.parent.name for meta in folder.glob(f"[0-9]*_[0-9]*/{META}")]
    written = 0
    with replaced_folder(folder, [LOD_META, *former, *(file.name for file in files)]) as draft:
        (draft / LOD_META).write_text(json.dumps(meta), encoding="utf-8")
        for file in files:
            (draft / file.name).mkdir()
            joined = _joined(file.leaves, splats)
            for name, content in sog_files(_OrderedTable(joined)).items():
                (draft / file.name / name).write_bytes(content)
            written += len(joined)
            on_progress(0.6 + 0.4 * written / sum(counts))


def sog_lod_summary(path: Path) -> tuple[list[int], int]:
    """(number of splats of each level, bytes of all files) of a streamed SOG that was written at `path`."""
    meta = json.loads(path.read_text(encoding="utf-8"))
    files = [path, *(file for name in meta["filenames"] for file in (path.parent / name).parent.iterdir())]
    return meta["counts"], sum(file.stat().st_size for file in files)


def level_count(count: int) -> int:
    """Number of levels of detail of `count` splats."""
    levels = 1
    while count > COARSE_SPLATS:
        count, levels = count // LEVEL_FACTOR, levels + 1
    return levels


def leaf_rows(means: NDArray[np.float32], most: int) -> list[NDArray[np.int64]]:
    """Rows of each leaf of splats at means [N,3], at most `most` of them; neighbors in the list are near."""

    def halves(rows: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
        if len(rows) <= most:
            yield rows
            return
        points = means[rows]
        axis = int(np.argmax(points.max(axis=0) - points.min(axis=0)))
        order = np.argsort(points[:, axis], kind="stable")
        yield from halves(rows[order[: len(rows) // 2]])
        yield from halves(rows[order[len(rows) // 2 :]])

    return list(halves(np.arange(len(means))))


def _leaf(splats: SplatField, rows: NDArray[np.int64], levels: int, files: list[_File]) -> dict[str, Any]:
    """Node of a leaf, whose splats of each level are appended to the files."""
    part = splats.take(rows)
    lods: dict[str, dict[str, int]] = {}
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for level in range(levels):
        if level:
            part = decimate_splats(part, max(1, len(rows) // LEVEL_FACTOR**level))
        ordered = SplatField(**_columns(list(FieldTable(part).sorted_batches())))
        number = _open_file(files, level)
        lods[str(level)] = {"file": number, "offset": files[number].count, "count": len(part)}
        files[number].leaves.append(ordered)
        reach = _half_boxes(part)
        low = np.minimum(low, (part.means - reach).min(axis=0))
        high = np.maximum(high, (part.means + reach).max(axis=0))
    return {"bound": {"min": low.tolist(), "max": high.tolist()}, "lods": lods}


def _open_file(files: list[_File], level: int) -> int:
    """Index of the level's file that has room; a new one where none has."""
    own = [number for number, file in enumerate(files) if file.name.startswith(f"{level}_")]
    if own and files[own[-1]].count < FILE_SPLATS:
        return own[-1]
    files.append(_File(f"{level}_{len(own)}"))
    return len(files) - 1


def _tree(nodes: list[dict[str, Any]]) -> dict[str, Any]:
    """Binary tree over leaves whose order is one of space."""
    if len(nodes) == 1:
        return nodes[0]
    children = [_tree(nodes[: len(nodes) // 2]), _tree(nodes[len(nodes) // 2 :])]
    bounds = [child["bound"] for child in children]
    low = np.min([bound["min"] for bound in bounds], axis=0).tolist()
    high = np.max([bound["max"] for bound in bounds], axis=0).tolist()
    return {"bound": {"min": low, "max": high}, "children": children}


def _half_boxes(splats: SplatField) -> Array:
    """Half the sides [N,3] of the boxes around the ellipsoids of one standard deviation."""
    axes = rotation_matrices(splats.quaternions.astype(np.float64))
    scaled = axes * np.exp(splats.log_scales.astype(np.float64))[:, None, :]
    return np.asarray(np.sqrt((scaled**2).sum(axis=2)))


def _field_of(table: SplatTable) -> SplatField:
    """All splats of a table."""
    return SplatField(**_columns(list(table.batches())), antialiased=table.antialiased)


def _columns(batches: list[SplatBatch]) -> dict[str, Any]:
    return {name: np.concatenate([getattr(batch, name) for batch in batches]) for name in _COLUMNS}


def _joined(leaves: list[SplatField], whole: SplatField) -> SplatField:
    """Splats of leaves, one after the other."""
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(leaf, name) for leaf in leaves]) for name in _COLUMNS
    }
    return SplatField(**columns, antialiased=whole.antialiased)
