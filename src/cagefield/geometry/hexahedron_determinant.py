"""Positivity of a trilinear hexahedron's Jacobian determinant, proven by Bernstein coefficients.

Notation: see `geometry.hexahedron`.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from cagefield.geometry.hexahedron import BITS, cross
from cagefield.typing import Array, Mask


def determinant_coefficients(corners: Array) -> Array:
    """Bernstein coefficients [...,3,3,3] over u in [0,1]^3 of det dx/du, axes (u_x, u_y, u_z).

    The determinant has degree 2 in each variable. Its minimum is at least the least coefficient, and the
    eight coefficients at the corners of the block are the determinants at the corners of the hexahedron.
    """
    along = [corners[..., _EDGE_HEADS[a], :] - corners[..., _EDGE_TAILS[a], :] for a in range(3)]
    a, b, c = (np.moveaxis(edges, -1, 0) for edges in along)
    normals = cross(b[..., :, None], c[..., None, :])  # [3,...,4,4]
    triple = np.einsum("d...i,d...jk->...ijk", a, normals).reshape(*a.shape[1:-1], 64)
    return np.asarray((triple @ _TRIPLE_WEIGHTS.T).reshape(*triple.shape[:-1], 3, 3, 3))


def are_positive(bernstein: Array) -> Mask:
    """Mask [B] of the triquadratic polynomials with coefficients [B,3,3,3] that `is_positive` finds so."""
    mask = np.asarray((bernstein > 0.0).all(axis=(1, 2, 3)))
    doubtful = ~mask & (bernstein[:, ::2, ::2, ::2] > 0.0).all(axis=(1, 2, 3))
    for row in np.flatnonzero(doubtful):
        mask[row] = is_positive(bernstein[row])
    return mask


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


def _triples() -> tuple[list[NDArray[np.intp]], list[NDArray[np.intp]], Array]:
    """Edge tails and heads per axis, and the Bernstein weights [27,64] of products of one edge per axis."""
    tails, heads = [], []
    for axis in range(3):
        tail = np.array([k for k in range(8) if not k >> axis & 1])
        tails.append(tail)
        heads.append(tail | 1 << axis)
    weights = np.zeros((27, 64))
    for n, (i, j, k) in enumerate(product(range(4), repeat=3)):
        degree = (BITS[tails[0][i]] + BITS[tails[1][j]] + BITS[tails[2][k]]).astype(int)
        # B1_i B1_j = C(1,i) C(1,j) / C(2,i+j) B2_{i+j}: one half where the two indices differ.
        weights[degree[0] * 9 + degree[1] * 3 + degree[2], n] = np.prod(np.where(degree == 1, 0.5, 1.0))
    return tails, heads, weights


_EDGE_TAILS, _EDGE_HEADS, _TRIPLE_WEIGHTS = _triples()
_SPLIT: Array = np.array(
    [
        [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.25, 0.5, 0.25]],
        [[0.25, 0.5, 0.25], [0.0, 0.5, 0.5], [0.0, 0.0, 1.0]],
    ]
)
