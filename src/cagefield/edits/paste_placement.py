"""Where a paste stands at first: upright, on a point, of a size."""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from cagefield.edits.edit import Edit, Paste
from cagefield.edits.operations import Rotate, Scale, Translate, euler_degrees
from cagefield.geometry.cage import Cage
from cagefield.typing import Array

MIN_TILT_DEGREES = 1.0
"""Degrees between two directions that are up from which on a paste is turned upright."""

_OPERATION_DECIMALS = 9
"""Decimals of operations, as a person would read them."""


def placed_paste(
    source: str | os.PathLike[str],
    box: Array,
    at: ArrayLike,
    *,
    up: ArrayLike = (0.0, 0.0, 1.0),
    source_up: ArrayLike = (0.0, 0.0, 1.0),
    size: float | None = None,
    name: str = "",
) -> Paste:
    """The edit that pastes a box [2,3] of another scene so that it stands on a point `at` [3].

    `up` [3] and `source_up` [3] are the unit directions that are up here and there; `size` is the longest
    edge of the box here, None leaves it as large as it is there.
    """
    low, high = np.asarray(box, np.float64)
    edit = Edit.paste(source, Cage.box(0.5 * (low + high), high - low), name=name)
    if size is not None:
        factor = float(size / (high - low).max())
        edit = edit.then(Scale.from_factors(float(f"{factor:.6g}")))
    up, turn = np.asarray(up, np.float64), upright_turn(source_up, up)
    if turn.magnitude() > np.radians(MIN_TILT_DEGREES):
        x, y, z = np.round(euler_degrees(turn), _OPERATION_DECIMALS).tolist()
        edit = edit.then(Rotate((x, y, z)))
    middle = edit.deformed.corners.mean(axis=0)
    height = ((edit.deformed.corners - middle) @ up).max()
    x, y, z = np.round(np.asarray(at, np.float64) + height * up - middle, _OPERATION_DECIMALS).tolist()
    return edit.then(Translate((x, y, z)))


def upright_turn(source_up: ArrayLike, up: ArrayLike) -> Rotation:
    """The shortest rotation of one unit direction [3] into another; about x or y where it is a half turn."""
    a, b = np.asarray(source_up, np.float64), np.asarray(up, np.float64)
    axis = np.cross(a, b)
    sine, cosine = float(np.linalg.norm(axis)), float(a @ b)
    if sine < 1e-9:
        if cosine > 0.0:
            return Rotation.identity()
        axis = np.cross(a, np.eye(3)[1 if abs(a[1]) < 0.9 else 0])
    return Rotation.from_rotvec(np.arctan2(sine, cosine) * axis / np.linalg.norm(axis))
