"""A checkpoint of another program with its data set: the field and its cameras, in the field's world."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np

from cagefield.cameras.camera import Camera, turntable
from cagefield.datasets.transforms.transforms_json import remove_scale
from cagefield.fields.external.external_field import number

if TYPE_CHECKING:
    from cagefield.datasets import Dataset
    from cagefield.formats.external.checkpoint import ExternalCheckpoint

ORBIT_FOV = 0.6911112070083618
"""Horizontal field of view of cameras on an orbit, radians: that of the NeRF-synthetic scenes."""


def with_data_scale(checkpoint: ExternalCheckpoint, scale: float) -> ExternalCheckpoint:
    """Checkpoint whose training multiplied the data set's camera positions by another factor.

    Raises:
        FieldError: a factor that is not from 1e-6 to 1e6.
    """
    world = dataclasses.replace(checkpoint.world, scale=number("data scale", scale, 1e-6, 1e6))
    return dataclasses.replace(checkpoint, world=world)


def cameras_of(checkpoint: ExternalCheckpoint, dataset: Dataset | None) -> dict[str, tuple[Camera, ...]]:
    """Cameras by split, in the field's world: the data set's, the checkpoint's, or those of an orbit."""
    if dataset is not None:
        splits = {"train": dataset.train, "test": dataset.test, "val": dataset.val}
        return {
            name: tuple(_placed(view.camera, checkpoint, dataset) for view in views)
            for name, views in splits.items()
            if views
        }
    if checkpoint.cameras:
        return {"train": checkpoint.cameras, "test": checkpoint.cameras[::8]}
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


def _placed(camera: Camera, checkpoint: ExternalCheckpoint, dataset: Dataset) -> Camera:
    """A data set's camera in the field's world."""
    if checkpoint.from_source:
        camera = camera.with_c2w(remove_scale(np.linalg.inv(dataset.source_to_world) @ camera.c2w)[0])
    return checkpoint.world.transform_camera(camera)
