"""Closed-form bends and twists of parts, with their inverses: the ground truth of bent and twisted edits.

Nothing here uses the code of edits. Points are [3,N], as in `shapes`; results are in their dtype.

Notation: canonical points are those of the part as modeled, deformed ones those of the bent part. s is the
coordinate along the axis, from `start` on. Over 0 <= s <= length the axis is bent or twisted; before it
nothing moves, after it the part goes on as a rigid body.

Source: Barr, "Global and local deformations of solid primitives", SIGGRAPH 1984.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cagefield.errors import SceneError
from cagefield.procedural.textures import Vector
from cagefield.typing import Array

Rows = NDArray[Any]


class Deformation(Protocol):
    """Invertible map of space that deforms a part."""

    def forward(self, points: Rows) -> Rows:
        """Deformed points [3,N] of canonical ones."""
        ...

    def inverse(self, points: Rows) -> Rows:
        """Canonical points [3,N] of deformed ones."""
        ...

    def inverse_jacobian(self, points: Rows) -> Rows:
        """Derivatives [3,3,N] of `inverse` at deformed points [3,N]."""
        ...

    def bound_distance(self, points: Rows, distance: Rows) -> Rows:
        """Lower bound [N] of the distance of deformed points to a deformed surface, to first order the
        distance where that is small in a bend.

        `distance` [N] is that of the canonical points to the canonical surface, negative inside as the bound.
        """
        ...

    def image_bounds(self, corners: Array) -> Array:
        """Box [2,3] that holds the deformed points of the hull of canonical corners [K,3]."""
        ...


def _frame(axis: ArrayLike, towards: ArrayLike, name: str) -> Array:
    """Rows [3,3]: the unit axis, the unit part of `towards` across it, their cross product."""
    a, b = np.array(axis, np.float64), np.array(towards, np.float64)
    if not (np.isfinite(a).all() and np.isfinite(b).all() and np.linalg.norm(np.cross(a, b)) > 1e-9):
        raise SceneError(
            f"axis {axis!r} and towards {towards!r} of a {name} must be two different directions"
        )
    a = a / np.linalg.norm(a)
    b = b - (a @ b) * a
    b = b / np.linalg.norm(b)
    return np.stack([a, b, np.cross(a, b)])


def _check_length(length: float, name: str) -> None:
    if not 0 < length < np.inf:
        raise SceneError(f"length of a {name} must be positive, not {length}")


def _box(low: Array, high: Array, frame: Array, start: Array) -> Array:
    """World box [2,3] of a box in a frame."""
    middle, half = start + (low + high) / 2 @ frame, (high - low) / 2 @ np.abs(frame)
    return np.stack([middle - half, middle + half])


@dataclass(frozen=True)
class ArcBend:
    """Bend of an axis into an arc of `angle` radians, in (0, pi], that turns towards another direction.

    The line through `start` along `axis` keeps its length; its radius is R = length / angle. With b the
    coordinate along `towards`, (s, b) goes to ((R - b) sin(s/R), R - (R - b) cos(s/R)); parts have b < R.
    """

    start: Vector
    axis: Vector
    towards: Vector
    length: float
    angle: float

    def __post_init__(self) -> None:
        _check_length(self.length, "bend")
        if not 0 < self.angle <= np.pi:
            raise SceneError(f"angle of a bend must be in (0, pi], not {self.angle}; turn `towards` around")
        self._frame  # noqa: B018 - checked here

    @cached_property
    def _frame(self) -> Array:
        return _frame(self.axis, self.towards, "bend")

    @property
    def radius(self) -> float:
        """Radius of the arc."""
        return self.length / self.angle

    def _local(self, points: Rows) -> Rows:
        rows: Rows = np.einsum("ij,jn->in", self._frame, points - np.array(self.start)[:, None])
        return rows.astype(points.dtype)

    def _world(self, local: list[Rows], like: Rows) -> Rows:
        rows: Rows = np.einsum("ji,jn->in", self._frame, np.stack(local)) + np.array(self.start)[:, None]
        return rows.astype(like.dtype)

    def _angle(self, s: Rows, b: Rows) -> Rows:
        """Angle [N] of deformed points about the arc's center; the cut lies opposite to the arc's middle."""
        half = self.angle / 2
        return (np.arctan2(s, self.radius - b) - half + np.pi) % (2 * np.pi) - np.pi + half

    def forward(self, points: Rows) -> Rows:
        s, b, c = self._local(points)
        turn = np.clip(s, 0, self.length) / self.radius
        over = s - np.clip(s, 0, self.length)
        arm = self.radius - b
        return self._world(
            [
                arm * np.sin(turn) + over * np.cos(turn),
                self.radius - arm * np.cos(turn) + over * np.sin(turn),
                c,
            ],
            points,
        )

    def inverse(self, points: Rows) -> Rows:
        s, b, c = self._local(points)
        turn = np.clip(self._angle(s, b), 0, self.angle)
        bent = (turn > 0) & (turn < self.angle)
        # from the arc's center, along the arc's tangent and inwards
        along = s * np.cos(turn) - (self.radius - b) * np.sin(turn)
        arm = np.where(
            bent, np.hypot(s, self.radius - b), s * np.sin(turn) + (self.radius - b) * np.cos(turn)
        )
        return self._world([self.radius * turn + np.where(bent, 0, along), self.radius - arm, c], points)

    def inverse_jacobian(self, points: Rows) -> Rows:
        s, b, _ = self._local(points)
        turn = np.clip(self._angle(s, b), 0, self.angle)
        bent = (turn > 0) & (turn < self.angle)
        stretch = np.where(bent, self.radius / np.maximum(np.hypot(s, self.radius - b), 1e-9), 1.0)
        local = np.zeros((3, 3, len(turn)))
        local[0, 0], local[0, 1] = stretch * np.cos(turn), stretch * np.sin(turn)
        local[1, 0], local[1, 1] = -np.sin(turn), np.cos(turn)
        local[2, 2] = 1
        return np.einsum("ai,abn,bj->ijn", self._frame, local, self._frame).astype(points.dtype)

    def bound_distance(self, points: Rows, distance: Rows) -> Rows:
        """Lower bound [N], see `Deformation`.

        Within d of a point at distance rho from the arc's center lengths grow by R / (rho - d) at most, so
        that the surface is d = D rho / (R + D) away, or more. No surface across the cut is nearer than
        (R - b) sin(angle / 2); b is taken as R / 2 at most.
        """
        s, b, _ = self._local(points)
        rho, size = np.hypot(s, self.radius - b), np.abs(distance)
        near = distance * np.minimum(rho / (self.radius + size), 1)
        bound: Rows = np.minimum(near, self.radius * np.sin(self.angle / 2) / 2)
        return bound.astype(points.dtype)

    def image_bounds(self, corners: Array) -> Array:
        low, high = (f((corners - np.array(self.start)) @ self._frame.T, axis=0) for f in (np.min, np.max))
        if high[1] >= self.radius:
            raise SceneError(
                f"a part reaches {high[1]:.3g} towards the bend, past its radius of {self.radius:.3g}; bend "
                "it less, or over a greater length"
            )
        # of the coordinates, linear in b, the extremes along s are at ends, and at multiples of a right angle
        turns = np.array([0, np.pi / 2, np.pi, self.angle])
        s = np.unique(
            np.clip([low[0], high[0], *(self.radius * turns[turns <= self.angle])], low[0], high[0])
        )
        s, b = (grid.ravel() for grid in np.meshgrid(s, [low[1], high[1]]))
        world = np.einsum("ji,jn->in", self._frame, np.stack([s, b, 0 * s])) + np.array(self.start)[:, None]
        image = self._local(self.forward(world))
        image_low, image_high = image.min(1), image.max(1)
        image_low[2], image_high[2] = low[2], high[2]
        return _box(image_low, image_high, self._frame, np.array(self.start))


@dataclass(frozen=True)
class AxialTwist:
    """Twist about the axis through `start`, by `angle` radians in all, evenly over `length`; right-handed."""

    start: Vector
    axis: Vector
    length: float
    angle: float

    def __post_init__(self) -> None:
        _check_length(self.length, "twist")
        if not np.isfinite(self.angle):
            raise SceneError(f"angle of a twist must be finite, not {self.angle}")
        self._frame  # noqa: B018 - checked here

    @cached_property
    def _frame(self) -> Array:
        across = np.eye(3)[int(np.argmin(np.abs(np.array(self.axis, np.float64))))]
        return _frame(self.axis, across, "twist")

    @property
    def _rate(self) -> float:
        return self.angle / self.length

    def _local(self, points: Rows) -> Rows:
        rows: Rows = np.einsum("ij,jn->in", self._frame, points - np.array(self.start)[:, None])
        return rows.astype(points.dtype)

    def _turned(self, points: Rows, sign: float) -> Rows:
        s, a, b = self._local(points)
        turn = sign * self._rate * np.clip(s, 0, self.length)
        cos, sin = np.cos(turn), np.sin(turn)
        local = np.stack([s, cos * a - sin * b, sin * a + cos * b])
        rows: Rows = np.einsum("ji,jn->in", self._frame, local) + np.array(self.start)[:, None]
        return rows.astype(points.dtype)

    def forward(self, points: Rows) -> Rows:
        return self._turned(points, 1.0)

    def inverse(self, points: Rows) -> Rows:
        return self._turned(points, -1.0)

    def inverse_jacobian(self, points: Rows) -> Rows:
        s, a, b = self._local(points)
        turn = self._rate * np.clip(s, 0, self.length)
        rate = np.where((s > 0) & (s < self.length), self._rate, 0.0)
        cos, sin = np.cos(turn), np.sin(turn)
        local = np.zeros((3, 3, len(turn)))
        local[0, 0] = 1
        local[1, 1], local[1, 2], local[1, 0] = cos, sin, rate * (cos * b - sin * a)
        local[2, 1], local[2, 2], local[2, 0] = -sin, cos, -rate * (cos * a + sin * b)
        return np.einsum("ai,abn,bj->ijn", self._frame, local, self._frame).astype(points.dtype)

    def bound_distance(self, points: Rows, distance: Rows) -> Rows:
        """Lower bound [N], see `Deformation`.

        At radius r lengths grow by at most (k + sqrt(k^2 + 4)) / 2, k = r angle / length: a shear's.
        """
        _, a, b = self._local(points)
        k = (np.hypot(a, b) + np.abs(distance)) * abs(self._rate)
        bound: Rows = distance / ((k + np.sqrt(k * k + 4)) / 2)
        return bound.astype(points.dtype)

    def image_bounds(self, corners: Array) -> Array:
        local = (corners - np.array(self.start)) @ self._frame.T
        low, high = local.min(axis=0), local.max(axis=0)
        if high[0] > 0:
            radius = float(np.hypot(*np.maximum(np.abs(low[1:]), np.abs(high[1:]))))
            low[1:], high[1:] = -radius, radius
        return _box(low, high, self._frame, np.array(self.start))


POINT_PULL_STEPS = 48


@dataclass(frozen=True)
class PointPull:
    """Pull of a point by a vector; around it points follow less, and from `radius` on not at all.

    The flow from t = 0 to 1 of the velocity by * w(|x - point - t by| / radius), w(g) = h^2 (3 - 2 h) with
    h = max(1 - g, 0), by the Runge-Kutta method of order 4 in POINT_PULL_STEPS steps; `inverse` runs it
    backwards.
    """

    point: Vector
    by: Vector
    radius: float

    def __post_init__(self) -> None:
        _check_length(self.radius, "pull")

    def forward(self, points: Rows) -> Rows:
        return self._flow(points, 0.0, 1.0)

    def inverse(self, points: Rows) -> Rows:
        return self._flow(points, 1.0, -1.0)

    def _flow(self, points: Rows, t: float, sign: float) -> Rows:
        x, h = points.astype(np.float64), sign / POINT_PULL_STEPS
        for _ in range(POINT_PULL_STEPS):
            k1 = self._velocity(x, t)
            k2 = self._velocity(x + h / 2 * k1, t + h / 2)
            k3 = self._velocity(x + h / 2 * k2, t + h / 2)
            k4 = self._velocity(x + h * k3, t + h)
            x, t = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), t + h
        return x.astype(points.dtype)

    def _velocity(self, x: Rows, t: float) -> Rows:
        by = np.array(self.by, np.float64)[:, None]
        away = x - np.array(self.point)[:, None] - t * by
        near = np.maximum(1 - np.sqrt((away**2).sum(0)) / self.radius, 0)
        velocity: Rows = by * (near * near * (3 - 2 * near))
        return velocity

    def inverse_jacobian(self, points: Rows) -> Rows:
        step, columns = 1e-5, []
        x = points.astype(np.float64)
        for axis in range(3):
            offset = step * np.eye(3)[axis][:, None]
            columns.append((self.inverse(x + offset) - self.inverse(x - offset)) / (2 * step))
        return np.stack(columns, axis=1).astype(points.dtype)

    def bound_distance(self, points: Rows, distance: Rows) -> Rows:
        """Lower bound [N], see `Deformation`; the velocity's slope is 1.5 |by| / radius at most."""
        slope = 1.5 * float(np.linalg.norm(self.by)) / self.radius
        bound: Rows = distance * np.exp(-slope)
        return bound.astype(points.dtype)

    def image_bounds(self, corners: Array) -> Array:
        low, high, by = corners.min(axis=0), corners.max(axis=0), np.array(self.by, np.float64)
        return np.stack([low + np.minimum(by, 0), high + np.maximum(by, 0)])
