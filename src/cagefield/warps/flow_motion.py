"""How the inner cage moves from its canonical to its deformed place, for the flow shell.

Notation: xi in [-1,1]^3 are the cage's trilinear coordinates, clamp(xi) their clamping to that cube, t in
[0,1] the time. The cage at time t, and all of space with it, is

    x(xi, t) = c(t) + F(t) (xi + B_t(clamp(xi))),
    B_t(xi) = K_0 xi eta + K_1 xi zeta + K_2 eta zeta + K_3 xi eta zeta,

so inside the cage x is the trilinear map of its corners, and outside it goes on along the columns of F. With
F_0, F_1 the Jacobians at the centres of the canonical and the deformed cage, and F_1 F_0^-1 = R S its polar
decomposition, F(t) = e^(-k sin(pi t)) R^t S^t F_0: the rotation turns evenly about a fixed axis (by 180
degrees at most), the stretch is log-linear, the bend K goes linearly from the one cage's to the other's,
and k >= 0 shrinks the cage on its way by just as much as keeps it inside the outer cage. c(t) is a straight
line, in the outer cage's coordinates where a straight one in space would leave it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from cagefield import hexahedron
from cagefield.cages import Cage
from cagefield.hexahedron import Array

BENDS = [3, 5, 6, 7]
AXES = [1, 2, 4]
LEAST_SIZE = 1e-2
"""The cage is shrunk to no less than this on its way."""

KEPT_GAP = 0.6
"""The cage keeps this share of the smaller of the gaps that it has at its two ends."""

_grid = np.linspace(0.0, 1.0, 41)
TIMES: Array = np.unique(
    np.concatenate([_grid, [0.002, 0.006, 0.0125], 1.0 - np.array([0.002, 0.006, 0.0125])])
)
"""Times at which the way is looked at: denser at its ends, where a cage with a small gap must shrink fast."""


@dataclass(frozen=True)
class Extended:
    """Space in a cage's coordinates: x = c + F (xi + B(clamp(xi))).

    Parameters: centre c [3], frame F [3,3], bend K [4,3]; F^-1 and the distances of the faces from the centre
    along their normals follow from them.
    """

    centre: Array
    frame: Array
    bend: Array

    @classmethod
    def of(cls, cage: Cage) -> Extended:
        """The coordinates of a cage at rest."""
        C = hexahedron.coefficients(cage.corners)
        F = np.ascontiguousarray(C[AXES].T)
        bend = C[BENDS] @ np.linalg.inv(F).T
        if np.abs(bend).max() < 1e-12:
            bend = np.zeros((4, 3))
        return cls(C[0], F, bend)

    @cached_property
    def inverse(self) -> Array:
        """F^-1 [3,3]."""
        return np.asarray(np.linalg.inv(self.frame))

    @cached_property
    def heights(self) -> Array:
        """Distance [3] of each pair of faces of the affine part from the centre."""
        return np.asarray(1.0 / np.linalg.norm(self.inverse, axis=1))

    @cached_property
    def is_affine(self) -> bool:
        """True for a parallelepiped."""
        return not self.bend.any()

    def points(self, xi: Array) -> Array:
        """x [N,3] of coordinates xi [N,3]."""
        return self.centre + (xi + bend(self.bend, xi.clip(-1.0, 1.0))) @ self.frame.T

    def coordinates(self, points: Array, start: Array | None = None) -> Array:
        """xi [N,3] of points [N,3], by Newton's method from xi = start."""
        y = (points - self.centre) @ self.inverse.T
        return y if self.is_affine else straighten(self.bend, y, start)

    def gradient(self, xi: Array) -> Array:
        """dxi/dx [N,3,3] at xi [N,3]; at a kink that of the side towards the cage's inside."""
        if self.is_affine:
            return np.broadcast_to(self.inverse, (len(xi), 3, 3))
        return hexahedron.invert(straightened_slope(self.bend, xi)) @ self.inverse

    @cached_property
    def is_one_to_one(self) -> bool:
        """True when no two coordinates are the same point: det dx/dxi > 0 inside the cage and around it."""
        if self.is_affine:
            return True
        return bends_one_to_one(self.bend[None])


def bend(K: Array, xi: Array) -> Array:
    """B(xi) [N,3] of the bend K [4,3]."""
    return _products(xi) @ K


def bend_slope(K: Array, xi: Array) -> Array:
    """dB/dxi [N,3,3], the last axis xi."""
    x, y, z = xi[:, :1], xi[:, 1:2], xi[:, 2:]
    along = (y * K[0] + z * K[1] + y * z * K[3], x * K[0] + z * K[2] + x * z * K[3])
    return np.stack([*along, x * K[1] + y * K[2] + x * y * K[3]], axis=2)


def bends_one_to_one(K: Array) -> bool:
    """True when xi + B(clamp(xi)) takes no two xi to the same point, for each of the bends K [B,4,3]."""
    corners = _SIGNS + np.stack([bend(k, _SIGNS) for k in K])
    pieces = corners[:, _NEXT_TO] + _AWAY  # [B,27,8,3]; the map is trilinear on each
    return hexahedron.is_positive(hexahedron.determinant_coefficients(pieces))


def straightened_slope(K: Array, xi: Array) -> Array:
    """d(xi + B(clamp(xi)))/dxi [N,3,3]."""
    inside = np.abs(xi) <= 1.0
    return np.eye(3) + bend_slope(K, xi.clip(-1.0, 1.0)) * inside[:, None, :]


def straighten(K: Array, y: Array, start: Array | None = None) -> Array:
    """xi [N,3] with xi + B(clamp(xi)) = y [N,3], by a damped Newton's method from `start` (else from y)."""
    xi = y.copy() if start is None else start.copy()
    rows = np.arange(len(y))
    residual = xi + bend(K, xi.clip(-1.0, 1.0)) - y
    for _ in range(60):
        size = np.abs(residual[rows]).max(axis=1, initial=0.0)
        rows = rows[size > 1e-14 * (1.0 + np.abs(y[rows]).max(axis=1, initial=0.0))]
        if len(rows) == 0:
            break
        step = (hexahedron.invert(straightened_slope(K, xi[rows])) @ residual[rows][:, :, None])[:, :, 0]
        size, left, share = np.abs(residual[rows]).max(axis=1), np.arange(len(rows)), 1.0
        for _ in range(7):
            trial = xi[rows[left]] - share * step[left]
            new = trial + bend(K, trial.clip(-1.0, 1.0)) - y[rows[left]]
            better = np.abs(new).max(axis=1) < size[left]
            xi[rows[left[better]]], residual[rows[left[better]]] = trial[better], new[better]
            left, share = left[~better], 0.5 * share
            if len(left) == 0:
                break
        rows = np.delete(rows, left)  # what no step improves has arrived, up to rounding
    return xi


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
            object.__setattr__(self, name, Extended.of(cage))

    @cached_property
    def is_affine(self) -> bool:
        """True when the cage is a parallelepiped all the way."""
        return self.start.is_affine and self.end.is_affine

    @cached_property
    def _turn(self) -> tuple[Array, Array, Array]:
        """(rotation vector [3], logarithms of the stretch [3], its directions as columns [3,3])."""
        U, s, Vt = np.linalg.svd(self.end.frame @ self.start.inverse)
        return Rotation.from_matrix(U @ Vt).as_rotvec(), np.log(s), Vt.T

    @cached_property
    def shrink(self) -> float:
        """k, how much the cage shrinks on its way; inf where no k to -log `LEAST_SIZE` keeps it inside."""
        least = KEPT_GAP * min(self.gaps)
        if least <= 0.0:
            return np.inf
        if (self._gap(TIMES, 0.0) >= least).all():
            return 0.0
        low, high = 0.0, -np.log(LEAST_SIZE)
        if (self._gap(TIMES, high) < least).any():
            return np.inf
        while high - low > 1e-3:
            middle = 0.5 * (low + high)
            low, high = (low, middle) if (self._gap(TIMES, middle) >= least).all() else (middle, high)
        return float(high)

    def frames(self, t: Array, shrink: float | None = None) -> tuple[Array, Array, Array, Array]:
        """(c [T,3], F [T,3,3], dc/dt [T,3], dF/dt [T,3,3]) at times t [T]."""
        k = self.shrink if shrink is None else shrink
        turn, stretch, V = self._turn
        R = Rotation.from_rotvec(t[:, None] * turn).as_matrix()
        grown = np.exp(t[:, None] * stretch) * np.exp(-k * np.sin(np.pi * t))[:, None]
        F = R @ (V * grown[:, None, :]) @ V.T @ self.start.frame
        rate = stretch - (k * np.pi * np.cos(np.pi * t))[:, None]
        omega = np.cross(np.eye(3), turn)  # omega v = turn x v
        dF = omega @ F + R @ (V * (grown * rate)[:, None, :]) @ V.T @ self.start.frame
        c, dc = self._centre(t)
        return c, F, dc, dF

    def bend(self, t: float) -> Array:
        """K [4,3] at time t."""
        return self.start.bend + t * (self.end.bend - self.start.bend)

    def _centre(self, t: Array) -> tuple[Array, Array]:
        a, b = self.start.centre, self.end.centre
        if self._straight:
            return a + t[:, None] * (b - a), np.broadcast_to(b - a, (len(t), 3))
        ends = self.confines.coordinates(np.stack([a, b]))
        z = ends[0] + t[:, None] * (ends[1] - ends[0])
        slope = self.confines.frame @ straightened_slope(self.confines.bend, z)
        return self.confines.points(z), slope @ (ends[1] - ends[0])

    @cached_property
    def _straight(self) -> bool:
        """False where the straight way of the cage's centre comes too near to the outer cage."""
        if self.confines.is_affine:
            return True
        a, b = self.start.centre, self.end.centre
        z = self.confines.coordinates(a + np.linspace(0.0, 1.0, 33)[:, None] * (b - a))
        inside = 1.0 - np.abs(z).max(axis=1)
        return bool(inside.min() >= 0.9 * min(inside[0], inside[-1]))

    def surface(self, t: Array, shrink: float | None = None, *, fine: bool = False) -> tuple[Array, Array]:
        """(z [T,S,3], dz/dt [T,S,3]) of points on the cage's faces, in the outer cage's coordinates.

        S is 26, the corners and the middles of edges and faces, or 124.
        """
        c, F, dc, dF = self.frames(t, shrink)
        xi = _SURFACE if fine else _SURFACE[:26]
        still, going = bend(self.start.bend, xi), bend(self.end.bend - self.start.bend, xi)
        y = xi + still + t[:, None, None] * going
        x = c[:, None] + y @ np.transpose(F, (0, 2, 1))
        v = dc[:, None] + y @ np.transpose(dF, (0, 2, 1)) + going @ np.transpose(F, (0, 2, 1))
        z = self.confines.coordinates(x.reshape(-1, 3))
        along = self.confines.gradient(z) @ v.reshape(-1, 3, 1)
        return z.reshape(x.shape), along.reshape(x.shape)

    def _gap(self, t: Array, shrink: float, *, fine: bool = False) -> Array:
        """Least distance [T], as a share of the outer cage's half-width, of the cage from the outer cage."""
        z, _ = self.surface(t, shrink, fine=fine)
        return 1.0 - np.abs(z).max(axis=(1, 2))

    @cached_property
    def gaps(self) -> tuple[float, float]:
        """The gaps of the canonical and the deformed cage, as shares of the outer cage's half-width."""
        first, last = self._gap(np.array([0.0, 1.0]), 0.0, fine=not self.confines.is_affine)
        return float(first), float(last)

    @cached_property
    def is_one_to_one(self) -> bool:
        """True when the cage stays a valid one, and space around it too, all the way."""
        return self.is_affine or bends_one_to_one(np.stack([self.bend(t) for t in np.linspace(0.0, 1.0, 5)]))


def _products(xi: Array) -> Array:
    x, y, z = xi[..., 0], xi[..., 1], xi[..., 2]
    return np.stack([x * y, x * z, y * z, x * y * z], axis=-1)


_SIGNS = 2.0 * hexahedron.BITS - 1.0


def _pieces() -> tuple[NDArray[np.intp], Array]:
    """The cage and the 26 pieces of space around it, one unit thick along its axes: for corner k of piece n

    the cage's corner [27,8] that it is at or next to, and how far it is from there [27,8,3].
    """
    sides = np.stack(np.meshgrid(*3 * [[-1.0, 0.0, 1.0]], indexing="ij"), axis=-1).reshape(-1, 1, 3)
    on = np.where(sides == 0.0, _SIGNS, sides)
    return (0.5 * (on + 1.0) @ [1.0, 2.0, 4.0]).astype(np.intp), sides * (sides == _SIGNS)


_NEXT_TO, _AWAY = _pieces()


def _surface(nodes: int) -> Array:
    """xi [S,3] of nodes^2 points on each face of the cube."""
    g = np.linspace(-1.0, 1.0, nodes)
    xi = np.stack(np.meshgrid(g, g, g, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.asarray(xi[np.abs(xi).max(axis=1) == 1.0])


_SURFACE = np.concatenate([_surface(3), _surface(5)])
