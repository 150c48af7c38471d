"""Meshroom's (AliceVision's) scenes as JSON: cameras.sfm, sfm.json.

  views       viewId, poseId, intrinsicId, path
  intrinsics  width, height, type, and by the file's version
                before 1.2.0  pxFocalLength;  before 1.2.2  pxFocalLength [2]
                from 1.2.2    focalLength and sensorWidth in millimeters, pixelRatio = fx / fy before 1.2.5,
                              fy / fx from then on
                principalPoint in pixels, from the upper left corner before 1.2.1, from the middle since
                distortionParams of radial1, radial3, brown (k1, k2, k3, p1, p2), fisheye4, fisheye1 (FOV)
  poses       rotation [9], world to camera in OpenCV axes, column by column, and center [3]
  structure   X, color, observations: sparse points
Numbers are text.

Source: AliceVision, `src/aliceVision/sfmDataIO/jsonIO.cpp` and `CHANGES.md`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cagefield.datasets.notices import warn
from cagefield.datasets.programs.number_parsing import as_number, as_numbers, as_size
from cagefield.datasets.programs.program_dataset import (
    OPENCV_AXES,
    Frame,
    Lenses,
    ProgramCapture,
    brown_lens,
    colmap_lens,
    program_dataset,
)
from cagefield.datasets.programs.program_json import objects_of, read_object
from cagefield.datasets.views import Dataset, SparsePoints
from cagefield.errors import DatasetError

FloatArray = npt.NDArray[np.float64]

SCENE_FILES = ("cameras.sfm", "sfm.json", "sfmData.json", "sfm.sfm")

MAX_BYTES = 256 << 20
"""Bytes of a scene with its structure that is read."""

_RADIAL = {"pinhole": 0, "none": 0, "radial1": 1, "radialk1": 1, "radial3": 3, "radialk3": 3}


def find_meshroom(folder: Path) -> Path | None:
    """The scene's file in a folder: one of SCENE_FILES, else the first .sfm; None where it has none."""
    named = [folder / name for name in SCENE_FILES]
    others = sorted(file for file in folder.glob("*.sfm") if not file.name.startswith("."))
    return next((file for file in (*named, *others) if file.is_file()), None)


def is_meshroom(values: dict[str, Any]) -> bool:
    """Whether a JSON file's values are a scene of Meshroom's."""
    return "views" in values and "intrinsics" in values


def load_meshroom(file: Path, downscale: int | None, holdout: int) -> Dataset:
    """The unbounded data set of a scene's file, whose photos lie where it says, beside it or below.

    Raises DatasetError where no view has a pose, or what it says makes no sense.
    """
    values = read_object(file, MAX_BYTES)
    where = str(file)
    version = _version(where, values)
    poses = {_text(pose.get("poseId")): pose for pose in objects_of(where, values, "poses")}
    intrinsics = {_text(one.get("intrinsicId")): one for one in objects_of(where, values, "intrinsics")}
    lenses: dict[str, Lenses] = {}
    capture = ProgramCapture(file, file.parent, file.parent, [])
    names: dict[str, str] = {}
    for number, view in enumerate(objects_of(where, values, "views")):
        name = view.get("path")
        if not isinstance(name, str) or not name:
            raise DatasetError(f"{file}: views[{number}]: key 'path' must name the photo, got {name!r:.80}")
        pose_id, intrinsic_id = _text(view.get("poseId")), _text(view.get("intrinsicId"))
        if "rigId" in view and _text(view.get("isPoseIndependant", "true")).lower() in ("false", "0"):
            capture.left_out.setdefault("are of a rig", []).append(name)
        elif pose_id not in poses:
            capture.left_out.setdefault("have no pose", []).append(name)
        elif intrinsic_id not in intrinsics:
            capture.left_out.setdefault("have no intrinsics", []).append(name)
        else:
            if intrinsic_id not in lenses:
                lenses[intrinsic_id] = _lenses(
                    f"{file}: intrinsic {intrinsic_id}", intrinsics[intrinsic_id], version
                )
            pose = _pose(f"{file}: pose {pose_id}", poses[pose_id])
            capture.frames.append(Frame(name, pose, lenses[intrinsic_id]))
            names[_text(view.get("viewId"))] = name
    capture.points = _points(where, values, names)
    return program_dataset(capture, downscale, holdout)


def _text(value: Any) -> str:
    """An identifier, a number or text, as text."""
    return value if isinstance(value, str) else f"{value!r:.40}"


def _version(where: str, values: dict[str, Any]) -> tuple[int, ...]:
    """The file's version, (1, 0, 0) where it has none."""
    if values.get("version") is None:
        return (1, 0, 0)
    numbers = as_numbers(f"{where}: key 'version'", values["version"], 3)
    if not np.isfinite(numbers).all():
        raise DatasetError(f"{where}: key 'version' must be finite numbers, got {numbers.tolist()}")
    return tuple(int(number) for number in numbers)


def _pose(where: str, values: dict[str, Any]) -> FloatArray:
    """OpenGL camera-to-world matrix [4,4]."""
    transform = values.get("pose")
    transform = transform.get("transform") if isinstance(transform, dict) else None
    if not isinstance(transform, dict):
        raise DatasetError(f"{where}: has no pose.transform; export the scene again")
    pose = np.eye(4)
    # The columns of world to camera are the rows of its transpose, camera to world.
    pose[:3, :3] = as_numbers(f"{where}: rotation", transform.get("rotation"), 9).reshape(3, 3)
    pose[:3, 3] = as_numbers(f"{where}: center", transform.get("center"), 3)
    return pose * OPENCV_AXES


def _lenses(where: str, values: dict[str, Any], version: tuple[int, ...]) -> Lenses:
    size = as_size(f"{where}: width", values.get("width")), as_size(f"{where}: height", values.get("height"))
    focal = _focal(where, values, version, size[0])
    center = as_numbers(f"{where}: principalPoint", values.get("principalPoint", [0, 0]), 2)
    if version >= (1, 2, 1):
        center += np.array(size) * 0.5
    kind = _text(values.get("type", "pinhole")).lower()
    if kind == "pinhole":
        kind = _text(values.get("distortionType", kind)).lower()
    params = values.get("distortionParams") or []
    if not isinstance(params, list) or len(params) > 20:
        raise DatasetError(f"{where}: key 'distortionParams' must be a list of numbers")
    found = [as_number(f"{where}: distortionParams", one) for one in params]
    if _text(values.get("undistortionType", "none")).lower() != "none" and values.get("undistortionParams"):
        warn(f"{where}: its undistortionParams are not used")
    middle = (float(center[0]), float(center[1]))
    if not any(found) and kind not in ("fisheye4", "fisheye1", "equidistant", "equidistant_r3"):
        return brown_lens(where, size, focal, middle)
    if kind in _RADIAL and len(found) >= _RADIAL[kind]:
        return brown_lens(where, size, focal, middle, found[: _RADIAL[kind]])
    if kind == "brown" and len(found) == 5:
        return brown_lens(where, size, focal, middle, found[:3], found[3:])
    if kind == "fisheye4" and len(found) in (0, 4):
        return colmap_lens(where, "OPENCV_FISHEYE", (*focal, *middle, *(found or [0.0] * 4)), size)
    if kind == "fisheye1" and len(found) == 1:
        return colmap_lens(where, "FOV", (*focal, *middle, *found), size)
    raise DatasetError(
        f"{where}: camera type {kind!r:.40} with {len(found)} distortionParams cannot be read; export the "
        "undistorted photos (node ExportImages or PrepareDenseScene) with their cameras"
    )


def _focal(where: str, values: dict[str, Any], version: tuple[int, ...], width: int) -> tuple[float, float]:
    """Focal lengths in pixels."""
    pixels = values.get("pxFocalLength")
    if isinstance(pixels, list):
        fx, fy = as_numbers(f"{where}: pxFocalLength", pixels, 2).tolist()
        return fx, fy
    if pixels is not None:
        f = as_number(f"{where}: pxFocalLength", pixels)
        return f, f
    if "focalLength" not in values:
        raise DatasetError(f"{where}: has no focalLength; export the scene again")
    sensor = as_number(f"{where}: sensorWidth", values.get("sensorWidth", 36.0))
    ratio = as_number(f"{where}: pixelRatio", values.get("pixelRatio", 1.0))
    if sensor <= 0 or ratio <= 0:
        raise DatasetError(f"{where}: sensorWidth and pixelRatio must be positive, got {sensor:g}, {ratio:g}")
    fx = as_number(f"{where}: focalLength", values["focalLength"]) * width / sensor
    return fx, fx / ratio if version < (1, 2, 5) else fx * ratio


def _points(where: str, values: dict[str, Any], names: dict[str, str]) -> SparsePoints | None:
    """The points of `structure` with finite positions; None where there are none."""
    landmarks = objects_of(where, values, "structure")
    if not landmarks:
        return None
    positions = np.stack(
        [as_numbers(f"{where}: structure[{n}].X", p.get("X"), 3) for n, p in enumerate(landmarks)]
    )
    colors = [as_numbers(f"{where}: structure[{n}].color", p.get("color", [127] * 3), 3) for n, p in
              enumerate(landmarks)]  # fmt: skip
    seen_by = tuple(
        frozenset(
            names[_text(one.get("observationId"))]
            for one in objects_of(where, point, "observations")
            if _text(one.get("observationId")) in names
        )
        for point in landmarks
    )
    rgb = np.stack(colors)
    finite = np.isfinite(np.concatenate([positions, rgb], axis=1)).all(axis=1)
    kept = np.flatnonzero(finite)
    if left_out := len(landmarks) - len(kept):
        warn(f"{where}: {left_out} of {len(landmarks)} points are left out, they are not finite")
    if not len(kept):
        return None
    return SparsePoints(
        positions[kept],
        np.clip(rgb[kept], 0, 255).astype(np.uint8),
        tuple(seen_by[n] for n in kept) if any(seen_by) else (),
    )
