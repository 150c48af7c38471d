"""Metrics of rendered images against photos: raw and color-corrected PSNR, SSIM, and the worst view."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.datasets.views import View
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.images.metrics import SSIM_WINDOW_PIXELS, correct_colors, psnr, ssim
from cagefield.typing import AnyArray, Float32


@dataclass(frozen=True)
class ViewMetrics:
    """Metrics of a rendered image against a view's photo, over the photo's valid pixels.

    psnr       of the image, in dB
    corrected  PSNR after an affine fit of each color channel to the photo, in dB
    ssim       of the image; NaN for photos smaller than SSIM's window
    """

    name: str
    psnr: float
    corrected: float
    ssim: float


@dataclass(frozen=True)
class Evaluation:
    """Metrics of several views; a mean over no values is NaN."""

    views: tuple[ViewMetrics, ...] = ()

    @property
    def psnr(self) -> float:
        """Mean raw PSNR in dB."""
        return _mean([view.psnr for view in self.views])

    @property
    def corrected(self) -> float:
        """Mean color-corrected PSNR in dB."""
        return _mean([view.corrected for view in self.views])

    @property
    def ssim(self) -> float:
        """Mean SSIM over the views that are at least as large as its window."""
        return _mean([view.ssim for view in self.views if view.ssim == view.ssim])

    @property
    def worst(self) -> ViewMetrics | None:
        """View of the lowest raw PSNR; None without views."""
        return min(self.views, key=lambda view: view.psnr, default=None)

    def __str__(self) -> str:
        """ "30.12 dB (31.03 color-corrected), SSIM 0.9312, worst view NAME 24.20 dB"."""
        worst, ssim_ = self.worst, self.ssim
        line = f"{self.psnr:.2f} dB ({self.corrected:.2f} color-corrected)"
        if ssim_ == ssim_:
            line += f", SSIM {ssim_:.4f}"
        return line if worst is None else f"{line}, worst view {worst.name} {worst.psnr:.2f} dB"


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if values else float("nan")


def composite_on_white(pixels: NDArray[np.uint8]) -> Float32:
    """Colors [H,W,3] in [0,1] of a photo's 8-bit pixels; a cut-out [H,W,4] is composited on white."""
    photo = pixels.astype(np.float32) / np.float32(255)
    if photo.shape[2] == 4:
        photo = photo[..., :3] * photo[..., 3:] + (1 - photo[..., 3:])
    return photo


def evaluate_image(
    name: str, image: AnyArray, photo: AnyArray, valid: NDArray[np.bool_] | None = None
) -> ViewMetrics | None:
    """Metrics of an image [H,W,3] in [0,1] against a photo; None where no pixel [H,W] is valid."""
    if valid is not None and not valid.any():
        return None
    image = np.clip(image, 0, 1)
    fits = min(photo.shape[:2]) >= SSIM_WINDOW_PIXELS
    return ViewMetrics(
        name,
        psnr(image, photo, valid),
        psnr(correct_colors(image, photo, valid), photo, valid),
        ssim(image, photo, valid) if fits else float("nan"),
    )


def collect_metrics(metrics: Sequence[ViewMetrics | None]) -> Evaluation:
    """Evaluation of the views that have metrics; a warning counts views whose masks leave no pixel."""
    known = tuple(view for view in metrics if view is not None)
    if len(known) < len(metrics):
        warnings.warn(
            f"{len(metrics) - len(known)} of {len(metrics)} photos are left out of the figures, "
            "their masks leave no pixel",
            stacklevel=3,
        )
    return Evaluation(known)


def evaluate_views(field: VoxelField | SplatField, views: Sequence[View]) -> Evaluation:
    """Metrics of the field's images against the views' photos; alpha is composited on white."""
    from cagefield.rendering.renderers import renderer_of

    renderer = renderer_of(field)
    metrics: list[ViewMetrics | None] = []
    for view in views:
        pixels = view.load()
        image = renderer.render(view.camera, background="white" if pixels.shape[2] == 4 else "black")
        metrics.append(evaluate_image(view.name, image.rgb, composite_on_white(pixels), view.valid_pixels()))
    return collect_metrics(metrics)
