"""Interpolation of detours between nodes, compiled; see `geometry.detour_grid`.

`place` holds the first node [3] and the distance of neighbors. Float64 between float32 nodes, as the oracle.
"""

from __future__ import annotations

import numpy as np

from cagefield.compute.numba_cache import njit
from cagefield.typing import Array, Float32


@njit(cache=True, fastmath=True, error_model="numpy", inline="always")
def locate(q: float, origin: float, edge: float, n: int) -> tuple[int, float, float]:
    """(middle node, place from it in [-1/2, 1/2], 1 within the grid and 0 beyond) along an axis."""
    s = (q - origin) / edge
    within = 1.0 if 0.5 < s < n - 1.5 else 0.0
    s = min(max(s, 0.5), n - 1.5)
    base = min(max(int(np.floor(s + 0.5)), 1), n - 2)
    return base, s - base, within


@njit(cache=True, fastmath=True, error_model="numpy")
def detour(nodes: Float32, place: Array, q0: float, q1: float, q2: float) -> float:
    """E at a point."""
    i, x, _ = locate(q0, place[0], place[3], nodes.shape[0])
    j, y, _ = locate(q1, place[1], place[3], nodes.shape[1])
    k, z, _ = locate(q2, place[2], place[3], nodes.shape[2])
    x0, x1, x2 = 0.5 * (0.5 - x) ** 2, 0.75 - x * x, 0.5 * (0.5 + x) ** 2
    y0, y1, y2 = 0.5 * (0.5 - y) ** 2, 0.75 - y * y, 0.5 * (0.5 + y) ** 2
    z0, z1, z2 = 0.5 * (0.5 - z) ** 2, 0.75 - z * z, 0.5 * (0.5 + z) ** 2
    total = 0.0
    for a in range(3):
        wx = x0 if a == 0 else x1 if a == 1 else x2
        for b in range(3):
            wy = y0 if b == 0 else y1 if b == 1 else y2
            row = nodes[i + a - 1, j + b - 1]
            total += wx * wy * (z0 * row[k - 1] + z1 * row[k] + z2 * row[k + 1])
    return total


@njit(cache=True, fastmath=True, error_model="numpy")
def detour_slope(
    nodes: Float32, place: Array, q0: float, q1: float, q2: float
) -> tuple[float, float, float, float]:
    """(E, dE/dq_0, dE/dq_1, dE/dq_2) at a point."""
    edge = place[3]
    i, x, in_x = locate(q0, place[0], edge, nodes.shape[0])
    j, y, in_y = locate(q1, place[1], edge, nodes.shape[1])
    k, z, in_z = locate(q2, place[2], edge, nodes.shape[2])
    x0, x1, x2 = 0.5 * (0.5 - x) ** 2, 0.75 - x * x, 0.5 * (0.5 + x) ** 2
    y0, y1, y2 = 0.5 * (0.5 - y) ** 2, 0.75 - y * y, 0.5 * (0.5 + y) ** 2
    z0, z1, z2 = 0.5 * (0.5 - z) ** 2, 0.75 - z * z, 0.5 * (0.5 + z) ** 2
    E, g0, g1, g2 = 0.0, 0.0, 0.0, 0.0
    for a in range(3):
        wx = x0 if a == 0 else x1 if a == 1 else x2
        sx = x - 0.5 if a == 0 else -2.0 * x if a == 1 else x + 0.5
        for b in range(3):
            wy = y0 if b == 0 else y1 if b == 1 else y2
            sy = y - 0.5 if b == 0 else -2.0 * y if b == 1 else y + 0.5
            row = nodes[i + a - 1, j + b - 1]
            along = z0 * row[k - 1] + z1 * row[k] + z2 * row[k + 1]
            E += wx * wy * along
            g0 += sx * wy * along
            g1 += wx * sy * along
            g2 += wx * wy * ((z - 0.5) * row[k - 1] - 2.0 * z * row[k] + (z + 0.5) * row[k + 1])
    return E, in_x * g0 / edge, in_y * g1 / edge, in_z * g2 / edge
