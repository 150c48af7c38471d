"""Record3D's export: metadata.json and the photos rgb/0.jpg, rgb/1.jpg, ...

poses                    for each photo [qx, qy, qz, qw, x, y, z]: OpenGL camera to world (ARKit's, y up)
K                        the camera matrix [9], column by column; w, h in pixels
perFrameIntrinsicCoeffs  for each photo [fx, fy, cx, cy]; wins over K
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cagefield.datasets.notices import warn
from cagefield.datasets.photo_names import photo_files
from cagefield.datasets.programs.number_parsing import parse_numbers, parse_pixel_count
from cagefield.datasets.programs.program_dataset import (
    Frame,
    ProgramCapture,
    build_brown_lens,
    build_program_dataset,
)
from cagefield.datasets.programs.program_json import read_object
from cagefield.datasets.views import Dataset
from cagefield.errors import DatasetError
from cagefield.geometry.quaternions import rotation_matrices

METADATA_FILE = "metadata.json"

FloatArray = npt.NDArray[np.float64]

_PHOTO_FOLDERS = ("rgb", "images", "EXR_RGBD/rgb", "rgbd")
_UNUSED_RECORD3D_FILES = ("depth", "confidence", "conf", "EXR_RGBD/depth", "EXR_RGBD/confidence", "sound.m4a")
_MAX_POSES = 1_000_000


def find_record3d(folder: Path) -> Path | None:
    """File metadata.json of a folder that has a folder of photos, too; None where either is missing."""
    for export_folder in (folder, folder / "EXR_RGBD"):
        if (export_folder / METADATA_FILE).is_file() and _photo_folder(export_folder) is not None:
            return export_folder / METADATA_FILE
    return None


def is_record3d(values: dict[str, Any]) -> bool:
    """Whether a JSON file's values are Record3D's."""
    return "poses" in values and ("K" in values or "perFrameIntrinsicCoeffs" in values)


def load_record3d(file: Path, downscale: int | None, holdout: int) -> Dataset:
    """Unbounded data set of a file metadata.json; photo N has pose N, counted from 0.

    Raises DatasetError where there are no photos, or values are invalid.
    """
    values = read_object(file)
    folder = _photo_folder(file.parent)
    if folder is None:
        raise DatasetError(f"{file}: no folder {_PHOTO_FOLDERS[0]} of photos beside it; copy it there")
    poses = values.get("poses")
    if not isinstance(poses, list) or not 0 < len(poses) <= _MAX_POSES:
        raise DatasetError(f"{file}: key 'poses' must be a list of poses")
    size = (
        parse_pixel_count(f"{file}: key 'w'", values.get("w")),
        parse_pixel_count(f"{file}: key 'h'", values.get("h")),
    )
    intrinsics = _intrinsics(file, values, len(poses))
    frames = []
    for number, name in _names(file, folder, len(poses)):
        pose = _pose(f"{file}: poses[{number}]", poses[number])
        fx, fy, cx, cy = intrinsics[number].tolist()
        frames.append(Frame(name, pose, build_brown_lens(f"{file}: photo {name}", size, (fx, fy), (cx, cy))))
    ignored = [name for name in _UNUSED_RECORD3D_FILES if (file.parent / name).exists()]
    if ignored:
        warn(f"{file}: not used: {', '.join(ignored)}")
    capture = ProgramCapture(file, file.parent, folder, frames, up=(0.0, 1.0, 0.0))
    return build_program_dataset(capture, downscale, holdout)


def _photo_folder(folder: Path) -> Path | None:
    return next((folder / name for name in _PHOTO_FOLDERS if (folder / name).is_dir()), None)


def _names(file: Path, folder: Path, count: int) -> list[tuple[int, str]]:
    """(number of the pose, name) of every expected photo, in order.

    Raises DatasetError where photos have numbers without a pose.
    """
    numbered = {int(photo.stem): photo.name for photo in photo_files(folder) if _is_number(photo.stem)}
    if not numbered:
        raise DatasetError(f"{file}: no photos 0.jpg, 1.jpg, ... in {folder}; copy them there")
    first = 1 if 0 not in numbered and max(numbered) == count else 0
    if max(numbered) - first >= count:
        raise DatasetError(
            f"{file}: has {count} poses, {folder} has a photo {numbered[max(numbered)]}; give the file that "
            "was exported with the photos"
        )
    extension = Path(numbered[max(numbered)]).suffix
    return [(n, numbered.get(n + first, f"{n + first}{extension}")) for n in range(count)]


def _is_number(stem: str) -> bool:
    return stem.isascii() and stem.isdigit() and len(stem) <= 9


def _pose(where: str, value: Any) -> FloatArray:
    """OpenGL camera-to-world matrix [4,4]; NaN where the quaternion is zero or not finite."""
    quaternion, position = np.split(parse_numbers(where, value, 7), [4])
    length = float(np.linalg.norm(quaternion))
    if not np.isfinite(length) or length < 1e-6:
        return np.full((4, 4), np.nan)
    x, y, z, w = quaternion / length
    pose = np.eye(4)
    pose[:3, :3] = rotation_matrices(np.array([[w, x, y, z]]))[0]
    pose[:3, 3] = position
    return pose


def _intrinsics(file: Path, values: dict[str, Any], count: int) -> FloatArray:
    """Intrinsics fx, fy, cx, cy [count,4] in pixels."""
    coefficients = values.get("perFrameIntrinsicCoeffs")
    if coefficients:
        if not isinstance(coefficients, list) or len(coefficients) != count:
            raise DatasetError(
                f"{file}: key 'perFrameIntrinsicCoeffs' must have one entry for each of the {count} poses"
            )
        where = f"{file}: perFrameIntrinsicCoeffs"
        return np.stack([parse_numbers(f"{where}[{n}]", one, 4) for n, one in enumerate(coefficients)])
    matrix = parse_numbers(f"{file}: key 'K'", values.get("K"), 9).reshape(3, 3).T
    if not matrix[0, 2] and not matrix[1, 2] and (matrix[2, 0] or matrix[2, 1]):
        matrix = matrix.T  # other programs write it row by row
    return np.tile((matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]), (count, 1))
