"""Where cages go by themselves: around a point of a surface, around dense content, around each other."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from cagefield.edits import Edit
from cagefield.errors import EditError
from cagefield.geometry import hexahedron
from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Mask

INNER_CAGE_VIEW_SHARE = 0.22
"""Edge of a new inner cage, as a share of the picture's height at the surface's distance."""

OUTER_CAGE_MARGIN_SHARE = 0.6
"""Margin of a new outer cage, in edges of the inner one."""

PROBES_PER_AXIS = 40
"""Points along each axis of a cage at which the field is sampled to fit it."""


def cage_pair_around(point: Array, view_height: float, bounds: Array, voxel: float) -> tuple[Cage, Cage]:
    """(inner, outer) cages, cubes along the world's axes, around a point [3].

    `view_height` is the height of the view frustum at the point's distance, world units; the edge is a share
    of it,
    not below 8 voxels and not above a third of the field's longest side.
    """
    longest = float((bounds[1] - bounds[0]).max())
    edge = min(max(INNER_CAGE_VIEW_SHARE * view_height, 8.0 * voxel), longest / 3.0)
    inner = Cage.box(point, edge)
    return inner, inner.grown(OUTER_CAGE_MARGIN_SHARE * edge)


def outer_cage_around(edit: Edit, margin: float) -> Cage:
    """The outer cage as a margin, world units, around the inner cage before and after its operations."""
    origin, edges = edit.inner.frame
    points = np.concatenate([edit.inner.corners, edit.deformed.corners])
    u = (points - origin) @ np.linalg.inv(edges).T
    low, high = u.min(axis=0), u.max(axis=0)
    size = high - low
    box = Cage(origin + edges @ low + (hexahedron.BITS * size) @ edges.T)
    return box.grown(margin)


def probes(cage: Cage) -> Array:
    """PROBES_PER_AXIS^3 points [N,3] of a cage, evenly spaced in its own coordinates, x fastest."""
    axis = (np.arange(PROBES_PER_AXIS) + 0.5) / PROBES_PER_AXIS
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    return hexahedron.points(cage.corners, np.stack([x, y, z], axis=-1).reshape(-1, 3))


def fit_to_content(cage: Cage, dense: Mask) -> Cage:
    """Smallest box in a cage around its `dense` probes [PROBES_PER_AXIS^3], with a margin of half a probe.

    Specks (pieces that touch nothing and have less than a fiftieth of the largest piece's probes) do not
    count.

    Raises EditError where nothing in the cage is dense.
    """
    grid = dense.reshape(PROBES_PER_AXIS, PROBES_PER_AXIS, PROBES_PER_AXIS)
    if not grid.any():
        raise EditError("there is nothing dense inside the inner cage to fit it to; move it over the object")
    labels, count = ndimage.label(grid, structure=np.ones((3, 3, 3)))
    sizes = np.bincount(labels.reshape(-1), minlength=count + 1)
    sizes[0] = 0
    kept = np.isin(labels, np.flatnonzero(sizes * 50 >= sizes.max()))
    kept &= grid
    low, high = np.empty(3), np.empty(3)
    for axis in range(3):
        hit = np.flatnonzero(kept.any(axis=tuple(a for a in range(3) if a != 2 - axis)))
        low[axis] = max(0.0, (hit[0] - 0.5) / PROBES_PER_AXIS)
        high[axis] = min(1.0, (hit[-1] + 1.5) / PROBES_PER_AXIS)
    return Cage(hexahedron.points(cage.corners, low + hexahedron.BITS * (high - low)))
