"""Cost of pictures: seconds = fixed * pictures + per ray * rays, fitted to the last ones of each size.

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


class FrameCost:
    """See the module."""

    def __init__(self) -> None:
        self.fixed = 0.0
        """Seconds of any picture, however small."""
        self.per_ray = 1.0 / FIRST_RATE
        """Seconds of a ray."""
        self._sizes: dict[tuple[int, int], tuple[int, float, float]] = {}
        """(pictures, rays, seconds) of each number and size, the last one last."""

    def add(self, rays: float, seconds: float, pictures: int = 1) -> None:
        """A picture, or the tiles of one, of so many rays altogether took so long."""
        rays, seconds = max(rays, 1.0), max(seconds, 1e-4)
        size = pictures, round(SIZES_PER_DOUBLING * math.log2(rays))
        before = self._sizes.pop(size, (pictures, rays, seconds))[2]
        self._sizes[size] = pictures, rays, 0.5 * (before + seconds)
        while len(self._sizes) > MAX_SIZES:
            del self._sizes[next(iter(self._sizes))]
        n, x, y = np.array([*self._sizes.values()]).T
        # Relative errors count alike for small and large pictures.
        weight = np.sqrt(MEMORY ** np.arange(len(x))[::-1]) / y
        rows = np.stack([n, x], axis=1) * weight[:, None]
        # Of one size alone the least solution would take part of it for fixed: so as if all were the rays'.
        fixed, per_ray = 0.0, 0.0
        if len(x) > 1:
            fixed, per_ray = np.linalg.lstsq(rows, y * weight, rcond=None)[0]
        if fixed < 0.0 or per_ray <= 0.0:
            fixed, per_ray = 0.0, float((rows[:, 1] * y * weight).sum() / (rows[:, 1] ** 2).sum())
        self.fixed, self.per_ray = float(fixed), float(per_ray)

    def rays(self, seconds: float, least: float) -> float:
        """Rays of a picture that takes so long, or whose rays take `least` seconds where it takes longer."""
        return max(seconds - self.fixed, least) / self.per_ray
