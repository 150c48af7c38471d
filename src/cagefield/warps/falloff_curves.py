"""Curves by which the motion of control points fades with the distance from them, and their slopes.

With s = 1 - d / r, d the distance and r the radius, the weight is 1 at s = 1 and 0 for s <= 0:

    smooth  3 s^2 - 2 s^3           sphere  sqrt(2 s - s^2)         root  sqrt(s)
    sharp   s^2                     linear  s

The curves of proportional editing in 3D editors. The square roots of sphere and root rise without a bound
where the motion ends, at s = 0, and a flow needs one. Below a small e = `ROOT_END` of its argument q the
root is

    sqrt(e) (5 u^2 - 3 u^3) / 2,    u = q / e,

which goes on with the root's value and slope at q = e, begins with a slope of 0, where a jump would draw
splats out into needles, and is no steeper than 25 / (18 sqrt(e)): in the outermost 13% (sphere) and 6% (root)
of the radius.
"""

from __future__ import annotations

import numpy as np

from cagefield.geometry.point_deformers import FALLOFF_CURVES
from cagefield.typing import Array

ROOT_END: dict[str, float] = {"sphere": 0.25, "root": 0.0625}
"""Argument of the root below which it is bounded."""

STEEPEST: dict[str, float] = {"smooth": 1.5, "sphere": 5.17, "root": 5.56, "sharp": 2.0, "linear": 1.0}
"""Largest slope of a curve by s."""


def curve_number(name: str) -> int:
    """Number of a curve in kernels: its place in `FALLOFF_CURVES`."""
    return FALLOFF_CURVES.index(name)


def curve(name: str, s: Array) -> tuple[Array, Array]:
    """(weight [N], slope dw/ds [N]) of a curve at s [N]; both 0 for s <= 0, s above 1 is taken for 1."""
    inside, s = s > 0.0, s.clip(0.0, 1.0)
    if name == "smooth":
        w, slope = s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s)
    elif name == "sharp":
        w, slope = s * s, 2.0 * s
    elif name == "linear":
        w, slope = s, np.ones_like(s)
    elif name == "root":
        w, slope = _bounded_root(s, ROOT_END[name])
    else:
        w, by_argument = _bounded_root(s * (2.0 - s), ROOT_END[name])
        slope = by_argument * 2.0 * (1.0 - s)
    return np.where(inside, w, 0.0), np.where(inside, slope, 0.0)


def _bounded_root(q: Array, end: float) -> tuple[Array, Array]:
    root, u = np.sqrt(np.maximum(q, end)), q / end
    is_low = q < end
    w = np.where(is_low, np.sqrt(end) * u * u * (2.5 - 1.5 * u), root)
    return w, np.where(is_low, u * (5.0 - 4.5 * u) / np.sqrt(end), 0.5 / root)
