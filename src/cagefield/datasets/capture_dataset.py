"""Data sets of unbounded captures, and intrinsics scaled to resized photos."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from cagefield.cameras.camera import Camera
from cagefield.datasets.far_origin import move_near_origin
from cagefield.datasets.notices import warn
from cagefield.datasets.photos import read_header
from cagefield.datasets.views import Dataset, SparsePoints, View, hold_out
from cagefield.errors import DatasetError
from cagefield.files.safe_open import real_path

Size = tuple[int, int]


def build_unbounded_dataset(
    folder: Path,
    views: Sequence[View],
    holdout: int,
    bounds: npt.NDArray[np.float64],
    leveling: npt.NDArray[np.float64],
    depths: tuple[float, float] | None,
    points: SparsePoints | None = None,
) -> Dataset:
    """Data set of the photos of an unbounded scene, moved near the origin; every `holdout`-th view tests.

    `bounds` [2,3] is the cube of interest and `leveling` [4,4] the rotation from the file's world to the data
    set's; `depths` are the nearest and farthest depth, in world units.
    """
    train, test = hold_out(views, holdout)
    dataset = Dataset(
        name=real_path(folder).name,
        path=folder,
        train=train,
        test=test,
        val=(),
        unbounded=True,
        bounds=bounds,
        white_background=False,
        source_to_world=leveling,
        depths=depths,
        points=points,
    )
    return move_near_origin(dataset, leveling[:3, :3].T)


def resize_camera_to_photo(where: str, camera: Camera, photo: Path, factor: int) -> Camera:
    """`camera` at the size of a photo stored at 1/`factor` of the camera's size.

    Raises DatasetError where the photo's size differs from the expected one by more than rounding.
    """
    header = read_header(photo)
    for axis, stored, full in (("wide", header.width, camera.width), ("high", header.height, camera.height)):
        if abs(stored * factor - full) >= factor:
            raise DatasetError(
                f"{where}: {photo} is {stored} pixels {axis}, the intrinsics say {full}"
                + (f" / {factor}" if factor > 1 else "")
                + "; use the photos that the intrinsics belong to"
            )
    return camera.resized(header.width, header.height)


def common_rescaled_size(camera_sizes: Sequence[Size], photo_sizes: Sequence[Size]) -> Size | None:
    """(width, height) of photos that were all scaled alike since the intrinsics were written, or None.

    The photos count as scaled where all of `photo_sizes` are equal, all of `camera_sizes` are another size,
    and the two aspects agree to a pixel.
    """
    if len(set(camera_sizes)) != 1 or len(set(photo_sizes)) != 1 or camera_sizes[0] == photo_sizes[0]:
        return None
    (width, height), (full_width, full_height) = photo_sizes[0], camera_sizes[0]
    scale_x, scale_y = width / full_width, height / full_height
    agrees = abs(width - scale_y * full_width) <= max(1.0, scale_y) or abs(
        height - scale_x * full_height
    ) <= max(1.0, scale_x)
    return photo_sizes[0] if agrees else None


def warn_of_scaling(where: str, camera_size: Size, photo_size: Size) -> None:
    """Warn that intrinsics of `camera_size` pixels are scaled to photos of `photo_size` pixels."""
    warn(
        f"{where}: the intrinsics are of {camera_size[0]}x{camera_size[1]} pixels, all photos have "
        f"{photo_size[0]}x{photo_size[1]}: the intrinsics are scaled by {photo_size[0] / camera_size[0]:.4g}"
    )
