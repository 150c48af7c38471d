"""Numba kernels of the lattice shell: its velocity on a grid, the flow through it, the lattice's own map.

Notation: see `lattice_shell`. Velocities [K,G,G,G,3] are dz/ds at nodes of an even grid over z in [-1,1]^3, x
fastest, one slice for each step.
"""

from __future__ import annotations

import numpy as np

from cagefield.compute.numba_cache import FAST, njit
from cagefield.compute.parallel_kernels import parallel_njit


@njit(inline="always", **FAST)
def fade(q, a, b, width):
    """Weight of `Falloff` at q = d_i / d_o."""
    g = (1.0 / (1.0 + q) - 1.0) / width + 1.0
    if g <= 0.0:
        return 0.0
    u = max(2.0 * g - 1.0, 0.0)
    u8 = u * u
    u8 *= u8
    u8 *= u8
    return g * (a + b * g * (3.0 - 2.0 * g)) + (1.0 - a - b) * u8 * u


@njit(**FAST)
def sample_velocity(grid, z, v, G):
    """Writes the velocity v [3] and its slope G [3,3] at z [3], trilinear between the nodes of one slice."""
    cells = grid.shape[0] - 1
    half = 0.5 * cells
    s0, s1, s2 = (z[0] + 1.0) * half, (z[1] + 1.0) * half, (z[2] + 1.0) * half
    i = min(max(int(s0), 0), cells - 1)
    j = min(max(int(s1), 0), cells - 1)
    k = min(max(int(s2), 0), cells - 1)
    a, b, c = s0 - i, s1 - j, s2 - k
    for n in range(3):
        p00, p01 = np.float64(grid[k, j, i, n]), np.float64(grid[k, j, i + 1, n])
        p10, p11 = np.float64(grid[k, j + 1, i, n]), np.float64(grid[k, j + 1, i + 1, n])
        q00, q01 = np.float64(grid[k + 1, j, i, n]), np.float64(grid[k + 1, j, i + 1, n])
        q10, q11 = np.float64(grid[k + 1, j + 1, i, n]), np.float64(grid[k + 1, j + 1, i + 1, n])
        p0, p1 = p00 + a * (p01 - p00), p10 + a * (p11 - p10)
        q0, q1 = q00 + a * (q01 - q00), q10 + a * (q11 - q10)
        p, q = p0 + b * (p1 - p0), q0 + b * (q1 - q0)
        v[n] = p + c * (q - p)
        G[n, 2] = half * (q - p)
        G[n, 1] = half * ((1.0 - c) * (p1 - p0) + c * (q1 - q0))
        x = (1.0 - b) * (p01 - p00) + b * (p11 - p10)
        G[n, 0] = half * ((1.0 - c) * x + c * ((1.0 - b) * (q01 - q00) + b * (q11 - q10)))


@njit(**FAST)
def largest_slope(grid):
    """Largest sum over the axes, of all cells of a grid [G,G,G,3] float32: that of the longest squared
    difference on a cell's four edges along the axis."""
    cells = grid.shape[0] - 1
    most = np.float32(0.0)
    x = np.empty((2, 2, cells), np.float32)  # squared differences along x on the rows around a line of cells
    for k in range(cells):
        for j in range(cells):
            for r in range(2):
                for q in range(2):
                    row = grid[k + r, j + q]
                    for i in range(cells):
                        d0, d1, d2 = (
                            row[i + 1, 0] - row[i, 0],
                            row[i + 1, 1] - row[i, 1],
                            row[i + 1, 2] - row[i, 2],
                        )
                        x[r, q, i] = d0 * d0 + d1 * d1 + d2 * d2
            low, high, far, end = grid[k, j], grid[k, j + 1], grid[k + 1, j], grid[k + 1, j + 1]
            y0 = z0 = np.float32(0.0)
            for i in range(cells + 1):
                ya = yb = za = zb = np.float32(0.0)
                for n in range(3):
                    ya += (high[i, n] - low[i, n]) * (high[i, n] - low[i, n])
                    yb += (end[i, n] - far[i, n]) * (end[i, n] - far[i, n])
                    za += (far[i, n] - low[i, n]) * (far[i, n] - low[i, n])
                    zb += (end[i, n] - high[i, n]) * (end[i, n] - high[i, n])
                y1, z1 = max(ya, yb), max(za, zb)
                if i > 0:
                    along = max(max(x[0, 0, i - 1], x[0, 1, i - 1]), max(x[1, 0, i - 1], x[1, 1, i - 1]))
                    most = max(most, along + max(y0, y1) + max(z0, z1))
                y0, z0 = y1, z1
    return most


@njit(**FAST)
def _inverse(A, out):
    """Writes A^-1 [3,3]."""
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for m in range(3):
            n, o = (m + 1) % 3, (m + 2) % 3
            out[m, i] = A[j, n] * A[k, o] - A[j, o] * A[k, n]
    det = A[0, 0] * out[0, 0] + A[0, 1] * out[1, 0] + A[0, 2] * out[2, 0]
    det = 1.0 / (det if abs(det) > 1e-300 else 1e-300)
    for i in range(3):
        for m in range(3):
            out[i, m] *= det


@njit(**FAST)
def solve_midpoint(grid, half, enough, z, m, work):
    """Writes the m [3] with m - half v(m) = z by Newton's method; work[8:11] keeps (1 - half dv/dm)^-1."""
    v, G, A, B = work[0], work[2:5], work[5:8], work[8:11]
    for i in range(3):
        m[i] = z[i]
    for _ in range(12):
        sample_velocity(grid, m, v, G)
        for i in range(3):
            for j in range(3):
                A[i, j] = -half * G[i, j]
            A[i, i] += 1.0
        _inverse(A, B)
        size = 0.0
        r0, r1, r2 = m[0] - half * v[0] - z[0], m[1] - half * v[1] - z[1], m[2] - half * v[2] - z[2]
        for i in range(3):
            d = B[i, 0] * r0 + B[i, 1] * r1 + B[i, 2] * r2
            m[i] = min(max(m[i] - d, -1.0), 1.0)
            size = max(size, abs(d))
        if size <= enough:
            break


@njit(**FAST)
def flow_point(grids, steps, backwards, enough, z, J, slopes, work):
    """Takes a point z [3] through all slices, and with `slopes` its Jacobian J [3,3], in place."""
    m, B = work[1], work[8:11]
    for k in range(len(grids)):
        at = len(grids) - 1 - k if backwards else k
        half = -0.5 * steps[at] if backwards else 0.5 * steps[at]
        solve_midpoint(grids[at], half, enough, z, m, work)
        for i in range(3):
            z[i] = 2.0 * m[i] - z[i]
        if slopes:
            # (1 + half G) (1 - half G)^-1 = 2 (1 - half G)^-1 - 1.
            for j in range(3):
                x0, x1, x2 = J[0, j], J[1, j], J[2, j]
                for i in range(3):
                    J[i, j] = 2.0 * (B[i, 0] * x0 + B[i, 1] * x1 + B[i, 2] * x2)
                J[0, j] -= x0
                J[1, j] -= x1
                J[2, j] -= x2


@parallel_njit(lambda grids, steps, backwards, enough, z, J: len(z), **FAST)
def flow_points(begin, end, grids, steps, backwards, enough, z, J):
    """Takes points z [N,3] in [-1,1]^3 through all slices, and their Jacobians J [N,3,3] (or [0,3,3])."""
    slopes = len(J) > 0
    work, none = np.empty((11, 3)), np.empty((3, 3))
    for n in range(begin, end):
        flow_point(grids, steps, backwards, enough, z[n], J[n] if slopes else none, slopes, work)


@njit(**FAST)
def spline_weights(shape, linear, u, weights):
    """Writes the weights of the control points at u [3], weights [3,9]: 4 values, 4 slopes, first point."""
    for a in range(3):
        cells = shape[2 - a] - 3
        s = u[a] * cells
        i = min(max(int(np.floor(s)), 0), cells - 1)
        t = s - i
        r = 1.0 - t
        w = weights[a]
        w[8] = i
        if linear:
            w[0], w[1], w[2], w[3] = 0.0, r, t, 0.0
            w[4], w[5], w[6], w[7] = 0.0, -cells, cells, 0.0
        else:
            w[0] = r * r * r / 6.0
            w[1] = (4.0 + t * t * (3.0 * t - 6.0)) / 6.0
            w[2] = (4.0 + r * r * (3.0 * r - 6.0)) / 6.0
            w[3] = t * t * t / 6.0
            w[4] = -0.5 * r * r * cells
            w[5] = t * (1.5 * t - 2.0) * cells
            w[6] = r * (2.0 - 1.5 * r) * cells
            w[7] = 0.5 * t * t * cells


@njit(**FAST)
def lattice_point(P, linear, u, x, J, weights):
    """Writes x(u) [3] and dx/du [3,3] of padded control points P, see `bspline_lattice.padded`."""
    spline_weights(P.shape, linear, u, weights)
    i, j, k = int(weights[0, 8]), int(weights[1, 8]), int(weights[2, 8])
    wx, wy, wz = weights[0], weights[1], weights[2]
    for c in range(3):
        x[c] = 0.0
        J[c, 0] = 0.0
        J[c, 1] = 0.0
        J[c, 2] = 0.0
    first, last = (1, 3) if linear else (0, 4)
    for c in range(first, last):
        for b in range(first, last):
            row = P[k + c, j + b]
            yz, dy, dz = wy[b] * wz[c], wy[4 + b] * wz[c], wy[b] * wz[4 + c]
            for n in range(3):
                p0, p1 = row[i, n], row[i + 1, n]
                p2, p3 = row[i + 2, n], row[i + 3, n]
                value = wx[0] * p0 + wx[1] * p1 + wx[2] * p2 + wx[3] * p3
                x[n] += yz * value
                J[n, 0] += yz * (wx[4] * p0 + wx[5] * p1 + wx[6] * p2 + wx[7] * p3)
                J[n, 1] += dy * value
                J[n, 2] += dz * value


@njit(**FAST)
def invert_lattice_point(P, linear, target, u, enough, work):
    """Newton's method from u [3] to x(u) = target [3], in place: True where it arrived."""
    x, J, B, weights, trial = work[0, :3], work[1:4, :3], work[4:7, :3], work[7:10], work[10, :3]
    lattice_point(P, linear, u, x, J, weights)
    r0, r1, r2 = x[0] - target[0], x[1] - target[1], x[2] - target[2]
    left = r0 * r0 + r1 * r1 + r2 * r2
    share = 1.0
    for _ in range(40):
        if left <= enough * enough:
            return True
        _inverse(J, B)
        longest = 0.0
        for i in range(3):
            longest = max(longest, abs(B[i, 0] * r0 + B[i, 1] * r1 + B[i, 2] * r2))
        limit = min(share, 0.25 / max(longest, 1e-30))
        for i in range(3):
            step = limit * (B[i, 0] * r0 + B[i, 1] * r1 + B[i, 2] * r2)
            trial[i] = min(max(u[i] - step, -0.5), 1.5)
        lattice_point(P, linear, trial, x, J, weights)
        s0, s1, s2 = x[0] - target[0], x[1] - target[1], x[2] - target[2]
        new = s0 * s0 + s1 * s1 + s2 * s2
        if new < left:
            u[0], u[1], u[2] = trial[0], trial[1], trial[2]
            r0, r1, r2, left = s0, s1, s2, new
            share = min(1.0, 2.0 * share)
        else:
            share *= 0.25
            if share < 1e-4:
                return False
            lattice_point(P, linear, u, x, J, weights)
    return left <= enough * enough


@parallel_njit(lambda P, linear, targets, u, *_: len(u), **FAST)
def invert_lattice(begin, end, P, linear, targets, u, enough, found):
    """Newton's method for points [N,3] from u [N,3], in place; found [N]: those that arrived."""
    work = np.empty((11, 9))
    for n in range(begin, end):
        found[n] = invert_lattice_point(P, linear, targets[n], u[n], enough, work)


@parallel_njit(lambda P, linear, u, *_: len(u), **FAST)
def lattice_points(begin, end, P, linear, u, x, J):
    """Writes x(u) [N,3] and dx/du [N,3,3] at u [N,3]."""
    weights = np.empty((3, 9))
    for n in range(begin, end):
        lattice_point(P, linear, u[n], x[n], J[n], weights)


@njit(**FAST)
def _meet_lattice(P, linear, margin, near, work):
    """Replaces the velocity near[6:9] and the distance near[9] by the lattice's own in a collar around it.

    near[0:3] is the place in the frame, near[3:6] an estimate of its u. All of it is the lattice's up to one
    margin away, nothing from two on.
    """
    target, u = near[0:3], near[3:6]
    if not invert_lattice_point(P[0], linear, target, u, 1e-3 * margin, work):
        return
    x, J, weights = work[0, :3], work[1:4, :3], work[7:10]  # J is that at u
    square = 0.0
    for i in range(3):
        e = u[i] - min(max(u[i], 0.0), 1.0)
        square += e * e * (J[0, i] * J[0, i] + J[1, i] * J[1, i] + J[2, i] * J[2, i])
    exact = np.sqrt(square)
    share = min(max(2.0 - exact / margin, 0.0), 1.0)
    if share > 0.0:
        lattice_point(P[1], linear, u, x, J, weights)
        near[9] += share * (exact - near[9])
        for i in range(3):
            near[6 + i] += share * (x[i] - near[6 + i])


@njit(**FAST)
def _fill_batch(places, reach, dz, frame, samples, P, linear, settings, out, first, local, work):
    """`fill_slice` at up to 256 nodes from `first`."""
    count, blur, margin = samples.shape[1], settings[0], settings[1]
    stride = min(len(dz) - 1, 1)
    for n in range(first, min(first + 256, len(places))):
        if reach[n] < 0.0:
            for i in range(3):
                out[n, i] = 0.0
            continue
        p0 = places[n, 0] - frame[0, 0]
        p1 = places[n, 1] - frame[0, 1]
        p2 = places[n, 2] - frame[0, 2]
        y0 = np.float32(frame[2, 0] * p0 + frame[2, 1] * p1 + frame[2, 2] * p2)
        y1 = np.float32(frame[3, 0] * p0 + frame[3, 1] * p1 + frame[3, 2] * p2)
        y2 = np.float32(frame[4, 0] * p0 + frame[4, 1] * p1 + frame[4, 2] * p2)
        total = np.float32(0.0)
        away = np.float32(0.0)
        d0 = np.float32(0.0)
        d1 = np.float32(0.0)
        d2 = np.float32(0.0)
        m0 = np.float32(0.0)
        m1 = np.float32(0.0)
        m2 = np.float32(0.0)
        one, zero, blurred = np.float32(1.0), np.float32(0.0), np.float32(blur)
        for j in range(np.uintp(count)):
            a = y0 - samples[0, j]
            b = y1 - samples[1, j]
            c = y2 - samples[2, j]
            r = a * a + b * b + c * c + blurred
            k = one / (r * r * r)
            u0 = samples[9, j] * a + samples[10, j] * b + samples[11, j] * c
            u1 = samples[12, j] * a + samples[13, j] * b + samples[14, j] * c
            u2 = samples[15, j] * a + samples[16, j] * b + samples[17, j] * c
            v0 = min(max(u0 + samples[3, j], zero), one) - samples[3, j]
            v1 = min(max(u1 + samples[4, j], zero), one) - samples[4, j]
            v2 = min(max(u2 + samples[5, j], zero), one) - samples[5, j]
            e0 = (u0 - v0) * samples[6, j]
            e1 = (u1 - v1) * samples[7, j]
            e2 = (u2 - v2) * samples[8, j]
            total += k
            m0 += k * (v0 + samples[3, j])
            m1 += k * (v1 + samples[4, j])
            m2 += k * (v2 + samples[5, j])
            away += k * np.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
            d0 += k * (samples[18, j] + samples[21, j] * v0 + samples[22, j] * v1 + samples[23, j] * v2)
            d1 += k * (samples[19, j] + samples[24, j] * v0 + samples[25, j] * v1 + samples[26, j] * v2)
            d2 += k * (samples[20, j] + samples[27, j] * v0 + samples[28, j] * v1 + samples[29, j] * v2)
        scale = np.float64(1.0) / np.float64(total)
        near = local
        near[0], near[1], near[2] = y0, y1, y2
        near[3], near[4], near[5] = m0 * scale, m1 * scale, m2 * scale
        near[6], near[7], near[8], near[9] = d0 * scale, d1 * scale, d2 * scale, np.float64(away) * scale
        if near[9] < 2.5 * margin:
            _meet_lattice(P, linear, margin, near, work)
        far = 1.0 / reach[n]
        w = fade(max(near[9] - min(margin, 0.5 * far), 0.0) * reach[n], settings[2], settings[3], settings[4])
        r0, r1, r2 = near[6], near[7], near[8]
        m = n * stride
        for i in range(3):
            out[n, i] = 0.0
        for i in range(3):
            v = frame[1, i] + frame[5 + i, 0] * y0 + frame[5 + i, 1] * y1 + frame[5 + i, 2] * y2
            v += frame[8 + i, 0] * r0 + frame[8 + i, 1] * r1 + frame[8 + i, 2] * r2
            for o in range(3):
                out[n, o] += np.float32(w * v * dz[m, o, i])


@parallel_njit(lambda places, *_: (len(places) + 255) // 256, **FAST)
def fill_slice(begin, end, places, reach, dz, frame, samples, P, linear, settings, out):
    """Writes dz/ds [G^3,3] of one slice, float32.

    places [N,3] of the nodes in the world; reach [N], their 1 / d_o, -1 where nothing moves; dz [N or 1,3,3],
    dz/dx; frame [11,3]: c, dc/ds, F^-1, dF/ds, F; samples [30,M] of the lattice: y, u, lengths of dx/du,
    (dy/du)^-1, velocity in the frame and its slope in u; P [2,nz+2,ny+2,nx+2,3], padded control points in
    the frame and their velocities; settings [5]: blur, a squared length; margin, a length; a, b and width of
    the falloff.
    """
    local, work = np.empty(10), np.empty((11, 9))
    for batch in range(begin, end):
        _fill_batch(
            places, reach, dz, frame, samples, P, linear, settings, out, np.intp(256 * batch), local, work
        )
