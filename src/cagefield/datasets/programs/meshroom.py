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
from cagefield.datasets.programs.number_parsing import parse_number, parse_numbers, parse_pixel_count
from cagefield.datasets.programs.program_dataset import (
    OPENCV_AXIS_SIGNS,
    Frame,
    Lenses,
    ProgramCapture,
    build_brown_lens,
    build_colmap_lens,
    build_program_dataset,
)
from cagefield.datasets.programs.program_json import read_object, read_objects
from cagefield.datasets.views import Dataset, SparsePoints
from cagefield.errors import DatasetError

FloatArray = npt.NDArray[np.float64]

SCENE_FILES = ("cameras.sfm", "sfm.json", "sfmData.json", "sfm.sfm")

MAX_SCENE_BYTES = 256 << 20
"""Maximum bytes of a scene file, its structure included."""

_RADIAL_COUNTS = {"pinhole": 0, "none": 0, "radial1": 1, "radialk1": 1, "radial3": 3, "radialk3": 3}


def find_meshroom(folder: Path) -> Path | None:
    """Scene file in a folder: one of SCENE_FILES, else the first .sfm; None where there is none."""
    standard_files = [folder / name for name in SCENE_FILES]
    other_files = sorted(file for file in folder.glob("*.sfm") if not file.name.startswith("."))
    return next((file for file in (*standard_files, *other_files) if file.is_file()), None)


def is_meshroom(values: dict[str, Any]) -> bool:
    """Whether a JSON file's values are a Meshroom scene."""
    return "views" in values and "intrinsics" in values


def load_meshroom(file: Path, downscale: int | None, holdout: int) -> Dataset:
    """Unbounded data set of a scene file, whose photos lie at their stored paths, beside the file or below.

    Raises DatasetError where no view has a pose, or values are invalid.
    """
    values = read_object(file, MAX_SCENE_BYTES)
    where = str(file)
    version = _version(where, values)
    poses = {_text(pose.get("poseId")): pose for pose in read_objects(where, values, "poses")}
    intrinsics = {_text(one.get("intrinsicId")): one for one in read_objects(where, values, "intrinsics")}
    lenses: dict[str, Lenses] = {}
    capture = ProgramCapture(file, file.parent, file.parent, [])
    names: dict[str, str] = {}
    for number, view in enumerate(read_objects(where, values, "views")):
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
    return build_program_dataset(capture, downscale, holdout)


def _text(value: Any) -> str:
    """Text of an identifier, which may be a number or text."""
    return value if isinstance(value, str) else f"{value!r:.40}"


def _version(where: str, values: dict[str, Any]) -> tuple[int, ...]:
    """Version of the file, (1, 0, 0) where it has none."""
    if values.get("version") is None:
        return (1, 0, 0)
    numbers = parse_numbers(f"{where}: key 'version'", values["version"], 3)
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
    pose[:3, :3] = parse_numbers(f"{where}: rotation", transform.get("rotation"), 9).reshape(3, 3)
    pose[:3, 3] = parse_numbers(f"{where}: center", transform.get("center"), 3)
    return pose * OPENCV_AXIS_SIGNS


def _lenses(where: str, values: dict[str, Any], version: tuple[int, ...]) -> Lenses:
    size = (
        parse_pixel_count(f"{where}: width", values.get("width")),
        parse_pixel_count(f"{where}: height", values.get("height")),
    )
    focal = _focal_pixels(where, values, version, size[0])
    center = parse_numbers(f"{where}: principalPoint", values.get("principalPoint", [0, 0]), 2)
    if version >= (1, 2, 1):
        center += np.array(size) * 0.5
    kind = _text(values.get("type", "pinhole")).lower()
    if kind == "pinhole":
        kind = _text(values.get("distortionType", kind)).lower()
    params = values.get("distortionParams") or []
    if not isinstance(params, list) or len(params) > 20:
        raise DatasetError(f"{where}: key 'distortionParams' must be a list of numbers")
    coefficients = [parse_number(f"{where}: distortionParams", one) for one in params]
    if _text(values.get("undistortionType", "none")).lower() != "none" and values.get("undistortionParams"):
        warn(f"{where}: its undistortionParams are not used")
    middle = (float(center[0]), float(center[1]))
    if not any(coefficients) and kind not in ("fisheye4", "fisheye1", "equidistant", "equidistant_r3"):
        return build_brown_lens(where, size, focal, middle)
    if kind in _RADIAL_COUNTS and len(coefficients) >= _RADIAL_COUNTS[kind]:
        return build_brown_lens(where, size, focal, middle, coefficients[: _RADIAL_COUNTS[kind]])
    if kind == "brown" and len(coefficients) == 5:
        return build_brown_lens(where, size, focal, middle, coefficients[:3], coefficients[3:])
    if kind == "fisheye4" and len(coefficients) in (0, 4):
        return build_colmap_lens(
            where, "OPENCV_FISHEYE", (*focal, *middle, *(coefficients or [0.0] * 4)), size
        )
    if kind == "fisheye1" and len(coefficients) == 1:
        return build_colmap_lens(where, "FOV", (*focal, *middle, *coefficients), size)
    raise DatasetError(
        f"{where}: camera type {kind!r:.40} with {len(coefficients)} distortionParams cannot be read; "
        f"export the "
        "undistorted photos (node ExportImages or PrepareDenseScene) with their cameras"
    )


def _focal_pixels(
    where: str, values: dict[str, Any], version: tuple[int, ...], width: int
) -> tuple[float, float]:
    """Focal lengths (fx, fy) in pixels."""
    pixels = values.get("pxFocalLength")
    if isinstance(pixels, list):
        fx, fy = parse_numbers(f"{where}: pxFocalLength", pixels, 2).tolist()
        return fx, fy
    if pixels is not None:
        f = parse_number(f"{where}: pxFocalLength", pixels)
        return f, f
    if "focalLength" not in values:
        raise DatasetError(f"{where}: has no focalLength; export the scene again")
    sensor = parse_number(f"{where}: sensorWidth", values.get("sensorWidth", 36.0))
    ratio = parse_number(f"{where}: pixelRatio", values.get("pixelRatio", 1.0))
    if sensor <= 0 or ratio <= 0:
        raise DatasetError(f"{where}: sensorWidth and pixelRatio must be positive, got {sensor:g}, {ratio:g}")
    fx = parse_number(f"{where}: focalLength", values["focalLength"]) * width / sensor
    return fx, fx / ratio if version < (1, 2, 5) else fx * ratio


def _points(where: str, values: dict[str, Any], names: dict[str, str]) -> SparsePoints | None:
    """Sparse points of `structure` with finite positions; None where there are none."""
    landmarks = read_objects(where, values, "structure")
    if not landmarks:
        return None
    positions = np.stack(
        [parse_numbers(f"{where}: structure[{n}].X", p.get("X"), 3) for n, p in enumerate(landmarks)]
    )
    colors = [parse_numbers(f"{where}: structure[{n}].color", p.get("color", [127] * 3), 3) for n, p in
              enumerate(landmarks)]  # fmt: skip
    seen_by = tuple(
        frozenset(
            names[_text(one.get("observationId"))]
            for one in read_objects(where, point, "observations")
            if _text(one.get("observationId")) in names
        )
        for point in landmarks
    )
    rgb = np.stack(colors)
    finite = np.isfinite(np.concatenate([positions, rgb], axis=1)).all(axis=1)
    rows = np.flatnonzero(finite)
    if left_out := len(landmarks) - len(rows):
        warn(f"{where}: {left_out} of {len(landmarks)} points are left out, they are not finite")
    if not len(rows):
        return None
    return SparsePoints(
        positions[rows],
        np.clip(rgb[rows], 0, 255).astype(np.uint8),
        tuple(seen_by[n] for n in rows) if any(seen_by) else (),
    )
