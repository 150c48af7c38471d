"""The way of a lattice of control points from its canonical to its deformed place, in pieces.

Notation: in a piece, s in [0,1] is the time; the lattice goes from control points A to B,

    x(u, s) = c(s) + F(s) y(u, s),    y(u, s) = y_A(u) + s (y_B(u) - y_A(u)),

with M the affine map that fits B over A best, M = R S its polar decomposition, F(s) = R^s S^s, c(s) the
straight way of the points' mean, y_A = A - mean A, y_B = M^-1 (B - mean B): the lattice turns and grows as a
whole, and the rest of its motion is straight in the frame that goes along. det dx/du > 0 all the way is
proven by `geometry.lattice_determinant`, in u and s together.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from cagefield.geometry import bspline_lattice, lattice_determinant
from cagefield.geometry.cage import MAX_WAY_STATES, LatticeCage
from cagefield.typing import Array
from cagefield.warps.linear_motion import LinearMotion

MOST_TURN = 1.6
"""Radians by which a part of the lattice may turn against the whole within a piece, if there are states."""


@dataclass(frozen=True)
class Piece:
    """One piece of a way: control points [n,3] at its start and end; the lattice's shape, interpolation."""

    start: Array
    end: Array
    shape: tuple[int, int, int]
    interpolation: str

    @cached_property
    def _fit(self) -> tuple[Array, Array, Array]:
        """(mean of A [3], mean of B [3], M [3,3])."""
        a, b = self.start.mean(axis=0), self.end.mean(axis=0)
        M, *_ = np.linalg.lstsq(self.start - a, self.end - b, rcond=None)
        return a, b, M.T

    @cached_property
    def local(self) -> tuple[Array, Array]:
        """(y_A [n,3], y_B [n,3])."""
        a, b, M = self._fit
        return self.start - a, (self.end - b) @ np.linalg.inv(M).T

    @cached_property
    def padded(self) -> tuple[Array, Array]:
        """Padded y_A and y_B - y_A, as kernels take them."""
        y_a, y_b = self.local
        return bspline_lattice.padded(y_a, self.shape), bspline_lattice.padded(y_b - y_a, self.shape)

    @cached_property
    def is_one_to_one(self) -> bool:
        """True where the determinant is proven positive all the way."""
        if np.linalg.det(self._fit[2]) <= 1e-6:
            return False
        y_a, y_b = self.local
        return lattice_determinant.verdict(y_a, self.shape, self.interpolation, y_b)[0] == "proven"

    @cached_property
    def turn(self) -> float:
        """Largest angle in radians by which a sampled part of the lattice turns against the whole."""
        y_a, y_b = self.local
        u = bspline_lattice.grid((2 * self.shape[0] - 1, 2 * self.shape[1] - 1, 2 * self.shape[2] - 1))
        both = np.concatenate([y_a, y_b], axis=1)
        slopes = bspline_lattice.evaluate(both, self.shape, self.interpolation, u)[1]
        A, B = slopes[:, :3], slopes[:, 3:]
        U, _, Vt = np.linalg.svd(B @ np.linalg.inv(A))
        return float(Rotation.from_matrix(U @ Vt).magnitude().max())

    def frame(self, s: float) -> tuple[Array, Array, Array, Array]:
        """(c [3], F [3,3], dc/ds [3], dF/ds [3,3]) at time s."""
        a, b, _ = self._fit
        (F,), (dF,) = self._linear.at(np.array([s]))
        return a + s * (b - a), F, b - a, dF

    @cached_property
    def _linear(self) -> LinearMotion:
        return LinearMotion(np.eye(3), self._fit[2])

    @cached_property
    def _evaluated(self) -> dict[bytes, tuple[Array, Array]]:
        """Values [M,6] and slopes [M,6,3] of (y_A, y_B - y_A), by the bytes of u."""
        return {}

    def samples(self, s: float, u: Array) -> tuple[Array, Array, Array, Array]:
        """(y [M,3], dy/du [M,3,3], y_B - y_A [M,3], its derivative in u [M,3,3]) at u [M,3] and time s."""
        known = self._evaluated.get(u.tobytes())
        if known is None:
            y_a, y_b = self.local
            both = np.concatenate([y_a, y_b - y_a], axis=1)
            known = bspline_lattice.evaluate(both, self.shape, self.interpolation, u)
            self._evaluated[u.tobytes()] = known
        value, slope = known
        y, d, dy, dd = value[:, :3], value[:, 3:], slope[:, :3], slope[:, 3:]
        return y + s * d, dy + s * dd, d, dd


def pieces_between(inner: LatticeCage, deformed: LatticeCage) -> tuple[Piece, ...] | None:
    """Pieces of a way that is one to one from an inner cage to the deformed one; None where none is found.

    The direct way, or one along the states that the operations have left on `deformed.way`, where a part of
    the lattice turns by more than `MOST_TURN` against the whole: a straight way would squeeze it.
    """
    if inner.shape != deformed.shape or inner.interpolation != deformed.interpolation:
        return None
    states = _states(inner, deformed)
    pieces: list[Piece] = []
    at = 0
    while at < len(states) - 1:
        found = None
        for to in range(len(states) - 1, at, -1):
            piece = Piece(states[at], states[to], inner.shape, inner.interpolation)
            if piece.is_one_to_one:
                is_last = found is None and to == at + 1  # taken whatever it turns by
                found = found or (to, piece)
                if is_last or piece.turn <= MOST_TURN:
                    found = to, piece
                    break
        if found is None:
            return None
        at = found[0]
        pieces.append(found[1])
    return tuple(pieces)


def _states(inner: LatticeCage, deformed: LatticeCage) -> list[Array]:
    """Control points of the inner cage, of the states after it, and of the deformed cage."""
    way = list(deformed.way)
    for n in range(len(way) - 1, -1, -1):
        if np.array_equal(way[n], inner.control_points):
            way = way[n + 1 :]
            break
    else:
        if len(way) < MAX_WAY_STATES:  # not made from this inner cage
            way = []
    return [inner.control_points, *way, deformed.control_points]
