"""Control points: an inner cage of points with a radius, around which the field follows by a falloff."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from cagefield.errors import CageError
from cagefield.geometry import hexahedron
from cagefield.geometry.cage import Axes, Cage
from cagefield.geometry.cage_checks import format_vector, read_only
from cagefield.geometry.detour_grid import DetourGrid
from cagefield.geometry.point_deformers import FALLOFF_CURVES, mirrored
from cagefield.typing import Array, Mask

MAX_CONTROL_POINTS = 256
"""Control points of an edit: a map evaluates all of them at each of its points."""

LEAST_SPACING = 1e-6
"""Least distance of two control points, as a share of the radius."""


@dataclass(frozen=True, eq=False, init=False, repr=False)
class ControlPoints(Cage):
    """Points that are dragged, with everything around them up to a radius going along, less and less.

    Parameters
    - points: [n,3] world units, n from 1 to `MAX_CONTROL_POINTS`.
    - radius: reach of each point, world units, > 0.
    - falloff: one of `FALLOFF_CURVES`.
    - pivot: [3], about which `rotate`, `scale` and `shear` turn; the mean of the points if left out.
    - linear: [3,3] with a positive determinant, the linear map that these operations have made of the space
      around the points: distances are measured before it. The identity for new points.
    - connected: True measures distances through dense matter ("Connected Only" of 3D editors), so that a
      finger moves without the one beside it.
    - detours: of connected points, how much longer than straight the ways through the matter of a field are,
      in the space of the canonical `local_points`; None until a scene prepares the edit
      (`selection.connected_points`). No part of edit files.

    `corners` are those of the parallelepiped that holds the balls around all points, under `linear`.

    Raises `CageError` for points that are not finite, too many or in one place, a radius that is not
    positive, and an unknown falloff.

    Source: Li & Pan, "Interactive Geometry Editing of Neural Radiance Fields", section 3: cages "are not
    restricted to typical shapes. Users can even indicate some control points"; the falloff is the
    proportional editing of 3D editors.
    """

    points: Array
    radius: float
    falloff: str
    linear: Array
    connected: bool
    detours: DetourGrid | None

    is_hexahedron: ClassVar[bool] = False
    has_own_falloff: ClassVar[bool] = True
    handle_noun: ClassVar[str] = "control point"
    plural_noun: ClassVar[str] = "control points"

    def __init__(
        self,
        points: ArrayLike,
        radius: float,
        falloff: str = "smooth",
        *,
        pivot: ArrayLike | None = None,
        linear: ArrayLike | None = None,
        connected: bool = False,
        detours: DetourGrid | None = None,
    ) -> None:
        p = _points(points)
        r = _radius(radius)
        if falloff not in FALLOFF_CURVES:
            raise CageError(f'falloff must be one of {", ".join(FALLOFF_CURVES)}, got "{falloff!s:.40}"')
        at = p.mean(axis=0) if pivot is None else pivot
        A = read_only(np.eye(3) if linear is None else linear, (3, 3), "linear map of control points")
        if not np.linalg.det(A) > 0.0:
            raise CageError(
                f"linear map of control points must have a positive determinant, got {np.linalg.det(A):.3g};"
                " leave it out for new points"
            )
        if not isinstance(connected, bool) or (detours is not None and not connected):
            raise CageError(
                f"connected must be True or False, and True with detours, got {connected!r:.40}; of points"
                " that are not connected leave detours out"
            )
        for name, value in (
            ("connected", connected),
            ("detours", detours),
            ("points", p),
            ("radius", r),
            ("falloff", falloff),
            ("linear", A),
            ("pivot", read_only(at, (3,), "pivot of control points")),
        ):
            object.__setattr__(self, name, value)
        self._check_spacing()
        object.__setattr__(self, "corners", self._box())
        super().__post_init__()

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ControlPoints):
            return NotImplemented
        return self.has_shape_of(other) and np.array_equal(self.pivot, other.pivot)

    def __hash__(self) -> int:
        return hash((self.points.tobytes(), self.radius, self.falloff, self.linear.tobytes()))

    def __repr__(self) -> str:
        shape = f"{self.points.tolist()}, radius={self.radius}, falloff={self.falloff!r}"
        return f"ControlPoints({shape}{', connected=True' if self.connected else ''})"

    @property
    def handles(self) -> Array:
        """The points [n,3]."""
        return self.points

    def has_shape_of(self, other: Cage) -> bool:
        """True where the other points, radius, falloff and linear map are these."""
        return (
            isinstance(other, ControlPoints)
            and np.array_equal(self.points, other.points)
            and (self.radius, self.falloff, self.connected) == (other.radius, other.falloff, other.connected)
            and self.detours == other.detours
            and np.array_equal(self.linear, other.linear)
        )

    @property
    def is_unprepared(self) -> bool:
        """True of connected points whose detours are not known yet."""
        return self.connected and self.detours is None

    def with_detours(self, detours: DetourGrid | None) -> ControlPoints:
        """The connected points with the detours of a field; None leaves them out."""
        return self.with_reach(detours=detours)

    def with_reach(
        self,
        *,
        radius: float | None = None,
        falloff: str | None = None,
        connected: bool | None = None,
        detours: DetourGrid | None = None,
    ) -> ControlPoints:
        """The points with another radius, falloff or kind of distance; None leaves each, but for detours."""
        return ControlPoints(
            self.points,
            self.radius if radius is None else radius,
            self.falloff if falloff is None else falloff,
            pivot=self.pivot,
            linear=self.linear,
            connected=self.connected if connected is None else connected,
            detours=detours,
        )

    @cached_property
    def local_points(self) -> Array:
        """The points [n,3] before `linear`: linear^-1 (p - pivot)."""
        return np.asarray((self.points - self.pivot) @ np.linalg.inv(self.linear).T)

    @property
    def aabb(self) -> Array:
        """Axis-aligned box [2,3] (min, max) of the reach of all points."""
        reach = self.radius * np.linalg.norm(self.linear, axis=1)
        return np.stack([self.points.min(axis=0) - reach, self.points.max(axis=0) + reach])

    def coordinates(self, points: ArrayLike) -> tuple[Array, Mask]:
        """(u [N,3], inside [N]) of points [N,3]: u in the box of `corners`; inside within the reach."""
        p = np.asarray(points, dtype=np.float64)
        return super().coordinates(p)[0], self.contains(p)

    def contains(self, points: ArrayLike) -> Mask:
        """Mask [N] of the points [N,3] within the radius of a control point."""
        p = np.asarray(points, dtype=np.float64)
        mask = np.zeros(len(p), dtype=bool)
        low, high = self.aabb
        near = np.flatnonzero(hexahedron.all_three((p >= low) & (p <= high)))
        y = (p[near] - self.pivot) @ np.linalg.inv(self.linear).T
        for point in self.local_points:
            mask[near] |= ((y - point) ** 2).sum(axis=1) <= self.radius**2
        return mask

    def mirrored(self, axis: int, at: float) -> ControlPoints:
        """The points across the plane where coordinate `axis` is `at`; their numbers stay."""
        F = np.diag(np.where(np.arange(3) == axis, -1.0, 1.0))
        points, pivot = mirrored(self.points, axis, at), mirrored(self.pivot, axis, at)
        # Other matter: its detours are not those of this side.
        return self.with_detours(None)._moved(points, pivot, linear=F @ self.linear @ F)

    def mirrored_handle(self, handle: int, axis: int) -> int:
        """The number itself: points keep theirs."""
        return handle

    def subdivided(self, cells: Iterable[int], interpolation: str = "bspline") -> NoReturn:
        """Raises `CageError`: points have no cells."""
        raise CageError("control points have no cells; subdivide a box, or add points")

    def _linear(self, M: Array, axes: Axes, own: bool = False) -> ControlPoints:
        if axes not in ("world", "cage"):
            raise CageError(f'axes must be "world" or "cage", got "{axes}"')
        if own and axes == "cage":
            M = self.axes @ M @ np.linalg.inv(self.axes)
        moved = self.pivot + (self.points - self.pivot) @ M.T
        return self._moved(moved, self.pivot, rigid=True, linear=M @ self.linear)

    def _move(self, corners: tuple[int, ...], by: Array) -> NoReturn:
        raise CageError("control points have no corners, edges or faces; use move_point")

    def _moved(
        self, points: Array, pivot: Array, *, rigid: bool = False, linear: Array | None = None
    ) -> ControlPoints:
        A = self.linear if linear is None else linear
        return ControlPoints(
            points,
            self.radius,
            self.falloff,
            pivot=pivot,
            linear=A,
            connected=self.connected,
            detours=self.detours,
        )

    def _box(self) -> Array:
        y = self.local_points
        low, high = y.min(axis=0) - self.radius, y.max(axis=0) + self.radius
        return np.asarray(self.pivot + (low + hexahedron.BITS * (high - low)) @ self.linear.T)

    def _check_spacing(self) -> None:
        y, least = self.local_points, LEAST_SPACING * self.radius
        for j in range(1, len(y)):
            distance = np.linalg.norm(y[:j] - y[j], axis=1)
            i = int(np.argmin(distance))
            if distance[i] < least:
                raise CageError(
                    f"control points {i} and {j} are both at {format_vector(self.points[j])}; keep them"
                    " apart, or leave one out"
                )


def _points(value: ArrayLike) -> Array:
    """Finite points [n,3] that cannot be written, or a `CageError`."""
    try:
        shape = np.shape(np.array(value, dtype=np.float64))
    except (TypeError, ValueError):
        shape = ()
    if len(shape) != 2 or shape[1] != 3 or not 1 <= shape[0] <= MAX_CONTROL_POINTS:
        raise CageError(
            f"control points must be 1 to {MAX_CONTROL_POINTS} points of 3 numbers, got"
            + (f" shape {list(shape)}" if shape else f" {value!r:.60}")
        )
    points = np.array(value, dtype=np.float64)
    for k in np.flatnonzero(~np.isfinite(points).all(axis=1)):
        raise CageError(f"control point {k} must be finite, got {format_vector(points[k])}")
    points.setflags(write=False)
    return points


def _radius(value: float) -> float:
    """A positive finite radius, or a `CageError`."""
    try:
        radius = float(value)
    except (TypeError, ValueError):
        raise CageError(f"radius of control points must be a number, got {value!r:.60}") from None
    if not 0.0 < radius < np.inf:
        raise CageError(f"radius of control points must be positive and finite, got {radius:g}")
    return radius
