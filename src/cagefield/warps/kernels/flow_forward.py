"""The flow of a shell for many points with their Jacobians, in float32, for CPUs (Numba).

The march of `flow_shell.FlowShell`, in Z, the affine coordinates of the outer cage; `flow_table` has the
layout of the table, and its knots give the direction of the flow: from 0 to 1 it takes canonical points to
deformed
space. D is dZ/dp of the way so far; with the velocity w V, dD/dt = w (dV/dZ) D + V (dw/dZ D).

Points are taken `POINTS_PER_BATCH` at a time: the innermost loops run over them, have no branches, and all
their
data lie in one buffer at constant offsets, so that compilers use vector instructions. Coordinates of bent
cages are followed by Newton's method from those of the last stage, `newton_steps` a stage; points that need
more
are marked as lost.

The oracle is `FlowShell.to_deformed`; of the velocity in it, `warps.flow_velocity`.
"""

from __future__ import annotations

import numpy as np

from cagefield.compute.numba_cache import FAST, njit
from cagefield.compute.parallel_kernels import parallel_njit
from cagefield.warps.flow_table import HEADER, MOMENT

f32, U = np.float32, np.uint64
POINTS_PER_BATCH = U(32)

START_NEWTON_STEPS = 8
"""Newton's steps for the coordinates at the start of a way."""

MIN_FACE_SHARE = f32(1e-6)
"""Points nearer than this to the outer cage's faces, as a share of its half-width, stay."""

# Rows of the buffer, of POINTS_PER_BATCH numbers each: the place Z and D by rows at the start of a step,
# the stage's Z,
# the coordinates z and xi, the rates of Z and D, their weighted sums, dz/dZ and dxi/dZ by rows, V, dV/dZ by
# rows, the last residual of coordinates and the largest at the end of a stage.
_Z, _D, _X, _OUTER, _INNER = (U(32 * n) for n in (0, 3, 12, 15, 18))
_K, _M, _SUM_Z, _SUM_D = (U(32 * n) for n in (21, 24, 33, 36))
_DZ, _DXI, _V, _G, _LEFT, _LOST = (U(32 * n) for n in (45, 54, 63, 66, 75, 76))
_ROWS = 77


@parallel_njit(lambda points, *_: (len(points) + 31) // 32, **FAST)
def march(begin, end, points, exact, bent_outer, bent_inner, newton_steps, followed, moved, jacobian, lost):
    """Writes the ends [N,3] of the ways of points [N,3], d(end)/d(point) [N,3,3], and where lost [N].

    bent_outer, bent_inner: True, or None where that cage is a parallelepiped: without the branches for bent
    ones the kernel takes half as long to compile. followed: the largest residual of coordinates, in units of
    xi, before the last of a stage's steps.
    """
    table = exact.astype(np.float32)
    s = np.zeros(_ROWS * 32, np.float32)
    for block in range(begin, end):
        first = block * 32
        count = min(32, len(points) - first)
        _begin(points, first, count, exact, s)
        if bent_outer is not None:
            for l in range(POINTS_PER_BATCH):
                for a in range(3):
                    s[_OUTER + U(32 * a) + l] = min(max(s[_Z + U(32 * a) + l], -f32(1.0)), f32(1.0))
            for _ in range(START_NEWTON_STEPS):
                _follow(s, _OUTER, _Z, table, U(10))
        if bent_inner is not None:
            _affine(s, _Z, _V, table, U(HEADER))
            for l in range(POINTS_PER_BATCH):
                for a in range(3):
                    s[_INNER + U(32 * a) + l] = s[_V + U(32 * a) + l]
            for _ in range(START_NEWTON_STEPS):
                _follow(s, _INNER, _V, table, U(HEADER + 10))
        for l in range(POINTS_PER_BATCH):
            s[_LOST + l] = f32(0.0)
        steps = int(table[8, 0])
        for n in range(steps):
            start = HEADER + 2 * MOMENT * n
            h = table[start + 9, 0]
            for stage in range(4):
                share = f32(0.0) if stage == 0 else (h if stage == 3 else f32(0.5) * h)
                moment = U(start + ((stage + 1) // 2) * MOMENT)
                _stage(s, share, table, moment, bent_outer, bent_inner, newton_steps)
                _slopes(
                    s,
                    share,
                    f32(2.0) if 0 < stage < 3 else f32(1.0),
                    f32(0.0) if stage == 0 else f32(1.0),
                    table,
                    moment,
                )
            sixth = h / f32(6.0)
            for i in range(U(12 * 32)):
                s[_Z + i] += sixth * s[_SUM_Z + i]
        _end(s, first, count, exact, followed, moved, jacobian, lost)


@njit(**FAST)
def _begin(points, first, count, table, s):
    """Writes Z and D = dZ/dp of the block's points, the last one's in lanes that have none."""
    for l in range(32):
        p = points[first + min(l, count - 1)]
        x, y, z = p[0] - table[3, 0], p[1] - table[3, 1], p[2] - table[3, 2]
        for a in range(3):
            s[_Z + U(32 * a + l)] = table[a, 0] * x + table[a, 1] * y + table[a, 2] * z
            for b in range(3):
                s[_D + U(32 * (3 * a + b) + l)] = table[a, b]


@njit(**FAST)
def _end(s, first, count, table, followed, moved, jacobian, lost):
    """Writes p = c + F Z and F D of the block's points."""
    for l in range(count):
        for a in range(3):
            p = table[3, a]
            for c in range(3):
                p += table[4 + a, c] * s[_Z + U(32 * c + l)]
            moved[first + l, a] = p
            for b in range(3):
                slope = f32(0.0)
                for c in range(3):
                    slope += table[4 + a, c] * s[_D + U(32 * (3 * c + b) + l)]
                jacobian[first + l, a, b] = slope
        lost[first + l] = s[_LOST + U(l)] > followed


@njit(**FAST)
def _affine(s, source, to, table, row):
    """Writes rows . x + [3] of the table, x the three lanes' rows at `source`."""
    for a in range(U(3)):
        r0, r1, r2 = table[row + a, 0], table[row + a, 1], table[row + a, 2]
        c = table[row + U(3), a]
        for l in range(POINTS_PER_BATCH):
            s[to + U(32) * a + l] = (
                r0 * s[source + l] + r1 * s[source + U(32) + l] + r2 * s[source + U(64) + l] + c
            )


@njit(**FAST)
def _stage(s, share, table, moment, bent_outer, bent_inner, newton_steps):
    """Writes the stage's coordinates, their slopes, V and its slope."""
    for i in range(U(96)):
        s[_X + i] = s[_Z + i] + share * s[_K + i]
    _affine(s, _X, _V, table, moment)
    # V holds the straightened coordinates of the inner cage until they are known.
    if bent_inner is not None:
        for _ in range(newton_steps):
            _follow(s, _INNER, _V, table, moment + U(10))
        for l in range(POINTS_PER_BATCH):
            s[_LOST + l] = max(s[_LOST + l], s[_LEFT + l])
        _straightened_inverse(s, _INNER, table, moment + U(10), _G)
        for a in range(U(3)):
            for b in range(U(3)):
                r0, r1, r2 = table[moment, b], table[moment + U(1), b], table[moment + U(2), b]
                for l in range(POINTS_PER_BATCH):
                    at = _G + U(96) * a + l
                    s[_DXI + U(32) * (U(3) * a + b) + l] = (
                        s[at] * r0 + s[at + U(32)] * r1 + s[at + U(64)] * r2
                    )
    else:
        for i in range(U(96)):
            s[_INNER + i] = s[_V + i]
        for a in range(U(3)):
            for b in range(U(3)):
                value = table[moment + a, b]
                for l in range(POINTS_PER_BATCH):
                    s[_DXI + U(32) * (U(3) * a + b) + l] = value
    if bent_outer is not None:
        for _ in range(newton_steps):
            _follow(s, _OUTER, _X, table, U(10))
        for l in range(POINTS_PER_BATCH):
            s[_LOST + l] = max(s[_LOST + l], s[_LEFT + l])
        _straightened_inverse(s, _OUTER, table, U(10), _DZ)
    else:
        for i in range(U(96)):
            s[_OUTER + i] = s[_X + i]
        for a in range(U(3)):
            for b in range(U(3)):
                value = f32(1.0) if a == b else f32(0.0)
                for l in range(POINTS_PER_BATCH):
                    s[_DZ + U(32) * (U(3) * a + b) + l] = value
    _affine(s, _X, _V, table, moment + U(4))
    for a in range(U(3)):
        for b in range(U(3)):
            value = table[moment + U(4) + a, b]
            for l in range(POINTS_PER_BATCH):
                s[_G + U(32) * (U(3) * a + b) + l] = value
    if bent_inner is not None:
        _add_bend(s, table, moment + U(20))


@njit(**FAST)
def _add_bend(s, table, rows):
    """Adds the velocity of the inner cage's bend, at the clamped coordinates, to V, its slope to dV/dZ."""
    k = table[20:24]
    for a in range(U(3)):
        # Row a of the matrix, times the bend's four vectors.
        w0 = table[rows + a, 0] * k[0, 0] + table[rows + a, 1] * k[0, 1] + table[rows + a, 2] * k[0, 2]
        w1 = table[rows + a, 0] * k[1, 0] + table[rows + a, 1] * k[1, 1] + table[rows + a, 2] * k[1, 2]
        w2 = table[rows + a, 0] * k[2, 0] + table[rows + a, 1] * k[2, 1] + table[rows + a, 2] * k[2, 2]
        w3 = table[rows + a, 0] * k[3, 0] + table[rows + a, 1] * k[3, 1] + table[rows + a, 2] * k[3, 2]
        for l in range(POINTS_PER_BATCH):
            x, y, z = s[_INNER + l], s[_INNER + U(32) + l], s[_INNER + U(64) + l]
            cx, cy, cz = (
                min(max(x, -f32(1.0)), f32(1.0)),
                min(max(y, -f32(1.0)), f32(1.0)),
                min(max(z, -f32(1.0)), f32(1.0)),
            )
            s[_V + U(32) * a + l] += cx * cy * w0 + cx * cz * w1 + cy * cz * w2 + cx * cy * cz * w3
            gx = (cy * w0 + cz * w1 + cy * cz * w3) if abs(x) <= f32(1.0) else f32(0.0)
            gy = (cx * w0 + cz * w2 + cx * cz * w3) if abs(y) <= f32(1.0) else f32(0.0)
            gz = (cx * w1 + cy * w2 + cx * cy * w3) if abs(z) <= f32(1.0) else f32(0.0)
            for b in range(U(3)):
                s[_G + U(32) * (U(3) * a + b) + l] += (
                    gx * s[_DXI + U(32) * b + l]
                    + gy * s[_DXI + U(32) * (U(3) + b) + l]
                    + gz * s[_DXI + U(32) * (U(6) + b) + l]
                )


@njit(**FAST)
def _slopes(s, share, weight, kept, table, moment):
    """Writes the rates of Z and D at the stage, and adds them to the step's sums, or begins those."""
    H0, H1, H2 = table[7, 0], table[7, 1], table[7, 2]
    h0, h1, h2 = table[moment + U(8), 0], table[moment + U(8), 1], table[moment + U(8), 2]
    per_width, end, middle = table[8, 2], table[9, 0], table[9, 2]
    last = f32(1.0) - end - middle
    for l in range(POINTS_PER_BATCH):
        z0, z1, z2 = s[_OUTER + l], s[_OUTER + U(32) + l], s[_OUTER + U(64) + l]
        x0, x1, x2 = s[_INNER + l], s[_INNER + U(32) + l], s[_INNER + U(64) + l]
        f0, f1, f2 = H0 * (f32(1.0) - z0 * z0), H1 * (f32(1.0) - z1 * z1), H2 * (f32(1.0) - z2 * z2)
        moves = f32(1.0) if min(f0, f1, f2) > MIN_FACE_SHARE else f32(0.0)
        i0, i1, i2 = (
            f32(1.0) / max(f0, MIN_FACE_SHARE),
            f32(1.0) / max(f1, MIN_FACE_SHARE),
            f32(1.0) / max(f2, MIN_FACE_SHARE),
        )
        e0, e1, e2 = (
            h0 * max(abs(x0) - f32(1.0), f32(0.0)),
            h1 * max(abs(x1) - f32(1.0), f32(0.0)),
            h2 * max(abs(x2) - f32(1.0), f32(0.0)),
        )
        E = e0 * e0 * e0 * e0 + e1 * e1 * e1 * e1 + e2 * e2 * e2 * e2
        F = i0 * i0 * i0 * i0 + i1 * i1 * i1 * i1 + i2 * i2 * i2 * i2
        q = np.sqrt(np.sqrt(E * F))
        r = f32(1.0) / (f32(1.0) + q)
        g = max((r - f32(1.0)) * per_width + f32(1.0), f32(0.0))
        u = max(f32(2.0) * g - f32(1.0), f32(0.0))
        u8 = u * u
        u8 *= u8
        u8 *= u8
        w = moves * (g * (end + middle * g * (f32(3.0) - f32(2.0) * g)) + last * u8 * u)
        slope = end + f32(6.0) * middle * g * (f32(1.0) - g) + f32(18.0) * last * u8
        slope *= (moves if g > f32(0.0) else f32(0.0)) * (-r * r * per_width * q)
        per_E, per_F = slope / max(E, f32(1e-30)), f32(2.0) * slope / F
        # The weight's gradient in xi, and in z.
        e0 = per_E * h0 * e0 * e0 * e0 * (f32(1.0) if x0 > f32(0.0) else -f32(1.0))
        e1 = per_E * h1 * e1 * e1 * e1 * (f32(1.0) if x1 > f32(0.0) else -f32(1.0))
        e2 = per_E * h2 * e2 * e2 * e2 * (f32(1.0) if x2 > f32(0.0) else -f32(1.0))
        f0 = per_F * H0 * z0 * i0 * i0 * i0 * i0 * i0
        f1 = per_F * H1 * z1 * i1 * i1 * i1 * i1 * i1
        f2 = per_F * H2 * z2 * i2 * i2 * i2 * i2 * i2
        d0 = e0 * s[_DXI + l] + e1 * s[_DXI + U(96) + l] + e2 * s[_DXI + U(192) + l]
        d0 += f0 * s[_DZ + l] + f1 * s[_DZ + U(96) + l] + f2 * s[_DZ + U(192) + l]
        d1 = e0 * s[_DXI + U(32) + l] + e1 * s[_DXI + U(128) + l] + e2 * s[_DXI + U(224) + l]
        d1 += f0 * s[_DZ + U(32) + l] + f1 * s[_DZ + U(128) + l] + f2 * s[_DZ + U(224) + l]
        d2 = e0 * s[_DXI + U(64) + l] + e1 * s[_DXI + U(160) + l] + e2 * s[_DXI + U(256) + l]
        d2 += f0 * s[_DZ + U(64) + l] + f1 * s[_DZ + U(160) + l] + f2 * s[_DZ + U(256) + l]
        V0, V1, V2 = s[_V + l], s[_V + U(32) + l], s[_V + U(64) + l]
        s[_K + l], s[_K + U(32) + l], s[_K + U(64) + l] = w * V0, w * V1, w * V2
        s[_SUM_Z + l] = kept * s[_SUM_Z + l] + weight * w * V0
        s[_SUM_Z + U(32) + l] = kept * s[_SUM_Z + U(32) + l] + weight * w * V1
        s[_SUM_Z + U(64) + l] = kept * s[_SUM_Z + U(64) + l] + weight * w * V2
        # d(w V)/dZ.
        s[_G + l] = w * s[_G + l] + V0 * d0
        s[_G + U(32) + l] = w * s[_G + U(32) + l] + V0 * d1
        s[_G + U(64) + l] = w * s[_G + U(64) + l] + V0 * d2
        s[_G + U(96) + l] = w * s[_G + U(96) + l] + V1 * d0
        s[_G + U(128) + l] = w * s[_G + U(128) + l] + V1 * d1
        s[_G + U(160) + l] = w * s[_G + U(160) + l] + V1 * d2
        s[_G + U(192) + l] = w * s[_G + U(192) + l] + V2 * d0
        s[_G + U(224) + l] = w * s[_G + U(224) + l] + V2 * d1
        s[_G + U(256) + l] = w * s[_G + U(256) + l] + V2 * d2
    for b in range(U(3)):
        at = U(32) * b
        for l in range(POINTS_PER_BATCH):
            y0 = s[_D + at + l] + share * s[_M + at + l]
            y1 = s[_D + U(96) + at + l] + share * s[_M + U(96) + at + l]
            y2 = s[_D + U(192) + at + l] + share * s[_M + U(192) + at + l]
            m0 = s[_G + l] * y0 + s[_G + U(32) + l] * y1 + s[_G + U(64) + l] * y2
            m1 = s[_G + U(96) + l] * y0 + s[_G + U(128) + l] * y1 + s[_G + U(160) + l] * y2
            m2 = s[_G + U(192) + l] * y0 + s[_G + U(224) + l] * y1 + s[_G + U(256) + l] * y2
            s[_M + at + l], s[_M + U(96) + at + l], s[_M + U(192) + at + l] = m0, m1, m2
            s[_SUM_D + at + l] = kept * s[_SUM_D + at + l] + weight * m0
            s[_SUM_D + U(96) + at + l] = kept * s[_SUM_D + U(96) + at + l] + weight * m1
            s[_SUM_D + U(192) + at + l] = kept * s[_SUM_D + U(192) + at + l] + weight * m2


@njit(inline="always", **FAST)
def _columns(x, y, z, table, K):
    """The columns of dy/dxi at xi = (x, y, z), for the form at a row of the table; see `trilinear_bend`."""
    cx, cy, cz = (
        min(max(x, -f32(1.0)), f32(1.0)),
        min(max(y, -f32(1.0)), f32(1.0)),
        min(max(z, -f32(1.0)), f32(1.0)),
    )
    in_x, in_y, in_z = abs(x) <= f32(1.0), abs(y) <= f32(1.0), abs(z) <= f32(1.0)
    a0, a1, a2 = table[K, 0], table[K, 1], table[K, 2]
    b0, b1, b2 = table[K + U(1), 0], table[K + U(1), 1], table[K + U(1), 2]
    c0, c1, c2 = table[K + U(2), 0], table[K + U(2), 1], table[K + U(2), 2]
    g0, g1, g2 = table[K + U(3), 0], table[K + U(3), 1], table[K + U(3), 2]
    u0 = f32(1.0) + (cy * a0 + cz * b0 + cy * cz * g0 if in_x else f32(0.0))
    u1 = (
        cy * a1 + cz * b1 + cy * cz * g1
        if in_x
        else (table[K + U(5), 1] if x > f32(0.0) else table[K + U(4), 1])
    )
    u2 = (
        cy * a2 + cz * b2 + cy * cz * g2
        if in_x
        else (table[K + U(5), 2] if x > f32(0.0) else table[K + U(4), 2])
    )
    v0 = (
        cx * a0 + cz * c0 + cx * cz * g0
        if in_y
        else (table[K + U(7), 0] if y > f32(0.0) else table[K + U(6), 0])
    )
    v1 = f32(1.0) + (cx * a1 + cz * c1 + cx * cz * g1 if in_y else f32(0.0))
    v2 = (
        cx * a2 + cz * c2 + cx * cz * g2
        if in_y
        else (table[K + U(7), 2] if y > f32(0.0) else table[K + U(6), 2])
    )
    w0 = (
        cx * b0 + cy * c0 + cx * cy * g0
        if in_z
        else (table[K + U(9), 0] if z > f32(0.0) else table[K + U(8), 0])
    )
    w1 = (
        cx * b1 + cy * c1 + cx * cy * g1
        if in_z
        else (table[K + U(9), 1] if z > f32(0.0) else table[K + U(8), 1])
    )
    w2 = f32(1.0) + (cx * b2 + cy * c2 + cx * cy * g2 if in_z else f32(0.0))
    return u0, u1, u2, v0, v1, v2, w0, w1, w2


@njit(inline="always", **FAST)
def _rows(u0, u1, u2, v0, v1, v2, w0, w1, w2):
    """The rows of [u v w]^-1, by Cramer's rule; a determinant under 1e-6 is held there."""
    p0, p1, p2 = v1 * w2 - v2 * w1, v2 * w0 - v0 * w2, v0 * w1 - v1 * w0
    scale = f32(1.0) / max(u0 * p0 + u1 * p1 + u2 * p2, f32(1e-6))
    return (
        p0 * scale,
        p1 * scale,
        p2 * scale,
        (w1 * u2 - w2 * u1) * scale,
        (w2 * u0 - w0 * u2) * scale,
        (w0 * u1 - w1 * u0) * scale,
        (u1 * v2 - u2 * v1) * scale,
        (u2 * v0 - u0 * v2) * scale,
        (u0 * v1 - u1 * v0) * scale,
    )


@njit(**FAST)
def _straightened_inverse(s, xi, table, K, to):
    """Writes (dy/dxi)^-1 [3,3], by rows, at the coordinates in the rows `xi`."""
    for l in range(POINTS_PER_BATCH):
        x, y, z = s[xi + l], s[xi + U(32) + l], s[xi + U(64) + l]
        u0, u1, u2, v0, v1, v2, w0, w1, w2 = _columns(x, y, z, table, K)
        r = _rows(u0, u1, u2, v0, v1, v2, w0, w1, w2)
        s[to + l], s[to + U(32) + l], s[to + U(64) + l] = r[0], r[1], r[2]
        s[to + U(96) + l], s[to + U(128) + l], s[to + U(160) + l] = r[3], r[4], r[5]
        s[to + U(192) + l], s[to + U(224) + l], s[to + U(256) + l] = r[6], r[7], r[8]


@njit(**FAST)
def _follow(s, xi, target, table, K):
    """One of Newton's steps of the coordinates in the rows `xi` towards y(xi) = those in `target`."""
    k = table[K : K + U(10)]
    for l in range(POINTS_PER_BATCH):
        x, y, z = s[xi + l], s[xi + U(32) + l], s[xi + U(64) + l]
        cx, cy, cz = (
            min(max(x, -f32(1.0)), f32(1.0)),
            min(max(y, -f32(1.0)), f32(1.0)),
            min(max(z, -f32(1.0)), f32(1.0)),
        )
        u0, u1, u2, v0, v1, v2, w0, w1, w2 = _columns(x, y, z, table, K)
        xy, xz, yz, xyz = cx * cy, cx * cz, cy * cz, cx * cy * cz
        fx, fy, fz = x - cx, y - cy, z - cz
        r0 = x + xy * k[0, 0] + xz * k[1, 0] + yz * k[2, 0] + xyz * k[3, 0] - s[target + l]
        r1 = y + xy * k[0, 1] + xz * k[1, 1] + yz * k[2, 1] + xyz * k[3, 1] - s[target + U(32) + l]
        r2 = z + xy * k[0, 2] + xz * k[1, 2] + yz * k[2, 2] + xyz * k[3, 2] - s[target + U(64) + l]
        # Beyond a face its column is the tilt; inside, there is nothing beyond.
        r0 += fy * v0 + fz * w0
        r1 += fx * u1 + fz * w1
        r2 += fx * u2 + fy * v2
        i = _rows(u0, u1, u2, v0, v1, v2, w0, w1, w2)
        s[xi + l] = x - (i[0] * r0 + i[1] * r1 + i[2] * r2)
        s[xi + U(32) + l] = y - (i[3] * r0 + i[4] * r1 + i[5] * r2)
        s[xi + U(64) + l] = z - (i[6] * r0 + i[7] * r1 + i[8] * r2)
        s[_LEFT + l] = max(abs(r0), abs(r1), abs(r2))
