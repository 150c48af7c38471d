"""The photos of a SplatField's training: tiles of pixels at several sizes, with their cameras."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.datasets.masks import shrink_mask
from cagefield.datasets.views import View
from cagefield.rendering.splats.rasterizer import tiled

LEVELS = 3
"""Sizes of each photo: whole, 1/2, 1/4."""

SMALLEST = 48
"""Pixels that the shorter side of a photo keeps at the least."""


@dataclass(frozen=True, eq=False)
class TrainingView:
    """One photo: its camera and its pixels [tiles, 3 or 4, AREA] uint8 by level, 0 the whole size.

    `valid` [tiles, AREA] by level is True where a pixel may be used; None where all of them may.
    """

    name: str
    cameras: tuple[Camera, ...]
    tiles: tuple[NDArray[np.uint8], ...]
    has_alpha: bool
    valid: tuple[NDArray[np.bool_], ...] | None = None

    @classmethod
    def of(cls, view: View) -> TrainingView:
        """The photo read and shrunk by box filters; straight alpha is weighed in."""
        pixels, mask = view.load(), view.valid_pixels()
        cameras, tiles = [view.camera], [tiled(pixels)]
        valid = [] if mask is None else [_tiled_mask(mask)]
        for level in range(1, LEVELS):
            factor = 2**level
            if min(view.camera.width, view.camera.height) // factor < SMALLEST:
                break
            cameras.append(view.camera.downscaled(factor))
            tiles.append(tiled(_boxed(pixels, factor)))
            if mask is not None:
                valid.append(_tiled_mask(shrink_mask(mask, factor)))
        return cls(view.name, tuple(cameras), tuple(tiles), pixels.shape[2] == 4, tuple(valid) or None)

    def level(self, level: int) -> tuple[Camera, NDArray[np.uint8]]:
        """(camera, tiles) of a level, or of the smallest that there is."""
        at = min(level, len(self.cameras) - 1)
        return self.cameras[at], self.tiles[at]

    def valid_at(self, level: int) -> NDArray[np.bool_] | None:
        """Pixels [tiles, AREA] of a level that may be used; None where all of them may."""
        return None if self.valid is None else self.valid[min(level, len(self.cameras) - 1)]

    def with_alpha(self) -> TrainingView:
        """The same; a photo without alpha is opaque."""
        if self.has_alpha:
            return self
        filled = (np.pad(tiles, ((0, 0), (0, 1), (0, 0)), constant_values=255) for tiles in self.tiles)
        return replace(self, tiles=tuple(filled), has_alpha=True)


def load_views(views: Sequence[View]) -> list[TrainingView]:
    """All photos, with alpha where one of them has it. Raises DatasetError where one cannot be read."""
    found = [TrainingView.of(view) for view in views]
    return [view.with_alpha() for view in found] if any(view.has_alpha for view in found) else found


def _tiled_mask(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """A mask [H,W] as tiles [tiles, AREA]."""
    return np.ascontiguousarray(tiled(mask[..., None])[:, 0])


def _boxed(pixels: NDArray[np.uint8], factor: int) -> NDArray[np.uint8]:
    height, width = pixels.shape[0] // factor, pixels.shape[1] // factor
    blocks = pixels[: height * factor, : width * factor].astype(np.float32)
    blocks = blocks.reshape(height, factor, width, factor, -1)
    if pixels.shape[2] == 3:
        return (blocks.mean(axis=(1, 3)) + 0.5).astype(np.uint8)
    alpha = blocks[..., 3:]
    rgb = (blocks[..., :3] * alpha).sum(axis=(1, 3)) / np.maximum(alpha.sum(axis=(1, 3)), 1e-6)
    return (np.concatenate([rgb, alpha.mean(axis=(1, 3))], axis=-1) + 0.5).astype(np.uint8)
