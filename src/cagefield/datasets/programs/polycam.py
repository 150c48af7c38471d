"""Polycam's raw data: a JSON file for each photo, in the folder `keyframes`.

  corrected_cameras/ID.json, corrected_images/ID.jpg   poses of its own bundle adjustment; preferred
  cameras/ID.json, images/ID.jpg                       ARKit's poses
A file has t_00 .. t_23, the rows of an OpenGL camera-to-world matrix in a world with y up, and fx, fy, cx,
cy, width, height in pixels. Depth maps, confidences and meshes are not used.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cagefield.datasets.hidden_files import is_hidden
from cagefield.datasets.notices import warn
from cagefield.datasets.programs.number_parsing import parse_number, parse_numbers, parse_pixel_count
from cagefield.datasets.programs.program_dataset import (
    Frame,
    ProgramCapture,
    build_brown_lens,
    build_program_dataset,
)
from cagefield.datasets.programs.program_json import read_object
from cagefield.datasets.views import Dataset
from cagefield.errors import DatasetError

KEYFRAMES_FOLDER = "keyframes"

_CAMERA_PHOTO_FOLDERS = (("corrected_cameras", "corrected_images"), ("cameras", "images"))
_UNUSED_POLYCAM_FILES = ("depth", "confidence", "mesh_info.json", "raw.glb", "raw.obj", "polycam.mp4")
_POSE_KEYS = [f"t_{row}{column}" for row in range(3) for column in range(4)]


def find_polycam(path: Path) -> Path | None:
    """Folder `keyframes` at `path` or in it, None where there is none with cameras."""
    for folder in (path / KEYFRAMES_FOLDER, path):
        if folder.name == KEYFRAMES_FOLDER and any(
            _json_files(folder / cameras) for cameras, _ in _CAMERA_PHOTO_FOLDERS
        ):
            return folder
    return None


def load_polycam(path: Path, downscale: int | None, holdout: int) -> Dataset:
    """Unbounded data set of a folder with `keyframes`, of that folder, or of a camera's file in it.

    Raises DatasetError where there are no cameras, or their files are damaged.
    """
    keyframes = find_polycam(path if path.is_dir() else path.parent.parent)
    if keyframes is None:
        raise DatasetError(
            f"{path}: no {KEYFRAMES_FOLDER}/corrected_cameras or {KEYFRAMES_FOLDER}/cameras with JSON files"
        )
    cameras, images = next(
        ((c, i) for c, i in _CAMERA_PHOTO_FOLDERS if _json_files(keyframes / c) and (keyframes / i).is_dir()),
        (_CAMERA_PHOTO_FOLDERS[-1]),
    )
    files = _json_files(keyframes / cameras)
    if not files:
        raise DatasetError(f"{keyframes}: no folder of photos, corrected_images or images; copy it there")
    _report_ignored(keyframes)
    return build_program_dataset(
        ProgramCapture(
            keyframes / cameras,
            keyframes.parent,
            keyframes / images,
            [_frame(file) for file in files],
            up=(0.0, 1.0, 0.0),
        ),
        downscale,
        holdout,
    )


def _json_files(folder: Path) -> list[Path]:
    if not folder.is_dir():
        return []
    files = [
        file for file in folder.iterdir() if file.suffix.lower() == ".json" and not is_hidden([file.name])
    ]
    return sorted(files)


def _frame(file: Path) -> Frame:
    values = read_object(file)

    def value(key: str) -> Any:
        return values.get(key)

    pose = np.eye(4)
    pose[:3] = parse_numbers(f"{file}: keys t_00 to t_23", [value(key) for key in _POSE_KEYS], 12).reshape(
        3, 4
    )
    size = (
        parse_pixel_count(f"{file}: key 'width'", value("width")),
        parse_pixel_count(f"{file}: key 'height'", value("height")),
    )
    fx, fy, cx, cy = (parse_number(f"{file}: key {key!r}", value(key)) for key in ("fx", "fy", "cx", "cy"))
    return Frame(file.stem, pose, build_brown_lens(str(file), size, (fx, fy), (cx, cy)))


def _report_ignored(keyframes: Path) -> None:
    """Warn of the files of a capture that are not read: depth maps, confidences, meshes, videos."""
    ignored = []
    for folder in (keyframes, keyframes.parent):
        for name in _UNUSED_POLYCAM_FILES:
            if (folder / name).is_dir():
                ignored.append(f"{name} ({len(list((folder / name).iterdir()))} files)")
            elif (folder / name).is_file():
                ignored.append(name)
    if ignored:
        warn(f"{keyframes}: not used: {', '.join(ignored)}")
