"""The flow of a velocity field given as a value: the map of inner cages that are no hexahedra.

Notation: v(x, t) [3] is the velocity at x at time t, from 0 (canonical) to 1 (deformed); L a bound of its
slope |dv/dx| (spectral norm). A step of the classical Runge-Kutta method over a time h differs from the
identity by a map with Lipschitz constant at most

    s + s^2 / 2 + s^3 / 6 + s^4 / 24,    s = h L,

which is below 1 for s <= `PROVEN`: the step is one to one, and its det J is positive, without a sample
(a perturbation of the identity by a contraction). Steps are shortened until that holds for each of them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Float32
from cagefield.warps.interfaces import InnerMap
from cagefield.warps.newton_inverse import inverted

EXACT_STEP_STRAIN = 0.25
"""Integral of L over a step, at most.

Of 60 random edits of control points (radius .5, scene of about 2), the largest errors: of the map by steps to
deformed space against the inverse of that to canonical space, and of the map to canonical space itself.

    strain     0.5               0.25              0.125
    smooth     9e-6 and 8e-5     7e-7 and 2e-5     4e-8 and 3e-6
    sphere     8e-6 and 7e-5     5e-7 and 1e-5     9e-9 and 1e-6
    root       2e-4 and 5e-4     1e-5 and 5e-5     3e-7 and 6e-6
    sharp      2e-5 and 2e-5     6e-7 and 3e-6     2e-8 and 3e-7
    linear     7e-5 and 6e-4     2e-5 and 4e-4     2e-5 and 3e-4
"""

KINKED_STEP_STRAIN = 0.05
"""Strain of a step for a velocity with a kink, that of the linear falloff where it ends: a step over it errs
by the square of its length. One point of radius .5, moved by 2: 1.4e-3 with 0.25, 7e-5 with 0.06, 2e-5 with
0.03."""

PROVEN = 0.69
"""Most h L of a step that is proven to be one to one; see above."""

MIN_PROVEN_STEPS, MAX_PROVEN_STEPS = 4, 1024

BOUND_TIMES: Array = np.linspace(0.0, 1.0, 65)
"""Ends of the intervals in which the velocity's slope is bounded."""

_CHUNK = 262_144
"""Nodes at a time: 64^3."""


class Velocity(Protocol):
    """Velocity v(x, t) in V^o, continuous and piecewise smooth; zero on and outside the outer cage."""

    def at(self, points: Array, t: float) -> tuple[Array, Array]:
        """(v [N,3], dv/dx [N,3,3]) at points [N,3] and a time."""

    def slope_bounds(self) -> Array:
        """Bounds L [I] of |dv/dx| at all points, and all times between each of `BOUND_TIMES` and the next."""

    def march(self, points: Array, knots: Array, jacobians: bool = True) -> tuple[Array, Array]:
        """(points [N,3], Jacobians [N,3,3]) at the last of the knots [K+1], of points at the first.

        As `march` computes them, faster. Without `jacobians` the second array is [0,3,3].
        """

    def problem(self) -> str | None:
        """Why there is no such motion, in words that continue "the flow shell ...", or None."""


@dataclass(frozen=True)
class FreeFormFlow:
    """The map of V^o onto itself by the flow of a velocity; a `Shell` that is valid in all of V^o.

    `to_canonical` goes backwards through the knots, with the Jacobian of the discrete scheme; `to_deformed`
    inverts it as computed. `strain` is the most that a step strains, see `EXACT_STEP_STRAIN`; `sample`, whose
    nodes are float32 and interpolated, takes steps of that where `strain` is less.
    """

    velocity: Velocity
    outer: Cage
    strain: float = EXACT_STEP_STRAIN

    @cached_property
    def knots(self) -> Array:
        """Times [K+1] from 0 to 1; a step, proven one to one, goes from each to the next."""
        # Steps that are shorter than they must be are no reason for more than there may be.
        least = min(float(self._slope_bounds.mean()) / (0.9 * MAX_PROVEN_STEPS), EXACT_STEP_STRAIN)
        return proven_knots(self._slope_bounds, max(self.strain, least))

    @cached_property
    def _node_knots(self) -> Array:
        """Knots of `sample`."""
        if self.strain >= EXACT_STEP_STRAIN:
            return self.knots
        return proven_knots(self._slope_bounds, EXACT_STEP_STRAIN)

    @cached_property
    def _slope_bounds(self) -> Array:
        return self.velocity.slope_bounds()

    def with_strain(self, strain: float) -> FreeFormFlow:
        """Flow with other step sizes."""
        other = replace(self, strain=strain)
        other.__dict__["_slope_bounds"] = self._slope_bounds
        return other

    def to_canonical(self, points: Array) -> tuple[Array, Array]:
        """(canonical points [N,3], Jacobians [N,3,3]) of deformed points [N,3]."""
        return self.velocity.march(points, self.knots[::-1])

    def to_deformed(self, points: Array) -> tuple[Array, Array]:
        """(deformed points [N,3], Jacobians [N,3,3]) of canonical points [N,3]; the inverse."""
        start, _ = self.velocity.march(points, self.knots, jacobians=False)
        return inverted(self.to_canonical, points, start, float(np.abs(self.outer.corners).max()))

    def march_to_deformed(self, points: Array) -> tuple[Array, Array]:
        """`to_deformed` by steps forwards: it differs by the error of the integration."""
        return self.velocity.march(points, self.knots)

    def sample(self, resolution: int, inner: InnerMap) -> Float32:
        """Displacements to canonical space [R^3,3], x fastest, of the nodes of the outer cage; see `Lattice`.

        Nodes in the region of `inner` get its displacements.
        """
        origin, frame = self.outer.frame
        along = np.linspace(0.0, 1.0, resolution)[:, None, None] * frame.T  # [R, axis, 3]
        displacement = np.empty((resolution, resolution, resolution, 3), dtype=np.float32)
        slices = max(1, _CHUNK // resolution**2)
        knots = self._node_knots[::-1]
        for first in range(0, resolution, slices):
            part = slice(first, first + slices)
            plane = along[None, :, 1, None] + along[None, None, :, 0]
            nodes = (origin + along[part, 2])[:, None, None] + plane
            flat = nodes.reshape(-1, 3)
            inside, canonical, _ = inner(flat)
            if inside.any():
                moved = np.empty_like(flat)
                moved[inside] = canonical
                moved[~inside], _ = self.velocity.march(
                    flat[~inside], self._node_knots[::-1], jacobians=False
                )
            else:
                moved, _ = self.velocity.march(flat, knots, jacobians=False)
            np.subtract(moved.reshape(nodes.shape), nodes, out=displacement[part], casting="same_kind")
        return displacement.reshape(-1, 3)

    def least_ratio(self) -> float:
        """Least det of d(deformed)/d(canonical) at 4096 points of the outer cage: a sample, not a bound."""
        origin, frame = self.outer.frame
        points = origin + np.random.default_rng(0).random((4096, 3)) @ frame.T
        return float(1.0 / np.linalg.det(self.to_canonical(points)[1]).max())

    def problem(self) -> str | None:
        """Why there is no such flow, in words that continue "the flow shell ...", or None."""
        problem = self.velocity.problem()
        if problem is not None:
            return problem
        if not (np.isfinite(self._slope_bounds).all() and len(self.knots) - 1 <= MAX_PROVEN_STEPS):
            strain = float(self._slope_bounds.mean())
            return (
                f"would be strained by {strain:.3g}, and at most {PROVEN * MAX_PROVEN_STEPS:.3g} is possible"
            )
        return None


def proven_knots(slope_bounds: Array, strain: float) -> Array:
    """Times [K+1] from 0 to 1 for bounds L [I] of the slope in I equal intervals of time.

    No step has an integral of L above `strain`, nor h L above `PROVEN`; there are no more than twice
    `MAX_PROVEN_STEPS` steps, where that would take more.
    """
    intervals = len(slope_bounds)
    ends = np.linspace(0.0, 1.0, intervals + 1)
    rate = np.maximum(slope_bounds, 1e-9)
    total = np.concatenate([[0.0], np.cumsum(rate * np.diff(ends))])
    wanted = np.ceil(total[-1] / strain) if np.isfinite(total[-1]) else np.inf
    steps = int(np.clip(wanted, MIN_PROVEN_STEPS, 2 * MAX_PROVEN_STEPS))
    if not np.isfinite(total[-1]):
        return np.linspace(0.0, 1.0, steps + 1)
    knots = np.interp(np.linspace(0.0, total[-1], steps + 1), total, ends)
    knots[0], knots[-1] = 0.0, 1.0
    while len(knots) <= 2 * MAX_PROVEN_STEPS:
        first = np.minimum(np.floor(knots[:-1] * intervals).astype(np.intp), intervals - 1)
        last = np.maximum(np.ceil(knots[1:] * intervals).astype(np.intp), first + 1)
        steepest = np.array([rate[i:j].max() for i, j in zip(first, last, strict=True)])
        long = np.flatnonzero(np.diff(knots) * steepest > PROVEN)
        if len(long) == 0:
            break
        knots = np.insert(knots, long + 1, 0.5 * (knots[long] + knots[long + 1]))
    return knots


def march(velocity: Velocity, points: Array, knots: Array) -> tuple[Array, Array]:
    """(points [N,3], Jacobians [N,3,3]) at the last of the knots [K+1], of points at the first.

    The classical Runge-Kutta method in float64: the oracle of the velocities' own `march`.
    """
    x, J = points.astype(np.float64), np.tile(np.eye(3), (len(points), 1, 1))
    for t, h in zip(knots[:-1], np.diff(knots), strict=True):
        dx, dJ = np.zeros_like(x), np.zeros_like(J)
        k, slope = dx, dJ
        for share, weight in ((0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)):
            k, G = velocity.at(x + (share * h) * k, float(t + share * h))
            slope = G @ (J + (share * h) * slope)
            dx, dJ = dx + weight * k, dJ + weight * slope
        x, J = x + (h / 6.0) * dx, J + (h / 6.0) * dJ
    return x, J
