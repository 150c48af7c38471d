"""Numba kernels of a mesh cage's inside: the harmonic blend of its vertices' motion at the nodes of a grid.

Laplace's equation at nodes inside of the mesh; where a line of the grid crosses the surface between a node
and the next one, the surface's motion stands there (Shortley and Weller, exact for quadratic functions).
Solved by successive over-relaxation from a start close to it.

Source: Joshi et al., "Harmonic Coordinates for Character Articulation" (2007), section 3; Shortley and
Weller, "The numerical solution of Laplace's equation" (1938).
"""

from __future__ import annotations

import numpy as np

from cagefield.compute.numba_cache import FAST, njit

LEAST_ARM = 1e-3
"""A surface is taken to be at least this share of the spacing away from a node."""

NO_CROSSING = 2.0


@njit(**FAST)
def cross_lines(n, s, triangles, motion, ends, values):
    """Writes where a mesh crosses the lines of a grid of n^3 nodes, and the mesh's motion there.

    s [V,3]: vertices in cells of the grid; motion [V,3]; ends [2,3,n^3]: shares of the spacing at which the
    segment from a node along each axis is crossed first and last, `NO_CROSSING` and its negative where it is
    not; values [2,3,n^3,3].
    """
    for t in range(len(triangles)):
        i, j, k = triangles[t]
        for axis in range(3):
            b, c = (axis + 1) % 3, (axis + 2) % 3
            e_b, e_c, e_a = s[j, b] - s[i, b], s[j, c] - s[i, c], s[j, axis] - s[i, axis]
            f_b, f_c, f_a = s[k, b] - s[i, b], s[k, c] - s[i, c], s[k, axis] - s[i, axis]
            det = e_b * f_c - e_c * f_b
            if abs(det) < 1e-14:
                continue
            first_b = max(int(np.ceil(min(s[i, b], min(s[j, b], s[k, b])))), 0)
            last_b = min(int(np.floor(max(s[i, b], max(s[j, b], s[k, b])))), n - 1)
            first_c = max(int(np.ceil(min(s[i, c], min(s[j, c], s[k, c])))), 0)
            last_c = min(int(np.floor(max(s[i, c], max(s[j, c], s[k, c])))), n - 1)
            step = 1 if axis == 0 else n if axis == 1 else n * n
            step_b = 1 if b == 0 else n if b == 1 else n * n
            step_c = 1 if c == 0 else n if c == 1 else n * n
            for p in range(first_b, last_b + 1):
                d_b = p - s[i, b]
                for q in range(first_c, last_c + 1):
                    d_c = q - s[i, c]
                    v, w = (d_b * f_c - d_c * f_b) / det, (e_b * d_c - e_c * d_b) / det
                    if min(v, w) < -1e-12 or v + w > 1.0 + 1e-12:
                        continue
                    at = s[i, axis] + v * e_a + w * f_a
                    cell = int(np.floor(at))
                    if cell < 0 or cell > n - 2:
                        continue
                    node, share = p * step_b + q * step_c + cell * step, at - cell
                    for end in range(2):
                        if (share < ends[0, axis, node]) if end == 0 else (share > ends[1, axis, node]):
                            ends[end, axis, node] = share
                            for o in range(3):
                                values[end, axis, node, o] = (
                                    motion[i, o] * (1.0 - v - w) + motion[j, o] * v + motion[k, o] * w
                                )


@njit(**FAST)
def relax(n, inside, weights, ends, values, blend, sweeps, omega):
    """Makes blend [n^3,3] harmonic at the nodes `inside` [M], in place, by `sweeps` of over-relaxation.

    weights [3]: squared inverse spacings; ends, values: see `cross_lines`. Neighbors that are not inside, and
    have no surface before them, stand for it.
    """
    count = len(inside)
    at = np.empty((count, 6), np.int64)  # neighbors, -1 where the surface is nearer
    share = np.empty((count, 6))
    fixed = np.zeros((count, 3))
    for m in range(count):
        node, total = inside[m], 0.0
        for axis in range(3):
            step = 1 if axis == 0 else n if axis == 1 else n * n
            low, high = node - step, node
            before, after = 1.0, 1.0
            at[m, 2 * axis], at[m, 2 * axis + 1] = low, node + step
            if ends[1, axis, low] >= 0.0:
                before = max(1.0 - ends[1, axis, low], LEAST_ARM)
                at[m, 2 * axis] = -1
            if ends[0, axis, high] <= 1.0:
                after = max(ends[0, axis, high], LEAST_ARM)
                at[m, 2 * axis + 1] = -1
            share[m, 2 * axis] = weights[axis] / (before * (before + after))
            share[m, 2 * axis + 1] = weights[axis] / (after * (before + after))
            total += share[m, 2 * axis] + share[m, 2 * axis + 1]
        for k in range(6):
            share[m, k] /= total
        for axis in range(3):
            step = 1 if axis == 0 else n if axis == 1 else n * n
            for o in range(3):
                if at[m, 2 * axis] < 0:
                    fixed[m, o] += share[m, 2 * axis] * values[1, axis, node - step, o]
                if at[m, 2 * axis + 1] < 0:
                    fixed[m, o] += share[m, 2 * axis + 1] * values[0, axis, node, o]
    for _ in range(sweeps):
        for m in range(count):
            r0, r1, r2 = fixed[m, 0], fixed[m, 1], fixed[m, 2]
            for k in range(6):
                if at[m, k] >= 0:
                    r0 += share[m, k] * blend[at[m, k], 0]
                    r1 += share[m, k] * blend[at[m, k], 1]
                    r2 += share[m, k] * blend[at[m, k], 2]
            node = inside[m]
            blend[node, 0] += omega * (r0 - blend[node, 0])
            blend[node, 1] += omega * (r1 - blend[node, 1])
            blend[node, 2] += omega * (r2 - blend[node, 2])
