"""Camera paths: nerfstudio camera-path files, and an orbit that suits the cameras of a capture.

Camera-to-world matrices are OpenGL [4,4] (camera looks along -z, +y up); angles are radians.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeGuard

import numpy as np
import numpy.typing as npt

from cagefield.cameras.camera import Camera, turntable
from cagefield.errors import CameraError
from cagefield.files import json_text
from cagefield.files.safe_open import read_text

Floats = npt.NDArray[np.float64]

MIN_FPS, MAX_FPS = 0.001, 1000.0
"""Least and largest frame rate of a video: the video encoder refuses other rates."""

_SWING_ARC_SHARE = 0.8
"""Share of the covered arc that a swing uses: few cameras see the regions near its ends."""


@dataclass(frozen=True)
class CameraPath:
    """Cameras in order of time, `fps` of them a second."""

    cameras: tuple[Camera, ...]
    fps: float


def load_camera_path(path: Path | str, dataparser_transforms: Path | str | None = None) -> CameraPath:
    """Camera path of a nerfstudio camera-path file.

    Its keys: `camera_path` (`camera_to_world`, `fov`), `render_width`, `render_height`, `fps`, `seconds`.
    `fov` is vertical and in degrees; pixels are square, so `aspect` follows from the size and is not read.
    Without `fps` the rate is the number of cameras over `seconds`.

    nerfstudio writes its paths in the space it trains in, not in that of transforms.json. Its file
    `dataparser_transforms.json` (`transform` [3,4], `scale`) holds the difference: with it the cameras are
    brought back to the space of transforms.json.

    Raises:
        CameraError: no camera path, or a value that makes no camera; names the entry and the cure.
    """
    path = Path(path)
    document = _read_json(path, "camera path")
    entries = document.get("camera_path")
    if not isinstance(entries, list) or not entries:
        raise CameraError(
            f'{path}: "camera_path" must be a list with at least one camera; export it again from nerfstudio'
        )
    kind = document.get("camera_type", "perspective")
    if kind != "perspective":
        raise CameraError(f"{path}: camera_type {kind!r:.60} is not supported; set it to 'perspective'")
    width, height = (_positive_integer(document, key, path) for key in ("render_width", "render_height"))
    to_dataset = _similarity_inverse(dataparser_transforms)
    cameras = tuple(
        _path_camera(entry, f"{path}: camera_path[{index}]", width, height, to_dataset)
        for index, entry in enumerate(entries)
    )
    return CameraPath(cameras, _frame_rate(document, len(cameras), path))


def orbit(cameras: Sequence[Camera], n: int, *, width: int, height: int) -> tuple[Camera, ...]:
    """`n` cameras on a closed circle around the common target of `cameras`, at their mean distance and
    elevation.

    The center is the point nearest to all optical axes (least squares), the axis of the circle their shared
    up direction. Where the cameras cover less than two thirds of the circle (a capture from one side) the
    path swings to and fro over most of the covered arc instead, within the observed region. The field of view
    is the first camera's, along the longer side.

    Raises:
        CameraError: fewer than one camera, or `n` < 1.
    """
    if not cameras:
        raise CameraError("an orbit needs at least one camera to start from; give a camera path instead")
    if n < 1:
        raise CameraError(f"an orbit has {n} cameras; give at least 1")
    poses = np.stack([camera.c2w for camera in cameras])
    up = shared_up(poses)
    center = _common_target(poses)
    offsets = poses[:, :3, 3] - center
    heights = offsets @ up
    level = offsets - heights[:, None] * up
    radius, elevation_height = float(np.linalg.norm(level, axis=1).mean()), float(heights.mean())
    first = cameras[0]
    focal = max(width, height) / max(first.width, first.height) * first.fx
    fov_x = 2.0 * math.atan(0.5 * width / focal)
    x_axis = _perpendicular(up)
    y_axis = np.cross(up, x_axis)
    arc = _covered_arc(np.arctan2(level @ y_axis, level @ x_axis))
    if arc is None:
        return turntable(
            center, math.hypot(radius, elevation_height), n, elevation=math.atan2(elevation_height, radius),
            up=up, width=width, height=height, fov_x=fov_x,
        )  # fmt: skip
    swing = arc[0] + 0.5 * arc[1] * (1.0 - _SWING_ARC_SHARE * np.cos(2.0 * math.pi * np.arange(n) / n))
    eyes = (
        center
        + elevation_height * up
        + radius * (np.cos(swing)[:, None] * x_axis + np.sin(swing)[:, None] * y_axis)
    )
    return tuple(Camera.look_at(eye, center, up, width=width, height=height, fov_x=fov_x) for eye in eyes)


def _path_camera(entry: object, where: str, width: int, height: int, to_dataset: Floats) -> Camera:
    """Perspective camera of an entry of `camera_path`, in the space of the data set."""
    if not isinstance(entry, Mapping):
        raise CameraError(f'{where} must be an object with "camera_to_world" and "fov"')
    values = entry.get("camera_to_world")
    try:
        c2w = np.asarray(values, dtype=np.float64).reshape(4, 4)
    except (TypeError, ValueError):
        raise CameraError(f'{where}: "camera_to_world" must hold 16 numbers, row by row') from None
    if not np.isfinite(c2w).all():
        raise CameraError(
            f'{where}: "camera_to_world" holds a value that is not finite; export the path again'
        )
    fov = entry.get("fov")
    if not _is_number(fov) or not 0.1 <= fov <= 179.0:
        raise CameraError(
            f'{where}: "fov" is {fov!r:.40}; give the vertical field of view in degrees, from 0.1 to 179'
        )
    focal = 0.5 * height / math.tan(0.5 * math.radians(fov))
    pose = to_dataset @ c2w
    pose[:3, :3] /= np.maximum(np.linalg.norm(pose[:3, :3], axis=0), 1e-12)
    pose[3] = 0.0, 0.0, 0.0, 1.0
    try:
        return Camera(pose, width, height, focal, focal, 0.5 * width, 0.5 * height)
    except CameraError as error:
        raise CameraError(f"{where}: {error}") from None


def _similarity_inverse(path: Path | str | None) -> Floats:
    """Map [4,4] from nerfstudio's training space to the space of transforms.json; identity without a file."""
    if path is None:
        return np.eye(4)
    path = Path(path)
    document = _read_json(path, "dataparser transform")
    try:
        transform = np.asarray(document.get("transform"), dtype=np.float64).reshape(3, 4)
    except (TypeError, ValueError):
        raise CameraError(
            f'{path}: "transform" must be a 3x4 matrix; use dataparser_transforms.json'
        ) from None
    scale = document.get("scale")
    if not _is_number(scale) or not 1e-30 < scale < 1e30 or not (np.abs(transform) < 1e30).all():
        raise CameraError(
            f'{path}: "scale" must be above 0 and "transform" finite, each below 1e30, got {scale!r:.40}'
        )
    forward = np.vstack([scale * transform, [0.0, 0.0, 0.0, 1.0]])
    if abs(np.linalg.det(forward[:3, :3])) < 1e-12 * scale**3:
        raise CameraError(f'{path}: "transform" is singular; use the file that nerfstudio wrote')
    return np.linalg.inv(forward)


def _frame_rate(document: Mapping[str, object], count: int, path: Path) -> float:
    for key in ("fps", "seconds"):
        value = document.get(key)
        if value is None:
            continue
        if not _is_number(value) or value <= 0:
            raise CameraError(f"{path}: {key!r} is {value!r:.40}; give a number above 0")
        rate = float(value) if key == "fps" else count / float(value)
        if not MIN_FPS <= rate <= MAX_FPS:
            raise CameraError(
                f"{path}: {key!r} is {value!r:.40}, {rate:g} pictures a second; give what makes "
                f"{MIN_FPS:g} to {MAX_FPS:g}"
            )
        return rate
    return 24.0


def shared_up(poses: Floats) -> Floats:
    """Unit up direction of cameras with these poses [N,4,4]; exactly +z where it is within 10 degrees.

    A camera that is not rolled has its +x axis level, so up is the direction most normal to all +x axes: the
    last eigenvector of Σ x xᵀ. Cameras that all share one +x axis leave it open; then it is their mean +y.
    """
    mean_y: Floats = poses[:, :3, 1].mean(axis=0)
    right = poses[:, :3, 0]
    values, vectors = np.linalg.eigh(right.T @ right / len(right))
    up = vectors[:, 0] * (1.0 if vectors[:, 0] @ mean_y > 0.0 else -1.0) if values[1] > 1e-2 else mean_y
    length = float(np.linalg.norm(up))
    if length < 1e-6:
        return np.array([0.0, 0.0, 1.0])
    up = up / length
    return np.array([0.0, 0.0, 1.0]) if up[2] > math.cos(math.radians(10.0)) else up


def _common_target(poses: Floats) -> Floats:
    """Point [3] nearest to all optical axes, in front of the cameras on average.

    Least squares of the distances to the axes, Σ (I - f fᵀ)(p - o) = 0. Parallel axes have no such point:
    then, or where it lies behind the cameras, it is the point one capture size ahead of the mean camera.
    """
    origins, forwards = poses[:, :3, 3], -poses[:, :3, 2]
    projectors = np.eye(3) - forwards[:, :, None] * forwards[:, None, :]
    system = projectors.sum(axis=0)
    if len(poses) > 1 and np.linalg.eigvalsh(system)[0] > 1e-3 * len(poses):
        target: Floats = np.linalg.solve(system, (projectors @ origins[:, :, None]).sum(axis=0))[:, 0]
        if ((target - origins) * forwards).sum(axis=1).mean() > 0.0:
            return target
    mean_origin, mean_forward = origins.mean(axis=0), forwards.mean(axis=0)
    ahead = 2.0 * float(np.linalg.norm(origins - mean_origin, axis=1).max()) or 1.0
    target_ahead: Floats = mean_origin + ahead * mean_forward / max(float(np.linalg.norm(mean_forward)), 1e-9)
    return target_ahead


def _covered_arc(azimuths: Floats) -> tuple[float, float] | None:
    """(start, length) of the arc that holds all azimuths; None for one, or over two thirds of a turn."""
    ordered = np.sort(np.mod(azimuths, 2.0 * math.pi))
    gaps = np.diff(np.append(ordered, ordered[0] + 2.0 * math.pi))
    widest = int(np.argmax(gaps))
    if len(azimuths) == 1 or gaps[widest] <= 2.0 * math.pi / 3.0:
        return None
    return float(ordered[(widest + 1) % len(ordered)]), float(2.0 * math.pi - gaps[widest])


def _perpendicular(direction: Floats) -> Floats:
    """Unit vector [3] at right angles to `direction`."""
    seed = np.eye(3)[int(np.argmin(np.abs(direction)))]
    perpendicular: Floats = np.cross(np.cross(direction, seed), direction)
    return perpendicular / np.linalg.norm(perpendicular)


def _read_json(path: Path, kind_name: str) -> dict[str, object]:
    try:
        document = json_text.loads(read_text(path))
    except OSError as error:
        raise CameraError(f"{kind_name} {path} cannot be read: {error.strerror}; check the path") from None
    except ValueError as error:
        raise CameraError(f"{kind_name} {path} is not valid JSON: {error}") from None
    if not isinstance(document, dict):
        raise CameraError(f"{kind_name} {path} must hold a JSON object")
    return document


def _positive_integer(document: Mapping[str, object], key: str, path: Path) -> int:
    value = document.get(key)
    if not _is_number(value) or value != int(value) or not 1 <= value <= 16384:
        raise CameraError(
            f'{path}: "{key}" is {value!r:.40}; give a whole number of pixels between 1 and 16384'
        )
    return int(value)


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
