"""Numba kernels: bounds of a lattice shell's flow over boxes and over patches of the cage's faces.

Notation: see `correction_proof`; all in the outer cage's coordinates z. Kernels are compiled without
`fastmath`, with which comparisons of infinite bounds may be taken for true.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cagefield.warps.kernels.lattice_flow import _inverse, sample_velocity, solve_midpoint

MOST_SPREAD = 1.0
"""Bound of an error of a slope from which nothing is proven."""

ROOM = 1.25
"""Growth of a midpoint's box over its first estimate."""


@njit(error_model="numpy")
def largest_singular(A):
    """(largest, least) singular value of A [3,3], squared: eigenvalues of A^T A."""
    a = A[0, 0] * A[0, 0] + A[1, 0] * A[1, 0] + A[2, 0] * A[2, 0]
    b = A[0, 1] * A[0, 1] + A[1, 1] * A[1, 1] + A[2, 1] * A[2, 1]
    c = A[0, 2] * A[0, 2] + A[1, 2] * A[1, 2] + A[2, 2] * A[2, 2]
    d = A[0, 0] * A[0, 1] + A[1, 0] * A[1, 1] + A[2, 0] * A[2, 1]
    e = A[0, 1] * A[0, 2] + A[1, 1] * A[1, 2] + A[2, 1] * A[2, 2]
    f = A[0, 0] * A[0, 2] + A[1, 0] * A[1, 2] + A[2, 0] * A[2, 2]
    q = (a + b + c) / 3.0
    p1 = d * d + e * e + f * f
    p = np.sqrt(max(((a - q) ** 2 + (b - q) ** 2 + (c - q) ** 2 + 2.0 * p1) / 6.0, 1e-300))
    x, y, z = (a - q) / p, (b - q) / p, (c - q) / p
    d, e, f = d / p, e / p, f / p
    half = 0.5 * (x * (y * z - e * e) - d * (d * z - e * f) + f * (d * e - y * f))
    angle = np.arccos(min(max(half, -1.0), 1.0)) / 3.0
    return q + 2.0 * p * np.cos(angle), q + 2.0 * p * np.cos(angle + 2.0943951023931953)


@njit(error_model="numpy")
def determinant(A):
    return (
        A[0, 0] * (A[1, 1] * A[2, 2] - A[1, 2] * A[2, 1])
        - A[0, 1] * (A[1, 0] * A[2, 2] - A[1, 2] * A[2, 0])
        + A[0, 2] * (A[1, 0] * A[2, 1] - A[1, 1] * A[2, 0])
    )


@njit(error_model="numpy")
def slope_range(grid, m, R, middle, spread):
    """Writes the middle and the half-width [3,3] of dv/dz over the box m +- R [3], cut to the grid's.

    A derivative along an axis is constant along it in each layer of cells, and piecewise bilinear in the two
    other coordinates: its extremes over a rectangle are at the rectangle's ends and at nodes in between.
    """
    cells = grid.shape[0] - 1
    half = 0.5 * cells
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        lo_a = min(max((m[a] - R[a] + 1.0) * half, 0.0), float(cells))
        hi_a = min(max((m[a] + R[a] + 1.0) * half, 0.0), float(cells))
        lo_b = min(max((m[b] - R[b] + 1.0) * half, 0.0), float(cells))
        hi_b = min(max((m[b] + R[b] + 1.0) * half, 0.0), float(cells))
        lo_c = min(max((m[c] - R[c] + 1.0) * half, 0.0), float(cells))
        hi_c = min(max((m[c] + R[c] + 1.0) * half, 0.0), float(cells))
        first, last = min(int(lo_a), cells - 1), min(int(hi_a), cells - 1)
        l0, l1, l2 = 1e300, 1e300, 1e300
        h0, h1, h2 = -1e300, -1e300, -1e300
        for i in range(first, last + 1):
            tb = lo_b
            while True:
                j = min(int(tb), cells - 1)
                fb = tb - j
                tc = lo_c
                while True:
                    k = min(int(tc), cells - 1)
                    fc = tc - k
                    g0, g1, g2 = 0.0, 0.0, 0.0
                    for q in range(4):
                        jb, kc = j + (q & 1), k + (q >> 1)
                        w = (fb if q & 1 else 1.0 - fb) * (fc if q >> 1 else 1.0 - fc)
                        if a == 0:
                            x, y, z, dx, dy, dz = i, jb, kc, 1, 0, 0
                        elif a == 1:
                            x, y, z, dx, dy, dz = kc, i, jb, 0, 1, 0
                        else:
                            x, y, z, dx, dy, dz = jb, kc, i, 0, 0, 1
                        g0 += w * (np.float64(grid[z + dz, y + dy, x + dx, 0]) - np.float64(grid[z, y, x, 0]))
                        g1 += w * (np.float64(grid[z + dz, y + dy, x + dx, 1]) - np.float64(grid[z, y, x, 1]))
                        g2 += w * (np.float64(grid[z + dz, y + dy, x + dx, 2]) - np.float64(grid[z, y, x, 2]))
                    l0, l1, l2 = min(l0, g0), min(l1, g1), min(l2, g2)
                    h0, h1, h2 = max(h0, g0), max(h1, g1), max(h2, g2)
                    if tc >= hi_c:
                        break
                    tc = min(np.floor(tc) + 1.0, hi_c)
                if tb >= hi_b:
                    break
                tb = min(np.floor(tb) + 1.0, hi_b)
        middle[0, a], spread[0, a] = half * 0.5 * (h0 + l0), half * 0.5 * (h0 - l0)
        middle[1, a], spread[1, a] = half * 0.5 * (h1 + l1), half * 0.5 * (h1 - l1)
        middle[2, a], spread[2, a] = half * 0.5 * (h2 + l2), half * 0.5 * (h2 - l2)


@njit(error_model="numpy")
def norm(A, rows, columns):
    total = 0.0
    for i in range(rows):
        for j in range(columns):
            total += A[i, j] * A[i, j]
    return np.sqrt(total)


@njit(error_model="numpy")
def flow_bound(grids, steps, z, K, spread, a0, a1, work):
    """Takes z [3] and K [3,2] = dz/dp back through the flow, in place: (bound of |dz/dp - K|, found).

    p is in the box [-a0, a0] x [-a1, a1], z that of its center; `spread` bounds |dz/dp - K| at the start,
    over the box. Not found where a midpoint's box cannot be closed.
    """
    m, R, Gc, rG, B, A, M = work[0], work[1], work[2:5], work[5:8], work[8:11], work[11:14], work[14:17]
    newton = work[17:28]
    long = np.sqrt(a0 * a0 + a1 * a1)
    for k in range(len(grids)):
        at = len(grids) - 1 - k
        grid, half = grids[at], -0.5 * steps[at]
        solve_midpoint(grid, half, 1e-12, z, m, newton)
        sample_velocity(grid, m, newton[0], newton[2:5])
        for i in range(3):
            for j in range(3):
                A[i, j] = -half * newton[2 + i, j]
            A[i, i] += 1.0
        _inverse(A, B)
        for i in range(3):
            for j in range(2):
                M[i, j] = B[i, 0] * K[0, j] + B[i, 1] * K[1, j] + B[i, 2] * K[2, j]
        guess = spread + 0.02 * norm(K, 3, 2)
        closed = False
        change, bent = 0.0, 0.0
        for _ in range(4):
            for i in range(3):
                R[i] = ROOM * (abs(M[i, 0]) * a0 + abs(M[i, 1]) * a1 + guess * long) + 1e-12
            slope_range(grid, m, R, Gc, rG)
            for i in range(3):
                for j in range(3):
                    A[i, j] = -half * Gc[i, j]
                A[i, i] += 1.0
            _inverse(A, B)
            most = np.sqrt(largest_singular(B)[0])
            # |dG| B with B the inverse of the middle: |B' - B| <= |B|^2 |half dG| / (1 - |B| |half dG|).
            share = abs(half) * norm(rG, 3, 3) * most
            if share >= 0.9:
                return 0.0, False
            if spread > MOST_SPREAD:
                return spread, False
            change = most * share / (1.0 - share)
            for i in range(3):
                for j in range(2):
                    M[i, j] = B[i, 0] * K[0, j] + B[i, 1] * K[1, j] + B[i, 2] * K[2, j]
            # B' K' - B K = B' half dG B K + B' (K' - K), with the first bounded entry by entry.
            bent = 0.0
            for i in range(3):
                for j in range(2):
                    x = rG[i, 0] * abs(M[0, j]) + rG[i, 1] * abs(M[1, j]) + rG[i, 2] * abs(M[2, j])
                    bent += x * x
            bent = (most + change) * abs(half) * np.sqrt(bent)
            need = (most + change) * spread + bent
            closed = True
            for i in range(3):
                closed = closed and abs(M[i, 0]) * a0 + abs(M[i, 1]) * a1 + need * long < R[i]
            if closed:
                break
            guess = 1.2 * need
        if not closed:
            return 0.0, False
        for i in range(3):
            for j in range(3):
                A[i, j] = 2.0 * B[i, j]
            A[i, i] -= 1.0
        most = np.sqrt(largest_singular(A)[0])
        spread = (most + 2.0 * change) * spread + 2.0 * bent
        for i in range(3):
            z[i] = 2.0 * m[i] - z[i]
        for j in range(2):
            x0, x1, x2 = K[0, j], K[1, j], K[2, j]
            for i in range(3):
                K[i, j] = A[i, 0] * x0 + A[i, 1] * x1 + A[i, 2] * x2
    return spread, True
