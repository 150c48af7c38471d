"""Operations of an edit as methods, each of which returns a new edit of the same kind."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import TypeVar

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from cagefield.edits import operations as ops
from cagefield.edits.mirror import Mirror
from cagefield.edits.operations import Operation
from cagefield.geometry.cage import Axes

AnyEdit = TypeVar("AnyEdit", bound="Transformable")


class Transformable(ABC):
    """Edit that operations extend: abstract, an `Edit`."""

    @abstractmethod
    def then(self: AnyEdit, operation: Operation) -> AnyEdit:
        """The edit with one more operation."""

    def translate(self: AnyEdit, by: ArrayLike) -> AnyEdit:
        """The edit with its inner cage moved by a vector [3]."""
        return self.then(ops.Translate(ops.displacement(by, "translate")))

    def rotate(self: AnyEdit, rotation: Rotation | ArrayLike, *, axes: Axes = "world") -> AnyEdit:
        """Edit with its inner cage turned about its pivot: SciPy `Rotation`, or XYZ angles [3], radians."""
        return self.then(ops.Rotate.from_rotation(rotation, axes))

    def scale(self: AnyEdit, by: ArrayLike, *, axes: Axes = "world") -> AnyEdit:
        """The edit with its inner cage scaled about its pivot by one factor or three."""
        return self.then(ops.Scale.from_factors(by, axes))

    def shear(self: AnyEdit, *, axes: Axes = "world", **factors: float) -> AnyEdit:
        """The edit with its inner cage sheared about its pivot; factors xy, xz, yx, yz, zx, zy."""
        return self.then(ops.Shear(**factors, axes=axes))

    def move_corner(self: AnyEdit, corner: int, by: ArrayLike) -> AnyEdit:
        """The edit with one corner of its inner cage moved by a vector [3]."""
        return self.then(ops.MoveCorner(corner, ops.displacement(by, "move_corner")))

    def move_edge(self: AnyEdit, edge: tuple[int, int], by: ArrayLike) -> AnyEdit:
        """The edit with an edge (i, j) of its inner cage moved by a vector [3]."""
        return self.then(ops.MoveEdge((edge[0], edge[1]), ops.displacement(by, "move_edge")))

    def move_face(self: AnyEdit, face: str, by: ArrayLike) -> AnyEdit:
        """The edit with a face of its inner cage, such as "+x", moved by a vector [3]."""
        return self.then(ops.MoveFace(face, ops.displacement(by, "move_face")))

    def move_point(self: AnyEdit, point: int, by: ArrayLike) -> AnyEdit:
        """The edit with one control point of its inner cage, numbered x fastest, moved by a vector [3]."""
        return self.then(ops.MovePoint(point, ops.displacement(by, "move_point")))

    def move_points(
        self: AnyEdit,
        points: Iterable[int],
        by: ArrayLike,
        *,
        radius: float = 0.0,
        falloff: str = "smooth",
    ) -> AnyEdit:
        """The edit with control points moved by a vector [3]; see `operations.MovePoints`."""
        by = ops.displacement(by, "move_points")
        return self.then(ops.MovePoints(tuple(points), by, radius, falloff))

    def bend(self: AnyEdit, axis: str, angle: float, *, towards: str = "", fixed: str = "start") -> AnyEdit:
        """The edit with its lattice bent along an axis by an angle in radians; see `operations.Bend`."""
        return self.then(ops.Bend(axis, ops.degrees(angle), towards, fixed))

    def twist(self: AnyEdit, axis: str, angle: float, *, fixed: str = "start") -> AnyEdit:
        """The edit with its lattice twisted about an axis by an angle in radians; see `operations.Twist`."""
        return self.then(ops.Twist(axis, ops.degrees(angle), fixed))

    def mirror(self: AnyEdit, axis: str) -> AnyEdit:
        """The edit with the content of its cage reflected along the cage's own axis "x", "y" or "z".

        Raises `EditError` for a continuous edit, whose content is connected to its surroundings.
        """
        return self.then(Mirror(axis))

    def taper(self: AnyEdit, axis: str, factor: float, *, fixed: str = "start") -> AnyEdit:
        """The edit with its lattice scaled across an axis to a factor at its end; see `operations.Taper`."""
        return self.then(ops.Taper(axis, float(factor), fixed))
