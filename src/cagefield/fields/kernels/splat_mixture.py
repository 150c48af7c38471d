"""Sums over splats at points, for `cagefield.fields.splat_mixture` (Numba, single-threaded).

Notation as in `cagefield.fields.splat_mixture`: u = diag(1/s) R^T (p - m), q = |u|^2, z = o exp(-q/2). A row
of `packed` is a splat's diag(1/s) R^T (9 values), m (3), -ln o, and the q of its end. A level has cells of
one size; the cells of all
levels share a hash table with open addressing, `keys` and `starts`: the splats of the cell in a slot are
ids[starts[slot]:ends[slot]]. Two cells may share a 64-bit key; a pair does with a probability of 2^-64.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cagefield.compute.numba_cache import njit

FAST: dict[str, Any] = {"error_model": "numpy", "cache": True, "nogil": True}

PACKED_FLOATS = 14
"""Number of values of a packed splat."""

INVERSE_ROOT_TAU = 0.3989422804014327
"""1 / sqrt(2 pi)"""

SERIES_LIMIT_W = 1.6
"""w = -ln z that separates the series in w from the series in z; both are accurate to 1e-6 there."""

FREE_SLOT = -1
"""Key of a free slot."""


@njit(inline="always", **FAST)
def polylog_half(w):
    """Li_1/2(z) = sum_k z^k / sqrt(k) of w = -ln z > 0; relative error below 1e-6.

    For small w it is sqrt(pi / w) + sum_k zeta(1/2 - k) (-w)^k / k!.
    Source: Wood, "The computation of polylogarithms" (1992), equation 9.3.
    """
    if w < SERIES_LIMIT_W:
        t = -5.4499364e-07 + w * (8.1077370e-08 + w * 1.2169403e-08)
        t = 1.8504213897830974e-04 + w * (2.5763910393465e-05 + w * (-3.710358361e-06 + w * t))
        t = -0.012742600944916527 + w * (-0.0014194881296417216 + w * t)
        return np.sqrt(np.pi / w) - 1.4603545088095868 + w * (0.20788622497735457 + w * t)
    z = np.exp(-w)
    t = 0.40824829046386302 + z * (0.37796447300922723 + z * (0.35355339059327376 + z * 0.33333333333333333))
    t = 0.57735026918962576 + z * (0.5 + z * (0.44721359549995794 + z * t))
    return z * (1.0 + z * (0.70710678118654752 + z * t))


@njit(inline="always", **FAST)
def cell_key(level, x, y, z):
    """64-bit key of a cell, never FREE_SLOT: its coordinates mixed by the finalizer of SplitMix64."""
    h = np.uint64(level) * np.uint64(0x9E3779B97F4A7C15)
    for part in (x, y, z):
        h = (h ^ np.uint64(part)) + np.uint64(0x9E3779B97F4A7C15)
        h = (h ^ (h >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        h = (h ^ (h >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        h = h ^ (h >> np.uint64(31))
    return np.int64(h & np.uint64(0x7FFFFFFFFFFFFFFF))


@njit(**FAST)
def overlapped_cells(packed, half, levels, sizes, keys, ids):
    """Number of overlapped cells over all splats; fills `keys` and `ids` with cells and splats until full.

    half [N,3]: half extents of the splats' boxes. A cell counts unless it is beyond a splat's end along one
    of the splat's own axes.
    """
    n = 0
    for i in range(len(packed)):
        size = sizes[levels[i]]
        reach = np.sqrt(packed[i, 13])
        x0, x1 = np.floor((packed[i, 9] - half[i, 0]) / size), np.floor((packed[i, 9] + half[i, 0]) / size)
        y0, y1 = np.floor((packed[i, 10] - half[i, 1]) / size), np.floor((packed[i, 10] + half[i, 1]) / size)
        z0, z1 = np.floor((packed[i, 11] - half[i, 2]) / size), np.floor((packed[i, 11] + half[i, 2]) / size)
        for x in range(np.int64(x0), np.int64(x1) + 1):
            for y in range(np.int64(y0), np.int64(y1) + 1):
                for z in range(np.int64(z0), np.int64(z1) + 1):
                    dx = (x + 0.5) * size - packed[i, 9]
                    dy = (y + 0.5) * size - packed[i, 10]
                    dz = (z + 0.5) * size - packed[i, 11]
                    is_separate = False
                    for a in range(3):
                        p, q, r = packed[i, 3 * a], packed[i, 3 * a + 1], packed[i, 3 * a + 2]
                        margin = 0.5 * size * (abs(p) + abs(q) + abs(r)) * (1.0 + 1e-6)
                        is_separate = is_separate or abs(p * dx + q * dy + r * dz) - margin > reach
                    if is_separate:
                        continue
                    if n < len(ids):
                        keys[n] = cell_key(levels[i], x, y, z)
                        ids[n] = i
                    n += 1
    return n


@njit(**FAST)
def fill_table(cells, table):
    """Insert keys [M] into the open-addressing table [2^b] (FREE_SLOT before); returns the slots."""
    slots = np.empty(len(cells), np.int64)
    mask = len(table) - 1
    for n in range(len(cells)):
        slot = cells[n] & mask
        while table[slot] != FREE_SLOT:
            slot = (slot + 1) & mask
        table[slot] = cells[n]
        slots[n] = slot
    return slots


@njit(inline="always", **FAST)
def find_slot(table, key):
    """Slot of a key, or -1."""
    mask = len(table) - 1
    slot = key & mask
    while table[slot] != FREE_SLOT:
        if table[slot] == key:
            return slot
        slot = (slot + 1) & mask
    return -1


@njit(inline="always", **FAST)
def mahalanobis(packed, i, x, y, z):
    """Squared Mahalanobis distance q of splat i at a point."""
    dx, dy, dz = x - packed[i, 9], y - packed[i, 10], z - packed[i, 11]
    a = packed[i, 0] * dx + packed[i, 1] * dy + packed[i, 2] * dz
    b = packed[i, 3] * dx + packed[i, 4] * dy + packed[i, 5] * dz
    c = packed[i, 6] * dx + packed[i, 7] * dy + packed[i, 8] * dz
    return a * a + b * b + c * c


@njit(**FAST)
def densities(packed, layers, sizes, table, starts, ends, ids, points, sigma):
    """Write `grid_sigma` [P] at points [P,3].

    layers [N,4]: the thinnest axis over its scale, and 1 / (sqrt(2 pi) s_d).
    """
    for p in range(len(points)):
        x, y, z = np.float64(points[p, 0]), np.float64(points[p, 1]), np.float64(points[p, 2])
        total = 0.0
        for level in range(len(sizes)):
            s = 1.0 / sizes[level]
            key = cell_key(
                level, np.int64(np.floor(x * s)), np.int64(np.floor(y * s)), np.int64(np.floor(z * s))
            )
            slot = find_slot(table, key)
            if slot < 0:
                continue
            for e in range(starts[slot], ends[slot]):
                i = ids[e]
                q = mahalanobis(packed, i, x, y, z)
                if q < packed[i, 13]:
                    dx, dy, dz = x - packed[i, 9], y - packed[i, 10], z - packed[i, 11]
                    u = layers[i, 0] * dx + layers[i, 1] * dy + layers[i, 2] * dz
                    across = np.exp(-packed[i, 12] - 0.5 * max(q - u * u, 0.0))
                    total -= layers[i, 3] * np.log(1.0 - across) * np.exp(-0.5 * u * u)
        sigma[p] = total


@njit(**FAST)
def colors(packed, harmonics, sizes, table, starts, ends, ids, points, directions, basis, sigma, rgb):
    """Write sigma [P,K] and rgb [P,K,3] at points [P,3] along directions [P,K,3], basis [P,K,T]; T >= 1."""
    views, terms = basis.shape[1], basis.shape[2]
    for p in range(len(points)):
        x, y, z = np.float64(points[p, 0]), np.float64(points[p, 1]), np.float64(points[p, 2])
        for k in range(views):
            sigma[p, k] = 0.0
            rgb[p, k, 0] = rgb[p, k, 1] = rgb[p, k, 2] = 0.0
        for level in range(len(sizes)):
            s = 1.0 / sizes[level]
            key = cell_key(
                level, np.int64(np.floor(x * s)), np.int64(np.floor(y * s)), np.int64(np.floor(z * s))
            )
            slot = find_slot(table, key)
            if slot < 0:
                continue
            for e in range(starts[slot], ends[slot]):
                i = ids[e]
                q = mahalanobis(packed, i, x, y, z)
                if q >= packed[i, 13]:
                    continue
                share = INVERSE_ROOT_TAU * polylog_half(packed[i, 12] + 0.5 * q)
                for k in range(views):
                    dx, dy, dz = directions[p, k, 0], directions[p, k, 1], directions[p, k, 2]
                    a = packed[i, 0] * dx + packed[i, 1] * dy + packed[i, 2] * dz
                    b = packed[i, 3] * dx + packed[i, 4] * dy + packed[i, 5] * dz
                    c = packed[i, 6] * dx + packed[i, 7] * dy + packed[i, 8] * dz
                    weight = share * np.sqrt(a * a + b * b + c * c)
                    sigma[p, k] += weight
                    red = green = blue = 0.5
                    for t in range(terms):
                        red += basis[p, k, t] * harmonics[i, t, 0]
                        green += basis[p, k, t] * harmonics[i, t, 1]
                        blue += basis[p, k, t] * harmonics[i, t, 2]
                    rgb[p, k, 0] += weight * max(0.0, red)
                    rgb[p, k, 1] += weight * max(0.0, green)
                    rgb[p, k, 2] += weight * max(0.0, blue)
        for k in range(views):
            if sigma[p, k] > 0.0:
                for channel in range(3):
                    rgb[p, k, channel] /= sigma[p, k]
