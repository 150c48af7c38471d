"""Robust weights of regions of photos, from low-frequency residuals across epochs.

A region that contradicts the other photos (somebody who walks through, a backdrop that moves) keeps a color
that no single field explains. Fine texture that the field does not resolve yet does not: its signed residual
averages out over a block. So each photo has, for each block of BLOCK x BLOCK pixels, a running mean of the
residual r_B = |mean_B(picture - photo)| over color channels, and the weight

    w_B = max(MIN_WEIGHT, 1 / (1 + (r_B / s)^2)^2),   s = max(MIN_SCALE, SCALE_MEDIANS median(r)),

Geman and McClure's, the median over blocks of all photos; r_B is taken from the largest residual among a
block's neighbors where the block contradicts itself by half the scale, so that outlines of an outlier go too.

Source: Sabour et al., "RobustNeRF" (2023), for regions in place of pixels; Barron, "A general and adaptive
robust loss function" (2019).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cagefield.rendering.splats.kernels.projection import AREA, TILE

BLOCK = 8
"""Pixels of a block's side."""

MEMORY = 0.5
"""Share of a block's residual that the next visit of the photo keeps."""

MIN_SCALE = 0.06
"""Least residual at which a weight falls to a quarter, of colors in [0,1]."""

SCALE_MEDIANS = 8.0
"""Residual at which a weight falls to a quarter, in medians of all blocks' residuals."""

MIN_WEIGHT = 0.15
"""Least weight of a block: one that no other photo shows is fitted all the same, if more slowly."""

FROM = 0.25
"""Progress of a training from which weights count: before, the field is too coarse to contradict."""

_SIDE = TILE // BLOCK


class RobustWeights:
    """Running residuals of the blocks of V photos, and the weights that they have.

    Attributes:
        residuals: [sum of blocks] float32, those of all photos one after the other, row by row.
        visits: [V] int64, how often each photo was taken in.
        scale: residual at which a weight falls to a quarter.
    """

    def __init__(self, tiles: Sequence[tuple[int, int]]) -> None:
        """`tiles` are (down, across) of each photo at its whole size."""
        self._tiles = tiles
        self._ends = np.cumsum([0, *(down * across * _SIDE**2 for down, across in tiles)])
        self.residuals: NDArray[np.float32] = np.zeros(int(self._ends[-1]), np.float32)
        self.visits: NDArray[np.int64] = np.zeros(len(tiles), np.int64)
        self.scale = MIN_SCALE

    def of_photo(self, index: int) -> NDArray[np.float32]:
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
        """Takes in a photo's residuals: `slopes` [tiles,3,AREA] are gain times (picture - photo)."""
        down, across = self._tiles[index]
        difference = slopes / gain[:, None]
        if valid is not None:
            difference = difference * valid[:, None]
        blocks = difference.reshape(-1, 3, _SIDE, BLOCK, _SIDE, BLOCK).mean(axis=(3, 5))
        size = np.sqrt((blocks**2).sum(axis=1))
        plane = size.reshape(down, across, _SIDE, _SIDE).transpose(0, 2, 1, 3).reshape(down * _SIDE, -1)
        keep = MEMORY if self.visits[index] else 0.0
        known = self.of_photo(index)
        known[:] = keep * known + (1.0 - keep) * plane
        self.visits[index] += 1

    def update_scale(self) -> None:
        """Sets the scale by the residuals of all photos so far."""
        seen = [self.of_photo(int(n)).ravel()[::7] for n in np.flatnonzero(self.visits)]
        if seen:
            self.scale = max(MIN_SCALE, SCALE_MEDIANS * float(np.median(np.concatenate(seen))))

    def block_weights(self, index: int) -> NDArray[np.float32]:
        """Weights [h,w] of a photo's blocks."""
        from scipy.ndimage import maximum_filter

        own = self.of_photo(index)
        around = np.where(own > 0.5 * self.scale, maximum_filter(own, 3, mode="nearest"), own)
        weights = 1.0 / (1.0 + (around / self.scale) ** 2) ** 2
        return np.maximum(weights, MIN_WEIGHT).astype(np.float32)

    def weigh(self, index: int, weights: NDArray[np.float32]) -> None:
        """Scales weights [tiles,AREA] of a photo at its whole size by those of its blocks."""
        if not self.visits[index]:
            return
        down, across = self._tiles[index]
        blocks = self.block_weights(index)
        tiled = blocks.reshape(down, _SIDE, across, _SIDE).transpose(0, 2, 1, 3).reshape(-1, _SIDE, _SIDE)
        pixels = np.repeat(np.repeat(tiled, BLOCK, axis=1), BLOCK, axis=2)
        weights *= pixels.reshape(-1, AREA)
