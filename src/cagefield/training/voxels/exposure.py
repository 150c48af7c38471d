"""Exposures of the training photos, fitted beside the field: photo = gain x picture, per channel."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.rendering.voxels.device_grid import to_device

DECAY = 0.995
"""Of the sums, for each batch."""

PRIOR = 0.05
"""Weight of gain 1 in a photo's fit, relative to what the photos' mean holds."""

LIMITS = (0.5, 2.0)
"""A gain before the gains are scaled to mean 1."""


class Exposure:
    """Gains of V photos; all 1 where they are not `fitted`.

    Attributes:
        sums: [V,6] decayed sums of C photo and of C C per channel, C the picture.
        gains: device [V,3] float32, those that the march uses; `refresh` brings them up to date.
    """

    def __init__(self, photos: int, fitted: bool) -> None:
        self.fitted = fitted
        self.sums: NDArray[np.float64] = np.zeros((photos, 6))
        self.gains: Any = to_device(np.ones((photos, 3), np.float32))

    def add(self, views: NDArray[np.int32], sums: NDArray[np.float32]) -> None:
        """Takes in a batch: sums [P,6] of patches of these views [P]."""
        self.sums *= DECAY
        np.add.at(self.sums, views, sums)

    def values(self) -> NDArray[np.float32]:
        """The least-squares gains [V,3] of all batches so far; their mean is 1."""
        if not self.fitted:
            return np.ones((len(self.sums), 3), np.float32)
        prior = PRIOR * self.sums[:, 3:].mean(axis=0) + 1e-6
        gains = (self.sums[:, :3] + prior) / (self.sums[:, 3:] + prior)
        gains = np.clip(gains, *LIMITS)
        return np.asarray(gains / gains.mean(axis=0), np.float32)

    def refresh(self) -> None:
        """From now on the march uses the gains of all batches so far."""
        self.gains.from_numpy(self.values().reshape(-1))

    def go_to(self, sums: NDArray[np.float64], gains: NDArray[np.float32]) -> None:
        """Goes on with these sums and gains in use."""
        self.sums = sums
        self.gains = to_device(gains.astype(np.float32))
