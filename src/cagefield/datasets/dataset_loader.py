"""Loader of a data set of posed photos in any of the supported formats."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from cagefield.datasets.colmap.colmap_model import MODEL_FILES, find_model, load_colmap
from cagefield.datasets.llff import POSES_FILE, load_llff
from cagefield.datasets.mask_files import attach_masks
from cagefield.datasets.photos import report_conversions
from cagefield.datasets.programs.capture_programs import (
    LAYOUTS,
    Reader,
    find_file_program,
    find_folder_program,
)
from cagefield.datasets.raw_photos import find_raw_photos, is_video
from cagefield.datasets.transforms.transforms_json_dataset import camera_file, load_transforms
from cagefield.datasets.views import Dataset, View, check_holdout
from cagefield.errors import DatasetError

__all__ = ["Dataset", "View", "has_photos_alone", "load_dataset"]

_CAMERA_FILES = ("transforms.json", "transforms_train.json")


def load_dataset(
    path: str | Path, *, downscale: int | None = None, holdout: int = 8, masks: Path | None = None
) -> Dataset:
    """Data set at `path`: a folder, or the file in it that describes the cameras.

    The first of these that a folder has is read: transforms_train.json (NeRF-synthetic), transforms.json
    (Instant-NGP, nerfstudio), poses_bounds.npy (LLFF), a COLMAP model in sparse/0, sparse or the folder
    itself, the files of a capture program (see `capture_programs`). Naming the file, or the model's folder,
    overrides that order.

    `downscale` shrinks the photos by that factor; None takes the smallest power of two that brings the longer
    side to 800 pixels or less. Test views are the ones that the files give, else every `holdout`-th, sorted
    by name, from the first on; 0 holds none out. Frames whose photo is missing are left out with one warning.
    Masks come from the folder `masks`, else from files beside the photos (see `mask_files`).

    Raises DatasetError, with file, key and cure, for anything that cannot be read, and for a `holdout` of 1
    or below 0, whether there is a test split or not.
    """
    check_holdout(holdout)
    path = Path(path).expanduser()
    return attach_masks(_load(path, downscale, holdout), masks)


def _load(path: Path, downscale: int | None, holdout: int) -> Dataset:
    """Data set without the masks beside its photos."""
    with _report_degenerate_poses(path):
        read, source = _find_reader(path)
        dataset = read(source, downscale, holdout)
    views = (*dataset.train, *dataset.test, *dataset.val)
    report_conversions(path, [view.image_path for view in views])
    return dataset


def _find_reader(path: Path) -> tuple[Reader, Path]:
    """Reader of the data set at `path`, and the folder or file that the reader takes."""
    if not path.exists():
        raise DatasetError(f"{path} does not exist; give the folder of the photos and their camera file")
    if path.is_file():
        if (program := find_file_program(path)) is not None:
            return program
        if path.suffix == ".json":
            return load_transforms, path
        if path.name == POSES_FILE:
            return load_llff, path
        if path.name in MODEL_FILES:
            return load_colmap, path.parent
        if is_video(path):
            raise DatasetError(
                f"{path}: a video has no poses; find them with: cagefield poses {path} -o DATA"
            )
        raise DatasetError(f"{path} is no camera file; give transforms.json, {POSES_FILE} or the folder")
    if camera_file(path) is not None:
        return load_transforms, path
    if (path / POSES_FILE).is_file():
        return load_llff, path
    if find_model(path) is not None:
        return load_colmap, path
    if (program := find_folder_program(path)) is not None:
        return program
    if has_photos_alone(path):
        raise DatasetError(
            f"{path}: photos without poses; find them with: cagefield poses {path} -o DATA (cagefield "
            "train does that by itself)"
        )
    raise DatasetError(
        f"{path}: no camera file; looked for {', '.join(_CAMERA_FILES)}, {POSES_FILE}, a COLMAP model "
        f"(sparse/0/cameras.bin or .txt), {LAYOUTS}, and there are no photos either"
    )


@contextmanager
def _report_degenerate_poses(path: Path) -> Iterator[None]:
    """Raise DatasetError in place of NumPy's errors for poses that no camera has."""
    try:
        yield
    except (np.linalg.LinAlgError, OverflowError) as error:
        raise DatasetError(
            f"{path}: the poses of its cameras make no sense ({error}); export them again"
        ) from None


def has_photos_alone(path: Path) -> bool:
    """Whether `path` is a video, or a folder of photos without a file of their cameras."""
    if path.is_file():
        return is_video(path)
    if not path.is_dir() or camera_file(path) is not None or (path / POSES_FILE).is_file():
        return False
    if find_model(path) is not None or find_folder_program(path) is not None:
        return False
    return bool(find_raw_photos(path))
