"""Cages of other programs, given as arrays: boxes by their 8 vertices, lattices, closed meshes.

A cage comes with its `rest` shape, which is the canonical cage, and its `target`, the shape that it has now.
A mesh of 8 vertices, 12 edges and 6 quadrilaterals is a hexahedron, whose vertices may be in any order.
"""

from __future__ import annotations

from itertools import permutations
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import CageError
from cagefield.geometry.bspline_lattice import INTERPOLATIONS
from cagefield.geometry.cage import Cage, LatticeCage
from cagefield.geometry.cage_checks import lattice_shape
from cagefield.geometry.hexahedron import BITS
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.geometry.triangle_mesh import signed_volume
from cagefield.typing import AnyArray, Array

Role: TypeAlias = Literal["inner", "outer"]

AT_ASSIGNMENT, NOW = "when it was assigned", "as it is now"
"""Moments of a cage, in messages."""


def hexahedron_order(vertices: AnyArray, edges: AnyArray) -> NDArray[np.intp] | None:
    """Vertex numbers [8] of corners 0 to 7, of a mesh with the edge graph of a cube; None for other meshes.

    Of the 24 right-handed numberings, the one whose edge directions are nearest to +x, +y and +z.
    """
    if len(vertices) != 8 or edges.shape != (12, 2) or edges.min() < 0 or edges.max() > 7:
        return None
    neighbors: list[set[int]] = [set() for _ in range(8)]
    for i, j in edges.tolist():
        neighbors[i].add(j)
        neighbors[j].add(i)
    if any(len(near) != 3 for near in neighbors):
        return None
    found: list[tuple[float, list[int]]] = []
    for first in range(8):
        for order in permutations(neighbors[first]):
            corners = _corners_from(first, order, neighbors)
            if corners is None:
                return None
            axes = _axes(vertices[corners])
            if np.linalg.det(axes) > 0.0:
                found.append((float(np.trace(axes / np.linalg.norm(axes, axis=0))), corners))
    return np.array(max(found)[1], np.intp) if found else None


def _corners_from(first: int, order: tuple[int, ...], neighbors: list[set[int]]) -> list[int] | None:
    """Corners 0 to 7 with corner 0 at a vertex and its neighbors along x, y, z; None where it is no cube."""
    x, y, z = order
    corners = [first, x, y, -1, z, -1, -1, -1]
    for corner, (a, b) in {3: (x, y), 5: (x, z), 6: (y, z)}.items():
        common = (neighbors[a] & neighbors[b]) - {first}
        if len(common) != 1:
            return None
        corners[corner] = common.pop()
    last = neighbors[corners[3]] & neighbors[corners[5]] & neighbors[corners[6]]
    if len(last) != 1:
        return None
    corners[7] = last.pop()
    return corners if len(set(corners)) == 8 else None


def _axes(corners: AnyArray) -> Array:
    """Mean edge vectors [3,3], as columns."""
    sides = 2.0 * BITS - 1.0
    return np.asarray(corners.T @ sides / 4.0)


def mesh_cage(
    rest: AnyArray, target: AnyArray, edges: AnyArray, triangles: AnyArray, role: Role
) -> tuple[Cage, Array]:
    """(canonical cage, target [n,3] of its handles) of a mesh: rest and target [V,3], edges [E,2], triangles
    [F,3].

    A hexahedron where it is a cube's mesh, else a `MeshCage`; an outer cage must be a hexahedron. Triangles
    that face inwards, as a mirrored object has them, are turned over. The pivot is the handles' mean.

    Raises:
        CageError: names the role; vertices that are not finite or of another number, an open mesh, a cage
            that is inside out, at rest or at its target.
    """
    before, after = _vertices(rest, role, "at rest"), _vertices(target, role, "now")
    if before.shape != after.shape:
        raise CageError(
            f"the {role} cage has {len(after)} vertices, {len(before)} when it was assigned; assign it again"
        )
    order = hexahedron_order(before, edges)
    if order is not None:
        cage = _valid(Cage, role, AT_ASSIGNMENT, before[order])
        _valid(Cage, role, NOW, after[order])
        return cage, after[order]
    if role == "outer":
        raise CageError(
            f"the outer cage must be a cube of 8 vertices and 6 faces, got {len(before)} vertices; use a"
            " cube that is not subdivided"
        )
    if _are_numbers_of(triangles, len(before)) and signed_volume(before, triangles) < 0.0:
        triangles = triangles[:, ::-1]
    mesh = _valid(MeshCage, role, AT_ASSIGNMENT, before, triangles)
    _valid(MeshCage, role, NOW, after, triangles)
    return mesh, after


def lattice_cage(
    rest: AnyArray, target: AnyArray, shape: list[int], interpolation: str
) -> tuple[Cage, Array]:
    """(canonical lattice, target [n,3]) of an inner lattice: rest and target [n,3], x fastest.

    A lattice that a mirrored object turns over is numbered the other way along x.

    Raises:
        CageError: as `mesh_cage`; a shape other than 2 to 8 along each axis, an unknown interpolation.
    """
    if interpolation not in INTERPOLATIONS:
        raise CageError(f"interpolation is one of {', '.join(INTERPOLATIONS)}, got {interpolation!r:.40}")
    before, after = _vertices(rest, "inner", "at rest"), _vertices(target, "inner", "now")
    counts = lattice_shape(shape)
    for points in (before, after):
        if len(points) != int(np.prod(counts)):
            raise CageError(
                f"the inner cage is a lattice of {counts[0]} x {counts[1]} x {counts[2]} points, got"
                f" {len(points)}; assign it again"
            )

    def as_grid(points: Array) -> Array:
        return points.reshape(counts[2], counts[1], counts[0], 3)

    grid = as_grid(before)
    directions = [(grid[:, :, -1] - grid[:, :, 0]), (grid[:, -1] - grid[:, 0]), (grid[-1] - grid[0])]
    if np.linalg.det(np.stack([side.mean(axis=(0, 1)) for side in directions])) < 0.0:
        before, after = (as_grid(points)[:, :, ::-1].reshape(-1, 3) for points in (before, after))
    cage = _valid(LatticeCage, "inner", AT_ASSIGNMENT, before, counts, interpolation)
    _valid(LatticeCage, "inner", NOW, after, counts, interpolation)
    return cage, after


def _are_numbers_of(triangles: AnyArray, count: int) -> bool:
    """True where triangles [F,3] name vertices below the count."""
    return bool(triangles.size) and bool(triangles.min() >= 0) and bool(triangles.max() < count)


def _vertices(values: AnyArray, role: Role, moment: str) -> Array:
    """Vertices [V,3] in float64. Raises CageError where one is not finite."""
    if values.ndim != 2 or values.shape[1:] != (3,):
        raise CageError(f"vertices of the {role} cage {moment} must be [V,3], got {list(values.shape)}")
    bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if len(bad):
        raise CageError(f"vertex {bad[0]} of the {role} cage {moment} must be finite; assign the cage again")
    return np.asarray(values, np.float64)


def _valid(make: type[Cage], role: Role, moment: str, *arguments: object) -> Cage:
    """A cage. Raises CageError with its role, the moment and a cure for the other program."""
    try:
        return make(*arguments)  # type: ignore[arg-type]
    except CageError as error:
        fault = str(error).partition(";")[0]
        cure = "move its points back" if moment == NOW else "repair it, and assign it again"
        raise CageError(f"{role} cage {moment}: {fault}; {cure}") from None
