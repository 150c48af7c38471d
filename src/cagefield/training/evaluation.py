"""How well a field shows what photos show."""

from __future__ import annotations

import numpy as np

from cagefield.datasets.views import View
from cagefield.fields.splat import SplatField
from cagefield.fields.voxel import VoxelField
from cagefield.rendering.metrics import psnr, ssim


def evaluate_views(field: VoxelField | SplatField, views: tuple[View, ...]) -> tuple[float, float]:
    """(PSNR, SSIM) of the field's pictures against photos, means over views; alpha is composited on white."""
    from cagefield.rendering.renderers import renderer_of

    renderer = renderer_of(field)
    scores = []
    for view in views:
        photo = view.load().astype(np.float32) / 255.0
        if photo.shape[2] == 4:
            photo = photo[..., :3] * photo[..., 3:] + (1.0 - photo[..., 3:])
            frame = renderer.render(view.camera, background="white")
        else:
            frame = renderer.render(view.camera, background="black")
        if frame is not None:
            rgb = np.clip(frame.rgb, 0.0, 1.0)
            scores.append((psnr(rgb, photo), ssim(rgb, photo)))
    means = np.mean(scores, axis=0)
    return float(means[0]), float(means[1])
