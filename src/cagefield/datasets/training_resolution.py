"""Training resolution: the whole factor by which photos are shrunk, from their size and the time there is.

A training step costs about as much as its photo has pixels, and needs about as many steps whatever their
size, so the pixels that can be resolved grow with the time: side = SIDE_PIXELS sqrt(minutes / 5), with
more for few photos, each of which is then seen more often. The factor is the whole number whose result is
nearest to that, by ratio.
"""

from __future__ import annotations

import math
from dataclasses import replace

from cagefield.datasets.views import Dataset, View

SIDE_PIXELS = 640
"""Longer side of the photos of a training of MINUTES."""

MINUTES = 5.0

SIDE_RANGE_PIXELS = (600.0, 1600.0)
"""Least and largest side that is aimed at."""

USUAL_PHOTOS = 80
"""Number of photos that SIDE_PIXELS is for."""

PHOTOS_EXPONENT = 0.125
"""Exponent of USUAL_PHOTOS / photos: four times as many photos have sides smaller by a sixth."""


def training_factor(longer_side: int, photos: int, minutes: float) -> int:
    """Whole factor, at least 1, by which photos of `longer_side` pixels are shrunk for a training."""
    wanted = SIDE_PIXELS * math.sqrt(minutes / MINUTES) * (USUAL_PHOTOS / max(photos, 1)) ** PHOTOS_EXPONENT
    wanted = min(max(wanted, SIDE_RANGE_PIXELS[0]), SIDE_RANGE_PIXELS[1])
    factors = range(1, max(1, math.ceil(longer_side / wanted)) + 1)
    return min(factors, key=lambda factor: abs(math.log(longer_side / factor / wanted)))


def at_training_resolution(dataset: Dataset, minutes: float) -> Dataset:
    """The data set with its photos shrunk by `training_factor`, from the largest that are stored."""
    whole = {name: [view.whole() for view in getattr(dataset, name)] for name in ("train", "test", "val")}
    sides = [max(v.camera.width, v.camera.height) for views in whole.values() for v in views]
    factor = training_factor(max(sides), len(whole["train"]), minutes)
    shrunk = {name: tuple(view.downscaled(factor) for view in views) for name, views in whole.items()}
    return replace(dataset, **shrunk)  # type: ignore[arg-type]


def describe_resolution(dataset: Dataset) -> str:
    """One line: the photos' size, that of the training, and the factor."""

    def sizes(views: list[View]) -> str:
        found = sorted({f"{view.camera.width}x{view.camera.height}" for view in views})
        return found[0] if len(found) == 1 else f"{len(found)} sizes up to {found[-1]}"

    views = list(dataset.train)
    factor = max(view.downscale for view in views)
    if factor == 1:
        return f"photos are trained at their size, {sizes(views)}"
    whole = sizes([view.whole() for view in views])
    return f"photos of {whole} are trained at {sizes(views)} (--downscale {factor})"
