"""Training photos of a SplatField: pixel tiles index several resolutions, with their cameras."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.datasets.masks import shrink_mask
from cagefield.datasets.views import View
from cagefield.rendering.splats.rasterizer import tiled

LEVEL_COUNT = 3
"""Number of resolutions of each photo: full, 1/2, 1/4."""

MIN_SIDE_PIXELS = 48
"""Minimum shorter side of a downscaled photo."""


@dataclass(frozen=True, eq=False)
class TrainingView:
    """Photo with its camera and its pixels [tiles, 3 or 4, AREA] uint8 by level; level 0 is the full size.

    `valid` [tiles, AREA] by level masks the valid pixels; None where all are valid.
    """

    name: str
    cameras: tuple[Camera, ...]
    tiles: tuple[NDArray[np.uint8], ...]
    has_alpha: bool
    valid: tuple[NDArray[np.bool_], ...] | None = None

    @classmethod
    def from_view(cls, view: View) -> TrainingView:
        """Photo of a view, downscaled by box filters that weigh colors by straight alpha."""
        pixels, mask = view.load(), view.valid_pixels()
        cameras, tiles = [view.camera], [tiled(pixels)]
        valid = [] if mask is None else [_tiled_mask(mask)]
        for level in range(1, LEVEL_COUNT):
            factor = 2**level
            if min(view.camera.width, view.camera.height) // factor < MIN_SIDE_PIXELS:
                break
            cameras.append(view.camera.downscaled(factor))
            tiles.append(tiled(_box_filter(pixels, factor)))
            if mask is not None:
                valid.append(_tiled_mask(shrink_mask(mask, factor)))
        return cls(view.name, tuple(cameras), tuple(tiles), pixels.shape[2] == 4, tuple(valid) or None)

    def level(self, level: int) -> tuple[Camera, NDArray[np.uint8]]:
        """(camera, tiles) of a level, or of the smallest level available."""
        index = min(level, len(self.cameras) - 1)
        return self.cameras[index], self.tiles[index]

    def valid_at(self, level: int) -> NDArray[np.bool_] | None:
        """Mask [tiles, AREA] of a level's valid pixels; None where all are valid."""
        return None if self.valid is None else self.valid[min(level, len(self.cameras) - 1)]

    def with_alpha(self) -> TrainingView:
        """View with an alpha channel; opaque where the photo has none."""
        if self.has_alpha:
            return self
        filled = (np.pad(tiles, ((0, 0), (0, 1), (0, 0)), constant_values=255) for tiles in self.tiles)
        return replace(self, tiles=tuple(filled), has_alpha=True)


def load_views(views: Sequence[View]) -> list[TrainingView]:
    """Training views of all photos, all with alpha if any has it. Raises DatasetError if unreadable."""
    loaded = [TrainingView.from_view(view) for view in views]
    return [view.with_alpha() for view in loaded] if any(view.has_alpha for view in loaded) else loaded


def _tiled_mask(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Mask [H,W] as tiles [tiles, AREA]."""
    return np.ascontiguousarray(tiled(mask[..., None])[:, 0])


def _box_filter(pixels: NDArray[np.uint8], factor: int) -> NDArray[np.uint8]:
    """Pixels averaged over factor x factor blocks, colors weighted by alpha."""
    height, width = pixels.shape[0] // factor, pixels.shape[1] // factor
    blocks = pixels[: height * factor, : width * factor].astype(np.float32)
    blocks = blocks.reshape(height, factor, width, factor, -1)
    if pixels.shape[2] == 3:
        return (blocks.mean(axis=(1, 3)) + 0.5).astype(np.uint8)
    alpha = blocks[..., 3:]
    rgb = (blocks[..., :3] * alpha).sum(axis=(1, 3)) / np.maximum(alpha.sum(axis=(1, 3)), 1e-6)
    return (np.concatenate([rgb, alpha.mean(axis=(1, 3))], axis=-1) + 0.5).astype(np.uint8)
