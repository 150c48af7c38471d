"""COLMAP models, binary or text, with their photos; read by pycolmap.

COLMAP's cameras look along +z with +y down, and pixel (0,0) has its centre at (.5,.5): axes y and z are
flipped, intrinsics are taken as they are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cagefield.cameras import Camera
from cagefield.datasets.captures import stored_camera, unbounded_capture, uniform_size, warn_of_scaling
from cagefield.datasets.colmap_files import check_unchanged, check_whole
from cagefield.datasets.photos import choose_downscale, find_photo, photo_folders, read_header
from cagefield.datasets.region import cube_of_interest, depths_of_points, levelling_rotation
from cagefield.datasets.views import Dataset, SparsePoints, View, report_missing
from cagefield.errors import CameraError, DatasetError
from cagefield.lenses import Lens
from cagefield.regular_files import real_path

FloatArray = npt.NDArray[np.float64]

_LONGEST_NAME = 500

MODEL_FILES = ("cameras.bin", "cameras.txt")

_MODEL_FOLDERS = ("sparse/0", "sparse", "colmap/sparse/0", ".")


def find_model(path: Path) -> Path | None:
    """The folder at or below `path` that holds a COLMAP model, None where there is none."""
    for folder in (path / name for name in _MODEL_FOLDERS):
        if any((folder / file).is_file() for file in MODEL_FILES):
            return folder
    return None


def load_colmap(path: Path, downscale: int | None, holdout: int) -> Dataset:
    """The unbounded data set of a COLMAP model at `path`, `path`/sparse/0 or `path`/sparse.

    Every `holdout`-th view tests. Photos are looked for in `images`, `images_2`, ... of the nearest folder
    upwards from the model that has them, by their names in the model. Lens distortion is kept. The world is
    rotated so that up is +z (see `levelling_rotation`); the sparse points bound the cube of interest and
    become `Dataset.points`.
    """
    model_folder = find_model(path)
    if model_folder is None:
        places = ", ".join(_MODEL_FOLDERS)
        raise DatasetError(f"{path}: no COLMAP model (cameras.bin or cameras.txt) in {places}")
    model, images = read_model(model_folder)
    if not images:
        raise DatasetError(f"{model_folder}: the model has no registered images; run COLMAP's mapper again")
    root = next((f for f in _upwards(model_folder) if photo_folders(f)), None)
    if root is None:
        raise DatasetError(f"{model_folder}: no folder images in it or up to three levels above it")
    poses = np.stack([pose_of(image) for image in images])
    levelling = np.eye(4)
    levelling[:3, :3] = levelling_rotation(poses)
    cameras = {camera_id: camera_of(model_folder, camera) for camera_id, camera in model.cameras.items()}

    folders = photo_folders(root)
    if 1 in folders and _scale_to_photos(model_folder, cameras, images, folders[1]):
        folders = {1: folders[1]}  # the names of the others count from the old size
    used = [cameras[image.camera_id] for image in images]
    factor = choose_downscale(max(max(c.width, c.height) for c in used), downscale, folders)
    usable = sorted((f for f in folders if factor % f == 0), reverse=True)
    views, missing = [], []
    for image, pose in zip(images, levelling @ poses, strict=True):
        stored, photo = _photo(folders, usable, image.name)
        if photo is None:
            missing.append(image.name)
            continue
        where = f"{model_folder}: image {image.name}"
        try:
            camera = cameras[image.camera_id].with_c2w(pose)
        except CameraError as error:
            raise DatasetError(f"{where}: {error}") from error
        view = View(image.name, stored_camera(where, camera, photo, stored), photo)
        views.append(view.downscaled(factor // stored))
    report_missing(root, sorted(missing), len(images))
    points = sparse_points(model, {view.name: view.name for view in views}, levelling)
    positions = np.empty((0, 3)) if points is None else points.positions
    view_cameras = [view.camera for view in views]
    bounds = cube_of_interest(view_cameras, points=positions)
    found = depths_of_points(view_cameras, positions)
    depths = None if found is None else (float(found[:, 0].min()), float(found[:, 1].max()))
    return unbounded_capture(root, views, holdout, bounds, levelling, depths, points)


def sparse_points(model: Any, names: Mapping[str, str], source_to_world: FloatArray) -> SparsePoints | None:
    """The points of a pycolmap reconstruction, moved by the similarity `source_to_world` [4,4]; None without.

    `names` gives the views of the images; others are not named among those that see a point.
    """
    kept = {number: names[image.name] for number, image in model.images.items() if image.name in names}
    found = [point for _, point in sorted(model.points3D.items()) if np.isfinite(point.xyz).all()]
    if not found:
        return None
    errors = np.array([point.error for point in found], dtype=np.float32)
    seen_by = tuple(
        frozenset(kept[e.image_id] for e in point.track.elements if e.image_id in kept) for point in found
    )
    return SparsePoints(
        positions=np.array([point.xyz for point in found]) @ source_to_world[:3, :3].T
        + source_to_world[:3, 3],
        rgb=np.array([point.color for point in found], dtype=np.uint8),
        seen_by=seen_by if any(seen_by) else (),
        errors=np.where(errors >= 0, errors, np.float32(np.nan)),
    )


def read_model(folder: Path) -> tuple[Any, list[Any]]:
    """The pycolmap reconstruction and its registered images."""
    try:
        import pycolmap
    except ImportError:
        raise DatasetError(
            f"{folder}: reading a COLMAP model needs pycolmap; pip install 'cagefield[colmap]'"
        ) from None
    states = check_whole(folder)
    try:
        model = pycolmap.Reconstruction(folder)
        images = [model.image(image_id) for image_id in model.reg_image_ids()]
        for image in images:
            image.name.encode()  # its bytes may be no UTF-8
            if len(image.name) > _LONGEST_NAME:
                raise ValueError(f"the name of an image has {len(image.name)} characters")
    except UnicodeError:
        check_unchanged(folder, states)
        raise DatasetError(
            f"{folder}: names of its images are no UTF-8 text; rename the photos and export the model again"
        ) from None
    except Exception as error:  # pycolmap raises whatever C++ threw
        check_unchanged(folder, states)
        reason = " ".join(str(error).split())
        raise DatasetError(
            f"{folder}: pycolmap cannot read the model ({reason:.200}); export it again"
        ) from error
    check_unchanged(folder, states)
    return model, images


def _upwards(folder: Path) -> Sequence[Path]:
    return [folder, *real_path(folder).parents[:3]]


def _photo(folders: dict[int, Path], factors: Sequence[int], name: str) -> tuple[int, Path | None]:
    """The photo `name` at the first of `factors` that has it; shrunk ones may have another extension."""
    for factor in factors:
        photo = find_photo(folders[factor] / name)
        if photo is None and factor > 1:
            photo = find_photo((folders[factor] / name).with_suffix(""))
        if photo is not None:
            return factor, photo
    return 1, None


def _scale_to_photos(where: Path, cameras: dict[int, Camera], images: Sequence[Any], folder: Path) -> bool:
    """Whether the cameras were scaled, in place, to photos that were scaled down since."""
    photos = [find_photo(folder / image.name) for image in images]
    headers = [read_header(photo) for photo in photos if photo is not None]
    used = [cameras[image.camera_id] for image in images]
    said = [(camera.width, camera.height) for camera in used]
    size = uniform_size(said, [(header.width, header.height) for header in headers]) if headers else None
    if size is None:
        return False
    warn_of_scaling(str(where), said[0], size)
    for camera_id in {image.camera_id for image in images}:
        cameras[camera_id] = cameras[camera_id].resized(*size)
    return True


def pose_of(image: Any) -> FloatArray:
    """OpenGL camera-to-world matrix [4,4]."""
    rigid = image.cam_from_world
    matrix = np.asarray((rigid() if callable(rigid) else rigid).matrix(), dtype=np.float64)
    rotation, translation = matrix[:, :3], matrix[:, 3]
    pose = np.eye(4)
    pose[:3, :3] = rotation.T * (1.0, -1.0, -1.0)
    pose[:3, 3] = -rotation.T @ translation
    return pose


def camera_of(folder: Path, camera: Any) -> Camera:
    """The COLMAP camera in the identity pose."""
    name, p = camera.model.name, [float(value) for value in camera.params]
    model: Lens = "pinhole"
    if name in ("SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL"):
        fx, fy, cx, cy, distortion = p[0], p[0], p[1], p[2], p[3:]
    elif name in ("PINHOLE", "OPENCV", "OPENCV_FISHEYE"):
        fx, fy, cx, cy, distortion = *p[:4], p[4:]
    else:
        raise DatasetError(
            f"{folder}: camera {camera.camera_id} has the COLMAP camera model {name}, which cannot be read; "
            "run colmap image_undistorter, or reconstruct with SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, "
            "RADIAL, OPENCV or OPENCV_FISHEYE"
        )
    if name == "OPENCV_FISHEYE":
        model = "opencv_fisheye"
    elif distortion:  # k1 [, k2 [, p1, p2]]
        model, distortion = "opencv", [*distortion, 0.0, 0.0, 0.0][:4]
    try:
        return Camera(
            np.eye(4), camera.width, camera.height, fx, fy, cx, cy, model=model, distortion=tuple(distortion)
        )
    except CameraError as error:
        raise DatasetError(f"{folder}: camera {camera.camera_id}: {error}") from error
