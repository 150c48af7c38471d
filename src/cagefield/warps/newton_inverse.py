"""The inverse of a smooth map of space that is known with its Jacobian."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cagefield.geometry import hexahedron
from cagefield.typing import Array

STEPS = 40
"""Most steps of Newton's method; all but points in nearly flat cages need three."""

LEAST_SHARE = 1e-4
"""A step is shortened to no less than this share of Newton's."""


def inverted(
    to_canonical: Callable[[Array], tuple[Array, Array]], points: Array, start: Array, size: float
) -> tuple[Array, Array]:
    """(x [N,3] that `to_canonical` takes to points [N,3], Jacobians dx/dpoint [N,3,3]).

    Newton's method from `start` [N,3], with steps shortened where they do not lead nearer, until it gives the
    points back to 1e-13 of `size`, or to rounding. `to_canonical` returns points and Jacobians.
    """
    x = start.copy()
    back, J = to_canonical(x)
    error = np.linalg.norm(back - points, axis=1)
    share = np.ones(len(x))
    for _ in range(STEPS):
        # A point that is nearly there and gets no nearer is limited by rounding.
        stuck = (share < 1.0) & ((error < 1e-10 * size) | (share < LEAST_SHARE))
        rows = np.flatnonzero((error > 1e-13 * size) & ~stuck)
        if len(rows) == 0:
            break
        step = (hexahedron.invert(J[rows]) @ (back - points)[rows][:, :, None])[:, :, 0]
        trial = x[rows] - share[rows, None] * step
        new, slope = to_canonical(trial)
        left = np.linalg.norm(new - points[rows], axis=1)
        better = left < (1.0 - 0.25 * share[rows]) * error[rows]
        share[rows] = np.where(better, np.minimum(1.0, 4.0 * share[rows]), 0.25 * share[rows])
        rows = rows[better]
        x[rows], back[rows], J[rows], error[rows] = trial[better], new[better], slope[better], left[better]
    return x, hexahedron.invert(J)
