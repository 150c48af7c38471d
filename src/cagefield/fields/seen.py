"""Which points of an unbounded scene its photos can have shown."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras import Camera

MARGIN = 0.05
"""A picture reaches this share of its size over its edges here, for what is interpolated there."""


def seen_by(cameras: Sequence[Camera], points: NDArray[np.float32], near: float = 0.0) -> NDArray[np.bool_]:
    """True [N] where a point [N,3] lies in the picture of any camera, at a depth of `near` or more.

    What is in between is not looked at.
    """
    seen = np.zeros(len(points), bool)
    left = np.arange(len(points))
    for camera in cameras:
        positions, depth = camera.project(points[left])
        size = np.array([camera.width, camera.height])
        with np.errstate(invalid="ignore"):
            inside = np.abs(positions / size - 0.5).max(axis=1) <= 0.5 + MARGIN
        found = inside & (depth > 0.0) & (depth >= near)
        seen[left[found]] = True
        left = left[~found]
    return seen
