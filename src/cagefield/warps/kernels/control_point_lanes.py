"""The march of `kernels.control_points` without Jacobians, `LANES` points at a time, for lattices' nodes.

The innermost loops run over the points, have no branches, and keep each number of all of them in one array,
so that compilers use vector instructions. Blocks that nothing reaches at a time are left out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.numba_cache import FAST, njit
from cagefield.compute.parallel_kernels import parallel_njit
from cagefield.typing import Array, Float32
from cagefield.warps.control_point_motion import DISTANCE_POWER
from cagefield.warps.falloff_curves import ROOT_END
from cagefield.warps.kernels.control_points import PLACES, PLANES, RATES, SLOPE
from cagefield.warps.kernels.detours import detour

LANES = 256

_SPHERE, _ROOT = ROOT_END["sphere"], ROOT_END["root"]
_SPHERE_SCALE, _ROOT_SCALE = _SPHERE**-1.5, _ROOT**-1.5
_HALF_POWER = DISTANCE_POWER // 2


@njit(**FAST)
def _weigh(number: int, s: Array) -> None:
    """Put the weights of a curve in the place of s [LANES] in [0,1]; numbers as in `FALLOFF_CURVES`."""
    if number == 0:
        for i in range(LANES):
            s[i] = s[i] * s[i] * (3.0 - 2.0 * s[i])
    elif number == 1:
        for i in range(LANES):
            q = s[i] * (2.0 - s[i])
            root, low = np.sqrt(max(q, _SPHERE)), q * q * (2.5 - 1.5 / _SPHERE * q) * _SPHERE_SCALE
            s[i] = low if q < _SPHERE else root
    elif number == 2:
        for i in range(LANES):
            q = s[i]
            root, low = np.sqrt(max(q, _ROOT)), q * q * (2.5 - 1.5 / _ROOT * q) * _ROOT_SCALE
            s[i] = low if q < _ROOT else root
    elif number == 3:
        for i in range(LANES):
            s[i] = s[i] * s[i]


@njit(**FAST)
def _velocities(
    head: Array,
    now: Array,
    n: int,
    x: Array,
    v: Array,
    y: Array,
    e: Array,
    near: Array,
    w: Array,
    total: Array,
    nodes: Float32,
    place: Array,
) -> bool:
    """Write the velocities v [3,LANES] at x [3,LANES]; False, and nothing is written, where nothing moves.

    y, e [3,LANES] and near, w, total [LANES] are room.
    """
    for a in range(3):
        w0, w1, w2 = now[12 + 3 * a], now[13 + 3 * a], now[14 + 3 * a]
        shift = w0 * now[0] + w1 * now[1] + w2 * now[2]
        for i in range(LANES):
            y[a, i] = w0 * x[0, i] + w1 * x[1, i] + w2 * x[2, i] - shift
    for j in range(n):
        p0, p1, p2 = now[PLACES + 3 * j], now[PLACES + 3 * j + 1], now[PLACES + 3 * j + 2]
        for i in range(LANES):
            a0, a1, a2 = y[0, i] - p0, y[1, i] - p1, y[2, i] - p2
            d2 = a0 * a0 + a1 * a1 + a2 * a2
            near[i] = d2 if j == 0 else min(near[i], d2)
    r, reach, fade = head[1], head[2], head[3]
    closest = near[0]
    for i in range(LANES):
        closest = min(closest, near[i])
    if closest >= reach * reach:
        return False
    least = 1e-24 * r * r
    if n == 1:
        for i in range(LANES):
            w[i] = max(1.0 - np.sqrt(near[i]) / r, 0.0)
    else:
        for i in range(LANES):
            near[i] = max(near[i], least)
            total[i] = 0.0
        for j in range(n):
            p0, p1, p2 = now[PLACES + 3 * j], now[PLACES + 3 * j + 1], now[PLACES + 3 * j + 2]
            for i in range(LANES):
                a0, a1, a2 = y[0, i] - p0, y[1, i] - p1, y[2, i] - p2
                q = near[i] / max(a0 * a0 + a1 * a1 + a2 * a2, least)
                total[i] += q**_HALF_POWER
        for i in range(LANES):
            w[i] = max(1.0 - np.sqrt(near[i]) * total[i] ** (-1.0 / DISTANCE_POWER) / r, 0.0)
    if head[4] > 0.0:
        _blend(head, now, n, y, e, near, total, least)
    else:
        for a in range(3):
            for i in range(LANES):
                e[a, i] = head[RATES + a]
    if len(nodes):
        t = now[PLACES + 3 * n]
        for i in range(LANES):
            if w[i] > 0.0:
                q0, q1, q2 = y[0, i] - t * e[0, i], y[1, i] - t * e[1, i], y[2, i] - t * e[2, i]
                w[i] = max(w[i] - detour(nodes, place, q0, q1, q2) / r, 0.0)
    _weigh(int(head[0]), w)
    if fade > 0.0:
        for k in range(PLANES, PLANES + 24, 4):
            n0, n1, n2, offset = head[k], head[k + 1], head[k + 2], head[k + 3]
            for i in range(LANES):
                s = (offset - n0 * x[0, i] - n1 * x[1, i] - n2 * x[2, i]) / fade
                s = min(max(s, 0.0), 1.0)
                w[i] *= s * s * (3.0 - 2.0 * s)
    for a in range(3):
        F, D = 3 + 3 * a, SLOPE + 3 * a
        f0, f1, f2, d0, d1, d2 = now[F], now[F + 1], now[F + 2], now[D], now[D + 1], now[D + 2]
        rate = head[5 + a]
        for i in range(LANES):
            along = d0 * y[0, i] + d1 * y[1, i] + d2 * y[2, i]
            v[a, i] = w[i] * (rate + along + f0 * e[0, i] + f1 * e[1, i] + f2 * e[2, i])
    return True


@njit(**FAST)
def _blend(
    head: Array, now: Array, n: int, y: Array, e: Array, near: Array, total: Array, least: float
) -> None:
    """Write the blended motion e [3,LANES] of the points."""
    for i in range(LANES):
        total[i] = e[0, i] = e[1, i] = e[2, i] = 0.0
    for j in range(n):
        p0, p1, p2 = now[PLACES + 3 * j], now[PLACES + 3 * j + 1], now[PLACES + 3 * j + 2]
        e0, e1, e2 = head[RATES + 3 * j], head[RATES + 3 * j + 1], head[RATES + 3 * j + 2]
        for i in range(LANES):
            a0, a1, a2 = y[0, i] - p0, y[1, i] - p1, y[2, i] - p2
            q = near[i] / max(a0 * a0 + a1 * a1 + a2 * a2, least)
            b = q * q
            total[i] += b
            e[0, i] += b * e0
            e[1, i] += b * e1
            e[2, i] += b * e2
    for i in range(LANES):
        e[0, i] /= total[i]
        e[1, i] /= total[i]
        e[2, i] /= total[i]


@parallel_njit(lambda x, *_: (len(x) + LANES - 1) // LANES, **FAST)
def march_lanes(
    begin: int,
    end: int,
    x: Array,
    head: Array,
    moments: Array,
    steps: NDArray[np.float64],
    stride: int,
    nodes: Float32,
    place: Array,
) -> None:
    """Take points x [N,3] through `steps` [K], in place; arguments as for `control_points.march`.

    `stride`, coprime to the number of blocks, is the order in which they are taken: those of a thread are
    from everywhere.
    """
    n = (moments.shape[1] - PLACES) // 3
    blocks = (len(x) + LANES - 1) // LANES
    room, flat = np.empty((6, 3, LANES)), np.empty((3, LANES))
    here, at, v, total, y, e = room[0], room[1], room[2], room[3], room[4], room[5]
    near, w, sums = flat[0], flat[1], flat[2]
    for turn in range(begin, end):
        first = (turn * stride) % blocks * LANES
        count = min(LANES, len(x) - first)
        for i in range(LANES):
            row = first + min(i, count - 1)
            here[0, i], here[1, i], here[2, i] = x[row, 0], x[row, 1], x[row, 2]
        for k in range(len(steps)):
            h = steps[k]
            moves, going = False, False
            for stage in range(4):
                share = h if stage == 3 else 0.5 * h
                weight = 1.0 if stage == 0 or stage == 3 else 2.0
                moment = 2 * k + (stage + 1) // 2
                for a in range(3):
                    for i in range(LANES):
                        at[a, i] = here[a, i] + share * v[a, i] if going else here[a, i]
                going = _velocities(head, moments[moment], n, at, v, y, e, near, w, sums, nodes, place)
                if going:
                    for a in range(3):
                        for i in range(LANES):
                            total[a, i] = weight * v[a, i] + (total[a, i] if moves else 0.0)
                    moves = True
            if moves:
                for a in range(3):
                    for i in range(LANES):
                        here[a, i] += h / 6.0 * total[a, i]
        for i in range(count):
            x[first + i, 0], x[first + i, 1], x[first + i, 2] = here[0, i], here[1, i], here[2, i]
