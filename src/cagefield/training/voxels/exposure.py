"""Exposure gains of the training photos, fitted with the field: photo = gain x image, per channel."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.device_buffers import to_device

SUMS_DECAY = 0.995
"""Decay of the sums per batch."""

PRIOR_WEIGHT = 0.05
"""Weight of the prior gain 1 in a photo's fit, relative to the mean C C of the photos."""

GAIN_RANGE = (0.5, 2.0)
"""Limits of a gain, before all gains are scaled to mean 1."""


class Exposure:
    """Exposure gains of V photos; all 1 unless `fitted`.

    Attributes:
        sums: [V,6] decayed sums of C photo and of C C per channel, C the rendered color.
        gains: device [V,3] float32 gains of the march, as of the last `refresh`.
    """

    def __init__(self, photos: int, fitted: bool) -> None:
        self.fitted = fitted
        self.sums: NDArray[np.float64] = np.zeros((photos, 6))
        self.gains: Any = to_device(np.ones((photos, 3), np.float32))

    def add(self, views: NDArray[np.int32], sums: NDArray[np.float32]) -> None:
        """Add the sums [P,6] of a batch's patches, of the views [P]."""
        self.sums *= SUMS_DECAY
        np.add.at(self.sums, views, sums)

    def values(self) -> NDArray[np.float32]:
        """Least-squares gains [V,3] of all batches so far, scaled to mean 1."""
        if not self.fitted:
            return np.ones((len(self.sums), 3), np.float32)
        prior = PRIOR_WEIGHT * self.sums[:, 3:].mean(axis=0) + 1e-6
        gains = (self.sums[:, :3] + prior) / (self.sums[:, 3:] + prior)
        gains = np.clip(gains, *GAIN_RANGE)
        return np.asarray(gains / gains.mean(axis=0), np.float32)

    def refresh(self) -> None:
        """Set the gains of the march to `values()`."""
        self.gains.from_numpy(self.values().reshape(-1))

    def restore(self, sums: NDArray[np.float64], gains: NDArray[np.float32]) -> None:
        """Set the sums and gains to those of a checkpoint."""
        self.sums = sums
        self.gains = to_device(gains.astype(np.float32))
