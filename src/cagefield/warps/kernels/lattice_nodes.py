"""Numba kernel of a lattice shell's node lattice; see `lattice_shell`."""

from __future__ import annotations

from typing import Any

import numpy as np

from cagefield.compute.numba_cache import FAST, njit
from cagefield.compute.parallel_kernels import parallel_njit
from cagefield.warps.kernels.lattice_flow import invert_lattice_nearby

U = np.uintp

NODES_PER_BATCH = 64

ITERATIONS = 2
"""Iterations of a step: each takes the error times h/2 |dv/dz|, and Aitken's extrapolation ends them."""

MANY_STRAIN = 0.6
"""h |dv/dz| of a mesh's flow from which its steps take one iteration more."""

MOST_RATIO = np.float32(0.5)
"""Most ratio of two changes in a row from which the rest is extrapolated."""


def mesh_iterations(strain: float) -> int:
    """Iterations of a step of a mesh's flow, of which nothing corrects the rest, by its h |dv/dz|.

    Largest error, as a share of the scene, of six meshes and of six lattices, by iterations, without and with
    the extrapolation: 2 2e-3 and 5e-4, 5e-3 and 3e-3; 3 6e-4 and 6e-5, 1e-3 and 5e-4; 4 2e-4, 3e-4 without.
    """
    return 3 if strain <= MANY_STRAIN else 4


@njit(**FAST)
def _flow_back(grid, nodes, steps, z, room, iterations):
    """Takes z [N,4] float32 (x, y, z, -) back through all slices, in place; room [3,N,4] for velocities.

    The loop over the nodes is the innermost: a node's own steps wait for each other. With d and e the last
    two changes of the velocity, and c = d . e / d . d, what is still to come is c / (1 - c) e (Aitken).
    """
    size = U(4) * nodes * nodes * nodes
    line, plane = U(4) * nodes, U(4) * nodes * nodes
    cells = np.float32(nodes - U(1))
    half, one, zero, top = np.float32(0.5) * cells, np.float32(1.0), np.float32(0.0), cells - np.float32(1e-3)
    v, before, older = room[0], room[1], room[2]
    room[:] = zero
    for step in range(len(steps)):
        at = U(len(steps) - 1 - step)
        first, share = at * size, np.float32(-0.5) * np.float32(steps[at])
        for _ in range(iterations + (1 if step == 0 else 0)):
            v, before, older = older, v, before
            for l in range(U(len(z))):
                s0 = min(max((z[l, 0] + share * before[l, 0] + one) * half, zero), top)
                s1 = min(max((z[l, 1] + share * before[l, 1] + one) * half, zero), top)
                s2 = min(max((z[l, 2] + share * before[l, 2] + one) * half, zero), top)
                i, j, k = U(s0), U(s1), U(s2)
                a, b, c = s0 - np.float32(i), s1 - np.float32(j), s2 - np.float32(k)
                p = first + U(4) * i + line * j + plane * k
                w00, w10, w01, w11 = (one - b) * (one - c), b * (one - c), (one - b) * c, b * c
                d00, d10, d01, d11 = a * w00, a * w10, a * w01, a * w11
                w00, w10, w01, w11 = w00 - d00, w10 - d10, w01 - d01, w11 - d11
                for n in range(U(4)):
                    low = w00 * grid[p + n] + w10 * grid[p + line + n]
                    low += d00 * grid[p + U(4) + n] + d10 * grid[p + line + U(4) + n]
                    high = w01 * grid[p + plane + n] + w11 * grid[p + plane + line + n]
                    high += d01 * grid[p + plane + U(4) + n] + d11 * grid[p + plane + line + U(4) + n]
                    v[l, n] = low + high
        for l in range(U(len(z))):
            both, square = zero, np.float32(1e-30)
            for n in range(U(4)):
                d = before[l, n] - older[l, n]
                both += d * (v[l, n] - before[l, n])
                square += d * d
            c = min(max(both / square, -MOST_RATIO), MOST_RATIO)
            c /= one - c
            for n in range(U(4)):
                v[l, n] += c * (v[l, n] - before[l, n])
                z[l, n] += np.float32(2.0) * share * v[l, n]


@njit(**FAST)
def _uncorrect(X, confines, heights, material, table, most):
    """Takes X = R^-1(X) [3], in place, with r from a table [6,T,T,3]."""
    q0, q1, q2 = X[0], X[1], X[2]
    last = table.shape[1] - 1
    u, z = np.empty(3), np.empty(3)
    for _ in range(40):
        _affine(material, X, u)
        _affine(confines, X, z)
        e0 = u[0] - min(max(u[0], 0.0), 1.0)
        e1 = u[1] - min(max(u[1], 0.0), 1.0)
        e2 = u[2] - min(max(u[2], 0.0), 1.0)
        # The face is that of the axis furthest out, or nearest to it within rounding of the cage.
        f0, f1, f2 = abs(u[0] - 0.5), abs(u[1] - 0.5), abs(u[2] - 0.5)
        axis = 0 if f0 >= f1 and f0 >= f2 else 1 if f1 >= f2 else 2
        face = 2 * axis + (1 if u[axis] > 0.5 else 0)
        s = min(max(u[axis - 2], 0.0), 1.0) * last  # the next axis, counted round
        t = min(max(u[axis - 1], 0.0), 1.0) * last
        i, j = min(int(s), last - 1), min(int(t), last - 1)
        a, b = s - i, t - j
        square, inverse = 0.0, 0.0
        for n in range(3):
            d = material[4 + n, 0] * e0 + material[4 + n, 1] * e1 + material[4 + n, 2] * e2
            square += d * d
            f = 0.5 * heights[n] * max(1.0 - z[n] * z[n], 1e-12)
            f = 1.0 / (f * f)
            inverse += f * f
        g = 1.0 / (1.0 + np.sqrt(square * np.sqrt(inverse)))
        rho = g * g * (3.0 - 2.0 * g)
        w00, w10, w01, w11 = (1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b
        near, far = table[face, i], table[face, i + 1]
        n0 = q0 - rho * (w00 * near[j, 0] + w01 * near[j + 1, 0] + w10 * far[j, 0] + w11 * far[j + 1, 0])
        n1 = q1 - rho * (w00 * near[j, 1] + w01 * near[j + 1, 1] + w10 * far[j, 1] + w11 * far[j + 1, 1])
        n2 = q2 - rho * (w00 * near[j, 2] + w01 * near[j + 1, 2] + w10 * far[j, 2] + w11 * far[j + 1, 2])
        change = max(abs(n0 - X[0]), abs(n1 - X[1]), abs(n2 - X[2]))
        X[0], X[1], X[2] = n0, n1, n2
        if change <= most:
            break


def _batches(*args: Any) -> int:
    """Batches of the nodes of a cube whose resolution is the last argument but one."""
    return int((args[-2] ** 3 + NODES_PER_BATCH - 1) // NODES_PER_BATCH)


@njit(**FAST)
def _place(n, place, resolution, x):
    """Writes the place x [3] of a node."""
    i, j, k = n % resolution, n // resolution % resolution, n // (resolution * resolution)
    scale = 1.0 / (resolution - 1)
    a, b, c = i * scale, j * scale, k * scale
    for m in range(3):
        x[m] = place[0, m] + place[1 + m, 0] * a + place[1 + m, 1] * b + place[1 + m, 2] * c


@njit(**FAST)
def _affine(rows, x, y):
    """Writes y [3] = the matrix in rows 1 to 3 times x - row 0."""
    p0, p1, p2 = x[0] - rows[0, 0], x[1] - rows[0, 1], x[2] - rows[0, 2]
    for m in range(3):
        y[m] = rows[1 + m, 0] * p0 + rows[1 + m, 1] * p1 + rows[1 + m, 2] * p2


@njit(**FAST)
def _flow_batch(grid, nodes, steps, frames, iterations, resolution, out, first):
    """`flow_nodes_back` at nodes from `first`."""
    confines, place = frames[0:7], frames[7:11]
    x, u = np.empty(3), np.empty(3)
    z, room = np.zeros((NODES_PER_BATCH, 4), np.float32), np.empty((3, NODES_PER_BATCH, 4), np.float32)
    start = np.empty((NODES_PER_BATCH, 3), np.float32)
    last = min(first + NODES_PER_BATCH, resolution**3)
    for n in range(first, last):
        _place(n, place, resolution, x)
        _affine(confines, x, u)
        for m in range(3):
            z[n - first, m] = start[n - first, m] = u[m]
    _flow_back(grid, nodes, steps, z, room, iterations)
    for n in range(first, last):
        d0, d1, d2 = z[n - first, 0], z[n - first, 1], z[n - first, 2]
        d0, d1, d2 = d0 - start[n - first, 0], d1 - start[n - first, 1], d2 - start[n - first, 2]
        for m in range(3):
            out[n, m] = np.float32(
                confines[4 + m, 0] * d0 + confines[4 + m, 1] * d1 + confines[4 + m, 2] * d2
            )


@parallel_njit(_batches, **FAST)
def flow_nodes_back(begin, end, grid, nodes, steps, frames, iterations, resolution, out):
    """Writes Phi^-1(x) - x [R^3,3] of nodes x of a box.

    grid [K N^3 4] float32, nodes N, steps [K]: velocities (x fastest, padded to 4) and steps of the flow;
    iterations of each step; frames [11,3]: center, dz/dx, dx/dz of the outer cage, then origin and edges of
    the nodes' box.
    """
    for batch in range(begin, end):
        first = np.intp(batch) * NODES_PER_BATCH
        _flow_batch(grid, nodes, steps, frames, iterations, resolution, out, first)


@njit(**FAST)
def _sample_batch(frames, P, linear, table, near, resolution, out, first):
    """`sample_nodes` at nodes from `first`."""
    confines, heights, material, place = frames[0:7], frames[7], frames[8:15], frames[15:19]
    work, x, X, u = np.empty((11, 9)), np.empty(3), np.empty(3), np.empty(3)
    enough = 1e-5 * (abs(place[1, 0]) + abs(place[2, 1]) + abs(place[3, 2]))
    last = min(first + NODES_PER_BATCH, resolution**3)
    for n in range(first, last):
        _place(n, place, resolution, x)
        for m in range(3):
            X[m] = x[m] + out[n, m]
        _affine(material, X, u)
        e0 = u[0] - min(max(u[0], 0.0), 1.0)
        e1 = u[1] - min(max(u[1], 0.0), 1.0)
        e2 = u[2] - min(max(u[2], 0.0), 1.0)
        square = 0.0
        for m in range(3):
            d = material[4 + m, 0] * e0 + material[4 + m, 1] * e1 + material[4 + m, 2] * e2
            square += d * d
        inside = False
        if square <= near * near:
            for m in range(3):
                u[m] = min(max(u[m], 0.0), 1.0)
            if invert_lattice_nearby(P, linear, x, u, enough, work):
                inside = min(u[0], u[1], u[2]) >= 0.0 and max(u[0], u[1], u[2]) <= 1.0
        if inside:
            for m in range(3):
                X[m] = material[0, m] + material[4 + m, 0] * u[0] + material[4 + m, 1] * u[1]
                X[m] += material[4 + m, 2] * u[2]
        elif near > 2e-9:
            _uncorrect(X, confines, heights, material, table, enough)
        for m in range(3):
            out[n, m] = np.float32(X[m] - x[m])


@parallel_njit(_batches, **FAST)
def sample_nodes(begin, end, frames, P, linear, table, near, resolution, out):
    """Displacements to canonical space [R^3,3] of the nodes of an outer cage with parallel faces, in place of
    those by the flow, Phi^-1(x) - x.

    frames [19,3]: center, dz/dx, dx/dz of the outer cage, heights of its faces over the center, then origin,
    du/dx, dx/du of the canonical lattice, then origin and edges of the nodes' box; P: padded deformed control
    points; table: r on the faces; near: distance from the canonical cage after the flow up to which a node
    may be inside.
    """
    for batch in range(begin, end):
        first = np.intp(batch) * NODES_PER_BATCH
        _sample_batch(frames, P, linear, table, near, resolution, out, first)
