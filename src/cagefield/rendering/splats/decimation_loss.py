"""Loss of decimated splats: PSNR of their images against those of the splats before."""

from __future__ import annotations

import numpy as np

from cagefield.cameras.camera import turntable
from cagefield.fields.splat_field import SplatField
from cagefield.images.metrics import psnr
from cagefield.rendering.splats.splat_renderer import SplatRenderer

VIEWS, SIZE_PX = 8, 400
"""Number of views on a circle, and their width and height."""

VIEW_FOV_X = 0.9
"""Horizontal field of view, radians."""

DISTANCE_RADII, ELEVATION = 2.5, 0.35
"""Distance of the cameras in half diagonals of the bounds, and their elevation, radians."""


def decimation_loss(before: SplatField, after: SplatField) -> tuple[float, float]:
    """(mean, least) PSNR in dB of `after` against `before`, on views around the bounds, over white."""
    box = before.bounds
    radius = 0.5 * float(np.linalg.norm(box[1] - box[0]))
    cameras = turntable(
        box.mean(axis=0),
        DISTANCE_RADII * radius,
        VIEWS,
        elevation=ELEVATION,
        width=SIZE_PX,
        height=SIZE_PX,
        fov_x=VIEW_FOV_X,
    )
    renderers = SplatRenderer(before), SplatRenderer(after)
    scores = []
    for camera in cameras:
        first, second = (np.clip(renderer.render(camera).rgb, 0.0, 1.0) for renderer in renderers)
        scores.append(psnr(first, second))
    return float(np.mean(scores)), float(np.min(scores))
