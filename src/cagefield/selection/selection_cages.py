"""Inner and outer cages of several shapes around selected positions."""

from __future__ import annotations

from typing import Literal, TypeAlias

from cagefield.geometry.cage import Cage
from cagefield.selection.bounding_cages import lattice_cells, oriented_box, outer_cage_of_box
from cagefield.selection.enclosing_mesh import mesh_cage_around
from cagefield.typing import Array, Float32

CageShape: TypeAlias = Literal["box", "lattice", "mesh"]

DEFAULT_MESH_FACES = 240
"""Faces of a mesh cage: about half of the vertices that a mesh cage may have."""


def cage_around(
    shape: CageShape,
    points: Array,
    margin: float,
    radii: Array | Float32 | float = 0.0,
    *,
    faces: int = DEFAULT_MESH_FACES,
) -> Cage:
    """Inner cage of a shape around points [N,3], world units, each a ball of its radius, with a margin.

    A "box" is the least oriented one, a "lattice" that box divided into cells near to cubes, at most 4 along
    an axis, a "mesh" the closed one of at most `faces` triangles, whose points have no radius. Raises
    CagefieldError as `oriented_box` and `cage_mesh` do.
    """
    if shape == "mesh":
        return mesh_cage_around(points, margin, faces)
    box = oriented_box(points, margin=margin, radii=radii)
    return box.subdivided(lattice_cells(box)) if shape == "lattice" else box


def outer_cage_of_shape(inner: Cage) -> Cage:
    """Outer cage of an inner cage of any shape, the box around that grown; see `outer_cage_of_box`."""
    return outer_cage_of_box(Cage(inner.corners))
