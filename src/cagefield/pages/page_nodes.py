"""Levels of detail of splats for pages: nodes of nearby splats, each with a coarse stand-in.

Splats are cut along a Morton curve into nodes of at most NODE_SPLATS. A node's parent is its decimation
(`fields.splat_decimation`); all parents together are the coarse level, a file of `page_splats` whose header's
`nodes` list, in the order of the parents' splats,

    count   splats of the node
    coarse  [first, end) of the parent's splats in the coarse level
    bounds  [2,3], box of the means
    url, bytes   of the node's own file of `page_splats`, with the coarse file's center and steps

A page draws of each node the parent or the splats themselves, never both: the parent is hidden in the image
in which the node's splats appear. Nodes come in the order of their size in the camera's image.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import CagefieldError
from cagefield.fields.splat_decimation import decimate_splats
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.morton import morton_codes
from cagefield.pages.page_file import pack
from cagefield.pages.page_splats import (
    MAGIC,
    VERSION,
    coefficient_steps,
    encode_level,
    splat_header,
)

NODE_SPLATS = 65_536
"""Maximum number of splats of a node."""

COARSE_SPLATS = 60_000
"""Splats of the coarse level: about 1.2 MB of degree 0 and 2.9 MB of degree 3, 1 and 2.4 s at 10 Mbit/s."""

MIN_PARENT_SPLATS = 16
"""Minimum number of splats of a parent."""

NODE_NAME = "scene.node"
"""Beginning of the names of nodes' files."""


class NodeFiles(NamedTuple):
    """The coarse level's file, and the nodes' files by name."""

    coarse: bytes
    nodes: dict[str, bytes]


def encode_page_nodes(
    field: SplatField,
    *,
    background: tuple[float, float, float] | None = (1.0, 1.0, 1.0),
    coarse: int = COARSE_SPLATS,
    node: int = NODE_SPLATS,
    budget: int | None = None,
    on_progress: Callable[[float], None] = lambda done: None,
) -> NodeFiles:
    """Files of a field with levels of detail: about `coarse` splats, then nodes of at most `node` splats.

    A page holds at most `budget` splats at a time, the coarse ones too, if given: nodes that it has least
    recently shown give way to those in its image.

    Raises:
        CagefieldError: a field of no more than `coarse` splats, which needs no levels; one of discs; a budget
            without room for a node.
    """
    if field.discs:
        raise CagefieldError("the scene's splats are discs (2DGS), which pages do not draw")
    if len(field) <= coarse:
        raise CagefieldError(
            f"the scene has {len(field)} splats and a coarse level {coarse}; leave out --levels"
        )
    center, steps = field.center, coefficient_steps(field)
    parts = node_rows(field, node)
    share = max(MIN_PARENT_SPLATS, coarse // len(parts))
    parents, entries, files = [], [], {}
    first = 0
    for number, rows in enumerate(parts):
        splats = _rows_of(field, rows)
        parent = decimate_splats(splats, share)
        data = _file(splats, field, center, steps, background, {"count": len(rows)})
        name = f"{NODE_NAME}.{number:04d}"
        files[name] = data
        entries.append(
            {
                "count": len(rows),
                "coarse": [first, first + len(parent)],
                "bounds": [splats.means.min(axis=0).tolist(), splats.means.max(axis=0).tolist()],
                "url": f"{name}?{hashlib.sha256(data).hexdigest()[:12]}",
                "bytes": len(data),
            }
        )
        first += len(parent)
        parents.append(parent)
        on_progress((number + 1) / len(parts))
    together = _joined(parents, field)
    header: dict[str, Any] = {"count": first + len(field), "nodes": entries}
    if budget is not None:
        least = first + max(map(len, parts))
        if budget < least:
            raise CagefieldError(
                f"the budget is {budget} splats; give {least} at least: the coarse level and one node"
            )
        header["budget"] = budget
    return NodeFiles(_file(together, field, center, steps, background, header), files)


def node_rows(field: SplatField, node: int) -> list[NDArray[np.int64]]:
    """Rows of each node, at most `node` of them: consecutive ones along a Morton curve.

    The curve's cells are cubes, so that nodes of an elongated scene are compact.
    """
    low, high = field.means.min(axis=0), field.means.max(axis=0)
    codes = morton_codes(field.means, low, low + (high - low).max())
    order = np.argsort(codes, kind="stable")
    return np.array_split(order, -(-len(field) // node))


def _file(
    splats: SplatField,
    field: SplatField,
    center: NDArray[np.float64],
    steps: NDArray[np.float64],
    background: tuple[float, float, float] | None,
    values: dict[str, Any],
) -> bytes:
    """File of splats with the header of `field`, but for `values`."""
    rows = np.arange(len(splats))
    arrays = encode_level(splats, rows, splats.opacities, center, steps, field)
    header = splat_header(field, center, steps, background, [len(splats)])
    return pack(MAGIC, VERSION, {**header, **values}, {f"0.{name}": part for name, part in arrays.items()})


def _joined(parents: list[SplatField], field: SplatField) -> SplatField:
    """All parents as one field, one after the other."""
    arrays: dict[str, Any] = {
        name: np.concatenate([getattr(parent, name) for parent in parents]) for name in _COLUMNS
    }
    return replace(field, **arrays)


def _rows_of(field: SplatField, rows: NDArray[np.int64]) -> SplatField:
    arrays: dict[str, Any] = {name: getattr(field, name)[rows] for name in _COLUMNS}
    return replace(field, **arrays)


_COLUMNS = ("means", "log_scales", "quaternions", "opacities", "sh")
