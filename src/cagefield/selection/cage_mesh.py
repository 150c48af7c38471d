"""Closed triangle meshes around selections: level sets of the distance to the selected positions.

The distance is sampled on an even grid and interpolated, so the surface encloses every position where the
level is above sqrt(3/4) of the grid's edge: at a position p in a grid cell of edge h, the trilinear
interpolation of |x - p| is at most sqrt(sum_a u_a (1 - u_a)) h <= sqrt(3/4) h, by Jensen's inequality. Fewer
faces come from a coarser grid, not from edge collapses: the mesh stays closed and around the selection.

Source: Lewiner et al., "Efficient Implementation of Marching Cubes' Cases with Topological Guarantees"
(2003), implemented by scikit-image.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from cagefield.errors import CagefieldError
from cagefield.typing import Array

MAX_FACES = 500
"""Default number of faces, at most."""

FINEST_GRID = 96
"""Nodes along the longest axis of the first grid; the next ones are coarser by GRID_RATIO."""

GRID_RATIO = 0.85

COARSEST_GRID = 5

ENCLOSING_LEVEL = 0.9
"""Least level in edges of the grid: above sqrt(3/4), for the interpolation of marching cubes."""


@dataclass(frozen=True, eq=False)
class CageMesh:
    """Closed triangle mesh: vertices [V,3] float64, world units; faces [F,3] int32, counter-clockwise seen
    from outside.

    margin: distance from the positions to the surface that it was built for; at least the one asked for.
    """

    vertices: Array
    faces: NDArray[np.int32]
    margin: float


def cage_mesh(points: Array, margin: float, *, max_faces: int = MAX_FACES) -> CageMesh:
    """Closed mesh of at most `max_faces` triangles around points [N,3], about `margin` from them.

    Separate groups of points further apart than twice the margin get a closed surface each. The margin is
    larger where the few faces need it to enclose every point.

    Raises CagefieldError without points, for a margin <= 0, for fewer faces than the groups need, or without
    scikit-image.
    """
    try:
        from skimage.measure import marching_cubes
    except ImportError as error:
        raise CagefieldError(
            "a mesh needs scikit-image, which is not installed; pip install 'cagefield[mesh]'"
        ) from error
    p = np.asarray(points, dtype=np.float64)
    if p.ndim != 2 or p.shape[1] != 3 or not len(p):
        raise CagefieldError("a mesh needs at least one point [N,3]: nothing is selected")
    if not margin > 0.0:
        raise CagefieldError(f"the margin of a mesh must be a length > 0, got {margin:g}")
    tree = cKDTree(p)
    low, high = p.min(axis=0), p.max(axis=0)
    nodes = float(FINEST_GRID)
    while nodes >= COARSEST_GRID:
        edge = float((high - low).max() + 2.0 * margin) / nodes
        level = max(margin, ENCLOSING_LEVEL * edge)
        origin = low - level - 1.5 * edge
        shape = np.ceil((high + level + 1.5 * edge - origin) / edge).astype(int) + 1
        grid = origin + edge * np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
        distance = tree.query(grid.reshape(-1, 3), workers=-1)[0].reshape(tuple(shape))
        # Splats are on surfaces: the hollow inside of one belongs to the cage.
        distance[ndimage.binary_fill_holes(distance <= level) & (distance > level)] = 0.0
        vertices, faces, _, _ = marching_cubes(  # type: ignore[no-untyped-call]
            distance, level, spacing=(edge,) * 3, gradient_direction="ascent", allow_degenerate=False
        )
        if len(faces) <= max_faces:
            return CageMesh(vertices + origin, _outward(vertices, faces), level)
        nodes *= GRID_RATIO
    raise CagefieldError(
        f"{max_faces} faces are too few for a closed mesh around this selection; allow {len(faces)} or more, "
        "or select fewer separate parts"
    )


def _outward(vertices: Array, faces: NDArray[np.integer[Any]]) -> NDArray[np.int32]:
    """Faces with the orientation that gives a positive volume."""
    a, b, c = (vertices[faces[:, n]] for n in range(3))
    volume = float(np.einsum("ni,ni->", a, np.cross(b, c)))
    return np.ascontiguousarray(faces if volume > 0.0 else faces[:, ::-1], np.int32)
