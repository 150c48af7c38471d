"""Robust weights of photo regions, from low-frequency residuals across epochs.

A region that contradicts the other photos (a person who walks by, a moving backdrop) keeps a color that no
single field explains. Fine texture that the field does not resolve yet has a signed residual that averages
out over a block. Each photo has, for each block of BLOCK_PIXELS x BLOCK_PIXELS pixels, a running mean of the
residual r_B = |mean_B(image - photo)| over color channels, and the weight

    w_B = max(MIN_BLOCK_WEIGHT, 1 / (1 + (r_B / s)^2)^2)
    s = max(MIN_RESIDUAL_SCALE, SCALE_MEDIANS median(r))

of Geman and McClure, with the median over blocks of all photos. Where a block's residual exceeds half the
scale, r_B is the largest residual among the block's neighbors, so that the outlines of an outlier lose weight
too.

Source: Sabour et al., "RobustNeRF" (2023), for regions in place of pixels; Barron, "A general and adaptive
robust loss function" (2019).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cagefield.rendering.splats.kernels.projection import AREA, TILE_PX

BLOCK_PIXELS = 8
"""Side of a block."""

RESIDUAL_DECAY = 0.5
"""Decay of a block's residual per visit of its photo."""

MIN_RESIDUAL_SCALE = 0.06
"""Minimum residual at which a weight falls to a quarter, for colors in [0,1]."""

SCALE_MEDIANS = 8.0
"""Residual at which a weight falls to a quarter, in medians of all blocks' residuals."""

MIN_BLOCK_WEIGHT = 0.15
"""Minimum weight of a block; a region that no other photo shows still trains, only slower."""

ROBUST_START_PROGRESS = 0.25
"""Progress from which weights apply; earlier the field is too coarse to contradict a photo."""

_SIDE = TILE_PX // BLOCK_PIXELS


class RobustWeights:
    """Running residuals of the blocks of V photos, and the resulting weights.

    Attributes:
        residuals: [sum of blocks] float32, concatenated over photos, row by row.
        visits: [V] int64 number of visits of each photo.
        scale: residual at which a weight falls to a quarter.
    """

    def __init__(self, tiles: Sequence[tuple[int, int]]) -> None:
        """`tiles` are (down, across) of each photo at its whole size."""
        self._tiles = tiles
        self._ends = np.cumsum([0, *(down * across * _SIDE**2 for down, across in tiles)])
        self.residuals: NDArray[np.float32] = np.zeros(int(self._ends[-1]), np.float32)
        self.visits: NDArray[np.int64] = np.zeros(len(tiles), np.int64)
        self.scale = MIN_RESIDUAL_SCALE

    def photo_residuals(self, index: int) -> NDArray[np.float32]:
        """Residuals [h,w] of a photo's blocks."""
        down, across = self._tiles[index]
        part = self.residuals[self._ends[index] : self._ends[index + 1]]
        return part.reshape(down * _SIDE, across * _SIDE)

    def add(
        self,
        index: int,
        slopes: NDArray[np.float32],
        gain: NDArray[np.float32],
        valid: NDArray[np.bool_] | None,
    ) -> None:
        """Update a photo's residuals; `slopes` [tiles,3,AREA] are gain times (image - photo)."""
        down, across = self._tiles[index]
        difference = slopes / gain[:, None]
        if valid is not None:
            difference = difference * valid[:, None]
        blocks = difference.reshape(-1, 3, _SIDE, BLOCK_PIXELS, _SIDE, BLOCK_PIXELS).mean(axis=(3, 5))
        size = np.sqrt((blocks**2).sum(axis=1))
        plane = size.reshape(down, across, _SIDE, _SIDE).transpose(0, 2, 1, 3).reshape(down * _SIDE, -1)
        keep = RESIDUAL_DECAY if self.visits[index] else 0.0
        known = self.photo_residuals(index)
        known[:] = keep * known + (1.0 - keep) * plane
        self.visits[index] += 1

    def update_scale(self) -> None:
        """Set the scale from the residuals of all visited photos."""
        seen = [self.photo_residuals(int(n)).ravel()[::7] for n in np.flatnonzero(self.visits)]
        if seen:
            self.scale = max(MIN_RESIDUAL_SCALE, SCALE_MEDIANS * float(np.median(np.concatenate(seen))))

    def block_weights(self, index: int) -> NDArray[np.float32]:
        """Weights [h,w] of a photo's blocks."""
        from scipy.ndimage import maximum_filter

        own = self.photo_residuals(index)
        around = np.where(own > 0.5 * self.scale, maximum_filter(own, 3, mode="nearest"), own)
        weights = 1.0 / (1.0 + (around / self.scale) ** 2) ** 2
        return np.maximum(weights, MIN_BLOCK_WEIGHT).astype(np.float32)

    def scale_weights(self, index: int, weights: NDArray[np.float32]) -> None:
        """Multiply the pixel weights [tiles,AREA] of a photo at full size by its block weights."""
        if not self.visits[index]:
            return
        down, across = self._tiles[index]
        blocks = self.block_weights(index)
        tiled = blocks.reshape(down, _SIDE, across, _SIDE).transpose(0, 2, 1, 3).reshape(-1, _SIDE, _SIDE)
        pixels = np.repeat(np.repeat(tiled, BLOCK_PIXELS, axis=1), BLOCK_PIXELS, axis=2)
        weights *= pixels.reshape(-1, AREA)
