"""Numba kernel of a lattice shell's node lattice; see `lattice_shell`."""

from __future__ import annotations

import numpy as np
from numba import prange

from cagefield.compute.numba_cache import FAST, njit
from cagefield.warps.kernels.lattice_flow import invert_lattice_point

NODES_PER_BATCH = 64


@njit(**FAST)
def _velocity(grid, x, y, z):
    """The velocity at (x, y, z), trilinear between the nodes of one slice."""
    cells = grid.shape[0] - 1
    half = np.float32(0.5) * np.float32(cells)
    one = np.float32(1.0)
    s0, s1, s2 = (x + one) * half, (y + one) * half, (z + one) * half
    i = min(max(int(s0), 0), cells - 1)
    j = min(max(int(s1), 0), cells - 1)
    k = min(max(int(s2), 0), cells - 1)
    a, b, c = s0 - np.float32(i), s1 - np.float32(j), s2 - np.float32(k)
    r00, r10 = grid[k, j], grid[k, j + 1]
    r01, r11 = grid[k + 1, j], grid[k + 1, j + 1]
    w00, w10, w01, w11 = (one - b) * (one - c), b * (one - c), (one - b) * c, b * c
    v0 = w00 * r00[i, 0] + w10 * r10[i, 0] + w01 * r01[i, 0] + w11 * r11[i, 0]
    v1 = w00 * r00[i, 1] + w10 * r10[i, 1] + w01 * r01[i, 1] + w11 * r11[i, 1]
    v2 = w00 * r00[i, 2] + w10 * r10[i, 2] + w01 * r01[i, 2] + w11 * r11[i, 2]
    h = i + 1
    v0 += a * (w00 * r00[h, 0] + w10 * r10[h, 0] + w01 * r01[h, 0] + w11 * r11[h, 0] - v0)
    v1 += a * (w00 * r00[h, 1] + w10 * r10[h, 1] + w01 * r01[h, 1] + w11 * r11[h, 1] - v1)
    v2 += a * (w00 * r00[h, 2] + w10 * r10[h, 2] + w01 * r01[h, 2] + w11 * r11[h, 2] - v2)
    return v0, v1, v2


@njit(**FAST)
def _flow_back(grids, steps, z):
    """Takes z [3] float32 back through all slices, in place, by iterations from the last velocity."""
    x, y, w = z[0], z[1], z[2]
    v0, v1, v2 = _velocity(grids[-1], x, y, w)
    for n in range(len(grids)):
        at = len(grids) - 1 - n
        half = np.float32(-0.5) * np.float32(steps[at])
        for _ in range(3):
            v0, v1, v2 = _velocity(grids[at], x + half * v0, y + half * v1, w + half * v2)
        x += np.float32(2.0) * half * v0
        y += np.float32(2.0) * half * v1
        w += np.float32(2.0) * half * v2
    z[0], z[1], z[2] = x, y, w


@njit(**FAST)
def _uncorrect(X, confines, heights, material, table, most):
    """Takes X = R^-1(X) [3], in place, with r from a table [6,T,T,3]."""
    q0, q1, q2 = X[0], X[1], X[2]
    last = table.shape[1] - 1
    u, z, e = np.empty(3), np.empty(3), np.empty(3)
    for _ in range(40):
        p0, p1, p2 = X[0] - material[0, 0], X[1] - material[0, 1], X[2] - material[0, 2]
        o0, o1, o2 = X[0] - confines[0, 0], X[1] - confines[0, 1], X[2] - confines[0, 2]
        axis, far = 0, 0.0
        for i in range(3):
            u[i] = material[4 + i, 0] * p0 + material[4 + i, 1] * p1 + material[4 + i, 2] * p2
            z[i] = confines[1 + i, 0] * o0 + confines[1 + i, 1] * o1 + confines[1 + i, 2] * o2
            e[i] = u[i] - min(max(u[i], 0.0), 1.0)
            if abs(e[i]) > far:
                axis, far = i, abs(e[i])
        if far == 0.0:  # within rounding of a face
            for i in range(3):
                if abs(u[i] - 0.5) > abs(u[axis] - 0.5):
                    axis = i
        face = 2 * axis + (1 if u[axis] > 0.5 else 0)
        s = min(max(u[(axis + 1) % 3], 0.0), 1.0) * last
        t = min(max(u[(axis + 2) % 3], 0.0), 1.0) * last
        i, j = min(int(s), last - 1), min(int(t), last - 1)
        a, b = s - i, t - j
        square = 0.0
        inverse = 0.0
        for n in range(3):
            d = material[1 + n, 0] * e[0] + material[1 + n, 1] * e[1] + material[1 + n, 2] * e[2]
            square += d * d
            f = 0.5 * heights[n] * max(1.0 - z[n] * z[n], 1e-12)
            f = 1.0 / (f * f)
            inverse += f * f
        d_o = 1.0 / np.sqrt(np.sqrt(inverse))
        g = d_o / (np.sqrt(square) + d_o)
        rho = g * g * (3.0 - 2.0 * g)
        change = 0.0
        for n in range(3):
            low = table[face, i, j, n] + b * (table[face, i, j + 1, n] - table[face, i, j, n])
            high = table[face, i + 1, j, n] + b * (table[face, i + 1, j + 1, n] - table[face, i + 1, j, n])
            q = q0 if n == 0 else q1 if n == 1 else q2
            new = q - rho * (low + a * (high - low))
            change = max(change, abs(new - X[n]))
            X[n] = new
        if change <= most:
            break


@njit(**FAST)
def _sample_batch(
    grids, steps, confines, heights, material, P, linear, table, near, place, resolution, out, first
):
    """`sample_nodes` at nodes from `first`."""
    work, z, x, X, u = np.empty((11, 9)), np.empty(3, np.float32), np.empty(3), np.empty(3), np.empty(3)
    enough = 1e-6 * (abs(place[1, 0]) + abs(place[2, 1]) + abs(place[3, 2]) + abs(place[1, 1]))
    for n in range(first, min(first + NODES_PER_BATCH, resolution**3)):
        i, j = n % resolution, n // resolution % resolution
        k = n // (resolution * resolution)
        a, b, c = i / (resolution - 1), j / (resolution - 1), k / (resolution - 1)
        edge = 0.0
        for m in range(3):
            x[m] = place[0, m] + place[1 + m, 0] * a + place[1 + m, 1] * b + place[1 + m, 2] * c
        for m in range(3):
            s = confines[1 + m, 0] * (x[0] - confines[0, 0])
            s += confines[1 + m, 1] * (x[1] - confines[0, 1]) + confines[1 + m, 2] * (x[2] - confines[0, 2])
            z[m] = s
            edge = max(edge, abs(s))
        if edge >= 1.0 - 1e-9:
            out[n, 0] = 0.0
            out[n, 1] = 0.0
            out[n, 2] = 0.0
            continue
        _flow_back(grids, steps, z)
        for m in range(3):
            X[m] = confines[0, m] + confines[4 + m, 0] * z[0] + confines[4 + m, 1] * z[1]
            X[m] += confines[4 + m, 2] * z[2]
        p0, p1, p2 = X[0] - material[0, 0], X[1] - material[0, 1], X[2] - material[0, 2]
        square = 0.0
        for m in range(3):
            u[m] = material[4 + m, 0] * p0 + material[4 + m, 1] * p1 + material[4 + m, 2] * p2
        for m in range(3):
            d = material[1 + m, 0] * (u[0] - min(max(u[0], 0.0), 1.0))
            d += material[1 + m, 1] * (u[1] - min(max(u[1], 0.0), 1.0))
            d += material[1 + m, 2] * (u[2] - min(max(u[2], 0.0), 1.0))
            square += d * d
        inside = False
        if square <= near * near:
            for m in range(3):
                u[m] = min(max(u[m], 0.0), 1.0)
            if invert_lattice_point(P, linear, x, u, enough, work):
                inside = min(u[0], u[1], u[2]) >= 0.0 and max(u[0], u[1], u[2]) <= 1.0
        if inside:
            for m in range(3):
                X[m] = material[0, m] + material[1 + m, 0] * u[0] + material[1 + m, 1] * u[1]
                X[m] += material[1 + m, 2] * u[2]
        elif near > 2e-9:
            _uncorrect(X, confines, heights, material, table, enough)
        for m in range(3):
            out[n, m] = np.float32(X[m] - x[m])


@njit(parallel=True, **FAST)
def sample_nodes(grids, steps, confines, heights, material, P, linear, table, near, place, resolution, out):
    """Writes the displacements to canonical space [R^3,3] of the nodes of an outer cage with parallel faces.

    grids, steps: velocities and steps of the flow; confines [7,3]: centre, dz/dx, dx/dz of the outer cage;
    heights [3] of its faces over the centre; material [7,3]: origin, dx/du, du/dx of the canonical lattice;
    P: padded deformed control points; table: r on the faces; near: the distance from the canonical cage after
    the flow up to which a node may be inside; place [4,3]: origin and edges of the nodes' box.
    """
    count = resolution**3
    for part in prange((count + NODES_PER_BATCH - 1) // NODES_PER_BATCH):
        _sample_batch(
            grids, steps, confines, heights, material, P, linear, table, near, place, resolution, out,
            np.intp(part) * NODES_PER_BATCH,
        )  # fmt: skip
