"""Tiles that each projected splat touches, and the splats of each tile in their order (Numba)."""

from __future__ import annotations

import numpy as np

from cagefield.compute.numba_cache import FAST, njit
from cagefield.rendering.splats.kernels.projection import ALPHA_MIN, TILE_PX, clamped

FILTER = 0.25
"""F, in pixels^2: a disc is never thinner on the picture than a dot of the variance 2 F (`discs`)."""


@njit(**FAST)
def overlaps(p, across, down):
    """Whether alpha exceeds ALPHA_MIN at some point of a tile: the least of the quadratic form over it."""
    x0 = np.float64(across * TILE_PX) - p[0]
    y0 = np.float64(down * TILE_PX) - p[1]
    x1 = x0 + (TILE_PX - 1)
    y1 = y0 + (TILE_PX - 1)
    if x0 <= 0.0 and x1 >= 0.0 and y0 <= 0.0 and y1 >= 0.0:
        return True
    A, k, D = p[2], p[3], p[4]
    least = 1e30
    for side in range(2):
        y = y0 if side == 0 else y1
        l = clamped(-k * y, x0, x1) + k * y
        least = min(least, A * l * l + D * y * y)
        x = x0 if side == 0 else x1
        y = clamped(-A * k * x / (A * k * k + D), y0, y1)
        l = x + k * y
        least = min(least, A * l * l + D * y * y)
    return least < 2.0 * np.log(p[5] / ALPHA_MIN)


@njit(**FAST)
def disc_overlaps(p, across, down):
    """Whether alpha may exceed ALPHA_MIN somewhere in a tile: never False where it does.

    The least of the quadratic form over the tile is held against the reach times the largest denominator
    there; the dot by its radius.
    """
    reach = 2.0 * np.log(p[5] / ALPHA_MIN)
    x0 = np.float64(across * TILE_PX) - p[0]
    y0 = np.float64(down * TILE_PX) - p[1]
    x1 = x0 + (TILE_PX - 1)
    y1 = y0 + (TILE_PX - 1)
    nx, ny = clamped(0.0, x0, x1), clamped(0.0, y0, y1)
    if nx * nx + ny * ny <= 2.0 * FILTER * reach:
        return True
    A, k, D = p[2], p[3], p[4]
    least = 1e30
    for side in range(2):
        y = y0 if side == 0 else y1
        l = clamped(-k * y, x0, x1) + k * y
        least = min(least, A * l * l + D * y * y)
        x = x0 if side == 0 else x1
        y = clamped(-A * k * x / (A * k * k + D), y0, y1)
        l = x + k * y
        least = min(least, A * l * l + D * y * y)
    most = 0.0
    for corner in range(4):
        most = max(
            most, abs(1.0 + p[11] * (x0 if corner % 2 == 0 else x1) + p[12] * (y0 if corner < 2 else y1))
        )
    return least * 0.9999 < reach * most * most


@njit(**FAST)
def bin_pairs(order, tiles, packed, discs, across, starts, ids, firsts, slots):
    """Pairs (tile, splat), near to far within each tile, by a counting sort; returns their number.

    `discs`: the packed elements are discs.
    `ids[starts[t]:starts[t+1]]` are the splats of tile t; `slots[firsts[q]:firsts[q+1]]` are the places in
    `ids` of the splat order[q].
    """
    starts[:] = 0
    n = 0
    for q in range(order.size):
        i = order[q]
        firsts[q] = n
        x0, x1, y0, y1 = tiles[i, 0], tiles[i, 1], tiles[i, 2], tiles[i, 3]
        single = (x1 - x0) * (y1 - y0) == 1
        for y in range(y0, y1):
            for x in range(x0, x1):
                touched = single
                if not single:
                    touched = disc_overlaps(packed[i], x, y) if discs else overlaps(packed[i], x, y)
                if touched:
                    slots[n] = y * across + x
                    starts[y * across + x + 1] += 1
                    n += 1
    firsts[order.size] = n
    for t in range(starts.size - 1):
        starts[t + 1] += starts[t]
    fill = starts.copy()
    for q in range(order.size):
        for e in range(firsts[q], firsts[q + 1]):
            t = slots[e]
            ids[fill[t]] = order[q]
            slots[e] = fill[t]
            fill[t] += 1
    return n
