"""Mesh cages: inner cages of any shape, closed triangle meshes whose vertices are their control points."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from cagefield.errors import CageError
from cagefield.geometry import hexahedron, point_deformers
from cagefield.geometry.cage import MAX_WAY_STATES, Axes, Cage
from cagefield.geometry.cage_checks import read_only
from cagefield.geometry.lattice_points import finite, shares
from cagefield.geometry.triangle_mesh import Triangles, check_crossings, closed_mesh, encloses, mesh_edges
from cagefield.typing import Array, Mask


@dataclass(frozen=True, eq=False, init=False, repr=False)
class MeshCage(Cage):
    """A closed triangle mesh; operations move its vertices, and its inside follows by their flow.

    Parameters
    - vertices: [V,3] world units, V up to `MAX_MESH_VERTICES`.
    - triangles: [F,3] numbers of vertices, counter-clockwise seen from outside.
    - pivot: [3], about which `rotate`, `scale` and `shear` turn; the mean of the vertices if left out.
    - linear: [3,3] with a positive determinant, the linear map that these operations have made: its rotation
      gives the cage's own axes. The identity for new cages.

    `corners` are those of the least box along the own axes. `way` holds the vertices of states that a bend or
    a twist goes through: the flow follows them.

    Raises `CageError` for a mesh that is open, inside out, branching or flat, has edges that go through its
    triangles, is not finite, or has too many vertices.
    """

    vertices: Array
    triangles: Triangles
    linear: Array
    way: tuple[Array, ...]

    is_hexahedron: ClassVar[bool] = False
    handle_noun: ClassVar[str] = "vertex"
    plural_noun: ClassVar[str] = "mesh cages"

    def __init__(
        self,
        vertices: ArrayLike,
        triangles: ArrayLike,
        *,
        pivot: ArrayLike | None = None,
        linear: ArrayLike | None = None,
        way: tuple[Array, ...] = (),
    ) -> None:
        v, t = closed_mesh(vertices, triangles)
        check_crossings(v, t)
        A = read_only(np.eye(3) if linear is None else linear, (3, 3), "linear map of a mesh cage")
        if not np.linalg.det(A) > 0.0:
            raise CageError("linear map of a mesh cage must have a positive determinant; leave it out")
        at = v.mean(axis=0) if pivot is None else pivot
        for name, value in (
            ("vertices", v),
            ("triangles", t),
            ("linear", A),
            ("way", way),
            ("pivot", read_only(at, (3,), "pivot of a mesh cage")),
        ):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "corners", self._box())
        super().__post_init__()

    @classmethod
    def of_box(cls, box: Cage) -> MeshCage:
        """The 12 triangles of a cage's faces; vertex k is corner k."""
        quads = [(ids[0], ids[1], ids[3], ids[2]) for ids in box.faces.values()]
        triangles = []
        for a, b, c, d in quads:
            n = np.cross(box.corners[c] - box.corners[a], box.corners[d] - box.corners[b])
            outward = n @ (box.corners[[a, b, c, d]].mean(axis=0) - box.center) > 0.0
            triangles += [(a, b, c), (a, c, d)] if outward else [(a, c, b), (a, d, c)]
        return cls(box.corners, triangles, pivot=box.pivot)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, MeshCage):
            return NotImplemented
        frames = zip((self.pivot, self.linear), (other.pivot, other.linear), strict=True)
        return self.has_shape_of(other) and all(np.array_equal(a, b) for a, b in frames)

    def __hash__(self) -> int:
        return hash((self.vertices.tobytes(), self.triangles.tobytes(), self.pivot.tobytes()))

    def __repr__(self) -> str:
        return f"MeshCage({self.vertices.tolist()}, {self.triangles.tolist()})"

    @property
    def handles(self) -> Array:
        """The vertices [V,3]."""
        return self.vertices

    @property
    def points(self) -> Array:
        """The vertices [V,3]."""
        return self.vertices

    @property
    def mesh_edges(self) -> Triangles:
        """The edges [E,2] of the triangles, the lower number of a vertex first."""
        return mesh_edges(self.triangles)

    def has_shape_of(self, other: Cage) -> bool:
        """True where another mesh has the same vertices and triangles."""
        return (
            isinstance(other, MeshCage)
            and np.array_equal(self.vertices, other.vertices)
            and np.array_equal(self.triangles, other.triangles)
        )

    def coordinates(self, points: ArrayLike) -> tuple[Array, Mask]:
        """(u [N,3], inside [N]) of points [N,3]: u in the box of `corners`; inside of the surface."""
        p = np.asarray(points, dtype=np.float64)
        return super().coordinates(p)[0], self.contains(p)

    def contains(self, points: ArrayLike) -> Mask:
        """Mask [N] of the points [N,3] inside of the surface."""
        p = np.asarray(points, dtype=np.float64)
        mask = np.zeros(len(p), dtype=bool)
        low, high = self.aabb
        near = np.flatnonzero(hexahedron.all_three((p >= low) & (p <= high)))
        mask[near] = encloses(self.vertices, self.triangles, p[near])
        return mask

    def mirrored(self, axis: int, at: float) -> MeshCage:
        """The mesh across the plane where coordinate `axis` is `at`; its vertices keep their numbers."""
        F = np.diag(np.where(np.arange(3) == axis, -1.0, 1.0))
        return MeshCage(
            point_deformers.mirrored(self.vertices, axis, at),
            self.triangles[:, ::-1],
            pivot=point_deformers.mirrored(self.pivot, axis, at),
            linear=F @ self.linear @ F,
            way=tuple(point_deformers.mirrored(state, axis, at) for state in self.way),
        )

    def mirrored_handle(self, handle: int, axis: int) -> int:
        """The number itself: vertices keep theirs."""
        return handle

    def subdivided(self, cells: Iterable[int], interpolation: str = "bspline") -> NoReturn:
        """Raises `CageError`: a mesh has no cells."""
        raise CageError("a mesh cage has no cells; subdivide a box, or use a mesh with more vertices")

    def bend(self, axis: str, angle: float, *, towards: str = "", fixed: str = "start") -> MeshCage:
        """The mesh bent along an axis of its own by an angle in radians; see `LatticePoints.bend`."""
        along = point_deformers.axis_number(axis, "axis")
        across = point_deformers.axis_number(towards, "towards") if towards else (along + 1) % 3
        if across == along:
            raise CageError(f"a bend along {axis} goes towards another axis than {axis}")
        turn, v, Q = finite(angle, "bend angle"), self.vertices, self.heading
        return self._through(
            [point_deformers.bend(v, Q, along, across, t * turn, fixed) for t in shares(turn)]
        )

    def twist(self, axis: str, angle: float, *, fixed: str = "start") -> MeshCage:
        """The mesh twisted about an axis of its own by an angle in radians; see `LatticePoints.twist`."""
        along, turn = point_deformers.axis_number(axis, "axis"), finite(angle, "twist angle")
        v, Q = self.vertices, self.heading
        return self._through([point_deformers.twist(v, Q, along, t * turn, fixed) for t in shares(turn)])

    def taper(self, axis: str, factor: float, *, fixed: str = "start") -> MeshCage:
        """The mesh scaled across an axis of its own, evenly to a factor > 0; see `LatticePoints.taper`."""
        along, by = point_deformers.axis_number(axis, "axis"), finite(factor, "taper factor")
        if by <= 0.0:
            raise CageError(f"taper factor must be positive, got {by:g}")
        moved = point_deformers.taper(self.vertices, self.heading, along, by, fixed)
        return self._moved(moved, self.pivot)

    def _through(self, states: list[Array]) -> MeshCage:
        """The mesh at the last of states [V,3], with the others, and the present one, on its way."""
        return self._moved(states[-1], self.pivot, way=(self.vertices, *states[:-1]))

    def _linear(self, M: Array, axes: Axes, own: bool = False) -> MeshCage:
        if axes not in ("world", "cage"):
            raise CageError(f'axes must be "world" or "cage", got "{axes}"')
        if own and axes == "cage":
            M = self.axes @ M @ np.linalg.inv(self.axes)
        moved = self.pivot + (self.vertices - self.pivot) @ M.T
        return self._moved(moved, self.pivot, rigid=True, linear=M @ self.linear)

    def _move(self, corners: tuple[int, ...], by: Array) -> NoReturn:
        raise CageError("a mesh cage has no corners, edges or faces; use move_point on its vertices")

    def _moved(
        self,
        points: Array,
        pivot: Array,
        *,
        rigid: bool = False,
        linear: Array | None = None,
        way: tuple[Array, ...] = (),
    ) -> MeshCage:
        A = self.linear if linear is None else linear
        states = (*self.way, *way)[-MAX_WAY_STATES:]
        return MeshCage(points, self.triangles, pivot=pivot, linear=A, way=states)

    def _box(self) -> Array:
        y = (self.vertices - self.pivot) @ np.linalg.inv(self.linear).T
        low, high = y.min(axis=0), y.max(axis=0)
        return np.asarray(self.pivot + (low + hexahedron.BITS * (high - low)) @ self.linear.T)
