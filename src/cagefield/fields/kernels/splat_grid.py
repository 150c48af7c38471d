"""Sums over splats at the vertices of a regular grid, for `cagefield.fields.splat_grid` (Numba,
single-threaded).

Notation and rows of `packed` as in `cagefield.fields.kernels.splat_mixture`. A slab [X,Y,Z] of a grid
begins at vertex `first` along x; vertex (0, 0, 0) of the grid is at `low` [3], and vertices are `edge` apart.
Along z a splat's q is a quadratic, whose roots bound the vertices within the splat's end.
"""

from __future__ import annotations

import numpy as np

from cagefield.compute.numba_cache import njit
from cagefield.fields.kernels.splat_mixture import FAST, INVERSE_ROOT_TAU, polylog_half


@njit(inline="always", **FAST)
def axis_range(center, half, low, edge, first, count):
    """(first, end) of the vertices within `half` of a center along an axis, among `count` from `first`."""
    start = np.int64(np.ceil(min(max((center - half - low) / edge, -1.0), 1e9)))
    end = np.int64(np.floor(min(max((center + half - low) / edge, -1.0), 1e9))) + 1
    return max(start, first), min(end, first + count)


@njit(inline="always", **FAST)
def z_range(a, b, c, p, q, r, limit, center, low, edge, count):
    """(first, end) of the vertices of a column whose q = |(a, b, c) + (p, q, r) dz|^2 is below a limit."""
    square, mixed, rest = p * p + q * q + r * r, a * p + b * q + c * r, a * a + b * b + c * c - limit
    root = mixed * mixed - square * rest
    if root <= 0.0:
        return 0, 0
    root = np.sqrt(root)
    return axis_range(center - mixed / square, root / square, low, edge, 0, count)


@njit(inline="always", **FAST)
def column(packed, i, dx, dy):
    """The part of u of splat i that a column of vertices shares, at an offset (dx, dy) from the mean."""
    return (
        packed[i, 0] * dx + packed[i, 1] * dy,
        packed[i, 3] * dx + packed[i, 4] * dy,
        packed[i, 6] * dx + packed[i, 7] * dy,
    )


@njit(**FAST)
def mark_boxes(packed, half, low, edge, first, covered):
    """Sets the vertices of a slab `covered` [X,Y,Z] in the boxes of half extents [N,3] around splats."""
    for i in range(len(packed)):
        x0, x1 = axis_range(packed[i, 9], half[i, 0], low[0], edge, first, covered.shape[0])
        y0, y1 = axis_range(packed[i, 10], half[i, 1], low[1], edge, 0, covered.shape[1])
        z0, z1 = axis_range(packed[i, 11], half[i, 2], low[2], edge, 0, covered.shape[2])
        for x in range(x0, x1):
            for y in range(y0, y1):
                for z in range(z0, z1):
                    covered[x - first, y, z] = True


@njit(**FAST)
def add_densities(packed, layers, half, low, edge, first, sigma):
    """Add `grid_sigma` of splats to a slab `sigma` [X,Y,Z]; layers [N,4] as in `densities`."""
    for i in range(len(packed)):
        x0, x1 = axis_range(packed[i, 9], half[i, 0], low[0], edge, first, sigma.shape[0])
        y0, y1 = axis_range(packed[i, 10], half[i, 1], low[1], edge, 0, sigma.shape[1])
        p, q, r = packed[i, 2], packed[i, 5], packed[i, 8]
        for x in range(x0, x1):
            dx = low[0] + edge * x - packed[i, 9]
            for y in range(y0, y1):
                dy = low[1] + edge * y - packed[i, 10]
                a0, b0, c0 = column(packed, i, dx, dy)
                z0, z1 = z_range(
                    a0, b0, c0, p, q, r, packed[i, 13], packed[i, 11], low[2], edge, sigma.shape[2]
                )
                u0 = layers[i, 0] * dx + layers[i, 1] * dy
                for z in range(z0, z1):
                    dz = low[2] + edge * z - packed[i, 11]
                    a, b, c = a0 + p * dz, b0 + q * dz, c0 + r * dz
                    u = u0 + layers[i, 2] * dz
                    across = np.exp(-packed[i, 12] - 0.5 * max(a * a + b * b + c * c - u * u, 0.0))
                    sigma[x - first, y, z] -= layers[i, 3] * np.log(1.0 - across) * np.exp(-0.5 * u * u)


@njit(**FAST)
def add_colors(packed, colors, half, low, edge, first, row, weight, total):
    """Add density-weighted colors [N,3] of splats along +z to the vertices of a slab that have a row.

    row [X,Y,Z]: the row of a vertex in `weight` [M] and `total` [M,3], negative for none.
    """
    for i in range(len(packed)):
        x0, x1 = axis_range(packed[i, 9], half[i, 0], low[0], edge, first, row.shape[0])
        y0, y1 = axis_range(packed[i, 10], half[i, 1], low[1], edge, 0, row.shape[1])
        p, q, r = packed[i, 2], packed[i, 5], packed[i, 8]
        scale = INVERSE_ROOT_TAU * np.sqrt(p * p + q * q + r * r)
        for x in range(x0, x1):
            dx = low[0] + edge * x - packed[i, 9]
            for y in range(y0, y1):
                dy = low[1] + edge * y - packed[i, 10]
                a0, b0, c0 = column(packed, i, dx, dy)
                z0, z1 = z_range(
                    a0, b0, c0, p, q, r, packed[i, 13], packed[i, 11], low[2], edge, row.shape[2]
                )
                for z in range(z0, z1):
                    n = row[x - first, y, z]
                    if n < 0:
                        continue
                    dz = low[2] + edge * z - packed[i, 11]
                    a, b, c = a0 + p * dz, b0 + q * dz, c0 + r * dz
                    share = scale * polylog_half(packed[i, 12] + 0.5 * (a * a + b * b + c * c))
                    weight[n] += share
                    total[n, 0] += share * colors[i, 0]
                    total[n, 1] += share * colors[i, 1]
                    total[n, 2] += share * colors[i, 2]
