"""How closely a baked field shows what the field it was baked from shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cagefield.cameras import Camera
from cagefield.fields.nerf import NerfField
from cagefield.fields.voxel import VoxelField
from cagefield.rendering.frame import Background, background_rgb
from cagefield.rendering.metrics import psnr

PIXELS = 2500
"""Pixels compared in each view, on a regular grid."""


def agreement(
    original: NerfField, voxels: VoxelField, cameras: Sequence[Camera], background: Background
) -> float:
    """PSNR in dB of the voxels' pictures against the original's, unedited; the mean over the cameras."""
    from cagefield.rendering.nerf import Rays, trace
    from cagefield.rendering.renderer import Renderer

    behind = np.array(background_rgb(background) or (0.0, 0.0, 0.0), np.float32)
    renderer = Renderer(voxels)
    scores = []
    for camera in cameras:
        step = max(1, round((camera.width * camera.height / PIXELS) ** 0.5))
        j, i = np.meshgrid(np.arange(0, camera.height, step), np.arange(0, camera.width, step), indexing="ij")
        pixels = np.stack([i.ravel(), j.ravel()], axis=1)
        rgb, opacity, _ = trace(original.torch, Rays.of(camera, original.torch.device, pixels))
        exact = rgb.cpu().numpy() + (1.0 - opacity.cpu().numpy()[:, None]) * behind
        frame = renderer.render(camera, background=background)
        if frame is not None:
            scores.append(psnr(np.clip(frame.rgb[j.ravel(), i.ravel()], 0, 1), np.clip(exact, 0, 1)))
    return float(np.mean(scores))
