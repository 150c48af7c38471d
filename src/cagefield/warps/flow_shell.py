"""The flow shell: the space between the cages is carried along by the moving inner cage, and cannot fold."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cagefield.geometry.cage import Cage
from cagefield.geometry.cage_checks import are_valid
from cagefield.typing import Array, Mask
from cagefield.warps.cage_motion import TIMES, Motion, gaps, may_bend
from cagefield.warps.extended_coordinates import Extended
from cagefield.warps.falloff import Falloff
from cagefield.warps.flow_velocity import Coordinates, FlowVelocity
from cagefield.warps.newton_inverse import inverted

LEAST_GAP = 2e-3
"""The gap between the cages that a flow needs, as a share of the outer cage's half-width."""

STRAIN = 0.125
"""A step lasts until the flow has strained some part of the shell by about this much."""

LEAST_STEPS, MOST_STEPS = 4, 512

FLAT = 0.1
"""Least singular value of the inner cage's unit face normals (1 for a box) below which steps get shorter."""

_CHUNK = 8192


SMOOTH = Falloff()


@dataclass(frozen=True)
class FlowShell:
    """phi' by the flow of a velocity field: v(x, t) = w(x, t) V(x, t), t from 0 (canonical) to 1 (deformed).

    V is the velocity of the inner cage's motion (see `cage_motion`), with which all of space would go along:
    an affine map of x for a parallelepiped. w is 1 in the cage and 0 outside the outer cage, so a point on
    the one's faces goes with it, and on the other's stays. With xi the coordinates of the inner cage at t, z
    those of the outer cage, h and H the distances of their pairs of faces from their centers,

        d_i = |e|_p,  e_a = h_a max(|xi_a| - 1, 0);    1 / d_o = |1 / D|_p,  D_a = H_a (1 - z_a^2) / 2,

    and w depends on d_o / (d_i + d_o), see `Falloff`. The flow of a Lipschitz field is one to one: it
    cannot fold while the inner cage stays inside the outer. Valid for all pairs of hexahedra with a gap.

    Integrated by the classical Runge-Kutta method with steps of equal estimated strain; `to_canonical` goes
    backwards through the same times, its Jacobian is that of the discrete scheme, and `to_deformed` is the
    inverse of `to_canonical` as computed.

    Chosen by measurement (`benchmarks/flow_profiles.py`, 23 edits), geometric means of the least det J and
    the largest stretch, smooth: p = 2 0.201 and 7.0; p = 4 0.231 and 5.9; p = 8 0.238 and 5.8, for which
    float32 has no room; with the same slope a at the outer cage for all edits, p = 4: a = 0 (which is
    g^2 (3 - 2 g)) 0.212 and 7.2, 0.5 0.228 and 6.2, 0.95 0.208 and 6.6; linear 0.184 and 8.8; as much of it
    as of g^2 (3 - 2 g) 0.235 and 5.9, but with a kink at the inner cage; w = 1 / (1 + (d_i / d_o)^2), p = 2:
    0.165 and 10.1. The largest stretch of the nine among them that are edits of the built-in scenes: smooth
    3.8, a = 0 5.0, linear 4.5, the trilinear shell 4.7.

    Parameters: the canonical and the deformed inner cage, the outer cage, the falloff, the strain of a step.
    """

    inner: Cage
    deformed: Cage
    outer: Cage
    falloff: Falloff = SMOOTH
    strain: float = STRAIN

    @cached_property
    def motion(self) -> Motion:
        """The way of the inner cage."""
        return Motion(self.inner, self.deformed, self.outer)

    @cached_property
    def coefficients(self) -> tuple[float, float]:
        """(a, b) of the weight, see `Falloff`."""
        z = self.motion.surface[0][[0, -1]]
        gaps = np.concatenate([1.0 + z.min(axis=1), 1.0 - z.max(axis=1)], axis=1)
        before, after = np.log(np.maximum(gaps, LEAST_GAP))
        return self.falloff.coefficients(float(np.abs(after - before).max()))

    def with_strain(self, strain: float) -> FlowShell:
        """Shell with other step sizes and the same precomputed motion."""
        other = replace(self, strain=strain)
        known = ("motion", "coefficients", "_strained")
        other.__dict__.update({name: getattr(self, name) for name in known})
        return other

    @cached_property
    def knots(self) -> Array:
        """Times [K+1] from 0 to 1; a step goes from each to the next."""
        t, total = self._strained
        steps = int(np.clip(np.ceil(total[-1] / self.strain), LEAST_STEPS, MOST_STEPS))
        return np.interp(np.linspace(0.0, total[-1], steps + 1), total, t)

    @cached_property
    def _strained(self) -> tuple[Array, Array]:
        """(times, strain up to each of them)."""
        t = TIMES
        z, dz = self.motion.surface
        squeeze = (np.abs(dz) / np.maximum(1.0 - np.abs(z), 1e-6)).max(axis=(1, 2)) / self.falloff.width
        _, F, _, dF = self.motion.way
        W = np.linalg.inv(F)
        inside = (dF @ W)[:, None]
        if not self.motion.is_affine:
            inside = inside + F[:, None] @ self.motion.corner_rates(t) @ W[:, None]
        rate = 1.5 * squeeze + np.linalg.norm(inside, axis=(2, 3)).max(axis=1) + 1e-3
        # A cage sheared nearly flat is felt far along its length: its faces' normals are nearly dependent.
        normals = W / np.linalg.norm(W, axis=2, keepdims=True)
        flat = np.linalg.svd(normals, compute_uv=False)[:, -1] / FLAT
        rate *= np.maximum(1.0, flat**-0.5)
        return t, np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))])

    def to_canonical(self, points: Array) -> tuple[Array, Array]:
        """(canonical points [N,3], Jacobians [N,3,3]) of deformed points [N,3] in the shell."""
        return self._march(points, self.knots[::-1])

    def to_deformed(self, points: Array) -> tuple[Array, Array]:
        """(deformed points [N,3], Jacobians [N,3,3]) of canonical points [N,3] in the shell."""
        start, _ = self._march(points, self.knots)
        return inverted(self.to_canonical, points, start, np.abs(self.outer.corners).max())

    def least_ratio(self) -> float:
        """Least det of d(deformed)/d(canonical) at 4096 points of the shell: a sample, not a bound."""
        origin, frame = self.outer.frame
        rng = np.random.default_rng(0)
        spread = origin + rng.random((2048, 3)) @ frame.T
        # Half of them near the inner cage, where a shell is squeezed most.
        near = 2.0 * rng.random((2048, 3)) - 1.0
        near *= rng.uniform(1.0, 1.3, (2048, 1)) / np.abs(near).max(axis=1, keepdims=True)
        points = np.concatenate([spread, self.motion.end.points(near)])
        points = points[self.outer.contains(points)]
        points = points[~self.deformed.contains(points)]
        if len(points) == 0:
            return 1.0
        return float(1.0 / np.linalg.det(self.to_canonical(points)[1]).max())

    @staticmethod
    def may_surround(inner: Cage, outer: Cage, corners: Array, *, fine: bool = True) -> Mask:
        """Mask [B] of the deformed inner cages [B,8,3] in which `problem` finds nothing but for their way.

        Corners that no cage may have are False. Where not fine, only the corners are tested, and edges or
        faces that come too near to a bent outer cage are missed.
        """
        mask = np.asarray(gaps(corners, Extended.from_cage(outer), 8) >= LEAST_GAP)
        mask[mask] = are_valid(corners[mask])
        if fine and not Extended.from_cage(outer).is_affine:
            mask[mask] = gaps(corners[mask], Extended.from_cage(outer)) >= LEAST_GAP
        mask[mask] = may_bend(inner, corners[mask])
        return mask

    def problem(self) -> str | None:
        """Why the shell is not one to one, in words that continue "the flow shell ...", or None."""
        motion = self.motion
        moves = self.deformed is not self.inner
        for gap, when in zip(motion.gaps, (" before any operation", ""), strict=True):
            if gap < 0.0:
                return (
                    f"is left by the inner cage{when}: it bulges through the outer cage between its corners"
                )
            if gap < LEAST_GAP:
                return (
                    f"has no room{when}: the gap between the cages is {gap:.2g} of the outer cage's"
                    f" half-width and must be at least {LEAST_GAP:g} on every side"
                )
        if not motion.start.is_one_to_one:
            return "cannot surround the inner cage: it is bent too far before any operation"
        if moves and not motion.is_one_to_one:
            return "cannot follow the inner cage: it is bent too far"
        if moves and not np.isfinite(motion.shrink):
            return "finds no way for the inner cage through the outer cage"
        return None

    def _march(self, points: Array, knots: Array) -> tuple[Array, Array]:
        """(points [N,3], Jacobians [N,3,3]) at the last of the knots, of points at the first."""
        times = np.empty(2 * len(knots) - 1)
        times[::2], times[1::2] = knots, 0.5 * (knots[1:] + knots[:-1])
        velocities = self._velocities(times)
        parts = [slice(n, n + _CHUNK) for n in range(0, len(points), _CHUNK)]
        x, J = points.copy(), np.tile(np.eye(3), (len(points), 1, 1))
        for part in parts:
            x[part], J[part] = self._runge_kutta(x[part], J[part], knots, velocities)
        return x, J

    def _runge_kutta(
        self, x: Array, J: Array, knots: Array, velocities: list[FlowVelocity]
    ) -> tuple[Array, Array]:
        at = Coordinates(self._in_outer(x), None)
        for n, h in enumerate(np.diff(knots)):
            dx, dJ = np.zeros_like(x), np.zeros_like(J)
            k, slope = dx, dJ
            for moment, share, weight in ((0, 0.0, 1.0), (1, 0.5, 2.0), (1, 0.5, 2.0), (2, 1.0, 1.0)):
                k, G = velocities[2 * n + moment].at(x + (share * h) * k, at)
                slope = G @ (J + (share * h) * slope)
                dx, dJ = dx + weight * k, dJ + weight * slope
            x, J = x + (h / 6.0) * dx, J + (h / 6.0) * dJ
        return x, J

    def _in_outer(self, x: Array) -> Array | None:
        """A start for the outer cage's coordinates: those inside the cage, where it has them."""
        if self.motion.confines.is_affine:
            return None
        u, inside = self.outer.coordinates(x)
        affine = (x - self.motion.confines.center) @ self.motion.confines.inverse.T
        return np.where(inside[:, None], 2.0 * u - 1.0, affine)

    def _velocities(self, times: Array) -> list[FlowVelocity]:
        c, F, dc, dF = self.motion.frames(times)
        rate = self.motion.end.bend - self.motion.start.bend
        return [
            FlowVelocity(
                Extended(c[n], F[n], self.motion.bend(t)), dc[n], dF[n], rate,
                self.motion.confines, self.falloff, self.coefficients,
            )
            for n, t in enumerate(times)
        ]  # fmt: skip
