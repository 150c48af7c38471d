"""Angles of rotations in degrees."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation


def degrees(radians: float) -> float:
    """An angle in degrees; within rounding of a short decimal number it becomes that number."""
    angle = float(np.degrees(radians))
    short = round(angle, 9)
    return short if abs(angle - short) <= 4e-16 * abs(angle) else angle


def euler_degrees(rotation: Rotation) -> NDArray[np.float64]:
    """Intrinsic XYZ angles [3] in degrees; in gimbal lock the last one is 0, without SciPy's warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return np.asarray(rotation.as_euler("XYZ", degrees=True))
