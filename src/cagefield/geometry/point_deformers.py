"""Bend, twist and taper of points along an axis, and weights of proportional editing.

Notation: Q [3,3], a rotation whose columns are the axes; the middle of points is that of their box along Q.

Source: Barr, "Global and local deformations of solid primitives", SIGGRAPH 1984.
"""

from __future__ import annotations

import numpy as np

from cagefield.errors import CageError
from cagefield.typing import Array

LATTICE_AXES: tuple[str, ...] = ("x", "y", "z")
FIXED: tuple[str, ...] = ("start", "middle", "end")
"""Where along the axis a bend, a twist or a taper leaves the points as they are."""

FALLOFF_CURVES: tuple[str, ...] = ("smooth", "sphere", "root", "sharp", "linear")


def falloff_weight(distance: Array, radius: float, falloff: str) -> Array:
    """Weight [N] of points at distances [N] >= 0: 1 at 0, 0 from `radius` on, by Blender's curves."""
    g = (1.0 - distance / radius).clip(0.0, 1.0)
    if falloff == "smooth":
        return np.asarray(g * g * (3.0 - 2.0 * g))
    if falloff == "sphere":
        return np.asarray(np.sqrt((2.0 * g - g * g).clip(0.0)))
    if falloff == "root":
        return np.asarray(np.sqrt(g))
    if falloff == "sharp":
        return np.asarray(g * g)
    if falloff == "linear":
        return np.asarray(g)
    raise CageError(f'falloff must be one of {", ".join(FALLOFF_CURVES)}, got "{falloff!s:.40}"')


def axis_number(axis: str, name: str) -> int:
    """The number of an axis "x", "y" or "z", or a `CageError`."""
    if axis not in LATTICE_AXES:
        raise CageError(f'{name} must be x, y or z, got "{axis!s:.40}"')
    return LATTICE_AXES.index(axis)


def bend(points: Array, Q: Array, axis: int, towards: int, angle: float, fixed: str) -> Array:
    """Points [N,3] whose middle line along an axis becomes an arc of `angle` radians, towards another axis.

    The line keeps its length L and passes through the points' middle; its radius is L / angle. Points
    further towards the bend than the radius would be turned inside out.
    """
    y, start, length = _along(points, Q, axis, fixed)
    if abs(angle) < 1e-12:
        return points.copy()
    curvature = angle / length
    low, high = y[:, towards].min(), y[:, towards].max()
    s, b = y[:, axis] - start, y[:, towards] - 0.5 * (low + high)
    radius = 1.0 / curvature - b
    moved = y.copy()
    moved[:, axis] = start + radius * np.sin(curvature * s)
    moved[:, towards] = 0.5 * (low + high) + 1.0 / curvature - radius * np.cos(curvature * s)
    return moved @ Q.T


def twist(points: Array, Q: Array, axis: int, angle: float, fixed: str) -> Array:
    """Points [N,3] turned about the axis through their middle, by `angle` radians from end to end."""
    y, start, length = _along(points, Q, axis, fixed)
    a, b = (axis + 1) % 3, (axis + 2) % 3
    turn = angle * (y[:, axis] - start) / length
    middle = 0.5 * (y.min(axis=0) + y.max(axis=0))
    p, q = y[:, a] - middle[a], y[:, b] - middle[b]
    moved = y.copy()
    moved[:, a] = middle[a] + np.cos(turn) * p - np.sin(turn) * q
    moved[:, b] = middle[b] + np.sin(turn) * p + np.cos(turn) * q
    return moved @ Q.T


def taper(points: Array, Q: Array, axis: int, factor: float, fixed: str) -> Array:
    """Points [N,3] scaled across the axis through their middle: by 1 at `fixed`, by `factor` a length on."""
    y, start, length = _along(points, Q, axis, fixed)
    share = factor ** ((y[:, axis] - start) / length)
    middle = 0.5 * (y.min(axis=0) + y.max(axis=0))
    moved = middle + (y - middle) * share[:, None]
    moved[:, axis] = y[:, axis]
    return moved @ Q.T


def _along(points: Array, Q: Array, axis: int, fixed: str) -> tuple[Array, float, float]:
    """(points in the frame [N,3], where along the axis nothing moves, length along it)."""
    if fixed not in FIXED:
        raise CageError(f'fixed must be one of {", ".join(FIXED)}, got "{fixed!s:.40}"')
    y = points @ Q
    low, high = float(y[:, axis].min()), float(y[:, axis].max())
    start = {"start": low, "middle": 0.5 * (low + high), "end": high}[fixed]
    return y, start, high - low


def mirrored(points: Array, axis: int, at: float) -> Array:
    """Points [...,3] across the plane where coordinate `axis` is `at`."""
    image = points.copy()
    image[..., axis] = 2.0 * at - image[..., axis]
    return image
