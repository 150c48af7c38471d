"""How well a field shows what photos show."""

from __future__ import annotations

import numpy as np

from cagefield.datasets.views import View
from cagefield.fields.splat import SplatField
from cagefield.fields.voxel import VoxelField
from cagefield.rendering.metrics import WINDOW, psnr, ssim


def evaluate_views(field: VoxelField | SplatField, views: tuple[View, ...]) -> tuple[float, float]:
    """(PSNR, SSIM) of the field's pictures against photos, means over views; alpha is composited on white.

    Of photos with masks over the valid pixels.
    SSIM is of the photos that its window fits in; NaN where it fits in none.
    """
    from cagefield.rendering.renderers import renderer_of

    renderer = renderer_of(field)
    ratios, similarities = [], []
    for view in views:
        photo = view.load().astype(np.float32) / 255.0
        if photo.shape[2] == 4:
            photo = photo[..., :3] * photo[..., 3:] + (1.0 - photo[..., 3:])
            frame = renderer.render(view.camera, background="white")
        else:
            frame = renderer.render(view.camera, background="black")
        if frame is not None:
            rgb = np.clip(frame.rgb, 0.0, 1.0)
            valid = view.valid_pixels()
            ratios.append(psnr(rgb, photo, valid))
            if min(photo.shape[:2]) >= WINDOW:
                similarities.append(ssim(rgb, photo, valid))
    return _mean(ratios), _mean(similarities)


def _mean(figures: list[float]) -> float:
    """The mean of the figures that are numbers; NaN of none."""
    known = [figure for figure in figures if figure == figure]
    return float(np.mean(known)) if known else float("nan")
