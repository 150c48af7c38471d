"""Visibility of points in the frusta of cameras."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera

IMAGE_MARGIN_SHARE = 0.05
"""Margin around an image, relative to its size, for interpolation at its edges."""


def in_frusta(
    cameras: Sequence[Camera], points: NDArray[Any], near: float = 0.0, min_views: int = 1
) -> NDArray[np.bool_]:
    """Mask [N] of points [N,3] within the images of `min_views` cameras, at a depth of at least `near`.

    Occlusion is ignored.
    """
    missing_views = np.full(len(points), min_views)
    for camera in cameras:
        rows = np.flatnonzero(missing_views > 0)
        positions, depth = camera.project(points[rows])
        size = np.array([camera.width, camera.height])
        with np.errstate(invalid="ignore"):
            inside = np.abs(positions / size - 0.5).max(axis=1) <= 0.5 + IMAGE_MARGIN_SHARE
        missing_views[rows] -= inside & (depth > 0.0) & (depth >= near)
    return missing_views <= 0
