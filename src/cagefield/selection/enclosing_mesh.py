"""Closed triangle meshes around selections: level sets of the distance to the selected cells, decimated.

The selected positions fill cells of an even grid of edge h. The distance of the nodes, at the cells' centers,
to the nearest filled one is interpolated by marching cubes. Its value at a position p in the cell with center
c is at most sqrt(|p - c|^2 + sum_a u_a (1 - u_a) h^2) <= sqrt(3/2) h, by Jensen's inequality: a level above
that encloses every position. Decimation may cut convex corners, so the result is checked, and built again
with a larger level where a position is outside or the mesh crosses itself.

Source: Lewiner et al., "Efficient Implementation of Marching Cubes' Cases with Topological Guarantees"
(2003), implemented by scikit-image.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.errors import CageError, CagefieldError
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.geometry.triangle_mesh import check_crossings, encloses
from cagefield.selection.mesh_decimation import decimate
from cagefield.typing import Array

MAX_FACES = 500
"""Default number of faces, at most."""

MAX_NODES_PER_AXIS = 64
"""Nodes along the longest axis of the grid."""

MAX_DECIMATED_FACES = 6_000
"""Faces before the decimation, at most: a coarser grid is taken instead."""

ENCLOSING_LEVEL = 1.25
"""Minimum level in edges of the grid, above sqrt(3/2)."""

LEVEL_STEP = 1.15
"""Growth of the level where a position is outside of the decimated mesh, or that crosses itself."""

MAX_ATTEMPTS = 8

TESTED_POSITIONS = 4000
"""Positions that are checked to be inside, at most."""


@dataclass(frozen=True, eq=False)
class CageMesh:
    """Closed triangle mesh: vertices [V,3] float64, world units; faces [F,3] int32, counter-clockwise seen
    from outside.

    margin: distance from the selected cells to the surface before its decimation; at least the one asked for.
    """

    vertices: Array
    faces: NDArray[np.int32]
    margin: float


def cage_mesh(points: Array, margin: float, *, max_faces: int = MAX_FACES) -> CageMesh:
    """Closed mesh of at most `max_faces` triangles around points [N,3], about `margin` from them.

    A hollow that the margin closes is filled; groups of points further apart than twice the margin get a
    closed surface each. The margin is larger where few faces, or the grid, need it to enclose every point.

    Raises CagefieldError without points, for a margin <= 0, for fewer faces than the groups need, or without
    scikit-image.
    """
    p = np.asarray(points, dtype=np.float64)
    if p.ndim != 2 or p.shape[1] != 3 or not len(p):
        raise CagefieldError("a mesh needs at least one point [N,3]: nothing is selected")
    if not margin > 0.0:
        raise CagefieldError(f"the margin of a mesh must be a length > 0, got {margin:g}")
    extent = float(np.ptp(p, axis=0).max()) + 2.0 * margin
    edge = max(0.5 * margin, extent / MAX_NODES_PER_AXIS)
    tested = p[:: -(-len(p) // TESTED_POSITIONS)]
    level = max(margin, ENCLOSING_LEVEL * edge)
    for _ in range(MAX_ATTEMPTS):
        vertices, faces = _level_set(p, edge, level)
        if len(faces) > MAX_DECIMATED_FACES:
            edge *= 1.3
            level = max(level, ENCLOSING_LEVEL * edge)
            continue
        vertices, faces = decimate(vertices, faces, max_faces)
        if len(faces) > max_faces:
            raise CagefieldError(
                f"{max_faces} faces are too few for a closed mesh around this selection; allow {len(faces)} "
                "or more, or select fewer separate parts"
            )
        if encloses(vertices, faces, tested).all() and not _crosses_itself(vertices, faces):
            return CageMesh(vertices, faces, level)
        level *= LEVEL_STEP
    raise CagefieldError(
        f"no mesh of {max_faces} faces encloses this selection without crossing itself; allow more faces, or "
        "select fewer parts"
    )


def mesh_cage_around(points: Array, margin: float, max_faces: int = MAX_FACES) -> MeshCage:
    """The `cage_mesh` around points [N,3] as the inner cage of an edit; raises as that."""
    mesh = cage_mesh(points, margin, max_faces=max_faces)
    return MeshCage(mesh.vertices, mesh.faces)


def _crosses_itself(vertices: Array, faces: NDArray[np.int32]) -> bool:
    """True for a mesh that no cage may have: collapses of edges can take parts through each other."""
    try:
        check_crossings(vertices, faces.astype(np.int64))
    except CageError:
        return True
    return False


def _level_set(p: Array, edge: float, level: float) -> tuple[Array, NDArray[np.int32]]:
    """(vertices, faces) of the surface at a distance, about `level`, from the cells of positions.

    Squared distances of nodes are whole numbers of squared edges: the level lies halfway between two of
    them, so that no vertex of the surface is at a node, where triangles would be degenerate.
    """
    try:
        from skimage.measure import marching_cubes
    except ImportError as error:
        raise CagefieldError(
            "a mesh needs scikit-image, which is not installed; pip install 'cagefield[mesh]'"
        ) from error
    level = edge * float(np.sqrt(np.ceil((level / edge) ** 2 - 0.5) + 0.5))
    border = int(np.ceil(level / edge)) + 2
    low = p.min(axis=0)
    cells = np.floor((p - low) / edge).astype(np.int64) + border
    empty = np.ones(tuple(cells.max(axis=0) + border + 1), bool)
    empty[tuple(cells.T)] = False
    distance = edge * ndimage.distance_transform_edt(empty)
    # Splats are on surfaces: the hollow inside of one belongs to the cage.
    distance[ndimage.binary_fill_holes(distance <= level) & (distance > level)] = 0.0
    vertices, faces, _, _ = marching_cubes(  # type: ignore[no-untyped-call]
        distance, level, spacing=(edge,) * 3, gradient_direction="ascent", allow_degenerate=False
    )
    a, b, c = (vertices[faces[:, n]] for n in range(3))
    outward = float(np.einsum("ni,ni->", a, np.cross(b, c))) > 0.0
    oriented = np.ascontiguousarray(faces if outward else faces[:, ::-1], np.int32)
    return vertices + low + (0.5 - border) * edge, oriented
