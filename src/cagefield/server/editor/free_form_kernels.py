"""Kernels of the checks of free-form edits, loaded or compiled before the first drag of such an edit.

Compilation takes many seconds after an installation. Amid a drag it would stop the server's event loop, and
pages would lose their connection.
"""

from __future__ import annotations

import functools
from typing import Literal, TypeAlias

import numpy as np

from cagefield.edits import Edit
from cagefield.edits.operations import MovePoint
from cagefield.geometry.cage import Cage
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.server.editor.validity import problem

FreeForm: TypeAlias = Literal["lattice", "mesh"]
"""Kinds of inner cages whose checks have kernels of their own."""

_BOX_TRIANGLES = np.array(
    [
        *((0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4)),
        *((2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)),
    ]
)
"""Numbers [12,3] of a box's corners, counter-clockwise seen from outside."""


@functools.cache
def load_kernels(kind: FreeForm) -> None:
    """Has the kernels of a kind ready in this process, by checks of a small edit; once."""
    box = Cage.box((0.5, 0.5, 0.5), 1.0)
    inner = MeshCage(box.corners, _BOX_TRIANGLES) if kind == "mesh" else box.subdivided((2, 2, 2))
    edit = Edit.continuous(inner, box.grown(1.0), lattice=8)
    moved = MovePoint(0, (0.05, 0.02, 0.01))
    problem(edit.replace(operations=(moved,)))
    edit.safe_fraction(moved)
