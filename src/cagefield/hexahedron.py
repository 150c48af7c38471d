"""The trilinear hexahedron: map, Jacobian, inverse and a sign test for its determinant, in float64.

Notation: corners v_k, k = x + 2y + 4z with x, y, z in {0, 1} (VTK voxel order); u in [0,1]^3;
x(u) = sum_k N_k(u) v_k with N_k the trilinear weights. Internally xi = 2u - 1 and the monomial form

    x(xi) = C_0 + C_1 xi + C_2 eta + C_4 zeta + C_3 xi eta + C_5 xi zeta + C_6 eta zeta + C_7 xi eta zeta

whose index has the bits of its variables. The inverse works on y = W (x - C_0) with W the inverse of the
Jacobian at the centre, so that y = xi + (four terms that vanish on parallelepipeds): thin and sheared
hexahedra are as well conditioned as cubes.
"""

from __future__ import annotations

from itertools import product
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]

BITS: Array = np.array([[k & 1, k >> 1 & 1, k >> 2 & 1] for k in range(8)], dtype=np.float64)
"""[8,3] u of the eight corners."""

_SIGNS = 2.0 * BITS - 1.0
_TO_MONOMIAL: Array = (
    np.array([[np.prod(_SIGNS[k] ** BITS[m]) for k in range(8)] for m in range(8)], dtype=np.float64) / 8.0
)
_CHUNK = 16384
_INSIDE = 1e-12
"""A point counts as inside when u is within this of [0,1]^3: some 5000 roundings, far below a float32."""


def coefficients(corners: Array) -> Array:
    """Monomial coefficients C [...,8,3] of hexahedra with corners [...,8,3]."""
    return np.asarray(_TO_MONOMIAL @ corners)


def points(corners: Array, u: Array) -> Array:
    """x(u) [N,3] for u [N,3] in a hexahedron with corners [8,3]."""
    return _evaluate(coefficients(corners), 2.0 * u - 1.0)


def jacobian(corners: Array, u: Array) -> Array:
    """dx/du [N,3,3] at u [N,3]; column j is the derivative along u_j."""
    return 2.0 * _derivative(coefficients(corners), 2.0 * u - 1.0)


def inverse(corners: Array, targets: Array) -> tuple[Array, Mask]:
    """u [N,3] with x(u) = targets [N,3], and a mask [N] of the points where such a u was found.

    Where a target has a preimage in [0,1]^3 that preimage is returned; elsewhere the root that Newton's
    method reaches from the affine guess, which may be any root or none (mask False). Damped Newton with the
    analytic Jacobian; targets that lie in the hull of the corners and did not reach a root in [0,1]^3 are
    tried again from the centres of those of the 512 sub-hexahedra whose boxes hold them, so a hexahedron
    with positive determinant misses none of its points.
    """
    C = coefficients(corners)
    W = np.linalg.inv(C[[1, 2, 4]].T)
    y = (targets - C[0]) @ W.T
    K = C[[3, 5, 6, 7]] @ W.T  # y = xi + K0 xi eta + K1 xi zeta + K2 eta zeta + K3 xi eta zeta
    if np.abs(K).max() < 1e-14:  # a parallelepiped up to rounding
        return 0.5 * (y + 1.0), np.isfinite(y).all(axis=1)
    xi = np.empty_like(y)
    found = np.empty(len(y), dtype=bool)
    for start in range(0, len(y), _CHUNK):
        part = slice(start, start + _CHUNK)
        xi[part], found[part] = _newton(K, y[part], y[part].copy())
    local = (corners - C[0]) @ W.T
    outside = np.abs(xi).max(axis=1, initial=0.0) > 1.0 + 2.0 * _INSIDE
    retry = np.flatnonzero((~found | outside) & _in_hull(local, y))
    if len(retry):
        better, where = _newton_from_cells(K, local, y[retry])
        xi[retry[where]] = better[where]
        found[retry[where]] = True
    return 0.5 * (xi + 1.0), found


def inside(u: Array, found: Mask) -> Mask:
    """Mask [N] of the points whose u, as `inverse` returns it, lies in the closed unit cube."""
    return found & np.asarray((u >= -_INSIDE).all(axis=1) & (u <= 1.0 + _INSIDE).all(axis=1))


def determinant_coefficients(corners: Array) -> Array:
    """Bernstein coefficients [...,3,3,3] over u in [0,1]^3 of det dx/du, axes (u_x, u_y, u_z).

    The determinant has degree 2 in each variable. Its minimum is at least the least coefficient, and the
    eight coefficients at the corners of the block are the determinants at the corners of the hexahedron.
    """
    along = [corners[..., _EDGE_HEADS[a], :] - corners[..., _EDGE_TAILS[a], :] for a in range(3)]
    triple = np.einsum(
        "...nd,...nd->...n",
        along[0][..., _TRIPLES[:, 0], :],
        np.cross(along[1][..., _TRIPLES[:, 1], :], along[2][..., _TRIPLES[:, 2], :]),
    )
    return np.asarray((triple @ _TRIPLE_WEIGHTS.T).reshape(*triple.shape[:-1], 3, 3, 3))


def is_positive(bernstein: Array, depth: int = 6) -> bool:
    """True when every triquadratic polynomial with Bernstein coefficients [B,3,3,3] is > 0 on the unit cube.

    Exact up to 2^-depth: blocks are split until the least coefficient is positive (proof), a corner is not
    (counter-example), or `depth` splits have not decided, which counts as not positive.
    """
    blocks = bernstein.reshape(-1, 3, 3, 3)
    for _ in range(depth):
        blocks = blocks[blocks.min(axis=(1, 2, 3)) <= 0.0]
        if len(blocks) == 0:
            return True
        if blocks[:, ::2, ::2, ::2].min() <= 0.0:
            return False
        for axis in (1, 2, 3):
            halves = np.tensordot(_SPLIT, blocks, axes=(2, axis))  # [2,3,B,...]
            blocks = np.moveaxis(halves, 1, axis + 1).reshape(-1, 3, 3, 3)
    return bool(blocks.min() > 0.0)


def _evaluate(C: Array, xi: Array) -> Array:
    x, y, z = xi[:, :1], xi[:, 1:2], xi[:, 2:]
    return C[0] + C[1] * x + y * (C[2] + C[3] * x) + z * (C[4] + C[5] * x + y * (C[6] + C[7] * x))


def _derivative(C: Array, xi: Array) -> Array:
    x, y, z = xi[:, :1], xi[:, 1:2], xi[:, 2:]
    return np.stack(
        [
            C[1] + C[3] * y + z * (C[5] + C[7] * y),
            C[2] + C[3] * x + z * (C[6] + C[7] * x),
            C[4] + C[5] * x + y * (C[6] + C[7] * x),
        ],
        axis=2,
    )


def _newton(K: Array, y: Array, xi: Array) -> tuple[Array, Mask]:
    """Roots xi [N,3] of xi + K-terms = y from the given start, and a mask of those with residual < 1e-11."""
    C = np.concatenate([np.zeros((1, 3)), np.eye(3)[:2], K[:1], np.eye(3)[2:], K[1:]])
    residual = _evaluate(C, xi) - y
    size = np.abs(residual).max(axis=1)
    active = np.flatnonzero(size > 0.0)
    for _ in range(60):
        if len(active) == 0:
            break
        J = _derivative(C, xi[active])
        step = _solve(J, residual[active])
        # A step of more than one cell leaves the region in which the linearisation says anything.
        step /= np.maximum(1.0, np.abs(step).max(axis=1, keepdims=True) / 2.0)
        scale = np.ones((len(active), 1))
        for _ in range(12):
            trial = xi[active] - scale * step
            new = _evaluate(C, trial) - y[active]
            new_size = np.abs(new).max(axis=1)
            worse = ~(new_size < size[active])
            if not worse.any():
                break
            scale[worse] *= 0.5
        better = ~worse
        moved = active[better]
        xi[moved], residual[moved], size[moved] = trial[better], new[better], new_size[better]
        # At rounding level no step improves the residual any more: that point has arrived (or is stuck).
        active = moved[size[moved] > 1e-16]
    return xi, np.asarray(size < 1e-11)


def _newton_from_cells(K: Array, local: Array, y: Array, depth: int = 3) -> tuple[Array, Mask]:
    """Roots in [-1,1]^3 found from the centres of sub-hexahedra whose boxes hold y, and their mask."""
    rows = np.arange(len(y))
    cells = np.broadcast_to(local, (len(y), 8, 3))
    low = np.full((len(y), 3), -1.0)
    for level in range(depth):
        half = 0.5**level
        children, starts, owners = [], [], []
        for octant in BITS:
            weights = 0.5 * (octant + BITS)  # u of the child's corners in the parent
            child = np.einsum("kc,ncd->nkd", _weights(weights), cells)
            slack = 1e-9
            holds = np.all(
                (y[rows] >= child.min(axis=1) - slack) & (y[rows] <= child.max(axis=1) + slack), axis=1
            )
            children.append(child[holds])
            starts.append(low[holds] + half * octant)
            owners.append(rows[holds])
        cells, low, rows = np.concatenate(children), np.concatenate(starts), np.concatenate(owners)
    best = np.zeros((len(y), 3))
    done = np.zeros(len(y), dtype=bool)
    xi, found = _newton(K, y[rows], low + 0.5 ** (depth - 1) * 0.5)
    good = found & np.asarray(np.abs(xi).max(axis=1, initial=0.0) <= 1.0 + 2.0 * _INSIDE)
    best[rows[good]], done[rows[good]] = xi[good], True
    return best, done


def _weights(u: Array) -> Array:
    """Trilinear weights [N,8] at u [N,3]."""
    return np.asarray(np.where(BITS[None] == 1.0, u[:, None], 1.0 - u[:, None]).prod(axis=2))


def _in_hull(local: Array, y: Array) -> Mask:
    """Mask [N] of the points that a box and the six face normals do not prove to be outside the hull."""
    normals = [np.eye(3)]
    for axis, side in product(range(3), (0, 1)):
        face = local[BITS[:, axis] == side]
        normals.append(np.cross(face[3] - face[0], face[2] - face[1])[None])
    n = np.concatenate(normals)
    reach = local @ n.T
    slack = 1e-9 * np.abs(reach).max(axis=0)
    along = y @ n.T
    return np.all((along >= reach.min(axis=0) - slack) & (along <= reach.max(axis=0) + slack), axis=1)


def _solve(J: Array, r: Array) -> Array:
    """J^-1 r [N,3] by Cramer's rule, with singular J moved off zero (the line search guards the step)."""
    a, b, c = J[:, :, 0], J[:, :, 1], J[:, :, 2]
    bc, ca, ab = np.cross(b, c), np.cross(c, a), np.cross(a, b)
    det = np.einsum("nd,nd->n", a, bc)
    det = np.where(np.abs(det) < 1e-12, np.where(det < 0.0, -1e-12, 1e-12), det)
    return np.stack([(v * r).sum(axis=1) / det for v in (bc, ca, ab)], axis=1)


def _triples() -> tuple[list[NDArray[np.intp]], list[NDArray[np.intp]], NDArray[np.intp], Array]:
    """Edge tails and heads per axis, the 64 products of one edge per axis, and their Bernstein weights."""
    tails, heads = [], []
    for axis in range(3):
        tail = np.array([k for k in range(8) if not k >> axis & 1])
        tails.append(tail)
        heads.append(tail | 1 << axis)
    rows, weights = [], np.zeros((27, 64))
    for n, (i, j, k) in enumerate(product(range(4), repeat=3)):
        degree = (BITS[tails[0][i]] + BITS[tails[1][j]] + BITS[tails[2][k]]).astype(int)
        # B1_i B1_j = C(1,i) C(1,j) / C(2,i+j) B2_{i+j}: one half where the two indices differ.
        weights[degree[0] * 9 + degree[1] * 3 + degree[2], n] = np.prod(np.where(degree == 1, 0.5, 1.0))
        rows.append((i, j, k))
    return tails, heads, np.array(rows), weights


_EDGE_TAILS, _EDGE_HEADS, _TRIPLES, _TRIPLE_WEIGHTS = _triples()
_SPLIT: Array = np.array(
    [
        [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.25, 0.5, 0.25]],
        [[0.25, 0.5, 0.25], [0.0, 0.5, 0.5], [0.0, 0.0, 1.0]],
    ]
)
