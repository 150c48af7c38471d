"""Which points of an unbounded scene its photos can have shown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera

MARGIN = 0.05
"""A picture reaches this share of its size over its edges here, for what is interpolated there."""


def in_frusta(
    cameras: Sequence[Camera], points: NDArray[Any], near: float = 0.0, least: int = 1
) -> NDArray[np.bool_]:
    """True [N] where a point [N,3] lies in the pictures of `least` cameras, at a depth of `near` or more.

    What is in between is not considered.
    """
    wanted = np.full(len(points), least)
    for camera in cameras:
        left = np.flatnonzero(wanted > 0)
        positions, depth = camera.project(points[left])
        size = np.array([camera.width, camera.height])
        with np.errstate(invalid="ignore"):
            inside = np.abs(positions / size - 0.5).max(axis=1) <= 0.5 + MARGIN
        wanted[left] -= inside & (depth > 0.0) & (depth >= near)
    return wanted <= 0
