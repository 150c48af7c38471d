"""A checkpoint of another program with its data set: the field and its cameras, in the field's world."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from cagefield.cameras.camera import Camera, turntable

if TYPE_CHECKING:
    from cagefield.datasets import Dataset
    from cagefield.formats.external.checkpoint import ExternalCheckpoint

ORBIT_FOV = 0.6911112070083618
"""Horizontal field of view of cameras on an orbit, radians: that of the NeRF-synthetic scenes."""


def cameras_of(checkpoint: ExternalCheckpoint, dataset: Dataset | None) -> dict[str, tuple[Camera, ...]]:
    """Cameras by split: the data set's, in the field's world, or on an orbit around the field's box."""
    if dataset is not None:
        splits = {"train": dataset.train, "test": dataset.test, "val": dataset.val}
        return {
            name: tuple(checkpoint.world.transform_camera(view.camera) for view in views)
            for name, views in splits.items()
            if views
        }
    lower, upper = checkpoint.field.bounds
    distance = checkpoint.distance
    if distance is None:
        distance = 1.5 * float(np.linalg.norm(upper - lower))
    center = 0.5 * (lower + upper)
    return {
        split: turntable(
            center, distance, n, elevation=math.radians(30.0), width=400, height=400, fov_x=ORBIT_FOV
        )
        for split, n in (("train", 24), ("test", 8))
    }
