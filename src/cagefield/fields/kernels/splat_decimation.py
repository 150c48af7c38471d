"""Numba kernel of `fields.splat_decimation`: costs of merging splats with their neighbors."""

from __future__ import annotations

import math

import numpy as np

from cagefield.compute.numba_cache import FAST, njit
from cagefield.compute.parallel_kernels import parallel_njit


@njit(**FAST)
def determinant(c):
    """Determinant of a symmetric matrix (xx, xy, xz, yy, yz, zz)."""
    return (
        c[0] * (c[3] * c[5] - c[4] * c[4])
        - c[1] * (c[1] * c[5] - c[4] * c[2])
        + c[2] * (c[1] * c[4] - c[3] * c[2])
    )


@njit(**FAST)
def area(c):
    """sqrt(trace(cof C)) of a covariance (xx, xy, xz, yy, yz, zz)."""
    minors = c[0] * c[3] - c[1] * c[1] + c[3] * c[5] - c[4] * c[4] + c[0] * c[5] - c[2] * c[2]
    return math.sqrt(max(minors, 0.0))


@njit(**FAST)
def overlap(dx, dy, dz, one, other, both):
    """<i, j> of two splats, their means apart by d; `both` [6] is overwritten by their covariances' sum."""
    for k in range(6):
        both[k] = one[k] + other[k]
    det = determinant(both)
    if not det > 0.0:
        return 0.0
    xx = both[3] * both[5] - both[4] * both[4]
    xy = both[2] * both[4] - both[1] * both[5]
    xz = both[1] * both[4] - both[2] * both[3]
    yy = both[0] * both[5] - both[2] * both[2]
    yz = both[1] * both[2] - both[0] * both[4]
    zz = both[0] * both[3] - both[1] * both[1]
    square = dx * dx * xx + dy * dy * yy + dz * dz * zz + 2.0 * (dx * dy * xy + dx * dz * xz + dy * dz * yz)
    ratio = determinant(one) * determinant(other) / det
    return math.sqrt(max(ratio, 0.0)) * math.exp(-0.5 * square / det)


@parallel_njit(lambda *args: len(args[-1]), **FAST)
def merge_costs(
    begin, end, means, covariances, blurred, channels, depths, colors, own, near, blur, most, costs
):
    """Write the cost [N,K] of merging splat n with its neighbor near[n, k]; inf with itself.

    means [N,3], covariances and blurred [N,6], channels [N,4] (a' and a' c), depths [N] A Li2(o), colors
    [N,3], own [N] <f, f>; blur: e^2; most: greatest Li2.
    """
    c, wide, both = np.empty(6), np.empty(6), np.empty(6)
    whole = np.empty(4)
    for n in range(begin, end):
        for k in range(near.shape[1]):
            m = near[n, k]
            if m == n:
                costs[n, k] = np.inf
                continue
            total = depths[n] + depths[m]
            t = depths[m] / total if total > 0.0 else 0.5
            dx, dy, dz = means[m, 0] - means[n, 0], means[m, 1] - means[n, 1], means[m, 2] - means[n, 2]
            s = t * (1.0 - t)
            for a in range(6):
                c[a] = (1.0 - t) * covariances[n, a] + t * covariances[m, a]
            c[0] += s * dx * dx
            c[1] += s * dx * dy
            c[2] += s * dx * dz
            c[3] += s * dy * dy
            c[4] += s * dy * dz
            c[5] += s * dz * dz
            for a in range(6):
                wide[a] = c[a]
            wide[0] += blur
            wide[3] += blur
            wide[5] += blur
            size = area(c)
            amplitude = min(total / max(size, 1e-300), most) * size / area(wide)
            whole[0] = amplitude
            for a in range(3):
                whole[1 + a] = amplitude * ((1.0 - t) * colors[n, a] + t * colors[m, a])
            square = between = to_n = to_m = 0.0
            for a in range(4):
                square += whole[a] * whole[a]
                between += channels[n, a] * channels[m, a]
                to_n += channels[n, a] * whole[a]
                to_m += channels[m, a] * whole[a]
            cost = own[n] + own[m] + square * overlap(0.0, 0.0, 0.0, wide, wide, both)
            cost += 2.0 * between * overlap(dx, dy, dz, blurred[n], blurred[m], both)
            cost -= 2.0 * to_n * overlap(t * dx, t * dy, t * dz, blurred[n], wide, both)
            u = 1.0 - t
            cost -= 2.0 * to_m * overlap(u * dx, u * dy, u * dz, blurred[m], wide, both)
            costs[n, k] = cost


@njit(**FAST)
def choose(order, first, second, stays, chosen):
    """Number of entries written to `chosen`: the first rows of `order` whose splats no earlier row has.

    Row n merges splats first[n] and second[n], or removes first[n] where second[n] is -1; `stays` [N]
    becomes False for both.
    """
    count = 0
    for row in order:
        if count == chosen.size:
            break
        i, j = first[row], second[row]
        if not stays[i] or i == j or (j >= 0 and not stays[j]):
            continue
        stays[i] = False
        if j >= 0:
            stays[j] = False
        chosen[count] = row
        count += 1
    return count
