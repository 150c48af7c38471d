"""Control points of a lattice cage: its spline, and operations that only a lattice has."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from cagefield.errors import CageError
from cagefield.geometry import bspline_lattice, hexahedron, lattice_determinant, point_deformers
from cagefield.geometry.cage_checks import are_valid
from cagefield.typing import Array, Mask

Lattice = TypeVar("Lattice")

STATE_ANGLE = 1.0
"""Radians after which a bend or twist leaves a state on the lattice's way."""


class LatticePoints(ABC, Generic[Lattice]):
    """Lattice of control points [n,3], shape (nx, ny, nz), x fastest, and its interpolation."""

    control_points: Array
    shape: tuple[int, int, int]
    interpolation: str
    way: tuple[Array, ...]
    pivot: Array
    frame: tuple[Array, Array]

    @abstractmethod
    def _moved(
        self, points: Array, pivot: Array, *, rigid: bool = False, way: tuple[Array, ...] = ()
    ) -> Lattice:
        """The lattice with its points elsewhere, by way of some states [n,3]; `rigid`: by one affine map."""

    @property
    def points(self) -> Array:
        """The control points [n,3], x fastest."""
        return self.control_points

    @property
    def handles(self) -> Array:
        """The control points [n,3]."""
        return self.control_points

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, LatticePoints):
            return NotImplemented
        return self.has_shape_of(other) and np.array_equal(self.pivot, other.pivot)

    def __hash__(self) -> int:
        return hash((self.control_points.tobytes(), self.pivot.tobytes(), self.shape, self.interpolation))

    def __repr__(self) -> str:
        return (
            f"LatticeCage(points={self.control_points.tolist()}, shape={self.shape},"
            f' interpolation="{self.interpolation}")'
        )

    def has_shape_of(self, other: object) -> bool:
        """True where another lattice has the same control points and interpolation."""
        return (
            isinstance(other, LatticePoints)
            and self.shape == other.shape
            and self.interpolation == other.interpolation
            and np.array_equal(self.control_points, other.control_points)
        )

    def mirrored_handle(self, handle: int, axis: int) -> int:
        """The number, in the mirrored lattice, of the mirror image of a control point."""
        at = list(np.unravel_index(handle, self.shape, order="F"))
        at[axis] = self.shape[axis] - 1 - at[axis]
        return int(np.ravel_multi_index(tuple(at), self.shape, order="F"))

    @property
    def outermost(self) -> Array:
        """The outermost control points [8,3], or where they are no valid hexahedron, `frame`'s corners."""
        nx, ny, nz = self.shape
        x, y, z = (hexahedron.BITS * (nx - 1, ny - 1, nz - 1)).astype(np.intp).T
        corners = self.control_points[x + nx * (y + ny * z)]
        if not are_valid(corners[None])[0]:
            origin, edges = self.frame
            corners = origin + hexahedron.BITS @ edges.T
        corners.setflags(write=False)
        return corners

    @cached_property
    def affine(self) -> tuple[Array, Array]:
        """(A [3,3], b [3]) with x(u) = b + A u for the control points, in the least-squares sense."""
        return lattice_determinant.fit(self.control_points, self.shape)

    @cached_property
    def is_affine(self) -> bool:
        """True when the lattice is an even grid in a parallelepiped, to 1e-12 of its extent."""
        A, b = self.affine
        even = b + bspline_lattice.grid(self.shape) @ A.T
        return bool(np.abs(even - self.control_points).max() <= 1e-12 * np.abs(A).max())

    def coordinates(self, points: ArrayLike) -> tuple[Array, Mask]:
        """(u [N,3], inside [N]) of points [N,3]: u in [0,1]^3 where inside, else unspecified."""
        p = np.asarray(points, dtype=np.float64)
        u, mask = np.full(p.shape, np.nan), np.zeros(len(p), dtype=bool)
        low, high = self.control_points.min(axis=0), self.control_points.max(axis=0)
        slack = 1e-9 * (high - low)
        near = np.flatnonzero(hexahedron.all_three((p >= low - slack) & (p <= high + slack)))
        u[near], mask[near] = bspline_lattice.inverse(
            self.control_points, self.shape, self.interpolation, p[near]
        )
        return u, mask

    def evaluate(self, u: Array) -> tuple[Array, Array]:
        """(x(u) [N,3], dx/du [N,3,3]) at u [N,3]."""
        return bspline_lattice.evaluate(self.control_points, self.shape, self.interpolation, u)

    @property
    def _turn(self) -> Array:
        """The rotation [3,3] nearest to the lattice's own axes."""
        A = self.affine[0]
        U, _, Vt = np.linalg.svd(A / np.linalg.norm(A, axis=0))
        return np.asarray(U @ Vt)

    def bend(self, axis: str, angle: float, *, towards: str = "", fixed: str = "start") -> Lattice:
        """The lattice bent: its middle line along an axis of its own becomes an arc of `angle` radians.

        `axis` and `towards` (the next axis in the order x, y, z, x if left out) are "x", "y" or "z";
        `fixed`, "start", "middle" or "end", is where along the axis nothing moves. Raises `CageError` for a
        cage without a lattice, unknown names, and a bend that turns the cage inside out.
        """
        along = point_deformers.axis_number(axis, "axis")
        across = point_deformers.axis_number(towards, "towards") if towards else (along + 1) % 3
        if across == along:
            raise CageError(f"a bend along {axis} goes towards another axis than {axis}")
        turn, points, Q = finite(angle, "bend angle"), self.control_points, self._turn
        states = [point_deformers.bend(points, Q, along, across, t * turn, fixed) for t in shares(turn)]
        return self._moved(states[-1], self.pivot, way=tuple(states[:-1]))

    def twist(self, axis: str, angle: float, *, fixed: str = "start") -> Lattice:
        """The lattice twisted about an axis of its own by `angle` radians from end to end; see `bend`."""
        along, turn = point_deformers.axis_number(axis, "axis"), finite(angle, "twist angle")
        points, Q = self.control_points, self._turn
        states = [point_deformers.twist(points, Q, along, t * turn, fixed) for t in shares(turn)]
        return self._moved(states[-1], self.pivot, way=tuple(states[:-1]))

    def taper(self, axis: str, factor: float, *, fixed: str = "start") -> Lattice:
        """The lattice scaled across an axis of its own, evenly to a factor > 0 at its end; see `bend`."""
        along, by = point_deformers.axis_number(axis, "axis"), finite(factor, "taper factor")
        if by <= 0.0:
            raise CageError(f"taper factor must be positive, got {by:g}")
        points = point_deformers.taper(self.control_points, self._turn, along, by, fixed)
        return self._moved(points, self.pivot)


def shares(angle: float) -> list[float]:
    """Shares of an angle, up to the whole, that are no more than `STATE_ANGLE` apart; at most 64."""
    count = int(np.clip(np.ceil(abs(angle) / STATE_ANGLE), 1, 64))
    return [(n + 1) / count for n in range(count)]


def finite(value: float, name: str) -> float:
    """A finite number, or a `CageError` that names it."""
    if not np.isfinite(value):
        raise CageError(f"{name} must be finite, got {float(value):g}")
    return float(value)
