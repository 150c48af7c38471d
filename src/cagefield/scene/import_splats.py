"""Splat file as a scene: box of interest, surroundings, and cameras around it.

Splat files hold no cameras and do not say where up is. Coordinates stay the file's; cameras turn around the
middle of the splats, upright by the axis that is given.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cagefield.cameras.camera import Camera, turntable
from cagefield.datasets.transforms.transforms_json import remove_scale
from cagefield.datasets.views import Dataset
from cagefield.errors import FieldError
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.splat_table import MIN_VISIBLE_OPACITY
from cagefield.typing import Array, Float32

Up = Literal["y-down", "y-up", "z-up", "z-down", "x-up", "x-down"]
Cameras = dict[str, tuple[Camera, ...]]

FAR_SHARE = 8.0
"""A file holds surroundings where the farthest hundredth of its splats is this many times as far from the
middle as half of them."""

BOX_MARGIN_SHARE = 0.05
"""Room around the splats in the box, in shares of its size."""

CAMERA_RINGS = ((0.0, 16), (25.0, 16), (50.0, 16))
"""Elevation, degrees, and number of cameras to look from; those of the test views lie between them."""

TEST_RING = (12.0, 8)
FOV_X = math.radians(45.0)
SIDE = 800  # pixels


@dataclass(frozen=True)
class ImportedSplats:
    """Imported splats: the field with its box, cameras by split, and its background."""

    field: SplatField
    cameras: Cameras
    background: tuple[float, float, float]


def import_splats(
    field: SplatField,
    up: Up = "y-down",
    *,
    dataset: Dataset | None = None,
    unbounded: bool | None = None,
) -> ImportedSplats:
    """The splats of a file, seen by the cameras of the data set that they were trained on, else by rings.

    `up` says which way the file's axes are turned; `unbounded` that splats beyond the box are surroundings;
    left out, the distances of the splats say so. The cameras of a data set are taken back to the coordinates
    of its reconstruction, in which 3DGS trains.

    Raises:
        FieldError: no splat that is visible.
    """
    visible = field.opacities >= MIN_VISIBLE_OPACITY
    if not visible.any():
        raise FieldError("the file holds no splat that is visible; export it again")
    means = field.means[visible]
    middle = np.array([np.median(column) for column in _columns(means)])
    distance = np.zeros(len(means))
    for column, at in zip(_columns(means), middle, strict=True):
        np.maximum(distance, np.abs(column - at), out=distance)
    half, far = np.quantile(distance, (0.5, 0.99))
    if unbounded is None:
        unbounded = bool(far > FAR_SHARE * half)
    if unbounded:
        reach = max(1.5 * float(half), 1e-6)
        bounds = np.stack([middle - reach, middle + reach])
    else:
        bounds = _whole(means)
    field = replace(field, bounds=bounds, unbounded=unbounded)
    cameras = _rings(field, up) if dataset is None else _cameras(dataset, np.array(field.offset))
    return ImportedSplats(field, cameras, (0.0,) * 3 if unbounded else (1.0,) * 3)


def axis_of(up: Up) -> NDArray[np.float64]:
    """The unit direction [3] that is up."""
    return np.eye(3)["xyz".index(up[0])] * (1.0 if up.endswith("up") else -1.0)


def nearest_up(up: ArrayLike) -> Up:
    """The axis that is nearest to a direction [3] that is up."""
    return max(get_args(Up), key=lambda name: float(axis_of(name) @ np.asarray(up)))


def _columns(means: Float32) -> Iterator[Array]:
    """The coordinates along each axis in float64, one axis at a time: all of them take much memory."""
    return (means[:, axis].astype(np.float64) for axis in range(3))


def _whole(means: Float32) -> Array:
    """The box of nearly all means, with room around it."""
    low, high = np.stack([np.quantile(column, (0.001, 0.999)) for column in _columns(means)], axis=1)
    room = BOX_MARGIN_SHARE * max(float((high - low).max()), 1e-6)
    return np.stack([low - room, high + room])


def _rings(field: SplatField, up: Up) -> Cameras:
    """Cameras around the box that see all of it; of surroundings, from where such captures are taken."""
    axis = axis_of(up)
    radius = float(np.linalg.norm(field.half_size)) / math.sin(0.5 * FOV_X)
    if field.unbounded:
        radius = 1.6 * float(field.half_size.max())

    def ring(elevation: float, count: int) -> tuple[Camera, ...]:
        return turntable(
            field.center, radius, count, elevation=math.radians(elevation), up=axis,
            width=SIDE, height=SIDE, fov_x=FOV_X,
        )  # fmt: skip

    return {
        "train": tuple(camera for part in CAMERA_RINGS for camera in ring(*part)),
        "test": ring(*TEST_RING),
    }


def _cameras(dataset: Dataset, offset: Array) -> Cameras:
    """The cameras of a data set in the coordinates of its reconstruction less the field's offset [3]."""
    back = np.linalg.inv(dataset.source_to_world)
    back[:3] -= offset[:, None] * back[3]
    splits = {"train": dataset.train, "test": dataset.test, "val": dataset.val}
    return {
        name: tuple(view.camera.with_c2w(remove_scale(back @ view.camera.c2w)[0]) for view in views)
        for name, views in splits.items()
        if views
    }
