"""Training resolution: the whole factor by which photos are shrunk, from their size and the training time.

A training step costs about as much as its photo has pixels, and the number of steps needed hardly depends on
the size, so the pixels that can be resolved grow with the time: side = REFERENCE_SIDE_PIXELS sqrt(minutes /
REFERENCE_MINUTES), with more for few photos, each of which is then used more often. The factor is the whole
number whose side is nearest to that, by ratio.
"""

from __future__ import annotations

import math
from dataclasses import replace

from cagefield.datasets.views import Dataset, View

REFERENCE_SIDE_PIXELS = 640
"""Longer side of the photos of a training of REFERENCE_MINUTES."""

REFERENCE_MINUTES = 5.0

SIDE_RANGE_PIXELS = (600.0, 1600.0)
"""Least and largest longer side that the factor aims at."""

REFERENCE_PHOTOS = 80
"""Number of photos at which REFERENCE_SIDE_PIXELS applies."""

PHOTOS_EXPONENT = 0.125
"""Exponent of REFERENCE_PHOTOS / photos: four times as many photos have sides smaller by a sixth."""


def training_factor(longer_side: int, photos: int, minutes: float) -> int:
    """Whole factor, at least 1, by which photos of `longer_side` pixels are shrunk for a training."""
    target_side = (
        REFERENCE_SIDE_PIXELS
        * math.sqrt(minutes / REFERENCE_MINUTES)
        * (REFERENCE_PHOTOS / max(photos, 1)) ** PHOTOS_EXPONENT
    )
    target_side = min(max(target_side, SIDE_RANGE_PIXELS[0]), SIDE_RANGE_PIXELS[1])
    factors = range(1, max(1, math.ceil(longer_side / target_side)) + 1)
    return min(factors, key=lambda factor: abs(math.log(longer_side / factor / target_side)))


def shrink_to_training_resolution(dataset: Dataset, minutes: float) -> Dataset:
    """Data set with its photos shrunk by `training_factor`, from their full size."""
    full_size = {name: [view.whole() for view in getattr(dataset, name)] for name in ("train", "test", "val")}
    sides = [max(v.camera.width, v.camera.height) for views in full_size.values() for v in views]
    factor = training_factor(max(sides), len(full_size["train"]), minutes)
    shrunk = {name: tuple(view.downscaled(factor) for view in views) for name, views in full_size.items()}
    return replace(dataset, **shrunk)  # type: ignore[arg-type]


def describe_resolution(dataset: Dataset) -> str:
    """One line of text: the photos' size, the training's, and the factor."""

    def sizes(views: list[View]) -> str:
        distinct = sorted({f"{view.camera.width}x{view.camera.height}" for view in views})
        return distinct[0] if len(distinct) == 1 else f"{len(distinct)} sizes up to {distinct[-1]}"

    views = list(dataset.train)
    factor = max(view.downscale for view in views)
    if factor == 1:
        return f"photos are trained at their size, {sizes(views)}"
    full_size = sizes([view.whole() for view in views])
    return f"photos of {full_size} are trained at {sizes(views)} (--downscale {factor})"
