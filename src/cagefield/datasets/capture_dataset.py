"""What LLFF and COLMAP captures share: the data set, and photos of another size than their intrinsics say."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from cagefield.cameras.camera import Camera
from cagefield.datasets.far_origin import near_origin
from cagefield.datasets.notices import warn
from cagefield.datasets.photos import read_header
from cagefield.datasets.views import Dataset, SparsePoints, View, hold_out
from cagefield.errors import DatasetError
from cagefield.files.safe_open import real_path

Size = tuple[int, int]


def unbounded_capture(
    folder: Path,
    views: Sequence[View],
    holdout: int,
    bounds: npt.NDArray[np.float64],
    levelling: npt.NDArray[np.float64],
    depths: tuple[float, float] | None,
    points: SparsePoints | None = None,
) -> Dataset:
    """The data set of photos of an unbounded scene, near the origin; every `holdout`-th view tests."""
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
        source_to_world=levelling,
        depths=depths,
        points=points,
    )
    return near_origin(dataset, levelling[:3, :3].T)


def stored_camera(where: str, camera: Camera, photo: Path, factor: int) -> Camera:
    """`camera` for the size of a photo stored at 1/`factor` of the camera's size.

    Raises DatasetError where the photo's size differs from that by more than rounding.
    """
    header = read_header(photo)
    for side, found, full in (("wide", header.width, camera.width), ("high", header.height, camera.height)):
        if abs(found * factor - full) >= factor:
            raise DatasetError(
                f"{where}: {photo} is {found} pixels {side}, the intrinsics say {full}"
                + (f" / {factor}" if factor > 1 else "")
                + "; use the photos that the intrinsics belong to"
            )
    return camera.resized(header.width, header.height)


def uniform_size(said: Sequence[Size], found: Sequence[Size]) -> Size | None:
    """The (width, height) of photos that were all scaled alike since the intrinsics were written, or None.

    That is where all of `found` have one size, all of `said` another, and their aspects agree to a pixel.
    """
    if len(set(said)) != 1 or len(set(found)) != 1 or said[0] == found[0]:
        return None
    (width, height), (full_width, full_height) = found[0], said[0]
    across, down = width / full_width, height / full_height
    agrees = abs(width - down * full_width) <= max(1.0, down) or abs(height - across * full_height) <= max(
        1.0, across
    )
    return found[0] if agrees else None


def warn_of_scaling(where: str, said: Size, found: Size) -> None:
    """Warns that intrinsics of `said` pixels are scaled to photos of `found` pixels."""
    warn(
        f"{where}: the intrinsics are of {said[0]}x{said[1]} pixels, all photos have {found[0]}x{found[1]}: "
        f"the intrinsics are scaled by {found[0] / said[0]:.4g}"
    )
