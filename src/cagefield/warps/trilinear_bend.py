"""How a cage is bent, and the map of the space around it.

Notation: xi in [-1,1]^3 are the cage's trilinear coordinates, clamp(xi) their clamping to that cube, and

    x(xi) = c + F y(xi),    y(xi) = xi + B(clamp(xi)) + sum_a |xi_a - clamp(xi)_a| s_a d_as, s_a = sign xi_a,
    B(xi) = K_0 xi eta + K_1 xi zeta + K_2 eta zeta + K_3 xi eta zeta,

so inside the cage x is the trilinear map of its corners, and beyond its face a, s it continues along
e_as = i_a + d_as, with i_a the unit vector of the axis and d_as, across it, the tilt. Along i_a it would fold
where the face is bent so far that one of its normals points away from i_a. A face's best direction is the
middle of the smallest cone that holds its corners' normals; e_as is the first one, on the way from i_a to it,
with at least `MIN_NORMAL_SHARE` of its least component along a normal. A face bent little has no tilt.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from cagefield.geometry import hexahedron, hexahedron_determinant
from cagefield.typing import Array, Mask

BENDS = [3, 5, 6, 7]
AXIS_COEFFICIENTS = [1, 2, 4]

MIN_NORMAL_SHARE = 0.5
"""A direction's least component along its face's normals, as a share of its largest possible value.

Of cages with all corners moved to 95% of the valid distance, 0.14% are refused with 0.3 to 0.7, and 3.4%
with 1.
"""


def bends(C: Array, F: Array) -> Array:
    """The bends K [B,4,3] of cages with monomial coefficients C [B,8,3] and frames F [B,3,3].

    Values at rounding level are set to 0.
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


def corner_slopes(K: Array) -> Array:
    """dB/dxi [B,8,3,3] of bends K [B,4,3] at the cube's corners, the last axis xi."""
    return np.asarray(np.einsum("bki,nkj->bnij", K, _CORNER_SLOPES))


def forms(K: Array) -> Array:
    """The bends K [B,4,3] and, below them, their tilts [B,6,3]: of the faces -x, +x, -y, +y, -z, +z."""
    M = np.eye(3) + corner_slopes(K)
    normals = np.stack([_cross(M[..., a - 2], M[..., a - 1]) for a in range(3)], axis=2)
    normals /= np.maximum(np.linalg.norm(normals, axis=3, keepdims=True), 1e-300)
    n = normals[:, _FACE_CORNERS, _FACE_AXES[:, None]].reshape(-1, 4, 3)
    axis = np.tile(_FACE_AXES, len(K))
    along = np.take_along_axis(n, axis[:, None, None], axis=2)[..., 0]
    # The middle's component along the axis is no less than the normals' least: above this there is no tilt.
    rows = np.flatnonzero(along.min(axis=1) < np.sqrt(MIN_NORMAL_SHARE))
    tilts = np.zeros((len(n), 3))
    tilts[rows] = _tilts(n[rows], along[rows], axis[rows])
    return np.concatenate([K, tilts.reshape(-1, 6, 3)], axis=1)


def _tilts(n: Array, along: Array, axis: NDArray[np.intp]) -> Array:
    """The tilts [N,3] of faces with unit normals n [N,4,3], whose components along their axis are `along`."""
    d = face_directions(n)
    rows = np.arange(len(d))
    # No cage that is one to one continues along a face.
    d /= np.maximum(d[rows, axis], 0.05)[:, None]
    d[rows, axis] = 0.0
    across = (n @ d[:, :, None])[..., 0]
    lacking = MIN_NORMAL_SHARE * (along + across).min(axis=1, keepdims=True) - along
    share = np.divide(lacking, across, out=np.zeros_like(across), where=(lacking > 0.0) & (across > 0.0))
    return np.asarray(d * share.max(axis=1, keepdims=True, initial=0.0).clip(0.0, 1.0))


def face_directions(n: Array) -> Array:
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
    form = forms(K)
    mask = (_row_sums(K) < 1.0) & ~form[:, 4:].any(axis=(1, 2))  # M's minors are positive
    rows = np.flatnonzero(~mask)
    mask[rows] = _are_one_to_one(form[rows])
    return np.asarray(mask)


def _are_one_to_one(form: Array) -> Mask:
    """Mask [B] of the injective forms [B,10,3], by all determinants; see `bends_one_to_one`."""
    K = form[:, :4]
    M = np.eye(3) + corner_slopes(K)
    e = np.eye(3) + np.swapaxes(form[:, _CORNER_TILTS], 2, 3)
    x, y, z = (np.stack([M[..., a], e[..., a]], axis=2) for a in range(3))  # [B,8,2,3]
    mixed = np.einsum("bnxi,bnyzi->bnxyz", x, _cross(y[:, :, :, None], z[:, :, None]))
    mask = (mixed.reshape(len(K), 8, 8) > 0.0).all(axis=(1, 2))
    rows = np.flatnonzero(mask)
    corners = SIGNS + np.einsum("nk,bki->bni", _products(SIGNS), K[rows])
    mask[rows] = hexahedron_determinant.are_positive(hexahedron_determinant.determinant_coefficients(corners))
    return np.asarray(mask)


def stay_one_to_one(start: Array, ends: Array) -> Mask:
    """Mask [B] of the bends [B,4,3] at which a cage bent by `start` [4,3] may end.

    All the way to them it must be one to one, see `bends_one_to_one`.
    """
    # Where each row of M - 1 sums to less than 1/4, the components of a face's normals across the axis sum to
    # less than 6/7 of the one along it, so a tilt's do, too: all choices of columns are diagonally dominant,
    # as for all bends on the way.
    mask = _row_sums(np.maximum(np.abs(ends), np.abs(start))) < 0.25
    rows = np.flatnonzero(~mask)
    t = np.linspace(0.0, 1.0, 5)[:, None, None, None]
    way = start + t * (ends[rows] - start)
    mask[rows] = bends_one_to_one(way.reshape(-1, 4, 3)).reshape(5, -1).all(axis=0)
    return np.asarray(mask)


def _row_sums(K: Array) -> Array:
    """The most [B] that the absolute values in a row of M - 1 sum to, of bends K [B,4,3]."""
    size = np.abs(K)
    return np.asarray((2.0 * size.sum(axis=1) + size[:, 3]).max(axis=1))


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
_FACE_AXES = np.repeat(range(3), 2)
_FACE_CORNERS = np.array([np.flatnonzero(SIGNS[:, a] == s) for a in range(3) for s in (-1.0, 1.0)])
_CORNER_TILTS = np.array([[4 + 2 * a + (SIGNS[k, a] > 0.0) for a in range(3)] for k in range(8)])
_PAIRS = np.array(list(combinations(range(4), 2)))
_TRIPLES = np.array(list(combinations(range(4), 3)))
