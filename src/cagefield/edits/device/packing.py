"""An edit as a row of float32 numbers, which kernels read.

Its regions are hexahedra, each a record of `RECORD` numbers: an affine flag; W [3,3] and c [3] with
y = W (p - c); the box of the hexahedron in y; the bend K [4,3] of
y = xi + K0 xi eta + K1 xi zeta + K2 eta zeta + K3 xi eta zeta, xi in [-1,1]^3; and the monomial coefficients
C [8,3] of its image in canonical space (see `cagefield.geometry.hexahedron`). Records: 0 is V with its image
V^c,
1 is V^o for a continuous edit and the region of a discrete one (V^c, or larger), 2 to 7 are the sides of the
trilinear shell.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cagefield.edits.grade import Grade
from cagefield.edits.grade_falloff import GradeFalloff
from cagefield.errors import EditError
from cagefield.geometry import hexahedron
from cagefield.typing import Array
from cagefield.warps import Warp
from cagefield.warps.continuous import ContinuousWarp
from cagefield.warps.discrete import DiscreteWarp
from cagefield.warps.flow_shell import FlowShell
from cagefield.warps.trilinear_shell import TrilinearShell

# Columns.
CHANGED_BOX = 0  # min, max of the deformed-space box outside which the edit changes nothing
FIRST, LAST = 6, 7  # records that are tried, in order: first <= record < last
CONTINUOUS = 8  # 1, or 0 for a discrete edit
RESOLUTION = 9  # lattice nodes per axis; 0 evaluates the shell exactly, -1 (`FLOW`) a flow shell by its table
FLOW = -1.0
OFFSET = 10  # first lattice node, or table's entry, as 65536 * [10] + [11]: a float32 counts to 2^24 only
TO_NODES = 12  # origin [3] and matrix [3,3] of the lattice, node units
NODE_BOX = 24  # min, max of the outer cage in node units, where it is a parallelepiped
SIMPLE = 30  # 1 where V, if it has a record, and V^o are parallelepipeds, phi is affine, the shell a lattice
ALONE = 31  # 1 where all that the edit moves is read at one place beneath it, `BASE_PLACE`
UNDER_PLACE = 32  # where samples of a discrete edit's region are read: `EMPTY_PLACE`, or the place of a layer
PART_PLACE = (
    33  # where samples of V are read: 0, the field as the earlier edits make it, or the place of a layer
)
RECORDS = 34
EMPTY_PLACE = -1.0  # a place without density
AFFINE, MATRIX, CENTER, LOW, HIGH, BEND, IMAGE, RECORD = 0, 1, 10, 13, 16, 19, 31, 55
GRADED = RECORDS + 8 * RECORD  # 1 where the edit grades colors, see `edits.grade`
GRADE_MATRIX = GRADED + 1  # M [3,3]
GRADE_DENSITY = GRADED + 10  # factor of density at weight 1
GRADE_INNER = GRADED + 11  # frame [4,3] of the inner cage of a `GradeFalloff`, of a continuous edit
GRADE_OUTER = GRADED + 23  # frame [4,3] of the outer cage
STILL = GRADED + 35  # 1 where the map is the identity: an edit that grades and moves nothing
IS_CUT = GRADED + 36  # 1 for a discrete edit but that of a light, and where one may move its samples on
BASE_PLACE = (
    GRADED + 37
)  # 0 where no earlier edit reaches what the edit moves, or the place of the region that holds all of it
WIDTH = GRADED + 38

EDGE = 1e-6
"""A sample counts as inside a hexahedron when its xi is within this of [-1,1]^3: rounding in float32."""

BOX_SLACK = 1e-5
"""Boxes are this share of their size larger than the edit, so that no float32 sample inside it is missed."""


def pack_warp(warp: Warp, boxes: Array, lattice: int | None = None) -> NDArray[np.float32]:
    """The row [WIDTH] of a map in `boxes` [B,2,3], but for the columns that depend on others in its stack.

    `lattice` is the resolution of the lattice from which a shell is interpolated, None evaluates it exactly.
    Raises `EditError` for a map without a kernel.
    """
    row = np.zeros(WIDTH, dtype=np.float32)
    row[CHANGED_BOX : CHANGED_BOX + 6] = widened(
        np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])[None]
    ).ravel()
    if isinstance(warp, DiscreteWarp):
        _pack_discrete(row, warp)
    elif isinstance(warp, ContinuousWarp):
        _pack_continuous(row, warp, lattice)
    else:
        raise EditError(f"a {type(warp).__name__} has no kernel")
    return row


def _pack_discrete(row: NDArray[np.float32], warp: DiscreteWarp) -> None:
    row[FIRST], row[LAST] = int(warp.inner is None), 1 if warp.region is None else 2
    row[UNDER_PLACE] = EMPTY_PLACE
    if warp.inner is not None:
        _record(row, 0, warp.inner.deformed.corners, warp.inner.onto)
    _record(row, 1, (warp.region or warp.source).corners)


def _pack_continuous(row: NDArray[np.float32], warp: ContinuousWarp, lattice: int | None) -> None:
    row[FIRST], row[LAST], row[CONTINUOUS] = int(warp.hexahedra is None), 2, 1
    if warp.hexahedra is not None:
        _record(row, 0, warp.hexahedra.deformed.corners, warp.hexahedra.canonical.corners)
    _record(row, 1, warp.outer.corners)
    if isinstance(warp.shell, TrilinearShell):
        row[LAST] = 8
        for n in range(6):
            _record(row, 2 + n, warp.shell.deformed_hexahedra[n], warp.shell.canonical_hexahedra[n])
    elif not isinstance(warp.shell, FlowShell) and lattice is None:
        raise EditError(f"a {type(warp.shell).__name__} has no kernel; set a lattice")
    origin, frame = warp.outer.frame
    row[TO_NODES : TO_NODES + 3] = origin
    if lattice is not None:
        row[TO_NODES + 3 : TO_NODES + 12] = ((lattice - 1) * np.linalg.inv(frame)).ravel()
        row[RESOLUTION] = lattice
        row[NODE_BOX : NODE_BOX + 3] = -EDGE * lattice
        row[NODE_BOX + 3 : NODE_BOX + 6] = lattice - 1 + EDGE * lattice
        is_straight = warp.hexahedra is None or row[RECORDS + AFFINE] == 1.0
        row[SIMPLE] = is_straight and warp.outer.is_affine
    elif isinstance(warp.shell, FlowShell):
        row[RESOLUTION] = FLOW


def pack_grade(row: NDArray[np.float32], grade: Grade, falloff: GradeFalloff | None) -> None:
    """Write the grade of an edit into its row, with the falloff of a continuous one."""
    if grade.is_neutral:
        return
    row[GRADED] = 1.0
    row[GRADE_MATRIX : GRADE_MATRIX + 9] = grade.matrix.ravel()
    row[GRADE_DENSITY] = grade.opacity
    if falloff is not None:
        row[GRADE_INNER : GRADE_INNER + 12] = falloff.inner.ravel()
        row[GRADE_OUTER : GRADE_OUTER + 12] = falloff.outer.ravel()


def _record(row: NDArray[np.float32], number: int, corners: Array, onto: Array | None = None) -> None:
    """Write the record of a hexahedron [8,3] and, if it has one, of its image [8,3]."""
    C = hexahedron.coefficients(corners)
    D = C if onto is None else hexahedron.coefficients(onto)
    W = hexahedron.center_inverse(C)
    bend = C[[3, 5, 6, 7]] @ W.T
    y = (corners - C[0]) @ W.T
    # Affine only where the image is, too: an affine record skips the image's bend.
    size = np.abs(D[[1, 2, 4]]).max()
    affine = np.abs(bend).max() < 1e-7 and np.abs(D[[3, 5, 6, 7]]).max() < 1e-7 * size
    slack = 1e-5 * (y.max(axis=0) - y.min(axis=0))
    at = RECORDS + number * RECORD
    row[at : at + RECORD] = np.concatenate(
        [[affine], W.ravel(), C[0], y.min(axis=0) - slack, y.max(axis=0) + slack, bend.ravel(), D.ravel()]
    )


def widened(boxes: Array) -> Array:
    """Boxes [B,2,3] grown by the rounding error of float32 samples."""
    rounding = 1e-6 * np.abs(boxes).max(axis=(1, 2), initial=0.0)
    slack = BOX_SLACK * (boxes[:, 1] - boxes[:, 0]) + rounding[:, None]
    return np.stack([boxes[:, 0] - slack, boxes[:, 1] + slack], axis=1)
