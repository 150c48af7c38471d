"""A nerf-pytorch checkpoint with its config and data set: the field, its cameras, its background.

World units are those of the training: the data set's own for Blender scenes. For a forward-facing LLFF
capture nerf-pytorch scales the poses until the nearest bound is 4/3 and puts the mean camera at the origin,
looking along -z; so are the cameras here. nerf-pytorch puts pixel centers at whole numbers; the cameras are
shifted by half a pixel so that their rays are the ones that the networks know.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera, turntable
from cagefield.datasets import Dataset
from cagefield.datasets.llff import POSES_FILE
from cagefield.datasets.nerf_normalization import (
    Similarity,
    all_cameras,
    mean_camera_similarity,
    ndc_box,
    ndc_ratios,
)
from cagefield.errors import FieldError
from cagefield.fields.nerf_field import NerfField
from cagefield.formats.nerf.nerf_pytorch import Checkpoint
from cagefield.formats.nerf.nerf_pytorch_config import SamplingSettings

BLENDER_FOV = 0.6911112070083618
"""Horizontal field of view of the NeRF-synthetic cameras, radians."""

Cameras = dict[str, tuple[Camera, ...]]


@dataclasses.dataclass(frozen=True)
class ImportedNerf:
    """Imported NeRF: the field, its cameras by split, and its background."""

    field: NerfField
    cameras: Cameras
    background: tuple[float, float, float]


def import_nerf(
    checkpoint: Checkpoint,
    settings: SamplingSettings,
    dataset: Dataset | None = None,
    fov_x: float | None = None,
) -> ImportedNerf:
    """The field of a checkpoint, in its own world, seen by the data set's cameras or by an orbit's.

    `fov_x` (radians) is the field of view of a forward-facing capture's photos, 4:3, where its data set is
    not at hand.

    Raises:
        FieldError: NDC without a data set or `fov_x`, or with one that is no LLFF capture.
    """
    if dataset is None:
        cameras = _guessed_cameras(settings, fov_x)
    elif settings.ndc:
        cameras = _llff_cameras(dataset)
    else:
        cameras = _cameras(dataset, Similarity(np.eye(4), 1.0))
    bounds = _bounds(settings, dataset)
    ndc = None
    if settings.ndc:
        ndc = ndc_ratios([camera for group in cameras.values() for camera in group])
        bounds = ndc_box(ndc)
    field = NerfField(
        checkpoint.coarse,
        checkpoint.fine,
        bounds,
        settings.near,
        settings.far,
        settings.samples,
        settings.lindisp,
        ndc,
    )
    return ImportedNerf(field, cameras, (1.0,) * 3 if settings.white_background else (0.0,) * 3)


def shifted(camera: Camera) -> Camera:
    """The camera with the rays that nerf-pytorch casts for its pixels: centers at whole numbers."""
    return dataclasses.replace(camera, cx=camera.cx + 0.5, cy=camera.cy + 0.5)


def _bounds(settings: SamplingSettings, dataset: Dataset | None) -> NDArray[np.float64]:
    if dataset is not None and not dataset.unbounded:
        return dataset.bounds
    half = 0.375 * (settings.far - settings.near)
    return np.array([[-half] * 3, [half] * 3])


def _cameras(dataset: Dataset, to_field: Similarity) -> Cameras:
    """The data set's cameras in the field's world."""
    splits = {"train": dataset.train, "test": dataset.test, "val": dataset.val}
    return {
        name: tuple(shifted(to_field.transform_camera(view.camera)) for view in views)
        for name, views in splits.items()
        if views
    }


def _llff_cameras(dataset: Dataset) -> Cameras:
    if not (dataset.path / POSES_FILE).is_file() or dataset.depths is None:
        raise FieldError(
            f"the checkpoint was trained in NDC, which needs the capture's depth bounds; {dataset.path} has "
            f"no {POSES_FILE}: give the LLFF folder it was trained on"
        )
    return _cameras(dataset, mean_camera_similarity(all_cameras(dataset), dataset.depths[0]))


def _guessed_cameras(settings: SamplingSettings, fov_x: float | None) -> Cameras:
    if not settings.ndc:
        radius = 0.5 * (settings.near + settings.far)
        return {
            split: turntable(
                (0, 0, 0), radius, n, elevation=math.radians(30.0), width=400, height=400, fov_x=BLENDER_FOV
            )
            for split, n in (("train", 24), ("test", 8))
        }
    if fov_x is None:
        raise FieldError(
            "the checkpoint was trained in NDC, which depends on the photos' field of view; give the data "
            "set (--data), or its horizontal field of view (--fov-deg)"
        )
    places = [(x, y) for y in (-0.2, 0.0, 0.2) for x in (-0.3, 0.0, 0.3)]
    cameras = []
    for x, y in places:
        pose = np.eye(4)
        pose[:2, 3] = x, y
        cameras.append(Camera.from_fov(pose, 504, 378, fov_x))
    return {"train": tuple(cameras), "test": (cameras[4],)}
