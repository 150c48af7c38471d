"""Figures of pictures of a field against photos: PSNR raw and color-corrected, SSIM, and the worst view."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.datasets.views import View
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.images.metrics import WINDOW, color_corrected, psnr, ssim
from cagefield.typing import AnyArray, Float32


@dataclass(frozen=True)
class ViewFigures:
    """Figures of a picture against the photo of a view, over the photo's valid pixels.

    psnr       of the picture as it is, in dB
    corrected  of the picture after the affine fit of each color channel to the photo, in dB
    ssim       of the picture as it is; NaN for photos smaller than SSIM's window
    """

    name: str
    psnr: float
    corrected: float
    ssim: float


@dataclass(frozen=True)
class Evaluation:
    """Figures of several views; means are NaN where no view has a figure."""

    views: tuple[ViewFigures, ...] = ()

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
        """Mean SSIM over the views that its window fits in."""
        return _mean([view.ssim for view in self.views if view.ssim == view.ssim])

    @property
    def worst(self) -> ViewFigures | None:
        """The view of the lowest raw PSNR, None where there are no views."""
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


def composited(pixels: NDArray[np.uint8]) -> Float32:
    """Colors [H,W,3] in [0,1] of a photo's 8-bit pixels; a cut-out [H,W,4] is composited on white."""
    photo = pixels.astype(np.float32) / np.float32(255)
    if photo.shape[2] == 4:
        photo = photo[..., :3] * photo[..., 3:] + (1 - photo[..., 3:])
    return photo


def view_figures(
    name: str, picture: AnyArray, photo: AnyArray, valid: NDArray[np.bool_] | None = None
) -> ViewFigures | None:
    """Figures of a picture [H,W,3] of [0,1] against a photo; None where no pixel [H,W] is valid."""
    if valid is not None and not valid.any():
        return None
    picture = np.clip(picture, 0, 1)
    fits = min(photo.shape[:2]) >= WINDOW
    return ViewFigures(
        name,
        psnr(picture, photo, valid),
        psnr(color_corrected(picture, photo, valid), photo, valid),
        ssim(picture, photo, valid) if fits else float("nan"),
    )


def collected(figures: Sequence[ViewFigures | None]) -> Evaluation:
    """The views that have figures; a warning counts those whose masks leave no pixel."""
    known = tuple(view for view in figures if view is not None)
    if len(known) < len(figures):
        warnings.warn(
            f"{len(figures) - len(known)} of {len(figures)} photos are left out of the figures, "
            "their masks leave no pixel",
            stacklevel=3,
        )
    return Evaluation(known)


def evaluate_views(field: VoxelField | SplatField, views: Sequence[View]) -> Evaluation:
    """Figures of the field's pictures against photos; alpha is composited on white."""
    from cagefield.rendering.renderers import renderer_of

    renderer = renderer_of(field)
    figures: list[ViewFigures | None] = []
    for view in views:
        pixels = view.load()
        frame = renderer.render(view.camera, background="white" if pixels.shape[2] == 4 else "black")
        if frame is not None:
            figures.append(view_figures(view.name, frame.rgb, composited(pixels), view.valid_pixels()))
    return collected(figures)
