"""Tiles that each projected splat touches, and the splats of each tile in their order (Numba)."""

from __future__ import annotations

import numpy as np

from cagefield.compute.numba_cache import FAST, njit
from cagefield.compute.parallel_kernels import parallel_njit
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


@parallel_njit(lambda bounds, *_: len(bounds) - 1, **FAST)
def find_pairs(begin, end, bounds, order, tiles, packed, discs, across, places, found, counts, numbers):
    """Pairs (tile, splat) of parts of the splats, near to far: the first half of a counting sort.

    Part p holds the splats order[bounds[p]:bounds[p+1]]. Its pairs' tiles stand one after the other in
    `found` from places[p] on; counts[p, t] is its number of pairs of tile t, numbers[q] that of the splat
    order[q]. `discs`: the packed elements are discs.
    """
    for part in range(begin, end):
        n = places[part]
        for q in range(bounds[part], bounds[part + 1]):
            i = order[q]
            first = n
            x0, x1, y0, y1 = tiles[i, 0], tiles[i, 1], tiles[i, 2], tiles[i, 3]
            single = (x1 - x0) * (y1 - y0) == 1
            for y in range(y0, y1):
                for x in range(x0, x1):
                    touched = single
                    if not single:
                        touched = disc_overlaps(packed[i], x, y) if discs else overlaps(packed[i], x, y)
                    if touched:
                        found[n] = y * across + x
                        counts[part, y * across + x] += 1
                        n += 1
            numbers[q] = n - first


@parallel_njit(lambda bounds, *_: len(bounds) - 1, **FAST)
def sort_pairs(begin, end, bounds, order, places, found, firsts, fill, ids, slots):
    """Places of the pairs of `find_pairs` by tile: the second half of the counting sort.

    fill[p, t] is the first place in `ids` of the pairs of part p and tile t. slots[firsts[q]:firsts[q+1]]
    become the places in `ids` of the splat order[q].
    """
    for part in range(begin, end):
        n = places[part]
        for q in range(bounds[part], bounds[part + 1]):
            for e in range(firsts[q], firsts[q + 1]):
                place = fill[part, found[n]]
                fill[part, found[n]] += 1
                ids[place] = order[q]
                slots[e] = place
                n += 1
