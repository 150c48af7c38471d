"""LLFF data sets: `poses_bounds.npy` and the photos it was made from.

Each row of the array [N,17] is a matrix [3,5], row by row, and the near and far depth of one photo, in the
order of the sorted file names. The matrix's columns are the camera's down, right and backward axes, its
position, and (height, width, focal length) in pixels. There is no lens distortion in the format: where the
folder also has the COLMAP model, opening that (`sparse/0`) honours it.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from cagefield.cameras import Camera
from cagefield.datasets.photos import EXTENSIONS, choose_downscale, photo_folders, read_header
from cagefield.datasets.region import cube_of_interest, levelling_rotation
from cagefield.datasets.views import Dataset, SparsePoints, View, hold_out
from cagefield.errors import CameraError, DatasetError

POSES_FILE = "poses_bounds.npy"


def load_llff(path: Path, downscale: int | None, holdout: int) -> Dataset:
    """The unbounded data set of a folder with `poses_bounds.npy`, or of that file.

    Every `holdout`-th view tests. The world is rotated so that up is +z and the cameras look towards +y (see
    `levelling_rotation`). Photos come from `images`, `images_4`, ...: the folder whose factor is the largest
    that divides the factor wanted.
    """
    folder = path if path.is_dir() else path.parent
    file = folder / POSES_FILE
    rows = _read_rows(file)
    matrices = rows[:, :15].reshape(-1, 3, 5)
    down, right, back, position = np.moveaxis(matrices[:, :, :4], 2, 0)
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, :3] = np.stack([right, -down, back, position], axis=2)
    levelling = np.eye(4)
    levelling[:3, :3] = levelling_rotation(poses)

    folders = photo_folders(folder)
    photos = {factor: _photos(images) for factor, images in folders.items()}
    complete = {factor: folders[factor] for factor, found in photos.items() if len(found) == len(rows)}
    if not complete:
        found = ", ".join(f"{folders[factor].name} has {len(photos[factor])}" for factor in folders)
        raise DatasetError(
            f"{file} has poses of {len(rows)} photos, but {found or 'there is no folder images'}; poses and "
            "photos are paired by order, so all of them must be there"
        )
    factor = choose_downscale(int(matrices[:, :2, 4].max()), downscale, complete)
    stored = max(f for f in complete if factor % f == 0)
    views = []
    for index, photo in enumerate(photos[stored]):
        where = f"{file}: row {index} ({photo.name})"
        height, width, focal = matrices[index, :, 4]
        try:
            camera = Camera(
                levelling @ poses[index], width, height, focal, focal, 0.5 * float(width), 0.5 * float(height)
            )
        except CameraError as error:
            raise DatasetError(f"{where}: {error}") from error
        view = View(photo.name, stored_camera(where, camera, photo, stored), photo)
        views.append(view.downscaled(factor // stored))
    bounds = cube_of_interest([view.camera for view in views], rows[:, 15:])
    return unbounded_capture(
        folder, views, holdout, bounds, levelling, (float(rows[:, 15].min()), float(rows[:, 16].max()))
    )


def unbounded_capture(
    folder: Path,
    views: Sequence[View],
    holdout: int,
    bounds: npt.NDArray[np.float64],
    levelling: npt.NDArray[np.float64],
    depths: tuple[float, float] | None,
    points: SparsePoints | None = None,
) -> Dataset:
    """The data set of photos of an unbounded scene; every `holdout`-th view tests."""
    train, test = hold_out(views, holdout)
    return Dataset(
        name=folder.resolve().name,
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


def _read_rows(file: Path) -> npt.NDArray[np.float64]:
    try:
        rows = np.load(file, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise DatasetError(f"{file}: cannot be read as a NumPy array ({error}); copy it again") from error
    if not isinstance(rows, np.ndarray) or rows.ndim != 2 or rows.shape[1] != 17 or len(rows) == 0:
        raise DatasetError(f"{file}: must be an array [N,17] (LLFF's poses and depth bounds)")
    rows = rows.astype(np.float64)
    if not np.isfinite(rows).all():
        row, column = np.argwhere(~np.isfinite(rows))[0].tolist()
        raise DatasetError(
            f"{file}: row {row}, column {column} is {rows[row, column]}; every entry must be finite"
        )
    near, far = rows[:, 15], rows[:, 16]
    if np.any((near <= 0) | (far <= near)):
        row = int(np.argmax((near <= 0) | (far <= near)))
        raise DatasetError(
            f"{file}: row {row} has the depth bounds {near[row]:g} to {far[row]:g}; "
            "they must be positive and grow"
        )
    return rows


def _photos(folder: Path) -> list[Path]:
    return sorted(file for file in folder.iterdir() if file.suffix.lower() in EXTENSIONS)
