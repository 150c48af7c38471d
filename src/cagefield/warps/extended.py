"""Space in the coordinates of a cage: trilinear inside it, and going on around it.

Notation: xi in [-1,1]^3 are the cage's trilinear coordinates, clamp(xi) their clamping to that cube, and

    x(xi) = c + F y(xi),    y(xi) = xi + B(clamp(xi)) + sum_a |xi_a - clamp(xi)_a| s_a d_as, s_a = sign xi_a,
    B(xi) = K_0 xi eta + K_1 xi zeta + K_2 eta zeta + K_3 xi eta zeta,

so inside the cage x is the trilinear map of its corners, and beyond its face a, s it goes on along
e_as = i_a + d_as, with i_a the unit vector of the axis and d_as, across it, the tilt. Along i_a it would fold
where the face is bent so far that one of its normals points away from i_a. A face's best direction is the
middle of the smallest cone that holds its corners' normals; e_as is the one nearest to i_a, on the way from
that, which has at least `KEPT` of its least component along a normal. A face bent little has no tilt.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import combinations

import numpy as np

from cagefield import hexahedron
from cagefield.cages import Cage
from cagefield.hexahedron import Array, Mask

BENDS = [3, 5, 6, 7]
AXES = [1, 2, 4]

KEPT = 0.5
"""A direction's least component along its face's normals, as a share of the most that it could be.

Of cages with all corners moved to 95% of what is valid, 0.14% are refused with 0.3 to 0.7, and 3.4% with 1.
"""


@dataclass(frozen=True)
class Extended:
    """Space in a cage's coordinates: x = c + F y(xi).

    Parameters: centre c [3], frame F [3,3], bend K [4,3]; the tilts, F^-1 and the distances of the faces from
    the centre along their normals follow from them.
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

    @cached_property
    def form(self) -> Array:
        """The bend's and the tilts' rows [10,3], see `forms`."""
        return np.asarray(forms(self.bend[None])[0])

    def points(self, xi: Array) -> Array:
        """x [N,3] of coordinates xi [N,3]."""
        y = xi if self.is_affine else xi + _factors(xi.T).T @ self.form
        return self.centre + y @ self.frame.T

    def coordinates(self, points: Array, start: Array | None = None, enough: float = 1e-14) -> Array:
        """xi [N,3] of points [N,3], by Newton's method from xi = start; see `straighten`."""
        y = (points - self.centre) @ self.inverse.T
        return y if self.is_affine else straighten(self.form, y, start, enough)

    def gradient(self, xi: Array) -> Array:
        """dxi/dx [N,3,3] at xi [N,3]; at a kink that of the side towards the cage's inside."""
        if self.is_affine:
            return np.broadcast_to(self.inverse, (len(xi), 3, 3))
        return hexahedron.invert(straightened_slope(self.form, xi)) @ self.inverse

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


def forms(K: Array) -> Array:
    """The bends K [B,4,3] and, below them, their tilts [B,6,3]: of the faces -x, +x, -y, +y, -z, +z."""
    M = np.eye(3) + np.einsum("bki,nkj->bnij", K, _CORNER_SLOPES)
    normals = np.stack([_cross(M[..., a - 2], M[..., a - 1]) for a in range(3)], axis=2)
    normals /= np.maximum(np.linalg.norm(normals, axis=3, keepdims=True), 1e-300)
    n = normals[:, _FACE_CORNERS, _FACE_AXES[:, None]]  # [B,6,4,3]
    d = _middles(n)
    # No cage that is one to one goes on along a face.
    d /= np.maximum(d[:, range(6), _FACE_AXES], 0.05)[:, :, None]
    d[:, range(6), _FACE_AXES] = 0.0
    along = np.take_along_axis(n, _FACE_AXES[None, :, None, None], axis=3)[..., 0]
    across = (n @ d[..., None])[..., 0]
    lacking = KEPT * (along + across).min(axis=2, keepdims=True) - along
    share = np.divide(lacking, across, out=np.zeros_like(across), where=(lacking > 0.0) & (across > 0.0))
    d *= share.max(axis=2, keepdims=True).clip(0.0, 1.0)
    return np.concatenate([K, d], axis=1)


def _middles(n: Array) -> Array:
    """The directions [...,3] that make the least largest angle with four unit vectors n [...,4,3].

    The smallest cone that holds them touches two of them, or three.
    """
    a, b, c = (n[..., _TRIPLES[:, i], :] for i in range(3))
    three = _cross(a, b) + _cross(b, c) + _cross(c, a)
    three *= np.where((three * a).sum(axis=-1) < 0.0, -1.0, 1.0)[..., None]
    tried = np.concatenate([n[..., _PAIRS[:, 0], :] + n[..., _PAIRS[:, 1], :], three], axis=-2)
    size = np.linalg.norm(tried, axis=-1, keepdims=True)
    tried = np.where(size > 1e-9, tried / np.maximum(size, 1e-9), 0.0)  # no cone touches three that are alike
    best = (tried @ np.swapaxes(n, -1, -2)).min(axis=-1).argmax(axis=-1)
    return np.asarray(np.take_along_axis(tried, best[..., None, None], axis=-2)[..., 0, :])


def bends_one_to_one(K: Array) -> Mask:
    """Mask [B] of the bends K [B,4,3] with which y(xi) takes no two xi to the same point.

    With M = d(xi + B(xi))/dxi, det M must be positive all over the cube. Around it, the columns of M along
    which xi is beyond a face are the directions e of these faces: det is bilinear beyond a face and constant
    beyond an edge or a corner, so it must be positive at the cube's corners, for every choice of columns.
    Then y is one to one at the kinks, too.

    Source: Samelson, Thrall, Wesler, "A partition theorem for Euclidean n-space", 1958: cones spanned by one
    vector out of each of n pairs fill space just once if their determinants have one sign.
    """
    M = np.eye(3) + np.einsum("bki,nkj->bnij", K, _CORNER_SLOPES)
    e = np.eye(3) + np.swapaxes(forms(K)[:, _CORNER_TILTS], 2, 3)
    x, y, z = (np.stack([M[..., a], e[..., a]], axis=2) for a in range(3))  # [B,8,2,3]
    mixed = np.einsum("bnxi,bnyzi->bnxyz", x, _cross(y[:, :, :, None], z[:, :, None]))
    mask = (mixed.reshape(len(K), 8, 8) > 0.0).all(axis=(1, 2))
    rows = np.flatnonzero(mask)
    corners = SIGNS + np.einsum("nk,bki->bni", _products(SIGNS), K[rows])
    mask[rows] = hexahedron.are_positive(hexahedron.determinant_coefficients(corners))
    return np.asarray(mask)


def straightened_slope(form: Array, xi: Array) -> Array:
    """dy/dxi [N,3,3]."""
    return np.transpose(np.stack(slope_columns(form, xi.T)), (2, 1, 0))


def straighten(form: Array, y: Array, start: Array | None = None, enough: float = 1e-14) -> Array:
    """xi [N,3] with y(xi) = y [N,3], by a damped Newton's method from `start` (else from y).

    It ends where what is left is `enough`, as a share of 1 + |y|. What is stuck at a kink is tried again from
    elsewhere.
    """
    target = np.ascontiguousarray(y.T)  # components first: numpy's inner loops are long
    xi = target.copy() if start is None else start.T.copy()
    size = _newton(form, xi, target, enough)
    for again in _STARTS:
        rows = np.flatnonzero(size > 1e-6 * (1.0 + np.abs(target).max(axis=0)))
        if len(rows) == 0:
            break
        trial = np.repeat(again[:, None], len(rows), axis=1)
        new_size = _newton(form, trial, target[:, rows], enough)
        better = new_size < size[rows]
        xi[:, rows[better]], size[rows[better]] = trial[:, better], new_size[better]
    return np.ascontiguousarray(xi.T)


def _newton(form: Array, xi: Array, target: Array, enough: float) -> Array:
    """What is left [N] of y(xi) - target after taking xi [3,N] to the root near it, in place."""
    residual = _residual(form, xi, target)
    size = np.abs(residual).max(axis=0)
    arrived = enough * (1.0 + np.abs(target).max(axis=0))
    rows = np.flatnonzero(size > arrived)
    for _ in range(60):
        if len(rows) == 0:
            break
        step = hexahedron.solve(slope_columns(form, xi[:, rows]), residual[:, rows])
        left, share = np.arange(len(rows)), 1.0
        for _ in range(7):
            here = rows[left]
            trial = xi[:, here] - share * step[:, left]
            new = _residual(form, trial, target[:, here])
            new_size = np.abs(new).max(axis=0)
            better = new_size < size[here]
            moved = here[better]
            xi[:, moved], residual[:, moved], size[moved] = trial[:, better], new[:, better], new_size[better]
            left, share = left[~better], 0.5 * share
            if len(left) == 0:
                break
        rows = np.delete(rows, left)  # what no step improves has arrived, up to rounding, or is stuck
        rows = rows[size[rows] > arrived[rows]]
    return np.asarray(size)


def _residual(form: Array, xi: Array, y: Array) -> Array:
    """y(xi) - y, all [3,N]."""
    return xi + form.T @ _factors(xi) - y


def _factors(xi: Array) -> Array:
    """What the rows of a form are multiplied by [10,N] at xi [3,N]."""
    a, b, c = xi.clip(-1.0, 1.0)
    ab = a * b
    below, above = np.minimum(xi + 1.0, 0.0), np.maximum(xi - 1.0, 0.0)
    beyond = (below[0], above[0], below[1], above[1], below[2], above[2])
    return np.stack([ab, a * c, b * c, ab * c, *beyond])


def slope_columns(form: Array, xi: Array) -> tuple[Array, Array, Array]:
    """The three columns [3,N] of dy/dxi at xi [3,N]."""
    a, b, c = xi.clip(-1.0, 1.0)
    inside = np.abs(xi) <= 1.0
    columns = (
        form[[0, 1, 3]].T @ np.stack([b, c, b * c]),
        form[[0, 2, 3]].T @ np.stack([a, c, a * c]),
        form[[1, 2, 3]].T @ np.stack([a, b, a * b]),
    )
    for axis, column in enumerate(columns):
        column *= inside[axis]
        column += form[4 + 2 * axis : 6 + 2 * axis].T @ np.stack([xi[axis] < -1.0, xi[axis] > 1.0])
        column[axis] += 1.0
    return columns


def stay_one_to_one(start: Array, ends: Array) -> Mask:
    """Mask [B] of the bends [B,4,3] at which a cage bent by `start` [4,3] may end.

    All the way to them it must be one to one, see `bends_one_to_one`.
    """
    # Where each row of M - 1 sums to less than 1/4, the components of a face's normals across the axis sum to
    # less than 6/7 of the one along it, so a tilt's do, too: all choices of columns are diagonally dominant,
    # as for all bends on the way.
    size = np.maximum(np.abs(ends), np.abs(start))
    mask = (2.0 * size.sum(axis=1) + size[:, 3]).max(axis=1) < 0.25
    rows = np.flatnonzero(~mask)
    t = np.linspace(0.0, 1.0, 5)[:, None, None, None]
    way = start + t * (ends[rows] - start)
    mask[rows] = bends_one_to_one(way.reshape(-1, 4, 3)).reshape(5, -1).all(axis=0)
    return np.asarray(mask)


def _cross(a: Array, b: Array) -> Array:
    """a x b [...,3]."""
    return np.stack(
        [
            a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1],
            a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
            a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0],
        ],
        axis=-1,
    )


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
_STARTS = np.concatenate([np.zeros((1, 3)), SIGNS, 2.0 * SIGNS])
_FACE_AXES = np.repeat(range(3), 2)
_FACE_CORNERS = np.array([np.flatnonzero(SIGNS[:, a] == s) for a in range(3) for s in (-1.0, 1.0)])
_CORNER_TILTS = np.array([[4 + 2 * a + (SIGNS[k, a] > 0.0) for a in range(3)] for k in range(8)])
_PAIRS = np.array(list(combinations(range(4), 2)))
_TRIPLES = np.array(list(combinations(range(4), 3)))
