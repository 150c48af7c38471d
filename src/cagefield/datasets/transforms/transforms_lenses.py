"""Intrinsics and lenses of `transforms*.json`; `transforms_json_dataset` lists the keys."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from cagefield.cameras.camera import Camera
from cagefield.datasets.colmap.colmap_lenses import LensView, lens_views
from cagefield.datasets.photos import Header
from cagefield.datasets.transforms.transforms_json import read_number
from cagefield.datasets.undistortion import EQUIRECTANGULAR
from cagefield.errors import DatasetError

PERSPECTIVE_MODELS: Final = (
    "OPENCV", "OPENCV5", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "PERSPECTIVE",
)  # fmt: skip
"""Models with the coefficients k1, k2, p1, p2, k3, k4, as far as they are given."""

FISHEYE_MODELS: Final = (
    "OPENCV_FISHEYE",
    "SIMPLE_RADIAL_FISHEYE",
    "RADIAL_FISHEYE",
    "SIMPLE_FISHEYE",
    "FISHEYE",
)
"""Models with the coefficients k1, k2, k3, k4, as far as they are given."""

PANORAMIC_MODELS: Final = (EQUIRECTANGULAR, "SPHERICAL", "LATLONG")

RESAMPLED_PARAMETERS: Final[dict[str, tuple[str, ...]]] = {
    "FULL_OPENCV": ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    "FOV": ("omega",),
    "THIN_PRISM_FISHEYE": ("k1", "k2", "p1", "p2", "k3", "k4", "sx1", "sy1"),
    "RAD_TAN_THIN_PRISM_FISHEYE": (
        "k0", "k1", "k2", "k3", "k4", "k5", "p0", "p1", "s0", "s1", "s2", "s3",
    ),
    "DIVISION": ("k",),
    "EUCM": ("alpha", "beta"),
}  # fmt: skip
"""COLMAP's parameter names after fx, fy, cx, cy, of models that `Camera` may not have."""

_MODEL_ALIASES: Final = {"THIN_PRISM": "THIN_PRISM_FISHEYE", "SIMPLE_DIVISION": "DIVISION"}


def build_frame_lenses(
    where: str, values: dict[str, Any], frame: dict[str, Any], header: Header
) -> tuple[LensView, ...]:
    """Views, in the identity pose, of a frame's photo, of the size given in the file.

    Raises DatasetError for invalid keys, CameraError for values that no camera has.
    """
    merged = {**values, **frame}
    width, height = _size(where, merged, header)
    model = _model(where, merged)
    if model in PANORAMIC_MODELS:
        return lens_views(EQUIRECTANGULAR, (), width, height)
    fx, fy = _focal_lengths(where, frame, width, height)
    if fx is None and fy is None:
        fx, fy = _focal_lengths(where, values, width, height)
    fx, fy = (fy if fx is None else fx), (fx if fy is None else fy)
    if fx is None or fy is None:
        raise DatasetError(f"{where}: no focal length; give fl_x (pixels) or camera_angle_x (radians)")
    cx, cy = read_number(where, merged, "cx"), read_number(where, merged, "cy")
    axis = 0.5 * width if cx is None else cx, 0.5 * height if cy is None else cy
    if model in RESAMPLED_PARAMETERS:
        params = tuple(read_number(where, merged, key) or 0.0 for key in RESAMPLED_PARAMETERS[model])
        try:
            return lens_views(model, (fx, fy, *axis, *params), width, height)
        except DatasetError as error:
            raise DatasetError(f"{where}: {error}") from None
    keys = ("k1", "k2", "k3", "k4") if model in FISHEYE_MODELS else ("k1", "k2", "p1", "p2", "k3", "k4")
    if merged.get("k1") is None and "k" in merged:
        merged["k1"] = merged["k"]
    distortion = tuple(read_number(where, merged, key) or 0.0 for key in keys)
    if model in FISHEYE_MODELS:
        camera = Camera(np.eye(4), width, height, fx, fy, *axis, "opencv_fisheye", distortion)
    elif any(distortion):
        camera = Camera(np.eye(4), width, height, fx, fy, *axis, "opencv", distortion)
    else:
        camera = Camera(np.eye(4), width, height, fx, fy, *axis)
    return (LensView(camera),)


def _model(where: str, merged: dict[str, Any]) -> str:
    """Name of the camera model in capitals; OPENCV where the file names none."""
    name = merged.get("camera_model")
    name = "OPENCV" if name is None else name
    model = _MODEL_ALIASES.get(name.upper(), name.upper()) if isinstance(name, str) else ""
    known_models = (*PERSPECTIVE_MODELS, *FISHEYE_MODELS, *PANORAMIC_MODELS, *RESAMPLED_PARAMETERS)
    if model not in known_models:
        raise DatasetError(
            f"{where}: camera_model {name!r:.40} cannot be read, only {', '.join(known_models)}; "
            "undistort the photos first"
        )
    for key in ("lens_mode", "ftheta_p0"):
        if merged.get(key):
            raise DatasetError(f"{where}: the lens of key {key!r} cannot be read; undistort the photos first")
    if merged.get("latlong") or merged.get("equirectangular"):
        return EQUIRECTANGULAR
    return "OPENCV_FISHEYE" if merged.get("is_fisheye") is True else model


def _size(where: str, merged: dict[str, Any], header: Header) -> tuple[int, int]:
    """(width, height) in the file; the photo's where the file has none."""
    width, height = read_number(where, merged, "w"), read_number(where, merged, "h")
    for key, value in (("w", width), ("h", height)):
        if value is not None and (value < 1 or value != int(value)):
            raise DatasetError(f"{where}: key {key!r} must be a whole number of pixels, got {value:g}")
    return int(width or header.width), int(height or header.height)


def _focal_lengths(
    where: str, source: dict[str, Any], width: int, height: int
) -> tuple[float | None, float | None]:
    """Focal lengths in pixels along x and y as far as `source` gives them."""
    focals: list[float | None] = []
    for axis, side in (("x", width), ("y", height)):
        focal = read_number(where, source, f"fl_{axis}")
        if focal is None:
            angle = read_number(where, source, f"camera_angle_{axis}")
            degrees = read_number(where, source, f"{axis}_fov")
            if degrees is not None:
                angle = math.radians(degrees)
            if angle is not None:
                if not 0.0 < angle < math.pi:
                    raise DatasetError(
                        f"{where}: the field of view along {axis} is {math.degrees(angle):g} degrees; it "
                        f"must lie between 0 and 180 (radians in camera_angle_{axis}, degrees in {axis}_fov)"
                    )
                focal = 0.5 * side / math.tan(0.5 * angle)
        focals.append(focal)
    return focals[0], focals[1]
