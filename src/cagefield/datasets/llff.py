"""LLFF data sets: `poses_bounds.npy` and its photos.

Each row of the array [N,17] is a matrix [3,5], row by row, and the near and far depth of one photo, in the
order of the sorted file names. The matrix's columns are the camera's down, right and backward axes, its
position, and (height, width, focal length) in pixels. The format has no lens distortion and no points: where
the folder also has the COLMAP model that the poses came from, both are taken from the model.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cagefield.cameras.camera import Camera
from cagefield.datasets.capture_dataset import (
    Size,
    build_unbounded_dataset,
    common_rescaled_size,
    resize_camera_to_photo,
    warn_of_scaling,
)
from cagefield.datasets.colmap.colmap_lenses import LensView, report_resampled
from cagefield.datasets.colmap.colmap_model import (
    find_model,
    image_pose,
    read_model,
    sparse_points,
    view_lenses,
)
from cagefield.datasets.notices import warn
from cagefield.datasets.photo_names import photo_files
from cagefield.datasets.photos import FULL_SIZE_FOLDERS, choose_downscale, photo_folders, read_header
from cagefield.datasets.scene_bounds import cube_of_interest, leveling_rotation
from cagefield.datasets.views import Dataset, SparsePoints, View
from cagefield.errors import CameraError, DatasetError
from cagefield.files.npz import read_array

FloatArray = npt.NDArray[np.float64]

POSES_FILE = "poses_bounds.npy"


def load_llff(path: Path, downscale: int | None, holdout: int) -> Dataset:
    """Unbounded data set of a folder with `poses_bounds.npy`, or of that file.

    Every `holdout`-th view tests. The world is rotated so that up is +z and the cameras look towards +y (see
    `leveling_rotation`). Photos come from `images`, `images_4`, ...: the folder whose factor is the largest
    that divides the factor wanted. Where all photos in `images` have one size and the file another with the
    same aspect, the intrinsics are scaled, with a warning.
    """
    folder = path if path.is_dir() else path.parent
    file = folder / POSES_FILE
    rows = _read_rows(file)
    matrices = rows[:, :15].reshape(-1, 3, 5)
    down, right, back, position = np.moveaxis(matrices[:, :, :4], 2, 0)
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, :3] = np.stack([right, -down, back, position], axis=2)
    leveling = np.eye(4)
    leveling[:3, :3] = leveling_rotation(poses)

    folders, photos = _photos(folder, len(rows))
    complete = {factor: folders[factor] for factor, found in photos.items() if len(found) == len(rows)}
    if not complete:
        found = ", ".join(f"{folders[factor].name} has {len(photos[factor])}" for factor in folders)
        raise DatasetError(
            f"{file} has poses of {len(rows)} photos, but {found or 'there is no folder images'}; poses and "
            "photos are paired by order, so all of them must be there"
        )
    sizes = [(int(width), int(height)) for height, width in matrices[:, :2, 4]]
    rescaled_size = _find_rescaled_size(photos[1], sizes) if 1 in complete else None
    if rescaled_size is not None:
        warn_of_scaling(str(file), sizes[0], rescaled_size)
        matrices[:, :, 4] *= rescaled_size[0] / sizes[0][0]
        matrices[:, :2, 4] = rescaled_size[::-1]
        complete = {1: complete[1]}  # the names of the others count from the old size
    factor = choose_downscale(int(matrices[:, :2, 4].max()), downscale, complete)
    stored = max(f for f in complete if factor % f == 0)
    model = _matching_model(folder, poses)
    views = []
    for index, photo in enumerate(photos[stored]):
        where = f"{file}: row {index} ({photo.name})"
        height, width, focal = matrices[index, :, 4]
        try:
            camera = Camera(
                leveling @ poses[index], width, height, focal, focal, 0.5 * float(width), 0.5 * float(height)
            )
            lens = None if model is None else model.lenses[index].resized(camera.width, camera.height)
            if lens is not None:
                camera = lens.camera.with_c2w(camera.c2w)
        except CameraError as error:
            raise DatasetError(f"{where}: {error}") from error
        camera = resize_camera_to_photo(where, camera, photo, stored)
        view = View(photo.name, camera, photo, source=None if lens is None else lens.source)
        views.append(view.downscaled(factor // stored))
    if model is not None:
        report_resampled(str(file), model.lenses)
    points = None if model is None else model.points([view.name for view in views], leveling)
    positions = None if points is None else points.positions
    bounds = cube_of_interest([view.camera for view in views], rows[:, 15:], positions)
    depths = float(rows[:, 15].min()), float(rows[:, 16].max())
    return build_unbounded_dataset(folder, views, holdout, bounds, leveling, depths, points)


@dataclass(frozen=True, eq=False)
class _Model:
    """COLMAP model that the poses came from: lenses by row, and the similarity `to_file` [4,4] to the file's
    world.
    """

    reconstruction: Any
    names: tuple[str, ...]
    lenses: tuple[LensView, ...]
    to_file: FloatArray

    def points(self, views: Sequence[str], leveling: FloatArray) -> SparsePoints | None:
        """Sparse points of the model in the data set's world; `views` are the views' names by row."""
        names = dict(zip(self.names, views, strict=True))
        return sparse_points(self.reconstruction, names, leveling @ self.to_file)


def _matching_model(folder: Path, poses: FloatArray) -> _Model | None:
    """COLMAP model in the folder whose cameras are `poses` [N,4,4] up to a similarity.

    None where there is no model, where its cameras differ, and where pycolmap is missing.
    """
    model_folder = find_model(folder)
    if model_folder is None or importlib.util.find_spec("pycolmap") is None:
        return None
    try:
        reconstruction, images = read_model(model_folder)
        images.sort(key=lambda image: image.name)
        views = [view_lenses(model_folder, reconstruction.cameras[image.camera_id]) for image in images]
    except DatasetError as error:
        warn(f"{error}; {folder / POSES_FILE} is used without lens and points")
        return None
    if len(images) != len(poses) or any(len(faces) > 1 for faces in views):
        return None
    to_file = _similarity(np.stack([image_pose(image) for image in images]), poses)
    if to_file is None:
        return None
    return _Model(
        reconstruction, tuple(image.name for image in images), tuple(view for (view,) in views), to_file
    )


def _similarity(source: FloatArray, target: FloatArray) -> FloatArray | None:
    """Similarity [4,4] that takes poses [N,4,4] to others; None where the rest error is too large.

    Allowed are half a degree, and a hundredth of the cameras' spread.
    """
    rotations = target[:, :3, :3] @ np.swapaxes(source[:, :3, :3], 1, 2)
    left, _, right = np.linalg.svd(rotations.sum(axis=0))
    rotation = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    cosines = 0.5 * (np.einsum("nij,ij->n", rotations, rotation) - 1.0)
    rotated = source[:, :3, 3] @ rotation.T
    first, second = rotated - rotated.mean(axis=0), target[:, :3, 3] - target[:, :3, 3].mean(axis=0)
    square = float((first**2).sum())
    scale = float((first * second).sum()) / square if square > 0 else 1.0
    offsets = np.linalg.norm(scale * first - second, axis=1)
    spread = np.linalg.norm(second, axis=1).max()
    if scale <= 0 or cosines.min() < np.cos(np.radians(0.5)) or offsets.max() > 0.01 * spread:
        return None
    matrix = np.eye(4)
    matrix[:3, :3] = scale * rotation
    matrix[:3, 3] = target[:, :3, 3].mean(axis=0) - scale * rotated.mean(axis=0)
    return matrix


def _find_rescaled_size(photos: Sequence[Path], sizes: Sequence[Size]) -> Size | None:
    """(width, height) of photos that were scaled since `sizes` were written, else None."""
    headers = [read_header(photo) for photo in photos]
    return common_rescaled_size(sizes, [(header.width, header.height) for header in headers])


def _read_rows(file: Path) -> npt.NDArray[np.float64]:
    try:
        rows = read_array(file)
        if rows.ndim == 2:
            rows = rows.astype(np.float64)
    except (OSError, ValueError, TypeError) as error:
        raise DatasetError(
            f"{file}: cannot be read as a NumPy array ({error!s:.120}); copy it again"
        ) from error
    if rows.ndim != 2 or rows.shape[1] != 17 or len(rows) == 0:
        raise DatasetError(f"{file}: must be an array [N,17] (LLFF's poses and depth bounds)")
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


def _photos(folder: Path, count: int) -> tuple[dict[int, Path], dict[int, list[Path]]]:
    """(photo folders by factor, their photos): the first set that has `count` photos, else the first."""
    full_size_names = [name for name in FULL_SIZE_FOLDERS if (folder / name).is_dir()]
    places = [photo_folders(folder, name) for name in full_size_names or [""]]
    if len(photo_files(folder)) == count:
        places.append({1: folder})
    candidates = [
        (model_folder, {factor: photo_files(images) for factor, images in model_folder.items()})
        for model_folder in places
    ]
    for model_folder, photos in candidates:
        if any(len(files) == count for files in photos.values()):
            return model_folder, photos
    return candidates[0]
