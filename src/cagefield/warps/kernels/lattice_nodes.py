"""Numba kernels of the node lattices of lattices and meshes; see `lattice_shell` and `mesh_shell`.

A line of up to `NODE_LANES` nodes along x goes through together: the innermost loops run over it. All is in
float32, in the coordinates z in [-1,1]^3 of the outer cage, but for the inside of a lattice.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cagefield.compute.numba_cache import FAST, njit
from cagefield.compute.parallel_kernels import parallel_njit
from cagefield.warps.kernels.interpolated_rows import blend_pairs, blend_spline
from cagefield.warps.kernels.lattice_flow import invert_lattice_point, spline_weights

U, F = np.uintp, np.float32

NODE_LANES = 64

ITERATIONS = 2
"""Iterations of a step: each takes the error times h/2 |dv/dz|, and Aitken's extrapolation ends them."""

MANY_STRAIN = 0.6
"""h |dv/dz| of a mesh's flow from which its steps take one iteration more."""

MOST_RATIO = F(0.5)
"""Most ratio of two changes in a row from which the rest is extrapolated."""

ENOUGH = F(2e-5)
"""Last change of z in the inversion of a correction: 1e-5 of the outer cage."""

MOST_CORRECTIONS = 40

NEAR_ENOUGH = F(3e-4)
"""Residual, as a share of the outer cage's size (the sum of its edges), from which one more step of Newton's
method ends the inversion of a lattice: the step squares it."""


def mesh_iterations(strain: float) -> int:
    """Iterations of a step of a mesh's flow, of which nothing corrects the rest, by its h |dv/dz|.

    Largest error, as a share of the scene, of six meshes and of six lattices, by iterations, without and with
    the extrapolation: 2 2e-3 and 5e-4, 5e-3 and 3e-3; 3 6e-4 and 6e-5, 1e-3 and 5e-4; 4 2e-4, 3e-4 without.
    """
    return 3 if strain <= MANY_STRAIN else 4


@njit(**FAST)
def _velocities(grid, nodes, first, share, count, z, before, v, at, weights):
    """Writes the velocities v [3,L] of a slice at z + share before [3,L], trilinear between its nodes.

    at [L] int32 and weights [5,L] float32 are room.
    """
    line, plane = np.int32(4 * nodes), np.int32(4 * nodes * nodes)
    cells = F(nodes - U(1))
    half, one, zero, top = F(0.5) * cells, F(1.0), F(0.0), cells - F(1e-3)
    for l in range(count):
        s0 = min(max((z[0, l] + share * before[0, l] + one) * half, zero), top)
        s1 = min(max((z[1, l] + share * before[1, l] + one) * half, zero), top)
        s2 = min(max((z[2, l] + share * before[2, l] + one) * half, zero), top)
        i, j, k = np.int32(s0), np.int32(s1), np.int32(s2)
        b, c = s1 - F(j), s2 - F(k)
        at[l] = np.int32(4) * i + line * j + plane * k
        weights[0, l] = s0 - F(i)
        weights[1, l] = (one - b) * (one - c)
        weights[2, l] = b * (one - c)
        weights[3, l] = (one - b) * c
        weights[4, l] = b * c
    up, far = U(4) * nodes, U(4) * nodes * nodes
    for l in range(count):
        p = first + U(at[l])
        v[0, l], v[1, l], v[2, l] = blend_pairs(
            grid,
            (p, p + up, p + far, p + far + up),
            (weights[1, l], weights[2, l], weights[3, l], weights[4, l]),
            weights[0, l],
        )


@njit(**FAST)
def _flow_back(grid, nodes, steps, iterations, count, z, room, at, weights):
    """Takes z [3,L] back through all slices, in place; room [3,3,L] for velocities.

    With d and e the last two changes of the velocity, and c = d . e / d . d, the rest of the series is
    c / (1 - c) e (Aitken).
    """
    size = U(4) * nodes * nodes * nodes
    zero, one, two = F(0.0), F(1.0), F(2.0)
    v, before, older = room[0], room[1], room[2]
    room[:] = zero
    for step in range(len(steps)):
        n = len(steps) - 1 - step
        first, share = U(n) * size, F(-0.5) * F(steps[n])
        for _ in range(iterations + (1 if step == 0 else 0)):
            v, before, older = older, v, before
            _velocities(grid, nodes, first, share, count, z, before, v, at, weights)
        for l in range(count):
            d0, d1, d2 = before[0, l] - older[0, l], before[1, l] - older[1, l], before[2, l] - older[2, l]
            e0, e1, e2 = v[0, l] - before[0, l], v[1, l] - before[1, l], v[2, l] - before[2, l]
            c = (d0 * e0 + d1 * e1 + d2 * e2) / (d0 * d0 + d1 * d1 + d2 * d2 + F(1e-30))
            c = min(max(c, -MOST_RATIO), MOST_RATIO)
            c /= one - c
            v[0, l] += c * e0
            v[1, l] += c * e1
            v[2, l] += c * e2
            z[0, l] += two * share * v[0, l]
            z[1, l] += two * share * v[1, l]
            z[2, l] += two * share * v[2, l]


@njit(**FAST)
def _start(batch, places, resolution, z):
    """Writes z [3,L] of a line of nodes; (number of the first, how many).

    places [4,3]: z of the first node, dz by a node along each axis.
    """
    parts = (resolution + NODE_LANES - 1) // NODE_LANES
    row, first = batch // parts, batch % parts * NODE_LANES
    count = min(NODE_LANES, resolution - first)
    j, k = row % resolution, row // resolution
    for m in range(3):
        from_here = places[0, m] + places[1, m] * first + places[2, m] * j + places[3, m] * k
        for l in range(count):
            z[m, l] = F(from_here + places[1, m] * l)
    return row * resolution + first, count


def _lines(*args: Any) -> int:
    """Lines of the nodes of a cube whose resolution is the last argument but one."""
    resolution = args[-2]
    return int(resolution**2 * ((resolution + NODE_LANES - 1) // NODE_LANES))


@parallel_njit(_lines, **FAST)
def flow_nodes_back(begin, end, flow, resolution, out):
    """Writes Phi^-1(x) - x [R^3,3] of nodes x of a box.

    flow: grid [K N^3 4] float32, nodes N, steps [K], its velocities (x fastest, padded to 4) and steps;
    iterations of each step; places [4,3], z of the first node and dz by a node along each axis; frame [3,3]
    float32, dx/dz.
    """
    grid, nodes, steps, iterations, places, frame = flow
    z, start, room = (
        np.empty((3, NODE_LANES), F),
        np.empty((3, NODE_LANES), F),
        np.empty((3, 3, NODE_LANES), F),
    )
    at, weights = np.empty(NODE_LANES, np.int32), np.empty((5, NODE_LANES), F)
    for batch in range(begin, end):
        first, count = _start(batch, places, resolution, start)
        z[:] = start
        _flow_back(grid, nodes, steps, iterations, U(count), z, room, at, weights)
        for l in range(count):
            d0, d1, d2 = z[0, l] - start[0, l], z[1, l] - start[1, l], z[2, l] - start[2, l]
            for m in range(3):
                out[first + l, m] = frame[m, 0] * d0 + frame[m, 1] * d1 + frame[m, 2] * d2


@njit(**FAST)
def _uncorrect(count, q, edges, around, z, at, weights):
    """Writes z = R^-1(q) [3,L], with r from a table.

    edges [3,3] float32: dx/du; around: as of `lattice_nodes_back`; at [L] int32, weights [5,L] float32: room.
    """
    material, heights, table, last = around
    zero, half, one = F(0.0), F(0.5), F(1.0)
    side = np.int32(last + 1)
    end = F(last)
    z[:] = q
    up = U(4) * U(last + 1)
    for _ in range(MOST_CORRECTIONS):
        for l in range(count):
            z0, z1, z2 = z[0, l], z[1, l], z[2, l]
            u0 = material[0, 0] + material[1, 0] * z0 + material[2, 0] * z1 + material[3, 0] * z2
            u1 = material[0, 1] + material[1, 1] * z0 + material[2, 1] * z1 + material[3, 1] * z2
            u2 = material[0, 2] + material[1, 2] * z0 + material[2, 2] * z1 + material[3, 2] * z2
            c0, c1, c2 = min(max(u0, zero), one), min(max(u1, zero), one), min(max(u2, zero), one)
            e0, e1, e2 = u0 - c0, u1 - c1, u2 - c2
            d0 = edges[0, 0] * e0 + edges[0, 1] * e1 + edges[0, 2] * e2
            d1 = edges[1, 0] * e0 + edges[1, 1] * e1 + edges[1, 2] * e2
            d2 = edges[2, 0] * e0 + edges[2, 1] * e1 + edges[2, 2] * e2
            f0 = heights[0] * max(half * (one - z0 * z0), F(1e-12))
            f1 = heights[1] * max(half * (one - z1 * z1), F(1e-12))
            f2 = heights[2] * max(half * (one - z2 * z2), F(1e-12))
            least = min(f0, min(f1, f2))
            f0, f1, f2 = least / f0, least / f1, least / f2
            f0, f1, f2 = f0 * f0, f1 * f1, f2 * f2
            g = least / (
                least + np.sqrt((d0 * d0 + d1 * d1 + d2 * d2) * np.sqrt(f0 * f0 + f1 * f1 + f2 * f2))
            )
            # The face is that of the axis furthest out, or nearest to it within rounding of the cage.
            a0, a1, a2 = abs(u0 - half), abs(u1 - half), abs(u2 - half)
            by_x = a0 >= a1 and a0 >= a2
            by_y = a1 >= a2
            out = u0 if by_x else u1 if by_y else u2
            s = end * (c1 if by_x else c2 if by_y else c0)  # the next axis, counted round
            t = end * (c2 if by_x else c0 if by_y else c1)
            face = np.int32(0) if by_x else np.int32(2) if by_y else np.int32(4)
            face += np.int32(1) if out > half else np.int32(0)
            i, j = np.int32(min(s, end - F(1e-3))), np.int32(min(t, end - F(1e-3)))
            at[l] = np.int32(4) * ((face * side + i) * side + j)
            a, rho = s - F(i), g * g * (F(3.0) - F(2.0) * g)
            weights[0, l] = t - F(j)
            weights[1, l] = rho * (one - a)
            weights[2, l] = rho * a
        change = zero
        for l in range(count):
            p = U(at[l])
            r0, r1, r2 = blend_pairs(table, (p, p + up), (weights[1, l], weights[2, l]), weights[0, l])
            r0, r1, r2 = q[0, l] - r0, q[1, l] - r1, q[2, l] - r2
            change = max(change, max(abs(r0 - z[0, l]), max(abs(r1 - z[1, l]), abs(r2 - z[2, l]))))
            z[0, l], z[1, l], z[2, l] = r0, r1, r2
        if change <= ENOUGH:
            break


@njit(**FAST)
def _newton(points, shape, linear, x, u, size, weights):
    """A step of Newton's method from u [3] towards x(u) = x [3] float32, in place; True where that suffices.

    points: float32, flat, of padded control points of a shape [3], z first; size: length that residuals are
    compared with.
    """
    for m in range(3):
        u[m] = min(max(u[m], F(0.0)), F(1.0))
    spline_weights(shape, linear, u, weights)
    line = U(4 * shape[2])
    plane = line * U(shape[1])
    start = U(4) * U(weights[0, 8]) + line * U(weights[1, 8]) + plane * U(weights[2, 8])
    x0, x1, x2, a0, a1, a2, b0, b1, b2, c0, c1, c2 = blend_spline(points, start, line, plane, weights)
    r0, r1, r2 = x[0] - x0, x[1] - x1, x[2] - x2
    # Cramer's rule, with columns a, b, c.
    n0, n1, n2 = b1 * c2 - b2 * c1, b2 * c0 - b0 * c2, b0 * c1 - b1 * c0
    p0, p1, p2 = r1 * c2 - r2 * c1, r2 * c0 - r0 * c2, r0 * c1 - r1 * c0
    q0, q1, q2 = b1 * r2 - b2 * r1, b2 * r0 - b0 * r2, b0 * r1 - b1 * r0
    det = a0 * n0 + a1 * n1 + a2 * n2
    det = F(1.0) / (det if abs(det) > F(1e-30) else F(1e-30))
    step = F(0.25)
    u[0] += min(max(det * (r0 * n0 + r1 * n1 + r2 * n2), -step), step)
    u[1] += min(max(det * (a0 * p0 + a1 * p1 + a2 * p2), -step), step)
    u[2] += min(max(det * (a0 * q0 + a1 * q1 + a2 * q2), -step), step)
    return r0 * r0 + r1 * r1 + r2 * r2 <= NEAR_ENOUGH * NEAR_ENOUGH * size * size


@njit(**FAST)
def _inside(first, count, resolution, q, material, lattice, near, size, room, out):
    """Displacements of the nodes of a line that are inside of the lattice, over those in `out`.

    Newton's method starts from q, shifted as it was at the node before.
    """
    P, points, center, linear, place, box = lattice
    work, x, vectors, weights = room
    X, u, shift, guess = vectors[0], vectors[1], vectors[2], vectors[3]
    i0, j, k = first % resolution, first // resolution % resolution, first // (resolution * resolution)
    shift[:] = F(0.0)
    reach = F(near * near)
    for l in range(count):
        square = F(0.0)
        for m in range(3):
            guess[m] = material[0, m] + material[1, m] * q[0, l] + material[2, m] * q[1, l]
            guess[m] += material[3, m] * q[2, l]
        e0 = guess[0] - min(max(guess[0], F(0.0)), F(1.0))
        e1 = guess[1] - min(max(guess[1], F(0.0)), F(1.0))
        e2 = guess[2] - min(max(guess[2], F(0.0)), F(1.0))
        for m in range(3):
            d = F(box[1 + m, 0]) * e0 + F(box[1 + m, 1]) * e1 + F(box[1 + m, 2]) * e2
            square += d * d
        if square > reach:
            continue
        for m in range(3):
            x[m] = place[0, m] + place[1, m] * (i0 + l) + place[2, m] * j + place[3, m] * k
            X[m] = F(x[m] - center[m])
            u[m] = guess[m] + shift[m]
        found = False
        for _ in range(3):
            if _newton(points, P.shape, linear, X, u, F(size), weights):
                found = True
                break
        if not found:
            for m in range(3):
                work[11, m] = min(max(guess[m], F(0.0)), F(1.0))
            if not invert_lattice_point(P, linear, x, work[11], 1e-5 * size, work):
                continue
            for m in range(3):
                u[m] = F(work[11, m])
        for m in range(3):
            shift[m] = u[m] - guess[m]
        if min(u[0], u[1], u[2]) >= F(0.0) and max(u[0], u[1], u[2]) <= F(1.0):
            for m in range(3):
                y = box[0, m] + box[1 + m, 0] * u[0] + box[1 + m, 1] * u[1] + box[1 + m, 2] * u[2]
                out[first + l, m] = F(y - x[m])


@parallel_njit(_lines, **FAST)
def lattice_nodes_back(begin, end, flow, lattice, around, near, resolution, out):
    """Writes displacements to canonical space [R^3,3] of nodes x of a box.

    flow: as of `flow_nodes_back`.
    lattice: padded deformed control points; these less a center in rows of four float32, flat; the center;
    whether it is linear; place [4,3], x of the first node and dx by a node along each axis; box [4,3], origin
    of the canonical lattice and dx/du.
    around: material [4,3] float32, u at z = 0 and du/dz transposed; heights [3] float32 of the outer cage's
    faces over its center; table [6 T T 4] float32, r on the faces in z; its T - 1 cells along an axis.
    near: distance from the canonical cage after the flow up to which a node may be inside.
    """
    grid, nodes, steps, iterations, places, frame = flow
    material, place, box = around[0], lattice[4], lattice[5]
    z, start, q = np.empty((3, NODE_LANES), F), np.empty((3, NODE_LANES), F), np.empty((3, NODE_LANES), F)
    at, weights = np.empty(NODE_LANES, np.int32), np.empty((5, NODE_LANES), F)
    room, vectors = np.empty((3, 3, NODE_LANES), F), np.empty((4, 3), F)
    inversion = np.empty((12, 9)), np.empty(3), vectors, np.empty((3, 9), F)
    edges = np.empty((3, 3), F)
    edges[:] = box[1:]
    size = 0.0
    for m in range(3):
        size += (resolution - 1) * np.sqrt(place[1 + m, 0] ** 2 + place[1 + m, 1] ** 2 + place[1 + m, 2] ** 2)
    for batch in range(begin, end):
        first, count = _start(batch, places, resolution, start)
        q[:] = start
        _flow_back(grid, nodes, steps, iterations, U(count), q, room, at, weights)
        _uncorrect(U(count), q, edges, around, z, at, weights)
        for l in range(count):
            d0, d1, d2 = z[0, l] - start[0, l], z[1, l] - start[1, l], z[2, l] - start[2, l]
            for m in range(3):
                out[first + l, m] = frame[m, 0] * d0 + frame[m, 1] * d1 + frame[m, 2] * d2
        _inside(first, count, resolution, q, material, lattice, near, size, inversion, out)
