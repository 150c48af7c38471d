"""The motion of a flow shell's cage as a table of float32 numbers, which kernels read.

With Z = W_o (p - c_o), the affine coordinates of the outer cage, the table holds, for the times of the
Runge-Kutta steps from t = 1 to 0, the affine maps from Z to the inner cage's coordinates and to the velocity.
It is a list of vec3, appended to the lattices' nodes:

    0-3   rows of W_o, c_o              4-6   rows of F_o (p = c_o + F_o Z)
    7     distances H / 2 of the faces  8     steps, affine 0 or 1, 1 / width
    9     a of the weight, outer cage affine 0 or 1, b of the weight
    10-19 bend and tilts of the outer cage, see `trilinear_bend.forms`
    20-23 dK/dt of the inner cage

then for each of 2 steps + 1 moments `MOMENT` of them:

    0-3   y = rows . Z + [3]            4-7   velocity of the affine part = rows . Z + [7]
    8     distances h of the faces      9     step h from this knot on, at even moments
    10-19 bend and tilts at that time   20-22 rows of W_o F, which takes the bend's velocity to Z
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cagefield.typing import Array
from cagefield.warps.flow_shell import FlowShell
from cagefield.warps.trilinear_bend import forms

HEADER, MOMENT = 24, 23


def table(shell: FlowShell) -> NDArray[np.float32]:
    """The table [T,3] of a flow shell, with the steps that its `strain` asks for."""
    return table_along(shell, shell.knots[::-1]).astype(np.float32)


def table_along(shell: FlowShell, knots: Array) -> Array:
    """The table [T,3], float64, of the flow through times [K+1]: from 0 to 1 to deformed space."""
    motion = shell.motion
    steps = len(knots) - 1
    times = np.empty(2 * steps + 1)
    times[::2], times[1::2] = knots, 0.5 * (knots[1:] + knots[:-1])
    outer = motion.confines
    c, F, dc, dF = motion.frames(times)
    W = np.linalg.inv(F)
    unit = outer.heights.max()  # float32 has no room for the powers of any unit of length
    bend_rate = motion.end.bend - motion.start.bend
    head = np.zeros((HEADER, 3))
    head[0:3], head[3], head[4:7], head[7] = (
        outer.inverse,
        outer.center,
        outer.frame,
        0.5 * outer.heights / unit,
    )
    head[8] = steps, motion.is_affine, 1.0 / shell.falloff.width
    head[9] = shell.coefficients[0], outer.is_affine, shell.coefficients[1]
    head[20:24] = bend_rate
    if not outer.is_affine:
        head[10:20] = outer.form
    rows = np.zeros((2 * steps + 1, MOMENT, 3))
    rows[:, 0:3] = W @ outer.frame
    rows[:, 3] = (W @ (outer.center - c)[:, :, None])[:, :, 0]
    L = outer.inverse @ dF @ W  # velocity in Z per offset of p from the cage's center
    rows[:, 4:7] = L @ outer.frame
    rows[:, 7] = (L @ (outer.center - c)[:, :, None])[:, :, 0] + dc @ outer.inverse.T
    rows[:, 8] = 1.0 / np.linalg.norm(W, axis=2) / unit
    rows[:-1:2, 9, 0] = np.diff(knots)
    if not motion.is_affine:
        rows[:, 10:20] = forms(motion.start.bend + times[:, None, None] * bend_rate)
    rows[:, 20:23] = outer.inverse @ F
    return np.concatenate([head, rows.reshape(-1, 3)])
