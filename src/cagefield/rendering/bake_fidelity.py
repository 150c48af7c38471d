"""Fidelity of a baked field: PSNR of its images against those of its source field."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from cagefield.cameras.camera import Camera
from cagefield.fields.external.external_field import ExternalField
from cagefield.fields.nerf_field import NerfField
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.images.metrics import psnr
from cagefield.images.render_result import Background, background_rgb

if TYPE_CHECKING:
    from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer

PIXELS = 2500
"""Pixels compared in each view, on a regular grid; of splats all."""


def agreement(
    original: NerfField | ExternalField | SplatField,
    voxels: VoxelField,
    cameras: Sequence[Camera],
    background: Background,
) -> float:
    """Mean PSNR in dB over the cameras of the voxels' images against the original's, unedited.

    Images without a background (None) are compared over white.
    """
    from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer

    behind = background_rgb(background) or (1.0, 1.0, 1.0)
    renderer = VoxelRenderer(voxels)
    if isinstance(original, SplatField):
        scores = _against_splats(original, renderer, cameras, behind)
    else:
        scores = _against_nerf(original, renderer, cameras, behind)
    return float(np.mean(scores))


def _against_splats(
    original: SplatField,
    renderer: VoxelRenderer,
    cameras: Sequence[Camera],
    behind: tuple[float, float, float],
) -> list[float]:
    from cagefield.rendering.splats.splat_renderer import SplatRenderer

    splats = SplatRenderer(original)
    scores = []
    for camera in cameras:
        frame, exact = (one.render(camera, background=behind) for one in (renderer, splats))
        if frame is not None and exact is not None:
            scores.append(psnr(np.clip(frame.rgb, 0, 1), np.clip(exact.rgb, 0, 1)))
    return scores


def _against_nerf(
    original: NerfField | ExternalField,
    renderer: VoxelRenderer,
    cameras: Sequence[Camera],
    behind: tuple[float, float, float],
) -> list[float]:
    from cagefield.rendering.external.external_renderer import trace_external
    from cagefield.rendering.nerf.nerf_renderer import Rays, trace

    device = original.torch.device
    scores = []
    for camera in cameras:
        step = max(1, round((camera.width * camera.height / PIXELS) ** 0.5))
        j, i = np.meshgrid(np.arange(0, camera.height, step), np.arange(0, camera.width, step), indexing="ij")
        pixels = np.stack([i.ravel(), j.ravel()], axis=1)
        rays = Rays.from_camera(camera, device, pixels)
        if isinstance(original, ExternalField):
            rgb, opacity, _ = trace_external(original, rays)
        else:
            rgb, opacity, _ = trace(original.torch, rays)
        exact = rgb.cpu().numpy() + (1.0 - opacity.cpu().numpy()[:, None]) * np.array(behind, np.float32)
        frame = renderer.render(camera, background=behind)
        if frame is not None:
            scores.append(psnr(np.clip(frame.rgb[j.ravel(), i.ravel()], 0, 1), np.clip(exact, 0, 1)))
    return scores
