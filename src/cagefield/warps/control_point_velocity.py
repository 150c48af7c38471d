"""The velocity of control points and everything within their reach.

With y = F^-1 (x - c), d_j = |y - y_j| (see `control_point_motion`), n points and the radius r,

    1 / d^p = sum_j 1 / d_j^p, p = 12:   the distance from the points, smooth where two are equally near;
    b_j = d_j^-4 / sum_i d_i^-4:         how much of the motion of point j is taken over;
    q = y - t sum_j b_j dy_j/dt:         the place at t = 0 of matter that follows the points;
    v(x, t) = u(x) w(1 - (d + E(q)) / r) (dc/dt + dF/dt y + F sum_j b_j dy_j/dt),

with w the falloff (see `falloff_curves`) and u the weight of the outer cage (see `outer_planes`), which is 1
where that holds all that the points reach. d is at most the distance from the nearest point, equal to it at
the points, and its gradient is at most 1. A point takes its place along: v(p_j, t) = dp_j/dt.

E >= 0 is 0, but for connected points (see `geometry.detour_grid`): there d + E is the way through dense
matter, at t = 0 and for what follows the points. E is 0 at the points, and its gradient bounded by its nodes:

    |d(d + E(q)) / dx| <= (1 + |dE/dq| (1 + t |d sum_j b_j dy_j/dt / dy|)) |F^-1|.

The blend b is Shepard's (inverse distances). For data e_j = dy_j/dt at points s_ij apart its slope is at most

    4 min(sum_(i<j) |e_i - e_j| / s_ij, (1 + n^(1/4)) max_ij |e_i - e_j| / s_ij).

The first: the slope is at most 4 sum_(i<j) b_i b_j |e_i - e_j| (1 / d_i + 1 / d_j), and with
d_i + d_j >= s_ij each term is largest where d_i = d_j = s_ij / 2. The second: |e_i - e_j| <= L (d_i + d_j),
and sum_i b_i d_i <= n^(1/4) min_i d_i by Jensen's inequality.

Source of the blend: Shepard, "A two-dimensional interpolation function for irregularly-spaced data" (1968).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cagefield.geometry.cage import Cage
from cagefield.geometry.control_points import LEAST_SPACING, ControlPoints
from cagefield.typing import Array, Float32
from cagefield.warps.cage_maps import flow_between, inner_map_between, reach_between
from cagefield.warps.control_point_motion import DISTANCE_POWER, ControlPointMotion
from cagefield.warps.falloff import Falloff
from cagefield.warps.falloff_curves import STEEPEST, curve, curve_number
from cagefield.warps.free_form import BOUND_TIMES, EXACT_STEP_STRAIN, KINKED_STEP_STRAIN, FreeFormFlow
from cagefield.warps.interfaces import InnerMap, NoInnerMap, Shell
from cagefield.warps.outer_planes import OuterPlanes

BLEND_POWER = 4
"""Exponent of the inverse distances by which the points' velocities are blended."""

LEAST_ROOM = 1e-3
"""Least distance of a control point from the outer cage on its way, as a share of the radius."""

NO_NODES: Float32 = np.zeros((0, 0, 0), np.float32)
"""Nodes of no detours; read-only, as those of a grid, so that kernels are compiled once."""
NO_NODES.setflags(write=False)

_CHUNK = 400_000
"""Pairs of points and control points at a time."""


@dataclass(frozen=True)
class ControlPointVelocity:
    """v(x, t) of control points that go from `inner` to `deformed` in an outer cage; see the module."""

    inner: ControlPoints
    deformed: ControlPoints
    outer: Cage

    @cached_property
    def motion(self) -> ControlPointMotion:
        """The way of the points."""
        return ControlPointMotion(self.inner, self.deformed)

    @cached_property
    def planes(self) -> OuterPlanes:
        """The half-spaces of the outer cage."""
        return OuterPlanes.from_cage(self.outer)

    @cached_property
    def fade(self) -> float:
        """Width of the outer cage's weight: 0 where the outer cage holds everything that is moved.

        Otherwise the least distance of a control point from the outer cage on its way, so that they go all
        the way; negative where one goes through it.
        """
        points, reach = self.motion.extents(self.planes.normals)
        slack = 1e-9 * np.abs(self.outer.corners).max()
        if (reach <= self.planes.offsets + slack).all():
            return 0.0
        room = float((self.planes.offsets - points).min())
        return room if room > 0.0 else min(room, -1e-300)

    def problem(self) -> str | None:
        """Why there is no such motion, in words that continue "the flow shell ...", or None."""
        least = LEAST_ROOM * self.motion.radius
        if self.fade != 0.0 and self.fade < least:
            return (
                f"has no room: a control point comes to within {max(self.fade, 0.0):.2g} of the outer cage on"
                f" its way, and must stay {least:.2g} from it"
            )
        if len(self.inner.points) > 1 and self.motion.rates.any():
            close = self.motion.separations().min(axis=0)
            i, j = np.unravel_index(int(np.argmin(close)), close.shape)
            if close[i, j] < LEAST_SPACING * self.motion.radius:
                return f"cannot follow the control points: {i} and {j} go through each other on their way"
        return None

    def at(self, points: Array, t: float) -> tuple[Array, Array]:
        """(v [N,3], dv/dx [N,3,3]) at points [N,3] and a time."""
        v, G = np.zeros_like(points), np.zeros((len(points), 3, 3))
        if self.fade < 0.0:
            return v, G
        chunk = max(1, _CHUNK // len(self.inner.points))
        for first in range(0, len(points), chunk):
            part = slice(first, first + chunk)
            v[part], G[part] = self._at(points[part], t)
        return v, G

    def _at(self, x: Array, t: float) -> tuple[Array, Array]:
        motion, r = self.motion, self.motion.radius
        now = np.array([t])
        (F,), (dF,) = motion.linear.at(now)
        W, c, at = np.linalg.inv(F), motion.centers(now)[0], motion.local_points(now)[0]
        v, G = np.zeros_like(x), np.zeros((len(x), 3, 3))
        y = (x - c) @ W.T
        away = y[:, None] - at
        d_j = np.maximum(np.linalg.norm(away, axis=2), 1e-12 * r)
        nearest = d_j.min(axis=1)
        rows = np.flatnonzero(nearest < motion.reach)
        x, y, away, d_j, nearest = x[rows], y[rows], away[rows], d_j[rows], nearest[rows]
        toward = away / d_j[:, :, None]
        share = (nearest[:, None] / d_j) ** DISTANCE_POWER
        d = nearest * share.sum(axis=1) ** (-1.0 / DISTANCE_POWER)
        d_slope = (((d[:, None] / d_j) ** (DISTANCE_POWER + 1))[:, :, None] * toward).sum(axis=1)
        b = (nearest[:, None] / d_j) ** BLEND_POWER
        b /= b.sum(axis=1, keepdims=True)
        e = b @ motion.rates
        left = b[:, :, None] * (motion.rates - e[:, None])
        e_slope = -BLEND_POWER * np.einsum("nji,njk->nik", left, toward / d_j[:, :, None])
        if self.inner.detours is not None:
            E, dE = self.inner.detours.at(y - t * e)
            d = d + E
            d_slope = d_slope + dE - t * np.einsum("nk,nki->ni", dE, e_slope)
        w, slope = curve(self.inner.falloff, 1.0 - d / r)
        V = motion.pivot_rate + y @ dF.T + e @ F.T
        dV = (dF + F @ e_slope) @ W
        dw = -(slope / r)[:, None] * (d_slope @ W)
        if self.fade > 0.0:
            u, du = self.planes.weight(x, self.fade)
            dw = u[:, None] * dw + w[:, None] * du
            w = u * w
        v[rows] = w[:, None] * V
        G[rows] = w[:, None, None] * dV + V[:, :, None] * dw[:, None]
        return v, G

    def slope_bounds(self) -> Array:
        """Bounds L [I] of |dv/dx| at all points, and all times between each of `BOUND_TIMES` and the next."""
        motion, h = self.motion, float(BOUND_TIMES[1])
        F, dF = motion.linear.at(BOUND_TIMES)
        angle, stretch = motion.linear.rates
        growth = np.exp(0.5 * h * stretch)
        size = _larger(np.linalg.norm(F, ord=2, axis=(1, 2))) * growth
        inverse = _larger(np.linalg.norm(np.linalg.inv(F), ord=2, axis=(1, 2))) * growth
        rate = _larger(np.linalg.norm(dF, ord=2, axis=(1, 2)))
        rate += 0.5 * h * (2.0 * angle * stretch + (angle + stretch) ** 2) * size
        differences = np.linalg.norm(motion.rates[:, None] - motion.rates[None], axis=2)
        speed = _larger(np.linalg.norm(motion.velocities(BOUND_TIMES), axis=2).max(axis=1))
        speed += 0.5 * h * motion.acceleration_bound() + rate * motion.reach + size * differences.max()
        blend = np.zeros(len(BOUND_TIMES) - 1)
        if differences.any():
            with np.errstate(divide="ignore"):
                ratios = differences / motion.separations()
            n = len(differences)
            blend = BLEND_POWER * np.minimum(
                0.5 * ratios.sum(axis=(1, 2)), (1.0 + n ** (1.0 / BLEND_POWER)) * ratios.max(axis=(1, 2))
            )
        fade = self.planes.slope_bound(self.fade) if self.fade > 0.0 else 0.0
        detour: Array | float = 0.0
        if self.inner.detours is not None:
            detour = self.inner.detours.slope_bound * (1.0 + BOUND_TIMES[1:] * blend)
        steepest = STEEPEST[self.inner.falloff] / motion.radius * inverse * (1.0 + detour) + fade
        return np.asarray(steepest * speed + angle + stretch + size * inverse * blend)

    @cached_property
    def _header(self) -> Array:
        """The numbers [36 + 3 n] that kernels read for all times; see `kernels.control_points`."""
        motion = self.motion
        head = [curve_number(self.inner.falloff), motion.radius, motion.reach, self.fade]
        blended = float(np.ptp(motion.rates, axis=0).max() > 0.0)
        planes = np.concatenate([self.planes.normals, self.planes.offsets[:, None]], axis=1)
        return np.concatenate([head, [blended], motion.pivot_rate, planes.ravel(), motion.rates.ravel()])

    def march(self, points: Array, knots: Array, jacobians: bool = True) -> tuple[Array, Array]:
        """(points [N,3], Jacobians [N,3,3]) at the last of the knots [K+1], of points at the first.

        Without `jacobians` the second array is [0,3,3].
        """
        from cagefield.warps.kernels.control_point_lanes import LANES, march_lanes
        from cagefield.warps.kernels.control_points import march

        x = np.array(points, dtype=np.float64, order="C")
        J = np.tile(np.eye(3), (len(x) if jacobians else 0, 1, 1))
        if self.fade < 0.0 or not len(x):
            return x, J
        times = np.empty(2 * len(knots) - 1)
        times[::2], times[1::2] = knots, 0.5 * (knots[1:] + knots[:-1])
        F, dF = self.motion.linear.at(times)
        n = len(times)
        moments = np.concatenate(
            [
                self.motion.centers(times),
                F.reshape(n, 9),
                np.linalg.inv(F).reshape(n, 9),
                dF.reshape(n, 9),
                self.motion.local_points(times).reshape(n, -1),
                times[:, None],
            ],
            axis=1,
        )
        grid = self.inner.detours
        nodes = NO_NODES if grid is None else grid.values
        place = np.zeros(4) if grid is None else np.append(grid.origin, grid.edge)
        if jacobians:
            march(x, J, self._header, moments, np.diff(knots), nodes, place)
        else:
            blocks = -(-len(x) // LANES)
            stride = next(n for n in range(int(0.618 * blocks) + 1, blocks + 2) if np.gcd(n, blocks) == 1)
            march_lanes(x, self._header, moments, np.diff(knots), stride, nodes, place)
        return x, J


def _larger(values: Array) -> Array:
    """The larger of each of values [T] and the next [T-1]."""
    return np.maximum(values[:-1], values[1:])


@flow_between.register
def _(inner: ControlPoints, deformed: Cage, outer: Cage, falloff: Falloff) -> Shell:
    assert isinstance(deformed, ControlPoints)
    strain = KINKED_STEP_STRAIN if inner.falloff == "linear" else EXACT_STEP_STRAIN
    return FreeFormFlow(ControlPointVelocity(inner, deformed, outer), outer, strain)


@inner_map_between.register
def _(inner: ControlPoints, deformed: Cage) -> InnerMap:
    return NoInnerMap()


@reach_between.register
def _(inner: ControlPoints, deformed: Cage) -> Array | None:
    assert isinstance(deformed, ControlPoints)
    return ControlPointMotion(inner, deformed).box()
