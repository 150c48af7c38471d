"""Validation of the numbers and poses of a camera, with errors that name the fault and the cure."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from cagefield.errors import CameraError
from cagefield.typing import Array

RIGID_TOLERANCE = 5e-3  # rotations printed with three decimals stay under it; a scale of 0.5 % does not


def validate_pose(c2w: npt.ArrayLike) -> Array:
    """Read-only [4,4] float64 copy of a rigid camera-to-world matrix. Raises CameraError for any other
    matrix.
    """
    try:
        pose = np.array(c2w, dtype=np.float64)
    except (TypeError, ValueError):
        raise CameraError("c2w must be a matrix [4,4] of numbers") from None
    if pose.shape != (4, 4):
        raise CameraError(f"c2w must have the shape [4,4], got {list(pose.shape)}")
    if not np.isfinite(pose).all():
        row, column = np.argwhere(~np.isfinite(pose))[0].tolist()
        raise CameraError(f"c2w[{row}][{column}] is {pose[row, column]}; every entry must be finite")
    if not np.array_equal(pose[3], (0.0, 0.0, 0.0, 1.0)):
        raise CameraError(f"the last row of c2w must be 0 0 0 1, got {pose[3].tolist()}; is it transposed?")
    rotation = pose[:3, :3]
    deviation = float(np.abs(rotation.T @ rotation - np.eye(3)).max())
    if deviation > RIGID_TOLERANCE:
        raise CameraError(
            f"c2w is not a rigid motion: its 3x3 part deviates from a rotation by {deviation:.3g} "
            f"(allowed {RIGID_TOLERANCE:g}); take scale and shear out of the pose"
        )
    if np.linalg.det(rotation) < 0:
        raise CameraError(
            "c2w is not a rigid motion: it mirrors (determinant -1); flip the sign of one camera axis"
        )
    pose.flags.writeable = False
    return pose


def validate_size(name: str, value: Any) -> int:
    """Whole number of pixels, at least 1. Raises CameraError, which names it."""
    number = validate_number(name, value)
    if number != int(number) or number < 1:
        raise CameraError(f"{name} must be a whole number of pixels, at least 1, got {value!r}")
    return int(number)


def validate_number(name: str, value: Any) -> float:
    """Finite number. Raises CameraError, which names it."""
    is_number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if not is_number or not math.isfinite(value):
        raise CameraError(f"{name} must be a finite number, got {value!r}")
    return float(value)
