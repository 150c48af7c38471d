"""Lattices and control points in the editor: new ones, their options, and operations that need them."""

from __future__ import annotations

import base64
from pathlib import PurePath

import numpy as np

from cagefield.edits import Continuous, Edit
from cagefield.edits import operations as ops
from cagefield.edits.operations import Operation
from cagefield.errors import EditError
from cagefield.geometry.cage import Cage, LatticeCage
from cagefield.geometry.cage_checks import point_numbers
from cagefield.geometry.control_points import ControlPoints
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.geometry.mesh_files import mesh_cage_of

OF_CORNERS = (ops.MoveCorner, ops.MoveEdge, ops.MoveFace, ops.MoveCorners)
"""Operations that a cage without corners does not have."""


def check_operation(cage: Cage, operation: Operation) -> None:
    """Raise a `CagefieldError` with the cure where a cage has no such operation, or no such points."""
    if isinstance(operation, ops.MovePoint):
        point_numbers((operation.point,), len(cage.handles))
    elif isinstance(operation, ops.MovePoints):
        point_numbers(operation.points, len(cage.handles))
    elif isinstance(operation, ops.Bend | ops.Twist | ops.Taper):
        if not isinstance(cage, LatticeCage | MeshCage):
            raise EditError(f"a {operation.noun} needs a lattice; subdivide the cage first (panel, Cages)")
        if isinstance(operation, ops.Bend) and operation.towards == operation.axis:
            raise EditError(f"a bend along {operation.axis} goes towards another axis; choose one")
    elif isinstance(cage, ControlPoints | MeshCage) and isinstance(operation, OF_CORNERS):
        raise EditError(f"{cage.plural_noun} have no corners, edges or faces; move the points")


def subdivided(edit: Edit, cells: tuple[int, int, int], interpolation: str) -> Edit:
    """The edit with its inner cage as a lattice of `cells` along its axes; operations stay.

    Raises `EditError` for edits that need 8 corners, control points, and points that were moved.
    """
    if not isinstance(edit, Continuous):
        raise edit.error("only a continuous edit has a lattice; choose that kind first (D)")
    if isinstance(edit.inner, ControlPoints):
        raise edit.error("control points have no cells; make a new pair of cages to subdivide")
    if isinstance(edit.inner, MeshCage):
        raise edit.error("a mesh cage has no cells; make a new pair of cages to subdivide")
    if any(isinstance(operation, ops.MovePoint | ops.MovePoints) for operation in edit.operations):
        raise edit.error("its points were moved, and would be others; reset its operations first")
    settings = edit.shell_settings
    if settings.shell.name != "flow":
        raise edit.error("a trilinear shell joins cages with 8 corners; choose the flow shell first")
    return edit.replace(inner=edit.inner.subdivided(cells, interpolation))


def edit_of_point(inner: Cage, *, name: str, lattice: int) -> Edit:
    """An edit of one control point, in the middle of a box that its reach fills."""
    radius = 0.5 * float(np.ptp(inner.corners, axis=0).max())
    return Edit.points([inner.center], radius=radius, name=name, lattice=lattice)


OUTER_MARGIN = 0.35
"""Margin of the outer cage of a mesh from a file, as a share of the mesh's largest extent."""


def decoded_mesh_cage(name: str, content: str) -> tuple[MeshCage, str | None]:
    """(mesh cage, warning or None) of a file's name and its content in base64.

    Raises `CagefieldError` for content that is no base64 and as `mesh_cage_of`.
    """
    try:
        data = base64.b64decode(content, validate=True)
    except ValueError:
        raise EditError(f"{name}: the file arrived damaged; choose it again") from None
    return mesh_cage_of(data, PurePath(name))


def edit_of_mesh(cage: MeshCage, *, name: str, lattice: int) -> Edit:
    """An edit of a mesh cage in a box around it."""
    margin = OUTER_MARGIN * float(np.ptp(cage.vertices, axis=0).max())
    return Edit.continuous(cage, cage.grown(margin), name=name, lattice=lattice)


def with_reach(edit: Edit, radius: float | None, falloff: str | None, connected: bool | None = None) -> Edit:
    """The edit with another radius, world units, falloff or kind of distance of its control points.

    None leaves each; `connected` points reach through dense matter alone.

    Raises `EditError` for an edit without control points of its own.
    """
    points = edit.inner
    if not isinstance(points, ControlPoints):
        raise edit.error("only control points have a radius; change the cage instead")
    return edit.replace(inner=points.with_reach(radius=radius, falloff=falloff, connected=connected))
