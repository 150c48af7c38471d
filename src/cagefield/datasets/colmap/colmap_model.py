"""COLMAP models with their photos: binary models, read by pycolmap, and text models.

COLMAP's cameras look along +z with +y down, and pixel (0,0) has its center at (.5,.5): axes y and z are
flipped, intrinsics are unchanged.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cagefield.datasets.capture_dataset import (
    build_unbounded_dataset,
    common_rescaled_size,
    resize_camera_to_photo,
    warn_of_scaling,
)
from cagefield.datasets.colmap.colmap_files import add_points_file, check_complete, check_unchanged, is_binary
from cagefield.datasets.colmap.colmap_lenses import LensView, lens_views, report_resampled
from cagefield.datasets.colmap.colmap_text import read_text_model
from cagefield.datasets.photo_names import FoundPhotos, find_photos
from cagefield.datasets.photos import FULL_SIZE_FOLDERS, choose_downscale, photo_folders, read_header
from cagefield.datasets.scene_bounds import cube_of_interest, depths_of_points, leveling_rotation
from cagefield.datasets.views import Dataset, SparsePoints, View, report_missing, report_unposed
from cagefield.errors import CameraError, DatasetError
from cagefield.files.safe_open import real_path

FloatArray = npt.NDArray[np.float64]

_MAX_IMAGE_NAME_CHARACTERS = 500

MODEL_FILES = ("cameras.bin", "cameras.txt")

_MODEL_FOLDERS = (
    "sparse/0",
    "sparse",
    "colmap/sparse/0",
    "colmap/sparse",
    ".",
    "colmap",
    "distorted/sparse/0",
)

_STRUCTURE_FOLDERS = ("sparse", "colmap", "distorted")  # and numbers: folders of models, not of photos


def find_model(path: Path) -> Path | None:
    """Folder at or below `path` that holds a COLMAP model, None where there is none."""
    for folder in (path / name for name in _MODEL_FOLDERS):
        if any((folder / file).is_file() for file in MODEL_FILES):
            return folder
    return None


def load_colmap(path: Path, downscale: int | None, holdout: int) -> Dataset:
    """Unbounded data set of a COLMAP model at or below `path`; see `find_model`.

    Every `holdout`-th photo tests. Photos are looked for in `images`, `images_2`, ..., in the other
    FULL_SIZE_FOLDERS of the nearest folder upwards from the model that has them, and beside the model, by
    their names in the model (see `photo_names`). Lenses that a `Camera` has are kept, others resampled. The
    world is rotated so that up is +z (see `leveling_rotation`); the sparse points bound the cube of interest
    and become `Dataset.points`.
    """
    model_folder = find_model(path)
    if model_folder is None:
        places = ", ".join(_MODEL_FOLDERS)
        raise DatasetError(f"{path}: no COLMAP model (cameras.bin or cameras.txt) in {places}")
    model, registered = read_model(model_folder)
    if not registered:
        raise DatasetError(f"{model_folder}: the model has no registered images; run COLMAP's mapper again")
    images = _filter_posed(model_folder, registered)
    poses = np.stack([image_pose(image) for image in images])
    leveling = np.eye(4)
    leveling[:3, :3] = leveling_rotation(poses)
    camera_ids = sorted({image.camera_id for image in images})
    lenses = {number: view_lenses(model_folder, model.cameras[number]) for number in camera_ids}
    names = [image.name for image in images]
    root, folders = _find_photo_folders(model_folder, path, names)
    if 1 in folders and _scale_to_photos(model_folder, lenses, images, find_photos(folders[1], names)):
        folders = {1: folders[1]}  # the names of the others count from the old size
    sides = [max(one.camera.width, one.camera.height) for lens in lenses.values() for one in lens]
    factor = choose_downscale(max(sides), downscale, folders)
    photos_by_factor = {
        stored: find_photos(folders[stored], names)
        for stored in sorted(folders, reverse=True)
        if factor % stored == 0
    }
    views: list[View] = []
    missing: list[str] = []
    view_names: dict[str, str] = {}
    for image, pose in zip(images, leveling @ poses, strict=True):
        stored = next((one for one, photos in photos_by_factor.items() if image.name in photos.photos), None)
        if stored is None:
            missing.append(image.name)
            continue
        photo = photos_by_factor[stored].photos[image.name]
        name = photos_by_factor[stored].relative_view_name(image.name, folders[stored])
        view_names[image.name] = name
        where = f"{model_folder}: image {image.name}"
        try:
            views += [
                build_stored_view(where, lens, name, photo, pose, stored).downscaled(factor // stored)
                for lens in lenses[image.camera_id]
            ]
        except CameraError as error:
            raise DatasetError(f"{where}: {error}") from error
    report_missing(root, sorted(missing), len(images))
    for stored, photos in photos_by_factor.items():
        photos.report(model_folder, folders[stored])
    report_resampled(str(model_folder), [one for image in images for one in lenses[image.camera_id]])
    points = sparse_points(model, view_names, leveling)
    positions = np.empty((0, 3)) if points is None else points.positions
    view_cameras = [view.camera for view in views]
    bounds = cube_of_interest(view_cameras, points=positions)
    depth = depths_of_points(view_cameras, positions)
    depths = None if depth is None else (float(depth[:, 0].min()), float(depth[:, 1].max()))
    return build_unbounded_dataset(root, views, holdout, bounds, leveling, depths, points)


def build_stored_view(
    where: str, lens: LensView, name: str, photo: Path, pose: FloatArray, stored: int = 1
) -> View:
    """View of a photo, stored at 1/`stored` of the lens's size, in the photo's pose [4,4].

    Raises DatasetError where the photo has another size, CameraError for a pose that no camera has.
    """
    camera = lens.camera.with_c2w(lens.pose(pose))
    camera = camera.downscaled(stored) if lens.face else resize_camera_to_photo(where, camera, photo, stored)
    return View(lens.name(name), camera, photo, source=lens.source)


def _filter_posed(folder: Path, images: Sequence[Any]) -> list[Any]:
    """Images with finite poses; one warning names the others. Raises DatasetError where there are none."""
    posed = [image for image in images if np.isfinite(image_pose(image)).all()]
    unposed_names = [image.name for image in images if not np.isfinite(image_pose(image)).all()]
    report_unposed(folder, unposed_names, len(images))
    return posed


def _candidate_photo_folders(model_folder: Path, path: Path) -> Iterator[tuple[Path, dict[int, Path]]]:
    """(root folder, photo folders by factor) of the possible places of the photos, the likeliest first."""
    for folder in _parent_folders(model_folder):
        folder_names = [name for name in FULL_SIZE_FOLDERS if (folder / name).is_dir()]
        for name in folder_names or [""]:
            if factor_folders := photo_folders(folder, name):
                yield folder, factor_folders
    for folder in _parent_folders(model_folder):
        yield folder, {1: folder}
        if folder in (path, real_path(path)) and folder.name != model_folder.name:
            return
        if not (folder.name in _STRUCTURE_FOLDERS or folder.name.isdigit()):
            return


def _find_photo_folders(model_folder: Path, path: Path, names: Sequence[str]) -> tuple[Path, dict[int, Path]]:
    """First candidate that has any of the photos, else the first candidate with a usual folder name.

    Raises DatasetError where there is neither.
    """
    first = None
    for root, folders in _candidate_photo_folders(model_folder, path):
        if any(find_photos(folder, names).photos for folder in folders.values()):
            return root, folders
        if first is None and folders != {1: root}:
            first = root, folders
    if first is None:
        raise DatasetError(
            f"{model_folder}: no folder images in it or up to three levels above it, and no photos beside it"
        )
    return first


def sparse_points(model: Any, names: Mapping[str, str], source_to_world: FloatArray) -> SparsePoints | None:
    """Points of a pycolmap reconstruction, moved by the similarity `source_to_world` [4,4]; None where it has
    none.

    `names` maps image names to view names; other images are left out of `seen_by`.
    """
    view_names = {number: names[image.name] for number, image in model.images.items() if image.name in names}
    finite_points = [point for _, point in sorted(model.points3D.items()) if np.isfinite(point.xyz).all()]
    if not finite_points:
        return None
    errors = np.array([point.error for point in finite_points], dtype=np.float32)
    seen_by = tuple(
        frozenset(view_names[e.image_id] for e in point.track.elements if e.image_id in view_names)
        for point in finite_points
    )
    return SparsePoints(
        positions=np.array([point.xyz for point in finite_points]) @ source_to_world[:3, :3].T
        + source_to_world[:3, 3],
        rgb=np.array([point.color for point in finite_points], dtype=np.uint8),
        seen_by=seen_by if any(seen_by) else (),
        errors=np.where(errors >= 0, errors, np.float32(np.nan)),
    )


def read_model(folder: Path) -> tuple[Any, list[Any]]:
    """(model, its registered images): pycolmap's objects, or for text models objects with the attributes used
    here.
    """
    states = check_complete(folder)
    if not is_binary(folder):
        text = read_text_model(folder)
        _check_image_names(folder, text.images.values())
        check_unchanged(folder, states)
        return text, [text.images[number] for number in sorted(text.images)]
    try:
        import pycolmap
    except ImportError:
        raise DatasetError(
            f"{folder}: reading a COLMAP model needs pycolmap; pip install -U pycolmap"
        ) from None
    try:
        with add_points_file(folder) as complete:
            model = pycolmap.Reconstruction(complete)
        images = [model.image(image_id) for image_id in model.reg_image_ids()]
        _check_image_names(folder, images)
    except DatasetError:
        raise
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


def _check_image_names(folder: Path, images: Iterable[Any]) -> None:
    """Raise DatasetError for a name that is too long, UnicodeError for a name whose bytes are no UTF-8."""
    for image in images:
        image.name.encode()
        if len(image.name) > _MAX_IMAGE_NAME_CHARACTERS:
            raise DatasetError(
                f"{folder}: the name of an image has {len(image.name)} characters; export the model again"
            )


def _parent_folders(folder: Path) -> Sequence[Path]:
    return [folder, *real_path(folder).parents[:3]]


def _scale_to_photos(
    where: Path, lenses: dict[int, tuple[LensView, ...]], images: Sequence[Any], photos: FoundPhotos
) -> bool:
    """Whether the lenses were scaled, in place, to photos that were scaled down since the model was
    written.
    """
    headers = [read_header(photo) for photo in photos.photos.values()]
    camera_sizes = [lenses[image.camera_id][0].size for image in images]
    size = (
        common_rescaled_size(camera_sizes, [(header.width, header.height) for header in headers])
        if headers
        else None
    )
    if size is None:
        return False
    warn_of_scaling(str(where), camera_sizes[0], size)
    for number, views in lenses.items():
        lenses[number] = tuple(view.resized(*size) for view in views)
    return True


def image_pose(image: Any) -> FloatArray:
    """OpenGL camera-to-world matrix [4,4] of a COLMAP image."""
    rigid = image.cam_from_world
    matrix = np.asarray((rigid() if callable(rigid) else rigid).matrix(), dtype=np.float64)
    rotation, translation = matrix[:, :3], matrix[:, 3]
    pose = np.eye(4)
    pose[:3, :3] = rotation.T * (1.0, -1.0, -1.0)
    with np.errstate(invalid="ignore"):
        pose[:3, 3] = -rotation.T @ translation
    return pose


def view_lenses(folder: Path, camera: Any) -> tuple[LensView, ...]:
    """Views, in the identity pose, of a photo of the model's camera.

    Raises DatasetError for values that no camera has.
    """
    params = tuple(float(value) for value in camera.params)
    try:
        return lens_views(camera.model.name, params, camera.width, camera.height)
    except (CameraError, DatasetError) as error:
        raise DatasetError(f"{folder}: camera {camera.camera_id}: {error}") from error
