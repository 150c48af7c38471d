"""Regions of a continuous edit whose cages are parallelepipeds (Numba): V moved, the outside at rest.

The oracle is `warps.continuous.ContinuousWarp`, whose order and tolerances are the same.
"""

from __future__ import annotations

from cagefield.compute.numba_cache import njit
from cagefield.compute.parallel_kernels import parallel_njit

OUTSIDE, SHELL, INNER = range(3)
"""Regions: beyond the outer cage, between the cages, and in the inner cage."""


@njit(error_model="numpy")
def holds(frame, x, y, z):
    """True for a point (x, y, z) in the parallelepiped |W p + c| <= 1 of a frame [3,4]: W, c."""
    for a in range(3):
        at = frame[a, 0] * x + frame[a, 1] * y + frame[a, 2] * z + frame[a, 3]
        if not -1.0 <= at <= 1.0:
            return False
    return True


@parallel_njit(lambda points, *_: len(points), error_model="numpy", cache=True)
def map_regions(begin, end, points, outer, inner, map_of_inner, images, jacobian, region):
    """Write images [N,3] and Jacobians [N,3,3] of points [N,3] outside of the shell, and all regions [N].

    outer, inner: frames [3,4] of the cages, see `holds`; map_of_inner: [3,4], A and b of the inner map.
    """
    for n in range(begin, end):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        here = OUTSIDE
        if holds(outer, x, y, z):
            here = INNER if holds(inner, x, y, z) else SHELL
        region[n] = here
        if here == OUTSIDE:
            for a in range(3):
                images[n, a] = points[n, a]
                for b in range(3):
                    jacobian[n, a, b] = 1.0 if a == b else 0.0
        elif here == INNER:
            for a in range(3):
                A = map_of_inner[a]
                images[n, a] = A[0] * x + A[1] * y + A[2] * z + A[3]
                for b in range(3):
                    jacobian[n, a, b] = A[b]


@parallel_njit(lambda rows, *_: len(rows), error_model="numpy", cache=True)
def put_rows(begin, end, rows, ends, slopes, images, jacobian):
    """Write the images [M,3] and Jacobians [M,3,3] of some rows into those of all points."""
    for m in range(begin, end):
        n = rows[m]
        for a in range(3):
            images[n, a] = ends[m, a]
            for b in range(3):
                jacobian[n, a, b] = slopes[m, a, b]
