"""An edit stack as the page's GPU evaluates it: numbers of the edits, their lattices, the deformed occupancy.

    rows        [EDIT_ROWS E + 2 B, 4] float32, the numbers of each edit in `edits.device.packing`, in the
                layout of `row_layout`. Then min and max of the boxes outside which nothing changes.
    lattice.N   [2, 3 R^3] uint8, low and high bytes of float16 displacements in world units, of lattice N
    layer.N.*   the arrays of layer N (`page_layers`), of those that the edits' patches have
    occupancy   [bx, by, bz] uint16, codes of the deformed field (`rendering.voxels.occupancy`), from
    `origin` on

Inner cages are exact. Shells are lattices: an edit whose shell is evaluated exactly gets one of LATTICE nodes
an axis, and finer ones than FINEST_LATTICE are made that coarse. In the GPU's texture every lattice begins at
a multiple of NODES_PER_TEXTURE_ROW nodes, so that one can be uploaded without the others.

The header names lattices, layers and the occupancy by keys, digests of their content. A file for a page that
has some of them already leaves those out; of an occupancy whose grid the page has, it holds the part that
changed, which `part` says: the key of the one before, and the part's first brick.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.weak_memo import memoized_weakly
from cagefield.edits import Continuous, Edit, PreparedEdit, PreparedStack
from cagefield.edits.device import packing
from cagefield.edits.device_stack import DeviceStack
from cagefield.errors import EditError
from cagefield.pages import row_layout as layout
from cagefield.pages.page_file import LEVEL, byte_planes, pack
from cagefield.pages.page_layers import bricks_of, digest, encode_layer, layer_key
from cagefield.rendering.voxels.occupancy import Occupancy
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from cagefield.typing import Float32

MAGIC, VERSION = b"cageedit", 3

LATTICE = 64
"""Nodes an axis of the lattices of edits that have none: 1.5 MB of halves."""

FINEST_LATTICE = 128
"""Most nodes an axis of a lattice: 12 MB of halves."""


@dataclass(frozen=True)
class PageEdits:
    """A file of edits, and the keys of the layers that a page has after reading it."""

    data: bytes
    keys: tuple[str, ...] = ()
    """Of the lattices, the layers and, last, the occupancy."""
    occupancy: Occupancy | None = field(default=None, repr=False)


def for_page(edit: Edit) -> Edit:
    """The edit itself, or the same with a lattice in its shell that a page can have."""
    if not isinstance(edit, Continuous) or (edit.kernel_lattice or FINEST_LATTICE + 1) <= FINEST_LATTICE:
        return edit
    return edit.replace(lattice=LATTICE if edit.lattice is None else FINEST_LATTICE)


def for_pages(edits: PreparedStack) -> PreparedStack:
    """The stack with a lattice in each continuous edit's shell."""
    return PreparedStack(replace(step, edit=for_page(step.edit)) for step in edits)


def encode_page_edits(renderer: VoxelRenderer) -> bytes:
    """The file of a renderer's edits, whose shells must be lattices (`for_pages`), and of their occupancy.

    Raises EditError for a shell without a lattice, and for more edits than the page's shader holds.
    """
    return encode_changed_edits(renderer).data


def encode_changed_edits(
    renderer: VoxelRenderer,
    has: Collection[str] = (),
    occupancies: Mapping[str, Occupancy] | None = None,
    level: int = LEVEL,
) -> PageEdits:
    """File of edits for a page that already `has` the layers of some keys; `occupancies` are known ones by
    key.

    `level` is deflate's. Raises EditError as `encode_page_edits` does.
    """
    stack = DeviceStack.from_stack(renderer.edits)
    steps = renderer.edits.steps
    table = page_rows(steps, stack)
    lattices: list[dict[str, Any]] = []
    arrays: dict[str, NDArray[Any]] = {}
    for step in steps:
        if isinstance(step.edit, Continuous):
            nodes, key = step.edit.lattice_nodes, _lattice_key(step.edit)
            if key not in has and all(key != before["key"] for before in lattices):
                arrays[f"lattice.{len(lattices)}"] = byte_planes(nodes.reshape(-1).astype(np.float16))
            lattices.append({"key": key, "nodes": len(nodes)})
    layers: list[dict[str, Any]] = []
    for layer, place in zip(renderer.edits.layers, renderer.edits.places, strict=True):
        key = layer_key(layer)
        if key not in has and all(key != before["key"] for before in layers):
            arrays.update(encode_layer(layer, renderer.field, f"layer.{len(layers)}"))
        layers.append({"key": key, **bricks_of(layer, place)})
    occupancy, codes = _occupancy(renderer.occupancy, has, occupancies or {})
    header = {
        "edits": len(steps),
        "boxes": len(stack.boxes) if steps else 0,
        "preserve_opacity": renderer.preserve_opacity,
        "lattices": lattices,
        "layers": layers,
        "occupancy": occupancy,
    }
    arrays = {"rows": table, **arrays}
    if codes is not None:
        arrays["occupancy"] = codes.astype(np.uint16)
    keys = (*(str(each["key"]) for each in (*lattices, *layers)), str(occupancy["key"]))
    return PageEdits(pack(MAGIC, VERSION, header, arrays, level), keys, renderer.occupancy)


def page_rows(edits: Sequence[PreparedEdit], stack: DeviceStack) -> Float32:
    """The rows [EDIT_ROWS E + 2 B, 4] of a stack's active edits, packed in `stack`.

    Raises EditError as `encode_page_edits` does.
    """
    boxes = stack.boxes if edits else np.zeros((0, 2, 3), np.float32)
    if layout.EDIT_ROWS * len(edits) + layout.BOX_ROWS * len(boxes) > layout.MAX_ROWS:
        raise EditError(
            f"{len(edits)} edits are more than a page's GPU takes; let the server draw, or bake some"
        )
    rows, first = [], 0
    for step, row in zip(edits, stack.params, strict=False):
        rows.append(_rows(step.edit, row, first))
        if row[packing.CONTINUOUS] > 0.5:
            nodes = round(float(row[packing.RESOLUTION])) ** 3
            first += -(-nodes // layout.NODES_PER_TEXTURE_ROW) * layout.NODES_PER_TEXTURE_ROW
    ends = np.zeros((layout.BOX_ROWS * len(boxes), 4), np.float32)
    ends[:, :3] = boxes.reshape(-1, 3)
    return np.concatenate([*rows, ends])


def _occupancy(
    occupancy: Occupancy, has: Collection[str], known: Mapping[str, Occupancy]
) -> tuple[dict[str, Any], NDArray[np.int32] | None]:
    """The header of an occupancy, and its codes, or the part of them that a page has to be sent."""
    codes, origin = occupancy.codes, [int(n) for n in occupancy.origin]
    key = digest(np.asarray([*origin, *codes.shape], np.int64), codes)
    header: dict[str, Any] = {"key": key, "origin": origin, "dims": list(codes.shape), "part": None}
    if key in has:
        return header, None
    for name, before in known.items():
        same_grid = before.codes.shape == codes.shape and (before.origin == occupancy.origin).all()
        if name not in has or not same_grid:
            continue
        changed = before.codes != codes
        spans = []
        for axis in range(3):
            along = np.flatnonzero(changed.any(axis=tuple(a for a in range(3) if a != axis)))
            spans.append(slice(int(along[0]), int(along[-1]) + 1))
        part = codes[tuple(spans)]
        low = [span.start for span in spans]
        return header | {"part": {"of": name, "low": low, "dims": list(part.shape)}}, part
    return header, codes


@memoized_weakly
def _lattice_key(edit: Continuous) -> str:
    """Key of an edit's lattice: the digest of its nodes."""
    return digest(edit.lattice_nodes)


def _rows(edit: Edit, row: NDArray[np.float32], first_node: int) -> Float32:
    """The rows [EDIT_ROWS,4] of an edit: `row` is its row of `edits.device.packing`, `first_node` the first
    node of its lattice.
    """
    p, at = packing, layout
    if row[p.CONTINUOUS] > 0.5 and row[p.RESOLUTION] < 1.0:
        raise EditError(f'edit "{edit.name}" has no lattice; a page draws shells from lattices (`for_pages`)')
    out = np.zeros((at.EDIT_ROWS, 4), np.float32)
    for first, column, count in (
        (at.BOX_VECTOR, p.CHANGED_BOX, 2),
        (at.LATTICE_VECTOR, p.TO_NODES, 1),
        (at.TO_NODES_VECTOR, p.TO_NODES + 3, 3),
        (at.NODE_BOX_VECTOR, p.NODE_BOX, 2),
    ):
        out[first : first + count, :3] = row[column : column + 3 * count].reshape(count, 3)
    for scalar, value in (
        (at.FIRST_SCALAR, row[p.FIRST]),
        (at.LAST_SCALAR, row[p.LAST]),
        (at.RESOLUTION_SCALAR, row[p.RESOLUTION]),
        (at.CONTINUOUS_SCALAR, row[p.CONTINUOUS]),
        # The page's short way looks for V first.
        (at.SIMPLE_SCALAR, float(row[p.SIMPLE] > 0.5 and row[p.FIRST] < 0.5)),
        (at.UNDER_SCALAR, row[p.UNDER_PLACE]),
        (at.NODE_SCALAR, first_node),
        (at.PART_SCALAR, row[p.PART_PLACE]),
    ):
        out[scalar, 3] = value
    if row[p.GRADED] > 0.5:
        grade = np.concatenate(
            [
                row[p.GRADE_MATRIX : p.GRADE_MATRIX + 9],
                [row[p.GRADE_DENSITY] + 1.0],
                row[p.GRADE_INNER : p.GRADE_INNER + 24],
            ]
        )
        k = np.arange(at.GRADE_COUNT)
        out[at.GRADE_SCALARS + k + (k >= at.GRADE_FIRST_PART), 3] = grade
    for number in range(2):
        record = row[p.RECORDS + number * p.RECORD : p.RECORDS + (number + 1) * p.RECORD]
        first = at.HEXAHEDRON + number * at.HEXAHEDRON_ROWS
        for vector, column, count in (
            (at.MATRIX_VECTOR, p.MATRIX, 3),
            (at.CENTER_VECTOR, p.CENTER, 1),
            (at.Y_BOX_VECTOR, p.LOW, 2),
            (at.BEND_VECTOR, p.BEND, 4),
            (at.IMAGE_VECTOR, p.IMAGE, 8),
        ):
            vectors = record[column : column + 3 * count].reshape(count, 3)
            out[first + vector : first + vector + count, :3] = vectors
        out[first + at.AFFINE_SCALAR, 3] = record[p.AFFINE]
    return out
