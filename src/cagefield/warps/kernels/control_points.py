"""The march of points through the velocity of control points, compiled; see `control_point_velocity`.

`head` holds the curve's number, r, the reach, the width of the outer cage's weight, whether the points'
velocities differ, dc/dt [3], the six planes [6,4] (normal, offset) and dy/dt [n,3]. A row of `moments`, one
for each knot and the middle of each step, holds c [3], F [9], F^-1 [9], dF/dt [9], y [n,3] and t. `nodes`
[X,Y,Z] are the detours of connected points, at `place` (see `kernels.detours`); none of others. Float64, as
the oracle.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.numba_cache import FAST, njit
from cagefield.compute.parallel_kernels import parallel_njit
from cagefield.typing import Array, Float32
from cagefield.warps.control_point_motion import DISTANCE_POWER
from cagefield.warps.falloff_curves import ROOT_END
from cagefield.warps.kernels.detours import detour_slope

PLANES, RATES = 8, 32
INVERSE, SLOPE, PLACES = 12, 21, 30

_SPHERE, _ROOT = ROOT_END["sphere"], ROOT_END["root"]
_HALF_POWER = DISTANCE_POWER // 2


@njit(cache=True, fastmath=True, error_model="numpy", inline="always")
def _bounded_root(q: float, end: float) -> tuple[float, float]:
    if q < end:
        u = q / end
        return np.sqrt(end) * u * u * (2.5 - 1.5 * u), u * (5.0 - 4.5 * u) / np.sqrt(end)
    root = np.sqrt(q)
    return root, 0.5 / root


@njit(cache=True, fastmath=True, error_model="numpy", inline="always")
def _curve(number: int, s: float) -> tuple[float, float]:
    """(weight, slope) at 0 < s <= 1; numbers as in `FALLOFF_CURVES`."""
    if number == 0:
        return s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s)
    if number == 1:
        w, slope = _bounded_root(s * (2.0 - s), _SPHERE)
        return w, slope * 2.0 * (1.0 - s)
    if number == 2:
        return _bounded_root(s, _ROOT)
    if number == 3:
        return s * s, 2.0 * s
    return s, 1.0


@njit(**FAST)
def _velocity(
    head: Array,
    now: Array,
    n: int,
    x: Array,
    v: Array,
    G: Array,
    e: Array,
    eG: Array,
    nodes: Float32,
    place: Array,
) -> bool:
    """Write v [3] and dv/dx [3,3] at x [3]; False where nothing moves, and nothing is written.

    e [3] and eG [3,3] are room for the blend and its slope.
    """
    x0, x1, x2 = x[0] - now[0], x[1] - now[1], x[2] - now[2]
    y0 = now[12] * x0 + now[13] * x1 + now[14] * x2
    y1 = now[15] * x0 + now[16] * x1 + now[17] * x2
    y2 = now[18] * x0 + now[19] * x1 + now[20] * x2
    nearest = 1e300
    for j in range(n):
        a0, a1, a2 = y0 - now[30 + 3 * j], y1 - now[31 + 3 * j], y2 - now[32 + 3 * j]
        nearest = min(nearest, a0 * a0 + a1 * a1 + a2 * a2)
    r, reach, fade = head[1], head[2], head[3]
    if nearest >= reach * reach:
        return False
    least = 1e-24 * r * r
    nearest = max(nearest, least)
    d = np.sqrt(nearest)
    t0, t1, t2 = 0.0, 0.0, 0.0  # dd/dy
    blended = head[4] > 0.0
    if n == 1:
        t0, t1, t2 = (y0 - now[30]) / d, (y1 - now[31]) / d, (y2 - now[32]) / d
    else:
        total = 0.0
        for j in range(n):
            a0, a1, a2 = y0 - now[30 + 3 * j], y1 - now[31 + 3 * j], y2 - now[32 + 3 * j]
            q = nearest / max(a0 * a0 + a1 * a1 + a2 * a2, least)
            total += q**_HALF_POWER
        d *= total ** (-1.0 / DISTANCE_POWER)
        if d >= r:
            return False
        for j in range(n):
            a0, a1, a2 = y0 - now[30 + 3 * j], y1 - now[31 + 3 * j], y2 - now[32 + 3 * j]
            q = d * d / max(a0 * a0 + a1 * a1 + a2 * a2, least)
            share = q ** (_HALF_POWER + 1) / d
            t0, t1, t2 = t0 + share * a0, t1 + share * a1, t2 + share * a2
    if d >= r:
        return False
    for i in range(3):
        e[i] = head[RATES + i]
        eG[i, 0] = eG[i, 1] = eG[i, 2] = 0.0
    if blended:
        total = 0.0
        e[0] = e[1] = e[2] = 0.0
        for j in range(n):
            a0, a1, a2 = y0 - now[30 + 3 * j], y1 - now[31 + 3 * j], y2 - now[32 + 3 * j]
            q = nearest / max(a0 * a0 + a1 * a1 + a2 * a2, least)
            total += q * q
            for i in range(3):
                e[i] += q * q * head[RATES + 3 * j + i]
        for i in range(3):
            e[i] /= total
        for j in range(n):
            a0, a1, a2 = y0 - now[30 + 3 * j], y1 - now[31 + 3 * j], y2 - now[32 + 3 * j]
            d2 = max(a0 * a0 + a1 * a1 + a2 * a2, least)
            q = nearest / d2
            share = -4.0 * q * q / (total * d2)
            for i in range(3):
                left = share * (head[RATES + 3 * j + i] - e[i])
                eG[i, 0] += left * a0
                eG[i, 1] += left * a1
                eG[i, 2] += left * a2
    if len(nodes):
        t = now[PLACES + 3 * n]
        E, E0, E1, E2 = detour_slope(nodes, place, y0 - t * e[0], y1 - t * e[1], y2 - t * e[2])
        d += E
        if d >= r:
            return False
        t0 += E0 - t * (E0 * eG[0, 0] + E1 * eG[1, 0] + E2 * eG[2, 0])
        t1 += E1 - t * (E0 * eG[0, 1] + E1 * eG[1, 1] + E2 * eG[2, 1])
        t2 += E2 - t * (E0 * eG[0, 2] + E1 * eG[1, 2] + E2 * eG[2, 2])
    w, slope = _curve(int(head[0]), 1.0 - d / r)
    u = 1.0
    u0, u1, u2 = 0.0, 0.0, 0.0
    if fade > 0.0:
        for k in range(6):
            at = PLANES + 4 * k
            away = head[at + 3] - head[at] * x[0] - head[at + 1] * x[1] - head[at + 2] * x[2]
            s = away / fade
            if s <= 0.0:
                return False
            if s < 1.0:
                one = s * s * (3.0 - 2.0 * s)
                du = -6.0 * s * (1.0 - s) / fade * u
                u0 = u0 * one + du * head[at]
                u1 = u1 * one + du * head[at + 1]
                u2 = u2 * one + du * head[at + 2]
                u *= one
    w_all = u * w
    for i in range(3):
        F, D = 3 + 3 * i, SLOPE + 3 * i
        v[i] = head[5 + i] + now[D] * y0 + now[D + 1] * y1 + now[D + 2] * y2
        v[i] += now[F] * e[0] + now[F + 1] * e[1] + now[F + 2] * e[2]
    down = -slope / r * u
    g0 = down * (t0 * now[12] + t1 * now[15] + t2 * now[18]) + w * u0
    g1 = down * (t0 * now[13] + t1 * now[16] + t2 * now[19]) + w * u1
    g2 = down * (t0 * now[14] + t1 * now[17] + t2 * now[20]) + w * u2
    for i in range(3):
        m0, m1, m2 = now[SLOPE + 3 * i], now[SLOPE + 3 * i + 1], now[SLOPE + 3 * i + 2]
        if blended:
            for k in range(3):
                f = now[3 + 3 * i + k]
                m0, m1, m2 = m0 + f * eG[k, 0], m1 + f * eG[k, 1], m2 + f * eG[k, 2]
        G[i, 0] = w_all * (m0 * now[12] + m1 * now[15] + m2 * now[18]) + v[i] * g0
        G[i, 1] = w_all * (m0 * now[13] + m1 * now[16] + m2 * now[19]) + v[i] * g1
        G[i, 2] = w_all * (m0 * now[14] + m1 * now[17] + m2 * now[20]) + v[i] * g2
    for i in range(3):
        v[i] *= w_all
    return True


@njit(**FAST)
def _runge_kutta(
    x: Array,
    J: Array,
    head: Array,
    moments: Array,
    m: int,
    h: float,
    n: int,
    room: Array,
    nodes: Float32,
    place: Array,
) -> None:
    """One step of a point x [3] and its Jacobian J [3,3] from moment m on, in place; room [15,3]."""
    at, v, e = room[0], room[1], room[2]
    G, eG, kJ, dJ = room[3:6], room[6:9], room[9:12], room[12:15]
    d0 = d1 = d2 = 0.0
    k0 = k1 = k2 = 0.0
    moves = False
    kJ[:] = 0.0
    dJ[:] = 0.0
    for stage in range(4):
        share = h * (0.0 if stage == 0 else 1.0 if stage == 3 else 0.5)
        weight = 1.0 if stage == 0 or stage == 3 else 2.0
        at[0], at[1], at[2] = x[0] + share * k0, x[1] + share * k1, x[2] + share * k2
        moment = m if stage == 0 else m + 2 if stage == 3 else m + 1
        if _velocity(head, moments[moment], n, at, v, G, e, eG, nodes, place):
            moves = True
            k0, k1, k2 = v[0], v[1], v[2]
            for a in range(3):
                # The columns of J are carried along independently.
                c0 = J[0, a] + share * kJ[0, a]
                c1 = J[1, a] + share * kJ[1, a]
                c2 = J[2, a] + share * kJ[2, a]
                for i in range(3):
                    kJ[i, a] = G[i, 0] * c0 + G[i, 1] * c1 + G[i, 2] * c2
                    dJ[i, a] += weight * kJ[i, a]
        else:
            k0 = k1 = k2 = 0.0
            kJ[:] = 0.0
        d0, d1, d2 = d0 + weight * k0, d1 + weight * k1, d2 + weight * k2
    if moves:
        x[0] += h / 6.0 * d0
        x[1] += h / 6.0 * d1
        x[2] += h / 6.0 * d2
        for i in range(3):
            for a in range(3):
                J[i, a] += h / 6.0 * dJ[i, a]


@parallel_njit(lambda x, *_: len(x), **FAST)
def march(
    begin: int,
    end: int,
    x: Array,
    J: Array,
    head: Array,
    moments: Array,
    steps: NDArray[np.float64],
    nodes: Float32,
    place: Array,
) -> None:
    """Take points x [N,3] and Jacobians J [N,3,3] through `steps` [K], in place."""
    n = (moments.shape[1] - PLACES) // 3
    room = np.empty((15, 3))
    for row in range(begin, end):
        for k in range(len(steps)):
            _runge_kutta(x[row], J[row], head, moments, 2 * k, steps[k], n, room, nodes, place)
