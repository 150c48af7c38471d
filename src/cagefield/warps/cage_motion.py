"""How the inner cage moves from its canonical to its deformed place, for the flow shell.

Notation: t in [0,1] is the time. The cage at time t, and all of space with it (see `trilinear_bend`), is

    x(xi, t) = c(t) + F(t) y_t(xi),    y_t(xi) = xi + B_t(xi) in the cage.

With F_0, F_1 the Jacobians at the centers of the canonical and the deformed cage, and F_1 F_0^-1 = R S its
polar decomposition, F(t) = e^(-k sin(pi t)) R^t S^t F_0: the rotation turns evenly about a fixed axis (by 180
degrees at most), the stretch is log-linear, the bend K goes linearly from the one cage's to the other's,
and k >= 0 shrinks the cage on its way by just as much as keeps it inside the outer cage. c(t) is a straight
line, in the outer cage's coordinates where a straight one in space would leave it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np

from cagefield.geometry import hexahedron
from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Mask
from cagefield.warps.extended_coordinates import Extended, slope_columns, straightened_slope
from cagefield.warps.linear_motion import LinearMotion
from cagefield.warps.trilinear_bend import (
    AXIS_COEFFICIENTS,
    SIGNS,
    bend,
    bends,
    corner_slopes,
    stay_one_to_one,
)

LEAST_SIZE = 1e-2
"""The cage is shrunk to no less than this on its way."""

KEPT_GAP = 0.6
"""The cage keeps this share of the smaller of the gaps that it has at its two ends."""

_grid = np.linspace(0.0, 1.0, 41)
TIMES: Array = np.unique(
    np.concatenate([_grid, [0.002, 0.006, 0.0125], 1.0 - np.array([0.002, 0.006, 0.0125])])
)
"""Times at which the motion is sampled: denser at its ends, where a small gap makes it fast."""


@dataclass(frozen=True)
class Motion:
    """The inner cage's way from V^c (t = 0) to V (t = 1) through the outer cage."""

    inner: Cage
    deformed: Cage
    outer: Cage
    start: Extended = field(init=False, repr=False)
    end: Extended = field(init=False, repr=False)
    confines: Extended = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for name, cage in (("start", self.inner), ("end", self.deformed), ("confines", self.outer)):
            object.__setattr__(self, name, Extended.from_cage(cage))

    @cached_property
    def is_affine(self) -> bool:
        """True when the cage is a parallelepiped all the way."""
        return self.start.is_affine and self.end.is_affine

    @property
    def _keeps_its_shape(self) -> bool:
        """True for a cage that only moves, but for rounding, in an outer cage with parallel faces."""
        a, b = self.start, self.end
        return (
            self.confines.is_affine
            and bool(np.abs(b.frame - a.frame).max() <= 1e-12 * np.abs(a.frame).max())
            and bool(np.abs(b.bend - a.bend).max() <= 1e-12)
        )

    @cached_property
    def _linear(self) -> LinearMotion:
        """The way of F."""
        return LinearMotion(self.start.frame, self.end.frame)

    @cached_property
    def shrink(self) -> float:
        """k, how much the cage shrinks on its way; inf where no k to -log `LEAST_SIZE` keeps it inside."""
        least = KEPT_GAP * min(self.gaps)
        if least <= 0.0:
            return np.inf
        if self._keeps_its_shape and least > 1e-6:
            return 0.0  # a point's distance from a plane is least at an end of its straight way
        at_rest = 1.0 - np.abs(self._at_rest).max(axis=(1, 2)) - least
        if at_rest.min() >= 0.0:
            return 0.0
        high = -float(np.log(LEAST_SIZE))
        if (self.gap(TIMES, high) < least).any():
            return np.inf
        # The least gap grows with k: regula falsi, over the times at which there is too little of it.
        times = TIMES[at_rest < 0.0]
        low, below, above = 0.0, float(at_rest.min()), float(self.gap(times, high).min()) - least
        for _ in range(40):
            if high - low <= 1e-3 or above <= 1e-3 * least:
                break
            middle = low + np.clip(below / (below - above), 0.01, 0.99) * (high - low)
            value = float(self.gap(times, middle).min()) - least
            if value >= 0.0:
                high, above, below = middle, value, 0.5 * below
            else:
                low, below, above = middle, value, 0.5 * above
        return high

    def frames(self, t: Array, shrink: float | None = None) -> tuple[Array, Array, Array, Array]:
        """(c [T,3], F [T,3,3], dc/dt [T,3], dF/dt [T,3,3]) at times t [T]."""
        k = self.shrink if shrink is None else shrink
        F, dF = self._linear.at(t, k)
        c, dc = self._center(t)
        return c, F, dc, dF

    @cached_property
    def way(self) -> tuple[Array, Array, Array, Array]:
        """`frames` at `TIMES`."""
        return self._way_at_rest if self.shrink == 0.0 else self.frames(TIMES)

    @cached_property
    def _way_at_rest(self) -> tuple[Array, Array, Array, Array]:
        """`way`, were the cage not to shrink."""
        return self.frames(TIMES, 0.0)

    def bend(self, t: float) -> Array:
        """K [4,3] at time t."""
        return self.start.bend + t * (self.end.bend - self.start.bend)

    def corner_rates(self, t: Array) -> Array:
        """How the bend strains the cage at its corners [T,8,3,3] at times t [T], in the straightened cage."""
        going = self.end.bend - self.start.bend
        return corner_slopes(going[None]) @ np.linalg.inv(
            np.eye(3) + corner_slopes(self.start.bend + t[:, None, None] * going)
        )

    def _center(self, t: Array) -> tuple[Array, Array]:
        a, b = self.start.center, self.end.center
        if self._straight:
            return a + t[:, None] * (b - a), np.broadcast_to(b - a, (len(t), 3))
        ends = self.confines.coordinates(np.stack([a, b]))
        z = ends[0] + t[:, None] * (ends[1] - ends[0])
        slope = self.confines.frame @ straightened_slope(self.confines.form, z)
        return self.confines.points(z), slope @ (ends[1] - ends[0])

    @cached_property
    def _straight(self) -> bool:
        """False where the straight way of the cage's center comes too near to the outer cage."""
        if self.confines.is_affine:
            return True
        a, b = self.start.center, self.end.center
        z = self.confines.coordinates(a + np.linspace(0.0, 1.0, 33)[:, None] * (b - a), enough=1e-7)
        inside = 1.0 - np.abs(z).max(axis=1)
        return bool(inside.min() >= 0.9 * min(inside[0], inside[-1]))

    @cached_property
    def surface(self) -> tuple[Array, Array]:
        """(z, dz/dt), both [T,S,3], of points on its faces at `TIMES`, in the outer cage's coordinates.

        In an affine outer cage they are the corners: |z| and |dz/dt| / (1 - |z|) are largest there. In others
        the middles of edges and faces, too.
        """
        _, F, dc, dF = self.way
        v = dc[:, None] + self._straightened(TIMES) @ np.transpose(dF, (0, 2, 1))
        if not self.is_affine:
            v += bend(self.end.bend - self.start.bend, self._cage_grid) @ np.transpose(F, (0, 2, 1))
        z = self._at_rest
        if self.shrink != 0.0:
            z = self._inside(TIMES, self.way, z)
        along = v @ self.confines.inverse.T
        if not self.confines.is_affine:
            columns = slope_columns(self.confines.form, z.reshape(-1, 3).T)
            along = hexahedron.solve(columns, along.reshape(-1, 3).T).T.reshape(z.shape)
        return z, along

    @property
    def _cage_grid(self) -> Array:
        """The points xi [S,3] of `surface`."""
        return SIGNS if self.confines.is_affine else _SURFACE[:26]

    def _straightened(self, t: Array) -> Array:
        """xi + B_t(xi) [T,S,3] of the points of `surface` at times t [T]."""
        xi = self._cage_grid
        if self.is_affine:
            return np.broadcast_to(xi, (len(t), *xi.shape))
        going = bend(self.end.bend - self.start.bend, xi)
        return xi + bend(self.start.bend, xi) + t[:, None, None] * going

    @cached_property
    def _at_rest(self) -> Array:
        """z [T,S,3] of `surface`, were the cage not to shrink."""
        return self._inside(TIMES, self._way_at_rest)

    def faces(self, t: Array, shrink: float, enough: float = 1e-7) -> Array:
        """z [T,S,3] of the points of `surface` at times t [T], with that much shrinking, to `enough`."""
        return self._inside(t, self.frames(t, shrink), enough=enough)

    def _inside(
        self, t: Array, frames: tuple[Array, ...], start: Array | None = None, enough: float = 1e-7
    ) -> Array:
        """z [T,S,3] of the points of `surface` in these frames, by Newton's method from z = start [T,S,3]."""
        x = frames[0][:, None] + self._straightened(t) @ np.transpose(frames[1], (0, 2, 1))
        near = None if start is None else start.reshape(-1, 3)
        return self.confines.coordinates(x.reshape(-1, 3), near, enough).reshape(x.shape)

    def gap(self, t: Array, shrink: float) -> Array:
        """Least distance [T], as a share of the outer cage's half-width, of the cage from the outer cage."""
        return 1.0 - np.abs(self.faces(t, shrink)).max(axis=(1, 2))

    @cached_property
    def gaps(self) -> tuple[float, float]:
        """The gaps of the canonical and the deformed cage, as shares of the outer cage's half-width."""
        return _gap_between(self.inner, self.outer), _gap_between(self.deformed, self.outer)

    @cached_property
    def is_one_to_one(self) -> bool:
        """True when the cage stays a valid one, and space around it too, all the way."""
        return self.is_affine or bool(stay_one_to_one(self.start.bend, self.end.bend[None])[0])


def may_bend(inner: Cage, corners: Array) -> Mask:
    """Mask [B] of the valid cages [B,8,3] that the inner cage can become with its bend one to one."""
    C = hexahedron.coefficients(corners)
    ends = bends(C, np.transpose(C[:, AXIS_COEFFICIENTS], (0, 2, 1)))
    start = Extended.from_cage(inner).bend
    if not (start.any() or ends.any()):
        return np.ones(len(corners), dtype=bool)
    return stay_one_to_one(start, ends)


def gaps(corners: Array, confines: Extended, points: int = 124) -> Array:
    """Least distances [B] of cages [B,8,3] from the outer cage, as shares of its half-width; < 0 outside.

    Exact in an affine outer cage, where the corners are nearest; else at 124 points of the faces, or 8.
    """
    x = corners if confines.is_affine or points == 8 else _WEIGHTS @ corners
    z = confines.coordinates(x.reshape(-1, 3), enough=1e-7)
    return 1.0 - np.abs(z).max(axis=1).reshape(x.shape[:2]).max(axis=1)


@lru_cache(maxsize=64)
def _gap_between(cage: Cage, outer: Cage) -> float:
    return float(gaps(cage.corners[None], Extended.from_cage(outer))[0])


def _surface(nodes: int) -> Array:
    """xi [S,3] of nodes^2 points on each face of the cube."""
    g = np.linspace(-1.0, 1.0, nodes)
    xi = np.stack(np.meshgrid(g, g, g, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.asarray(xi[np.abs(xi).max(axis=1) == 1.0])


_SURFACE = np.concatenate([_surface(3), _surface(5)])
_WEIGHTS = np.prod(1.0 + SIGNS * _SURFACE[:, None], axis=2) / 8.0
"""Shares [124,8] of a cage's corners in the points of its faces."""
