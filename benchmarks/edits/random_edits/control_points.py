"""Random edits of control points, plain and connected."""

from __future__ import annotations

import numpy as np

from cagefield.edits import Continuous, Edit
from cagefield.geometry.cage import Cage
from cagefield.geometry.control_points import ControlPoints
from cagefield.geometry.detour_grid import DetourGrid
from cagefield.geometry.point_deformers import FALLOFF_CURVES
from cagefield.typing import Array

OUTER = Cage.box((0, 0, 0), 6.0)


def random_edit(seed: int) -> Continuous:
    """An edit of 1 to 4 points of radius .5 in a box of 1, moved by up to about two radii."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 5))
    points = 0.4 * np.stack(np.unravel_index(rng.permutation(27)[:count], (3, 3, 3)), axis=1) - 0.4
    points = points + rng.uniform(-0.1, 0.1, (count, 3))
    outer = None if rng.random() < 0.5 else Cage.box((0, 0, 0), 3.2, rng.uniform(-0.2, 0.2, 3))
    edit = Edit.points(points, radius=0.5, falloff=FALLOFF_CURVES[seed % len(FALLOFF_CURVES)], outer=outer)
    edit = edit.translate(rng.normal(0.0, 0.25, 3))
    if rng.random() < 0.7:
        edit = edit.rotate(rng.normal(0.0, 0.8, 3))
    if rng.random() < 0.5:
        edit = edit.scale(np.exp(rng.normal(0.0, 0.25, 3)))
    if rng.random() < 0.3:
        edit = edit.shear(xy=rng.normal(0.0, 0.3))
    for point in range(count):
        if rng.random() < 0.5:
            edit = edit.move_point(point, rng.normal(0.0, 0.1, 3))
    return edit


def points_around(edit: Continuous, count: int, seed: int) -> Array:
    """Points [count,3] in the box of an edit, half of them close to its control points."""
    rng = np.random.default_rng(seed)
    low, high = edit.outer.aabb
    spread = rng.uniform(low, high, (count - count // 2, 3))
    handles = edit.deformed.handles
    near = handles[rng.integers(0, len(handles), count // 2)] + rng.normal(0.0, 0.3, (count // 2, 3))
    return np.concatenate([spread, near])


def grid_around(points: ControlPoints, seed: int, edge: float = 0.25) -> DetourGrid:
    """Random detours in [0, r], 0 at the control points, smooth over some nodes."""
    y = points.local_points
    low, high = y.min(axis=0) - points.radius, y.max(axis=0) + points.radius
    shape = np.ceil((high - low) / edge).astype(int) + 3
    values = np.random.default_rng(seed).uniform(-0.5, 1.0, shape).clip(0.0) * points.radius
    base = np.floor((y - low) / edge + 0.5).astype(int)
    for i, j, k in base:
        values[i - 1 : i + 2, j - 1 : j + 2, k - 1 : k + 2] = 0.0
    return DetourGrid(low, edge, values)


def connected_edit(seed: int) -> Continuous:
    """`random_edit` of connected points, over random detours."""
    edit = random_edit(seed)
    assert isinstance(edit.inner, ControlPoints)
    points = edit.inner.with_reach(connected=True)
    return edit.replace(inner=points.with_detours(grid_around(points, seed)))
