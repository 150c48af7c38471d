"""Space in the coordinates of a cage: trilinear inside it, and going on around it.

Notation: xi in [-1,1]^3 are the cage's trilinear coordinates, clamp(xi) their clamping to that cube, and

    x(xi) = c + F (xi + B(clamp(xi))),
    B(xi) = K_0 xi eta + K_1 xi zeta + K_2 eta zeta + K_3 xi eta zeta,

so inside the cage x is the trilinear map of its corners, and outside it goes on along the columns of F.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from cagefield import hexahedron
from cagefield.cages import Cage
from cagefield.hexahedron import Array, Mask

BENDS = [3, 5, 6, 7]
AXES = [1, 2, 4]


@dataclass(frozen=True)
class Extended:
    """Space in a cage's coordinates: x = c + F (xi + B(clamp(xi))).

    Parameters: centre c [3], frame F [3,3], bend K [4,3]; F^-1 and the distances of the faces from the centre
    along their normals follow from them.
    """

    centre: Array
    frame: Array
    bend: Array

    @staticmethod
    @lru_cache(maxsize=64)
    def of(cage: Cage) -> Extended:
        """The coordinates of a cage at rest."""
        C = hexahedron.coefficients(cage.corners)
        F = np.ascontiguousarray(C[AXES].T)
        return Extended(C[0], F, bends(C[None], F[None])[0])

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

    def coordinates(self, points: Array, start: Array | None = None, enough: float = 1e-14) -> Array:
        """xi [N,3] of points [N,3], by Newton's method from xi = start; see `straighten`."""
        y = (points - self.centre) @ self.inverse.T
        return y if self.is_affine else straighten(self.bend, y, start, enough)

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
        return bool(bends_one_to_one(self.bend[None])[0])


def bends(C: Array, F: Array) -> Array:
    """The bends K [B,4,3] of cages with monomial coefficients C [B,8,3] and frames F [B,3,3].

    Those that are rounding are 0.
    """
    K = C[:, BENDS] @ np.transpose(np.linalg.inv(F), (0, 2, 1))
    K[np.abs(K).max(axis=(1, 2)) < 1e-12] = 0.0
    return np.asarray(K)


def bend(K: Array, xi: Array) -> Array:
    """B(xi) [N,3] of the bend K [4,3]."""
    return _products(xi) @ K


def bend_slope(K: Array, xi: Array) -> Array:
    """dB/dxi [N,3,3], the last axis xi."""
    x, y, z = xi[:, :1], xi[:, 1:2], xi[:, 2:]
    along = (y * K[0] + z * K[1] + y * z * K[3], x * K[0] + z * K[2] + x * z * K[3])
    return np.stack([*along, x * K[1] + y * K[2] + x * y * K[3]], axis=2)


def bends_one_to_one(K: Array) -> Mask:
    """Mask [B] of the bends K [B,4,3] with which xi + B(clamp(xi)) takes no two xi to the same point.

    With M = d(xi + B(xi))/dxi, det M must be positive all over the cube. Beyond one of its faces, the
    determinant is the minor of M for the two other axes, which is affine there; beyond an edge, the diagonal
    entry of M along it, which is constant. So these must be positive at the cube's corners.
    """
    M = np.eye(3) + np.einsum("bki,nkj->bnij", K, _CORNER_SLOPES)
    diagonal = M.diagonal(axis1=2, axis2=3)
    minors = [M[..., i, i] * M[..., j, j] - M[..., i, j] * M[..., j, i] for i, j in ((0, 1), (0, 2), (1, 2))]
    mask = (diagonal > 0.0).all(axis=(1, 2)) & (np.stack(minors) > 0.0).all(axis=(0, 2))
    rows = np.flatnonzero(mask)
    corners = SIGNS + np.einsum("nk,bki->bni", _products(SIGNS), K[rows])
    mask[rows] = hexahedron.are_positive(hexahedron.determinant_coefficients(corners))
    return np.asarray(mask)


def straightened_slope(K: Array, xi: Array) -> Array:
    """d(xi + B(clamp(xi)))/dxi [N,3,3]."""
    inside = np.abs(xi) <= 1.0
    return np.eye(3) + bend_slope(K, xi.clip(-1.0, 1.0)) * inside[:, None, :]


def straighten(K: Array, y: Array, start: Array | None = None, enough: float = 1e-14) -> Array:
    """xi [N,3] with xi + B(clamp(xi)) = y [N,3], by a damped Newton's method from `start` (else from y).

    It ends where what is left is `enough`, as a share of 1 + |y|.
    """
    target = np.ascontiguousarray(y.T)  # components first: numpy's inner loops are long
    xi = target.copy() if start is None else start.T.copy()
    residual = _residual(K, xi, target)
    size = np.abs(residual).max(axis=0)
    arrived = enough * (1.0 + np.abs(target).max(axis=0))
    rows = np.flatnonzero(size > arrived)
    for _ in range(60):
        if len(rows) == 0:
            break
        step = hexahedron.solve(slope_columns(K, xi[:, rows]), residual[:, rows])
        left, share = np.arange(len(rows)), 1.0
        for _ in range(7):
            here = rows[left]
            trial = xi[:, here] - share * step[:, left]
            new = _residual(K, trial, target[:, here])
            new_size = np.abs(new).max(axis=0)
            better = new_size < size[here]
            moved = here[better]
            xi[:, moved], residual[:, moved], size[moved] = trial[:, better], new[:, better], new_size[better]
            left, share = left[~better], 0.5 * share
            if len(left) == 0:
                break
        rows = np.delete(rows, left)  # what no step improves has arrived, up to rounding
        rows = rows[size[rows] > arrived[rows]]
    return np.ascontiguousarray(xi.T)


def _residual(K: Array, xi: Array, y: Array) -> Array:
    """xi + B(clamp(xi)) - y, all [3,N]."""
    a, b, c = xi.clip(-1.0, 1.0)
    ab = a * b
    return xi + K.T @ np.stack([ab, a * c, b * c, ab * c]) - y


def slope_columns(K: Array, xi: Array) -> tuple[Array, Array, Array]:
    """The three columns [3,N] of d(xi + B(clamp(xi)))/dxi at xi [3,N]."""
    a, b, c = xi.clip(-1.0, 1.0)
    inside = np.abs(xi) <= 1.0
    columns = (
        K[[0, 1, 3]].T @ np.stack([b, c, b * c]),
        K[[0, 2, 3]].T @ np.stack([a, c, a * c]),
        K[[1, 2, 3]].T @ np.stack([a, b, a * b]),
    )
    for axis, column in enumerate(columns):
        column *= inside[axis]
        column[axis] += 1.0
    return columns


def stay_one_to_one(start: Array, ends: Array) -> Mask:
    """Mask [B] of the bends [B,4,3] at which a cage bent by `start` [4,3] may end.

    All the way to them it must be one to one, see `bends_one_to_one`.
    """
    # Each row of M - 1 sums to less than 1 there: M's minors are positive, as for all bends on the way.
    size = np.maximum(np.abs(ends), np.abs(start))
    mask = (2.0 * size.sum(axis=1) + size[:, 3]).max(axis=1) < 1.0
    rows = np.flatnonzero(~mask)
    t = np.linspace(0.0, 1.0, 5)[:, None, None, None]
    way = start + t * (ends[rows] - start)
    mask[rows] = bends_one_to_one(way.reshape(-1, 4, 3)).reshape(5, -1).all(axis=0)
    return np.asarray(mask)


def _products(xi: Array) -> Array:
    x, y, z = xi[..., 0], xi[..., 1], xi[..., 2]
    return np.stack([x * y, x * z, y * z, x * y * z], axis=-1)


SIGNS = 2.0 * hexahedron.BITS - 1.0
_x, _y, _z = SIGNS.T
_0, _1 = np.zeros(8), np.ones(8)
_CORNER_SLOPES = np.stack(
    [
        np.stack([_y, _x, _0], axis=1),
        np.stack([_z, _0, _x], axis=1),
        np.stack([_0, _z, _y], axis=1),
        np.stack([_y * _z, _x * _z, _x * _y], axis=1),
    ],
    axis=1,
)
"""Derivatives [8,4,3] of the products xi eta, xi zeta, eta zeta and xi eta zeta at the cube's corners."""
