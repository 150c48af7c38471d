"""Cost of a picture: seconds = fixed + per ray * rays, fitted to the last pictures of each size.

Voxels cost what their rays cost. Splats are projected and sorted before the first pixel is drawn: a smaller
picture of them is hardly sooner there, and a view in many tiles costs many times as much.
"""

from __future__ import annotations

import math

import numpy as np

FIRST_RATE = 4e5
"""Rays a second before any was measured."""

MEMORY = 0.8
"""Weight of a size relative to the one rendered after it."""

SIZES_PER_DOUBLING, MAX_SIZES = 2, 8
"""Sizes that are told apart, per doubling of the rays; those that are kept, the last ones."""

MIN_SPREAD = 1.3
"""Ratio of numbers of rays from which on two pictures tell fixed costs from those of rays."""


class FrameCost:
    """See the module."""

    def __init__(self) -> None:
        self.fixed = 0.0
        """Seconds of any picture, however small."""
        self.per_ray = 1.0 / FIRST_RATE
        """Seconds of a ray."""
        self._sizes: dict[int, tuple[float, float]] = {}
        """(rays, seconds) of each size, the last one last."""

    def add(self, rays: float, seconds: float) -> None:
        """A picture of so many rays took so long."""
        rays, seconds = max(rays, 1.0), max(seconds, 1e-4)
        size = round(SIZES_PER_DOUBLING * math.log2(rays))
        _, before = self._sizes.pop(size, (rays, seconds))
        self._sizes[size] = rays, 0.5 * (before + seconds)
        while len(self._sizes) > MAX_SIZES:
            del self._sizes[next(iter(self._sizes))]
        x, y = np.array([*self._sizes.values()]).T
        # Relative errors count alike for small and large pictures.
        weight = MEMORY ** np.arange(len(x))[::-1] / y**2
        mean_x, mean_y = np.average(x, weights=weight), np.average(y, weights=weight)
        slope = 0.0
        if x.max() > MIN_SPREAD * x.min():
            slope = float((weight * (x - mean_x) * (y - mean_y)).sum() / (weight * (x - mean_x) ** 2).sum())
        self.fixed = float(mean_y - slope * mean_x)
        if slope <= 0.0 or self.fixed < 0.0:
            # Rays of one number, or noise: as if all of it were the rays'.
            slope, self.fixed = float((weight * x * y).sum() / (weight * x**2).sum()), 0.0
        self.per_ray = slope

    def rays(self, seconds: float, least: float) -> float:
        """Rays of a picture that takes so long, or whose rays take `least` seconds where it takes longer."""
        return max(seconds - self.fixed, least) / self.per_ray
