"""Detours on a grid: how much longer the way through dense matter is than the straight one.

A grid of nodes x_i with values E_i, edge h, interpolated by quadratic B-splines,

    E(q) = sum_i E_i B((q - x_i) / h),    B(s) = b(s_x) b(s_y) b(s_z),
    b(s) = 3/4 - s^2 for |s| <= 1/2,  (3/2 - |s|)^2 / 2 up to 3/2,

which is C1 and within the range of its 27 nodes. dE/dq along an axis is a mean of differences E_(i+1) - E_i
of those nodes, by h: the largest of them bound |dE/dq| without a sample.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy import ndimage

from cagefield.errors import CageError
from cagefield.typing import Array, Float32

MIN_NODES = 3
"""Nodes along an axis of a grid, at least: those of one spline."""


@dataclass(frozen=True, eq=False, init=False)
class DetourGrid:
    """Detours E >= 0 at nodes, in the space of `ControlPoints.local_points`.

    Parameters
    - origin: [3], the first node.
    - edge: distance of neighboring nodes.
    - values: [X,Y,Z], at least `MIN_NODES` along each axis, finite, >= 0, in the units of `edge`; as float32.

    Beyond the grid, and in its outermost half cell, E goes on as there. Equal grids have equal numbers.
    """

    origin: Array
    edge: float
    values: Float32

    def __init__(self, origin: ArrayLike, edge: float, values: ArrayLike) -> None:
        first = np.array(origin, dtype=np.float64)
        nodes = np.array(values, dtype=np.float32, order="C")
        if first.shape != (3,) or nodes.ndim != 3 or min(nodes.shape) < MIN_NODES or not edge > 0.0:
            raise CageError(
                f"a grid of detours has an origin of 3 numbers, an edge > 0 and {MIN_NODES} or more nodes"
                f" along each of 3 axes, got {list(first.shape)}, {edge!r:.40} and {list(nodes.shape)}"
            )
        if not (np.isfinite(nodes).all() and (nodes >= 0.0).all()):
            raise CageError("detours must be finite and not negative")
        first.setflags(write=False)
        nodes.setflags(write=False)
        for name, value in (("origin", first), ("edge", float(edge)), ("values", nodes)):
            object.__setattr__(self, name, value)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, DetourGrid):
            return NotImplemented
        return self is other or self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    @cached_property
    def digest(self) -> str:
        """Digest of all numbers."""
        found = hashlib.blake2b(digest_size=16)
        found.update(repr((self.edge, self.values.shape)).encode())
        found.update(self.origin.tobytes())
        found.update(self.values.tobytes())
        return found.hexdigest()

    @cached_property
    def slope_bound(self) -> float:
        """Bound of |dE/dq| at all points; see the module."""
        squares = np.zeros(self.values.shape)
        for axis in range(3):
            steps = np.abs(np.diff(self.values.astype(np.float64), axis=axis))
            pad = [(0, 0)] * 3
            # The differences between the spline's 3 nodes along the axis.
            pad[axis] = (1, 1)
            padded = np.pad(steps, pad)
            below, above = (np.take(padded, range(k, k + squares.shape[axis]), axis=axis) for k in (0, 1))
            largest = np.maximum(below, above)
            size = [3, 3, 3]
            size[axis] = 1
            squares += ndimage.maximum_filter(largest, size=size, mode="nearest") ** 2
        return float(np.sqrt(squares.max()) / self.edge)

    def at(self, q: Array) -> tuple[Array, Array]:
        """(E [N], dE/dq [N,3]) at points q [N,3]: the oracle of the kernels."""
        n = np.array(self.values.shape)
        s = (q - self.origin) / self.edge
        inside = (s > 0.5) & (s < n - 1.5)
        s = np.clip(s, 0.5, n - 1.5)
        base = np.clip(np.floor(s + 0.5).astype(np.intp), 1, n - 2)
        f = s - base
        w = np.stack([0.5 * (0.5 - f) ** 2, 0.75 - f * f, 0.5 * (0.5 + f) ** 2])  # [3, N, axis]
        slope = np.stack([f - 0.5, -2.0 * f, f + 0.5]) / self.edge
        E, dE = np.zeros(len(q)), np.zeros((len(q), 3))
        for i, j, k in np.ndindex(3, 3, 3):
            value = self.values[base[:, 0] + i - 1, base[:, 1] + j - 1, base[:, 2] + k - 1].astype(np.float64)
            wx, wy, wz = w[i, :, 0], w[j, :, 1], w[k, :, 2]
            E += value * wx * wy * wz
            dE[:, 0] += value * slope[i, :, 0] * wy * wz
            dE[:, 1] += value * wx * slope[j, :, 1] * wz
            dE[:, 2] += value * wx * wy * slope[k, :, 2]
        return E, np.where(inside, dE, 0.0)
