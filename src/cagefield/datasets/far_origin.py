"""Captures in map coordinates (UTM, Earth-centered), moved near the origin.

Poses and points are float64, training is float32, which rounds a coordinate c by up to 2^-24 c. At
MAX_DISTANCE_SPREADS the rounding is 6e-5 of the cameras' spread: a tenth of a pixel in a photo with a focal
length of 1500 pixels taken from one spread away. Larger distances would be visible.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from cagefield.datasets.nerf_normalization import Similarity, all_cameras
from cagefield.datasets.notices import warn
from cagefield.datasets.views import Dataset

FloatArray = npt.NDArray[np.float64]

MAX_DISTANCE_SPREADS = 1000.0
"""Maximum distance of the cameras' median position from the origin, in units of the cameras' spread."""


def move_near_origin(dataset: Dataset, to_file: FloatArray | None = None) -> Dataset:
    """Data set in its file's axes with its cameras around the origin, where they are far from it.

    The spread is the median distance of the cameras to their median position, or half of the largest edge of
    `bounds` where that is more. The field `offset` of the result is the subtracted vector, a multiple of a
    power of ten, and `source_to_world` the whole motion; one warning names the offset. `to_file` [3,3] undoes
    a rotation that leveled the world, so that the offset is one of the file's coordinates. Other data sets
    are returned unchanged.
    """
    rotation = np.eye(3) if to_file is None else to_file
    origins = np.stack([camera.origin for camera in all_cameras(dataset)])
    median_origin = np.median(origins, axis=0)
    half_size = 0.5 * float((dataset.bounds[1] - dataset.bounds[0]).max())
    spread = max(float(np.median(np.linalg.norm(origins - median_origin, axis=1))), half_size)
    if np.linalg.norm(median_origin) <= MAX_DISTANCE_SPREADS * spread:
        return dataset
    step = 10.0 ** np.floor(np.log10(spread))
    offset = np.round(rotation @ median_origin / step) * step + 0.0
    rigid = np.eye(4)
    rigid[:3, :3], rigid[:3, 3] = rotation, -offset
    # Bounds of turned data sets are cubes: their edges keep their directions.
    center, size = rotation @ dataset.bounds.mean(axis=0) - offset, dataset.bounds[1] - dataset.bounds[0]
    moved = Similarity(rigid, 1.0).transform_dataset(
        dataset, np.stack([center - 0.5 * size, center + 0.5 * size])
    )
    x, y, z = offset.tolist()
    warn(
        f"{dataset.path}: its coordinates are far from the origin; ({x:.15g}, {y:.15g}, {z:.15g}) is taken "
        "off, kept, and added where splats are exported as .ply or .glb"
    )
    return replace(moved, offset=(x, y, z))
