"""Pixel sizes from which a splat and its children are one to the eye (Numba).

Notation: along a world axis the picture of a splat is a Gaussian of the covariance S [2,2], its amplitude the
opacity o. The pixel's filter, of the variance b = BLUR p^2 at pixels of the size p, makes S + b of it and
keeps its sum. For the amplitudes o_i of the children and -o_j of their parents,

    e^2(p) = sum over i, j of 2 pi o_i o_j sqrt(|S_i| |S_j| / |S|) exp(-d^T S^-1 d / 2),  S = S_i + S_j + 2 b,

d the distance of their means, is the integral of the squared difference of the two pictures. e(p) / p falls
with p. A group's size is the p at which it is the group's limit, along the worst of the three axes.
"""

from __future__ import annotations

import numpy as np

from cagefield.compute.numba_cache import FAST, njit
from cagefield.compute.parallel_kernels import parallel_njit
from cagefield.rendering.splats.kernels.projection import BLUR

HALVINGS = 3
"""Halvings, in its logarithm, of the interval in which a size is known to be."""

_U, _V = np.array([1, 0, 0]), np.array([2, 2, 1])
_UU, _UV, _VV = np.array([3, 0, 0]), np.array([4, 2, 1]), np.array([5, 5, 3])


@njit(**FAST)
def squared_difference(axis, blur, means, covariances, weights, rows):
    """e^2 of some rows along an axis, blurred by a variance; weights [M] are o, -o of parents."""
    u, v, uu, uv, vv = _U[axis], _V[axis], _UU[axis], _UV[axis], _VV[axis]
    total = 0.0
    for a in range(len(rows)):
        i = rows[a]
        C = covariances[i]
        own = max(0.0, np.float64(C[uu]) * C[vv] - np.float64(C[uv]) * C[uv])
        for b in range(a + 1):
            j = rows[b]
            D = covariances[j]
            other = max(0.0, np.float64(D[uu]) * D[vv] - np.float64(D[uv]) * D[uv])
            s = C[uu] + D[uu] + 2.0 * blur
            t = C[uv] + D[uv]
            w = C[vv] + D[vv] + 2.0 * blur
            det = s * w - t * t
            if det > 0.0:
                x, y = means[i, u] - means[j, u], means[i, v] - means[j, v]
                q = (w * x * x - 2.0 * t * x * y + s * y * y) / det
                if q < 60.0:
                    value = weights[i] * weights[j] * np.sqrt(own * other / det) * np.exp(-0.5 * q)
                    total += value if a == b else 2.0 * value
    return max(0.0, 2.0 * np.pi * total)


@parallel_njit(lambda starts, *_: len(starts) - 1, **FAST)
def sizes_of(begin, end, starts, rows, means, covariances, weights, limits, most, sizes):
    """Write the sizes [G] of the groups rows[starts[g]:starts[g+1]]; infinite for groups of more than `most`.

    means [M,3], covariances [M,6] as `DeformedSplats`, weights [M]; limits [G] are the largest e(p) / p.
    """
    for g in range(begin, end):
        chosen = rows[starts[g] : starts[g + 1]]
        if len(chosen) > most:
            sizes[g] = np.inf
            continue
        limit, size = limits[g], 0.0
        for axis in range(3):
            if size > 0.0:
                here = squared_difference(axis, BLUR * size * size, means, covariances, weights, chosen)
                if here <= (limit * size) ** 2:
                    continue
            high = np.sqrt(squared_difference(axis, 0.0, means, covariances, weights, chosen)) / limit
            square = squared_difference(axis, BLUR * high * high, means, covariances, weights, chosen)
            low = max(size, np.sqrt(square) / limit, 1e-6 * high)
            for _ in range(HALVINGS):
                middle = np.sqrt(low * high)
                square = squared_difference(axis, BLUR * middle * middle, means, covariances, weights, chosen)
                if square <= (limit * middle) ** 2:
                    high = middle
                else:
                    low = middle
            size = max(size, high)
        sizes[g] = size
