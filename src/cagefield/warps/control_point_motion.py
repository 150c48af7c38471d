"""The way of control points from their canonical to their deformed places, and how far they reach on it.

Notation: t in [0,1] is the time, c(t) the pivot, F(t) the linear map of the space around the points (see
`linear_motion`), y_j(t) the points before it, so that point j is at

    p_j(t) = c(t) + F(t) y_j(t).

c and y_j go along straight lines. A point x has y = F^-1 (x - c); |y - y_j| is its distance from point j.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cagefield.geometry.control_points import ControlPoints
from cagefield.typing import Array
from cagefield.warps.free_form import BOUND_TIMES
from cagefield.warps.linear_motion import LinearMotion

DISTANCE_POWER = 12
"""Exponent p of the distance from all points, see `ControlPointVelocity`."""


@dataclass(frozen=True)
class ControlPointMotion:
    """The way of control points, t from 0 (canonical) to 1 (deformed)."""

    inner: ControlPoints
    deformed: ControlPoints

    @cached_property
    def linear(self) -> LinearMotion:
        """The way of F."""
        return LinearMotion(self.inner.linear, self.deformed.linear)

    @cached_property
    def rates(self) -> Array:
        """dy_j/dt [n,3]."""
        return self.deformed.local_points - self.inner.local_points

    @cached_property
    def pivot_rate(self) -> Array:
        """dc/dt [3]."""
        return self.deformed.pivot - self.inner.pivot

    @property
    def radius(self) -> float:
        """The radius r of the points."""
        return self.inner.radius

    @cached_property
    def reach(self) -> float:
        """Distance |y - y_j| from all points j from which on nothing moves: r n^(1/p)."""
        return float(self.radius * len(self.inner.points) ** (1.0 / DISTANCE_POWER))

    def centers(self, t: Array) -> Array:
        """c [T,3] at times t [T]."""
        return np.asarray(self.inner.pivot + t[:, None] * self.pivot_rate)

    def local_points(self, t: Array) -> Array:
        """y_j [T,n,3] at times t [T]."""
        return np.asarray(self.inner.local_points + t[:, None, None] * self.rates)

    def velocities(self, t: Array) -> Array:
        """dp_j/dt [T,n,3] at times t [T]."""
        F, dF = self.linear.at(t)
        along = self.local_points(t) @ np.transpose(dF, (0, 2, 1)) + self.rates @ np.transpose(F, (0, 2, 1))
        return np.asarray(self.pivot_rate + along)

    def acceleration_bound(self) -> float:
        """Bound of |d^2 p_j / dt^2| at all times and points.

        With g = |dF/dt F^-1| <= angle + log stretch: |d^2 F/dt^2| <= (2 angle log stretch + g^2) |F|.
        """
        angle, stretch = self.linear.rates
        g = angle + stretch
        size = self.linear_bound
        y = max(np.linalg.norm(each.local_points, axis=1).max() for each in (self.inner, self.deformed))
        rate = float(np.linalg.norm(self.rates, axis=1).max())
        return float(size * ((2.0 * angle * stretch + g * g) * y + 2.0 * g * rate))

    @cached_property
    def linear_bound(self) -> float:
        """Bound of |F| at all times: its logarithm grows by less than the stretch's."""
        return float(np.linalg.norm(self.inner.linear, 2) * np.exp(max(self.linear.rates[1], 0.0)))

    @cached_property
    def _way(self) -> tuple[Array, Array]:
        """(p_j [T,n,3], F [T,3,3]) at `BOUND_TIMES`."""
        F, _ = self.linear.at(BOUND_TIMES)
        p = self.centers(BOUND_TIMES)[:, None] + self.local_points(BOUND_TIMES) @ np.transpose(F, (0, 2, 1))
        return p, F

    def extents(self, normals: Array) -> tuple[Array, Array]:
        """(n . p_j, n . x) [K], the most along directions n [K,3] of any point, and of all that is moved.

        Bounds at all times, not samples.
        """
        p, F = self._way
        step = float(BOUND_TIMES[1])
        # Between two times a point is within h^2 / 8 of its acceleration from the chord.
        slack = 0.125 * step * step * self.acceleration_bound()
        along = (p.reshape(-1, 3) @ normals.T).max(axis=0)
        # Ellipsoids |F^-1 (x - p_j)| <= reach, grown by the change of F to the nearer of two times.
        change = 0.5 * step * sum(self.linear.rates) * self.linear_bound
        radii = self.reach * (np.linalg.norm(normals @ F, axis=2) + change)
        most = (p @ normals.T + radii[:, None]).reshape(-1, len(normals)).max(axis=0)
        return along + slack, most + slack

    def box(self) -> Array:
        """Axis-aligned box [2,3] (min, max) that holds everything that is moved on the way."""
        _, high = self.extents(np.concatenate([np.eye(3), -np.eye(3)]))
        return np.stack([-high[3:], high[:3]])

    def separations(self) -> Array:
        """Least |y_i - y_j| [I,n,n] in each interval of `BOUND_TIMES`; infinite for a point and itself."""
        start = self.inner.local_points[:, None] - self.inner.local_points[None]
        rate = self.rates[:, None] - self.rates[None]
        speed = (rate * rate).sum(axis=2)
        closest = -(start * rate).sum(axis=2) / np.where(speed > 0.0, speed, 1.0)
        t = np.clip(closest, BOUND_TIMES[:-1, None, None], BOUND_TIMES[1:, None, None])
        found = np.linalg.norm(start + t[..., None] * rate, axis=3)
        n = len(start)
        found[:, np.arange(n), np.arange(n)] = np.inf
        return found
