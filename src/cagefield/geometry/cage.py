"""Cages: hexahedra that bound the moved region (inner) and its deformable surroundings (outer).

Corner k = x + 2y + 4z with x, y, z in {0, 1} along the cage's own axes (VTK voxel order). Edges are corner
pairs (i, j), i < j, that differ in one bit. Faces are "+x", "-x", "+y", "-y", "+z", "-z" of the same axes.
Angles are radians, lengths world units.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from cagefield.errors import CageError
from cagefield.geometry import bspline_lattice, hexahedron, point_deformers
from cagefield.geometry.cage_checks import (
    check_lattice,
    check_orientation,
    check_shear,
    corner_number,
    factors,
    lattice_shape,
    point_numbers,
    read_only,
    vector,
)
from cagefield.geometry.hexahedron import EDGES as EDGES
from cagefield.geometry.hexahedron import FACES as FACES
from cagefield.geometry.lattice_points import LatticePoints
from cagefield.geometry.quaternions import rotation_matrix as rotation_matrix
from cagefield.typing import Array, Mask

Axes: TypeAlias = Literal["world", "cage"]

MAX_WAY_STATES = 64
"""Earlier states that a lattice remembers."""


@dataclass(frozen=True, eq=False)
class Cage:
    """A hexahedron with 8 corners, 12 edges and 6 bilinear faces; operations return a new cage.

    A point of the cage is x(u) = sum_k N_k(u) corners[k], u in [0,1]^3. The Jacobian determinant of this map
    must be positive over the whole cage.

    Parameters: corners [8,3] in world units; pivot [3], about which `rotate`, `scale` and `shear` turn. The
    pivot of a new cage is its center, travels with `translate`, and stays where it is when a corner, an edge
    or a face is moved.

    Raises `CageError` when a corner is not finite, or the cage is flat, mirrored or inside out.

    Source: Li & Pan, "Interactive Geometry Editing of Neural Radiance Fields", section 3. Its formula for the
    center divides the sum of the corners by 6; a hexahedron has 8, and the center here is their mean. Its
    R_z is the transpose of the right-handed rotation; rotations here are right-handed.
    """

    corners: Array
    pivot: Array = field(default=None, kw_only=True)  # type: ignore[arg-type]

    is_hexahedron: ClassVar[bool] = True
    """False for cages of other shapes, whose `corners` are those of a box around them."""

    follows_edit: ClassVar[bool] = False
    """True for outer cages that are made anew with the operations of their edit."""

    has_own_falloff: ClassVar[bool] = False
    """True for cages that say how the motion fades around them, in place of the shell."""

    handle_noun: ClassVar[str] = "inner corner"
    """One of `handles`, in messages."""

    plural_noun: ClassVar[str] = "cages"
    """Such cages, in messages."""

    def __post_init__(self) -> None:
        corners = read_only(self.corners, (8, 3), "cage corners")
        pivot = corners.mean(axis=0) if self.pivot is None else self.pivot
        object.__setattr__(self, "corners", corners)
        object.__setattr__(self, "pivot", read_only(pivot, (3,), "cage pivot"))
        check_orientation(corners)

    @classmethod
    def box(cls, center: ArrayLike, size: ArrayLike, rotation: ArrayLike = (0.0, 0.0, 0.0)) -> Cage:
        """A box: center [3], full edge lengths [3] (or one for a cube), intrinsic XYZ rotation in radians."""
        c = vector(center, "cage center")
        s = factors(size, "cage size")
        offsets = (hexahedron.BITS - 0.5) * s
        theta = vector(rotation, "cage rotation")
        if theta.any():
            offsets = offsets @ rotation_matrix(theta).T
        return cls(c + offsets, pivot=c)

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other) or not isinstance(other, Cage):
            return NotImplemented
        return np.array_equal(self.corners, other.corners) and np.array_equal(self.pivot, other.pivot)

    def __hash__(self) -> int:
        return hash((self.corners.tobytes(), self.pivot.tobytes()))

    def __repr__(self) -> str:
        return f"Cage(corners={self.corners.tolist()})"

    @property
    def handles(self) -> Array:
        """Points [n,3] by which the cage is moved, all of which an outer cage must hold: its corners."""
        return self.corners

    def has_shape_of(self, other: Cage) -> bool:
        """True where another cage of this kind lies in the same place, but for its pivot."""
        return type(self) is type(other) and np.array_equal(self.corners, other.corners)

    @property
    def center(self) -> Array:
        """Mean of the `handles` [3]."""
        return np.asarray(self.handles.mean(axis=0))

    @property
    def edges(self) -> tuple[tuple[int, int], ...]:
        """The 12 corner pairs (i, j), i < j: four along x, four along y, four along z."""
        return EDGES

    @property
    def faces(self) -> dict[str, tuple[int, int, int, int]]:
        """The corner numbers of each face, by name."""
        return dict(FACES)

    @property
    def aabb(self) -> Array:
        """Axis-aligned box [2,3] (min, max) of the cage; the cage lies in the hull of its handles."""
        return np.stack([self.handles.min(axis=0), self.handles.max(axis=0)])

    @cached_property
    def affine(self) -> tuple[Array, Array]:
        """(A [3,3], b [3]) with x(u) = b + A u: exact where `is_affine`, else the least-squares fit."""
        C = hexahedron.coefficients(self.corners)
        A = 2.0 * C[[1, 2, 4]].T
        return A, C[0] - A.sum(axis=1) / 2.0

    @cached_property
    def is_affine(self) -> bool:
        """True when the cage is a parallelepiped, to 1e-12 of its extent."""
        C = hexahedron.coefficients(self.corners)
        return bool(np.abs(C[[3, 5, 6, 7]]).max() <= 1e-12 * np.abs(C[[1, 2, 4]]).max())

    @property
    def frame(self) -> tuple[Array, Array]:
        """(origin [3], edge vectors as columns [3,3]) of the least box along `affine` that holds the cage."""
        A, b = self.affine
        if self.is_affine:
            return b, A
        u = (self.handles - b) @ np.linalg.inv(A).T
        low, high = u.min(axis=0), u.max(axis=0)
        return b + A @ low, A * (high - low)

    def grown(self, margin: ArrayLike) -> Cage:
        """A parallelepiped around the cage: its `frame` moved outwards by a margin > 0, one or three.

        The margin is in world units along the frame's edges, the same on both sides.
        """
        m = factors(margin, "margin")
        origin, edges = self.frame
        lengths = np.linalg.norm(edges, axis=0)
        origin = origin - edges @ (m / lengths)
        return Cage(origin + hexahedron.BITS @ (edges * (1.0 + 2.0 * m / lengths)).T)

    @property
    def axes(self) -> Array:
        """Unit edge directions at the cage's middle, as the columns of a [3,3] matrix."""
        A = self.affine[0]
        return np.asarray(A / np.linalg.norm(A, axis=0))

    @property
    def heading(self) -> Array:
        """The rotation [3,3] nearest to `axes`."""
        U, _, Vt = np.linalg.svd(self.axes)
        return np.asarray(U @ Vt)

    def coordinates(self, points: ArrayLike) -> tuple[Array, Mask]:
        """(u [N,3], inside [N]) of points [N,3]: u in [0,1]^3 where inside, else unspecified."""
        p = np.asarray(points, dtype=np.float64)
        u = np.full(p.shape, np.nan)
        mask = np.zeros(len(p), dtype=bool)
        low, high = self.aabb
        slack = 1e-9 * (high - low)
        near = np.flatnonzero(hexahedron.all_three((p >= low - slack) & (p <= high + slack)))
        u[near], found = hexahedron.inverse(self.corners, p[near])
        mask[near] = hexahedron.inside(u[near], found)
        return u, mask

    def contains(self, points: ArrayLike) -> Mask:
        """Mask [N] of the points [N,3] in the closed cage; exact for planar and for bilinear faces."""
        return self.coordinates(points)[1]

    def translate(self, by: ArrayLike) -> Cage:
        """The cage moved by a vector [3]; the pivot travels with it."""
        v = vector(by, "translate")
        return self._moved(self.handles + v, self.pivot + v, rigid=True)

    def rotate(self, rotation: Rotation | ArrayLike, *, axes: Axes = "world") -> Cage:
        """The cage turned about its pivot by a SciPy `Rotation`, or by intrinsic XYZ angles [3] in radians.

        Angles give R_x R_y R_z, as `Rotation.from_euler("XYZ", angles)`. axes="cage" turns about the cage's
        own x, y and z directions instead of the world's.
        """
        if isinstance(rotation, Rotation):
            R = read_only(rotation.as_matrix(), (3, 3), "rotate")
        else:
            R = rotation_matrix(vector(rotation, "rotate"))
        if axes == "cage":
            R = self.heading @ R @ self.heading.T
        return self._linear(R, axes)

    def scale(self, by: ArrayLike, *, axes: Axes = "world") -> Cage:
        """The cage scaled about its pivot by one factor or three, each > 0.

        axes="world" scales along the world's x, y, z; axes="cage" along the cage's own edges.
        """
        return self._linear(np.diag(factors(by, "scale")), axes, own=True)

    def shear(
        self,
        *,
        xy: float = 0.0,
        xz: float = 0.0,
        yx: float = 0.0,
        yz: float = 0.0,
        zx: float = 0.0,
        zy: float = 0.0,
        axes: Axes = "world",
    ) -> Cage:
        """The cage sheared about its pivot: `xy` adds xy * y to x, and so on for the other pairs."""
        S = np.array([[1.0, xy, xz], [yx, 1.0, yz], [zx, zy, 1.0]])
        check_shear(S)
        return self._linear(S, axes, own=True)

    def move_corner(self, corner: int, by: ArrayLike) -> Cage:
        """The cage with corner k, 0 to 7, moved by a vector [3]; the pivot stays."""
        return self._move((corner_number(corner),), vector(by, "move_corner"))

    def move_edge(self, edge: tuple[int, int], by: ArrayLike) -> Cage:
        """The cage with both corners of edge (i, j) moved by a vector [3]; the pivot stays."""
        pair = tuple(sorted(corner_number(k) for k in edge))
        if pair not in EDGES:
            raise CageError(f"edge {tuple(edge)} is not an edge of a cage: the edges are {list(EDGES)}")
        return self._move(pair, vector(by, "move_edge"))

    def move_face(self, face: str, by: ArrayLike) -> Cage:
        """The cage with the four corners of a face, such as "+x", moved by a vector [3]; the pivot stays."""
        if face not in FACES:
            raise CageError(f'face "{face}" is not a face of a cage: the faces are {", ".join(FACES)}')
        return self._move(FACES[face], vector(by, "move_face"))

    def move_corners(self, corners: Iterable[int], by: ArrayLike) -> Cage:
        """The cage with some of its corners, each named once, moved by one vector [3]; the pivot stays."""
        chosen = tuple(corner_number(corner) for corner in corners)
        if not chosen or len(set(chosen)) < len(chosen):
            raise CageError(f"corners must name one or more corners, each once, got {list(chosen)}")
        return self._move(chosen, vector(by, "move_corners"))

    def _linear(self, M: Array, axes: Axes, own: bool = False) -> Cage:
        if axes not in ("world", "cage"):
            raise CageError(f'axes must be "world" or "cage", got "{axes}"')
        if own and axes == "cage":
            M = self.axes @ M @ np.linalg.inv(self.axes)
        return self._moved(self.pivot + (self.handles - self.pivot) @ M.T, self.pivot, rigid=True)

    def move_point(self, point: int, by: ArrayLike) -> Cage:
        """The cage with one of its `handles` moved by a vector [3]; the pivot stays."""
        return self.move_points((point,), by)

    def move_points(
        self, points: Iterable[int], by: ArrayLike, *, radius: float = 0.0, falloff: str = "smooth"
    ) -> Cage:
        """The cage with some of its `handles`, each named once, moved by one vector [3]; the pivot stays.

        With a radius > 0 (world units) points around them go along in part, by the weight of `falloff`
        ("smooth", "sphere", "root", "sharp" or "linear") at their distance from the nearest moved point.
        """
        v = vector(by, "move_points")
        chosen = point_numbers(points, len(self.handles))
        weight = np.zeros(len(self.handles))
        if not (np.isfinite(radius) and radius >= 0.0):
            raise CageError(f"radius must be 0 or a positive distance, got {radius!r}")
        if radius > 0.0:
            distance = np.linalg.norm(self.handles[:, None] - self.handles[chosen], axis=2).min(axis=1)
            weight = point_deformers.falloff_weight(distance, radius, falloff)
        weight[chosen] = 1.0
        return self._moved(self.handles + weight[:, None] * v, self.pivot)

    def subdivided(self, cells: Iterable[int], interpolation: str = "bspline") -> LatticeCage:
        """A lattice of control points, one more than `cells` [3] (1 to 7) along each axis, in the same place.

        `interpolation` is "bspline" or "linear", see `LatticeCage`.
        """
        shape = lattice_shape([n + 1 for n in cells])
        points = hexahedron.points(self.corners, bspline_lattice.grid(shape))
        return LatticeCage(points, shape, interpolation, pivot=self.pivot)

    def mirrored(self, axis: int, at: float) -> Cage:
        """The cage across the plane where coordinate `axis`, 0 to 2, is `at`.

        A mirrored cage would be inside out, so its corners are numbered the other way along that axis.
        """
        corners = point_deformers.mirrored(
            self.corners[[self.mirrored_handle(k, axis) for k in range(8)]], axis, at
        )
        return Cage(corners, pivot=point_deformers.mirrored(self.pivot, axis, at))

    def mirrored_handle(self, handle: int, axis: int) -> int:
        """The number, in the mirrored cage, of the mirror image of one of the `handles`."""
        return handle ^ 1 << axis

    def _moved(self, points: Array, pivot: Array, *, rigid: bool = False) -> Cage:
        """The cage with its `handles` elsewhere; `rigid` where one affine map takes all of them there."""
        return Cage(points, pivot=pivot)

    def _move(self, corners: tuple[int, ...], by: Array) -> Cage:
        moved = self.corners.copy()
        moved[list(corners)] += by
        return self._moved(moved, self.pivot)


@dataclass(frozen=True, eq=False, init=False)
class LatticeCage(LatticePoints["LatticeCage"], Cage):
    """A cage of 2 to 8 control points along each axis; its inside is their spline, see `bspline_lattice`.

    "bspline" is twice continuously differentiable throughout; "linear" is continuous, with kinks between the
    cells. The points of `Cage.subdivided` lie evenly, and then the spline is the cage's own trilinear map.

    Parameters: points [n,3] in world units, x fastest; shape (nx, ny, nz); interpolation; pivot [3], the mean
    of the points if left out. `corners` [8,3] are the outermost control points where they make a valid
    hexahedron, else the corners of `frame`: for gizmos and boxes, not for the map.

    `way` holds the control points of earlier states, which operations leave: a map may follow them.

    Operations move all control points; moving corners, edges or faces moves them by trilinear weights.

    Raises `CageError` for a wrong number of points, and where the Jacobian determinant is not proven positive
    over the whole lattice (Bernstein coefficients with subdivision, `lattice_determinant`).
    """

    is_hexahedron: ClassVar[bool] = False
    handle_noun: ClassVar[str] = "control point"
    plural_noun: ClassVar[str] = "lattices"

    def __init__(
        self,
        points: ArrayLike,
        shape: Iterable[int],
        interpolation: str = "bspline",
        *,
        pivot: ArrayLike | None = None,
        proven: bool = False,
        way: tuple[Array, ...] = (),
    ) -> None:
        counts = lattice_shape(shape)
        control = read_only(points, (int(np.prod(counts)), 3), "lattice points")
        place = control.mean(axis=0) if pivot is None else pivot
        object.__setattr__(self, "control_points", control)
        object.__setattr__(self, "shape", counts)
        object.__setattr__(self, "interpolation", interpolation)
        object.__setattr__(self, "way", way)
        object.__setattr__(self, "pivot", read_only(place, (3,), "cage pivot"))
        check_lattice(control, counts, interpolation, proven=proven)
        object.__setattr__(self, "corners", self.outermost)

    def mirrored(self, axis: int, at: float) -> LatticeCage:
        """The lattice across the plane where coordinate `axis` is `at`, numbered the other way along it."""
        order = [self.mirrored_handle(k, axis) for k in range(len(self.handles))]
        points, pivot = (
            point_deformers.mirrored(self.handles[order], axis, at),
            point_deformers.mirrored(self.pivot, axis, at),
        )
        return LatticeCage(points, self.shape, self.interpolation, pivot=pivot, proven=True)

    def subdivided(self, cells: Iterable[int], interpolation: str = "bspline") -> LatticeCage:
        """The lattice's even grid with other cells; raises `CageError` once points have been moved."""
        if not self.is_affine:
            raise CageError("a lattice is subdivided before its points are moved; subdivide the box instead")
        return super().subdivided(cells, interpolation)

    def _moved(
        self, points: Array, pivot: Array, *, rigid: bool = False, way: tuple[Array, ...] = ()
    ) -> LatticeCage:
        way = (*self.way, self.control_points, *way)[-MAX_WAY_STATES:]
        return LatticeCage(points, self.shape, self.interpolation, pivot=pivot, proven=rigid, way=way)

    def _move(self, corners: tuple[int, ...], by: Array) -> Cage:
        u = bspline_lattice.grid(self.shape)
        weight = np.zeros(len(u))
        for bits in hexahedron.BITS[list(corners)]:
            weight += np.where(bits == 1.0, u, 1.0 - u).prod(axis=1)
        return self._moved(self.control_points + weight[:, None] * by, self.pivot)
