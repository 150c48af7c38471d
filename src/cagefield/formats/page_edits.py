"""An edit stack as the page's GPU evaluates it: numbers of the edits, their lattices, the deformed occupancy.

    rows       [44 E + 2 B, 4] float32. Of each edit 8 rows, its numbers in `warps.packing`:
                   box's min, first | box's max, last | lattice's origin, nodes an axis |
                   to nodes, row 0, continuous | row 1, simple | row 2 | node box's min, first node | max
               and the hexahedra 0 and 1, 18 rows each: W (its first w is the affine flag), c, the box of y,
               the bend [4,3], the image [8,3]. Then min and max of the boxes outside which nothing changes.
    lattice    [2, 3 N] uint8, low and high bytes of float16 displacements in world units, of all lattices
    occupancy  [bx, by, bz] uint16, codes of the deformed field (`rendering.occupancy`), from `origin` on

Inner cages are exact. Shells are lattices: an edit whose shell is evaluated exactly gets one of LATTICE nodes
an axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.edits import EditStack
from cagefield.edits.edit import Edit
from cagefield.errors import EditError
from cagefield.formats.page_file import byte_planes, pack
from cagefield.rendering.renderer import Renderer
from cagefield.typing import Float32
from cagefield.warps import packing as row_layout
from cagefield.warps.device_stack import DeviceStack

MAGIC, VERSION = b"cageedit", 1

LATTICE = 64
"""Nodes an axis of the lattices of edits that have none: 1.5 MB of halves."""

ROWS, MOST_ROWS = 44, 1024
"""Rows of an edit, and those of the shader's 16 KiB of uniforms, which every WebGL2 has."""


def for_pages(edits: EditStack) -> EditStack:
    """The stack with a lattice in each continuous edit's shell."""
    return EditStack(
        edit.replace(lattice=LATTICE) if edit.adjustment == "continuous" and edit.lattice is None else edit
        for edit in edits
    )


def encode_page_edits(renderer: Renderer) -> bytes:
    """The file of a renderer's edits, whose shells must be lattices (`for_pages`), and of their occupancy.

    Raises EditError for a shell without a lattice, and for more edits than the page's shader holds.
    """
    edits = renderer.edits.active
    stack = DeviceStack.from_stack(renderer.edits)
    occupancy = renderer.occupancy
    header = {
        "edits": len(edits),
        "boxes": len(stack.boxes) if edits else 0,
        "preserve_opacity": renderer.preserve_opacity,
        "origin": occupancy.origin.tolist(),
        "dims": list(occupancy.codes.shape),
    }
    arrays: dict[str, NDArray[Any]] = {
        "rows": page_rows(edits, stack),
        "lattice": byte_planes(stack.lattice.reshape(-1).astype(np.float16)),
        "occupancy": occupancy.codes.astype(np.uint16),
    }
    return pack(MAGIC, VERSION, header, arrays)


def page_rows(edits: Sequence[Edit], stack: DeviceStack) -> Float32:
    """The rows [ROWS E + 2 B, 4] of a stack's active edits, packed in `stack`. Raises EditError as above."""
    boxes = stack.boxes if edits else np.zeros((0, 2, 3), np.float32)
    if ROWS * len(edits) + 2 * len(boxes) > MOST_ROWS:
        raise EditError(
            f"{len(edits)} edits are more than a page's GPU takes; let the server draw, or bake some"
        )
    rows = [_rows(edit, row) for edit, row in zip(edits, stack.params, strict=False)]
    ends = np.zeros((2 * len(boxes), 4), np.float32)
    ends[:, :3] = boxes.reshape(-1, 3)
    return np.concatenate([*rows, ends])


def _rows(edit: Edit, row: NDArray[np.float32]) -> Float32:
    """The rows [ROWS,4] of an edit from its row of `warps.packing`."""
    p = row_layout
    if row[p.CONTINUOUS] > 0.5 and row[p.RESOLUTION] < 1.0:
        raise EditError(f'edit "{edit.name}" has no lattice; a page draws shells from lattices (`for_pages`)')
    out = np.zeros((ROWS, 4), np.float32)
    out[0:2, :3] = row[p.BOX : p.BOX + 6].reshape(2, 3)
    out[2:6, :3] = row[p.TO_NODES : p.TO_NODES + 12].reshape(4, 3)
    out[6:8, :3] = row[p.NODE_BOX : p.NODE_BOX + 6].reshape(2, 3)
    first_node = 65536.0 * row[p.OFFSET] + row[p.OFFSET + 1]
    out[:7, 3] = (
        row[p.FIRST], row[p.LAST], row[p.RESOLUTION], row[p.CONTINUOUS], row[p.SIMPLE], 0.0, first_node,
    )  # fmt: skip
    for number in range(2):
        record = row[p.RECORDS + number * p.RECORD : p.RECORDS + (number + 1) * p.RECORD]
        at = 8 + 18 * number
        out[at : at + 18, :3] = record[p.MATRIX : p.RECORD].reshape(18, 3)
        out[at, 3] = record[p.AFFINE]
    return out
