"""COLMAP's camera models as cameras: exact where `Camera` has the lens, else resampled at load.

Source: COLMAP, `src/colmap/sensor/models.h`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from cagefield.cameras.camera import Camera
from cagefield.cameras.lenses import Lens
from cagefield.datasets.notices import warn
from cagefield.datasets.undistortion import EQUIRECTANGULAR, IDENTITY, SourceLens, build_colmap_camera
from cagefield.errors import DatasetError

FloatArray = npt.NDArray[np.float64]

PARAMETERS: Final[dict[str, int]] = {
    "SIMPLE_PINHOLE": 3,
    "PINHOLE": 4,
    "SIMPLE_RADIAL": 4,
    "RADIAL": 5,
    "OPENCV": 8,
    "OPENCV_FISHEYE": 8,
    "FULL_OPENCV": 12,
    "FOV": 5,
    "SIMPLE_RADIAL_FISHEYE": 4,
    "RADIAL_FISHEYE": 5,
    "THIN_PRISM_FISHEYE": 12,
    "RAD_TAN_THIN_PRISM_FISHEYE": 16,
    "SIMPLE_DIVISION": 4,
    "DIVISION": 5,
    "SIMPLE_FISHEYE": 3,
    "FISHEYE": 4,
    "EUCM": 6,
    EQUIRECTANGULAR: 2,
}
"""Number of parameters of each camera model, in the order of COLMAP's model numbers from 0."""

MAX_PINHOLE_ANGLE = math.radians(60.0)
"""Maximum angle to the axis, radians, of a resampled photo that becomes a pinhole; wider photos become
fisheyes.
"""

PANORAMA_FACES: Final[dict[str, tuple[float, ...]]] = {
    "front": IDENTITY,
    "right": (0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0),
    "back": (-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0),
    "left": (0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0),
    "up": (1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0),
    "down": (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0),
}
"""Cube faces of a panorama: rotations [9], row by row, from a face's axes (OpenCV) to the panorama's."""

_ONE_FOCAL_MODELS = ("SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE",
              "SIMPLE_FISHEYE")  # fmt: skip
_FISHEYE_MODELS = ("OPENCV_FISHEYE", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE", "SIMPLE_FISHEYE", "FISHEYE")
_OPENGL_TO_OPENCV_MATRIX = np.diag([1.0, -1.0, -1.0])
_GRID_LINES = 33  # lines of a photo's grid by which its angles and the share that is shown are measured


@dataclass(frozen=True)
class LensView:
    """Camera in the identity pose that shows a photo, or one face of a panorama.

    `face` is empty where the camera shows the photo itself. `source` is None where the camera has the photo's
    lens.
    """

    camera: Camera
    source: SourceLens | None = None
    face: str = ""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the photo."""
        if self.face and self.source is not None:
            return self.source.width, self.source.height
        return self.camera.width, self.camera.height

    def resized(self, width: int, height: int) -> LensView:
        """View of a photo of `width` x `height` pixels."""
        if self.face:
            return next(view for view in _faces(width, height) if view.face == self.face)
        return replace(self, camera=self.camera.resized(width, height))

    def pose(self, c2w: FloatArray) -> FloatArray:
        """Pose [4,4] of the camera where the photo's pose is `c2w`."""
        if self.source is None or self.source.rotation == IDENTITY:
            return c2w
        rotation = np.eye(4)
        rotation[:3, :3] = (
            _OPENGL_TO_OPENCV_MATRIX @ np.array(self.source.rotation).reshape(3, 3) @ _OPENGL_TO_OPENCV_MATRIX
        )
        return np.asarray(c2w @ rotation)

    def name(self, photo: str) -> str:
        """Name of the view: the photo's name, with the face before the extension."""
        if not self.face:
            return photo
        stem, dot, extension = photo.rpartition(".")
        return f"{stem}.{self.face}.{extension}" if dot and "/" not in extension else f"{photo}.{self.face}"


def lens_views(model: str, params: tuple[float, ...], width: int, height: int) -> tuple[LensView, ...]:
    """Views of a photo of `width` x `height` pixels of a COLMAP camera model: one, or six faces.

    Raises DatasetError for a model that COLMAP does not have and for too many or too few parameters,
    CameraError for values that no camera has.
    """
    if model not in PARAMETERS:
        raise DatasetError(
            f"COLMAP has no camera model {model!r:.40}; undistort the photos first, to one of "
            f"{', '.join(PARAMETERS)}"
        )
    if model == EQUIRECTANGULAR:
        return _faces(width, height)
    if len(params) != PARAMETERS[model]:
        raise DatasetError(
            f"camera model {model} has {PARAMETERS[model]} parameters, got {len(params)}; export it again"
        )
    exact = _exact_lens(model, params)
    if exact is not None:
        fx, fy, cx, cy, lens, distortion = exact
        return (LensView(Camera(np.eye(4), width, height, fx, fy, cx, cy, lens, distortion)),)
    camera = _resampled_camera(model, params, width, height)
    return (LensView(camera, SourceLens(model, params, width, height)),)


def report_resampled(where: str, views: Sequence[LensView]) -> None:
    """Warn once for each camera model whose photos are resampled; `views` has an entry for each view of a
    photo.
    """
    for model in dict.fromkeys(view.source.model for view in views if view.source is not None):
        model_views = [view for view in views if view.source is not None and view.source.model == model]
        if model_views[0].face:
            warn(
                f"{where}: {len(model_views) // len(PANORAMA_FACES)} panoramas are shown as "
                f"{len(PANORAMA_FACES)} "
                f"pictures each, "
                f"{', '.join(PANORAMA_FACES)}, of "
                f"{model_views[0].camera.width}x{model_views[0].camera.height} pixels"
            )
            continue
        share = min(shown_share(view) for view in dict.fromkeys(model_views))
        kind = "fisheye" if model_views[0].camera.model == "opencv_fisheye" else "pinhole"
        warn(
            f"{where}: {len(model_views)} photos of camera model {model} are undistorted at load, to a "
            f"{kind}; "
            f"{share:.0%} of it is kept"
        )


def shown_share(view: LensView) -> float:
    """Share of the photo's area that its view shows, among the directions that the photo has."""
    source = view.source
    if source is None or view.face:
        return 1.0
    plane = _grid_directions(source)
    pixels, _ = view.camera.project(plane * (1.0, -1.0, -1.0))
    size = view.camera.width, view.camera.height
    with np.errstate(invalid="ignore"):
        inside = np.array(((pixels >= 0) & (pixels <= size)).all(axis=1))
    return float(inside.mean()) if len(inside) else 0.0


def _exact_lens(
    model: str, params: tuple[float, ...]
) -> tuple[float, float, float, float, Lens, tuple[float, ...]] | None:
    """(fx, fy, cx, cy, lens, distortion) of the lens that equals the camera model; None where there is
    none.
    """
    p = (params[0], *params) if model in _ONE_FOCAL_MODELS else params
    fx, fy, cx, cy, *rest = p
    distortion = tuple(rest)
    if model == "THIN_PRISM_FISHEYE" and not any(distortion[i] for i in (2, 3, 6, 7)):
        distortion = (*distortion[:2], *distortion[4:6])
    elif model == "FULL_OPENCV" and not any(distortion[5:]):
        distortion = distortion[:5]
    elif model in _FISHEYE_MODELS:
        distortion = (*distortion, 0.0, 0.0, 0.0, 0.0)[:4]
    elif model in ("SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV"):
        distortion = (*distortion, 0.0, 0.0, 0.0)[:4] if distortion else ()
    else:
        return None
    lens: Lens = "opencv_fisheye" if "FISHEYE" in model else "opencv" if distortion else "pinhole"
    return fx, fy, cx, cy, lens, distortion


def _resampled_camera(model: str, params: tuple[float, ...], width: int, height: int) -> Camera:
    """Pinhole or fisheye camera with the photo's size, focal length and principal point."""
    lens = build_colmap_camera(model, params, width, height)
    intrinsics = (
        float(lens.focal_length_x),
        float(lens.focal_length_y),
        float(lens.principal_point_x),
        float(lens.principal_point_y),
    )
    directions = _grid_directions(SourceLens(model, params, width, height))
    if not len(directions):
        raise DatasetError(
            f"camera model {model} with parameters {list(params)} sees nothing; export it again"
        )
    if np.arccos(directions[:, 2].min()) > MAX_PINHOLE_ANGLE:
        return Camera(np.eye(4), width, height, *intrinsics, "opencv_fisheye", (0.0,) * 4)
    return Camera(np.eye(4), width, height, *intrinsics)


def _grid_directions(source: SourceLens) -> FloatArray:
    """Unit directions [N,3] of a grid over the photo, where the lens has them."""
    lens = build_colmap_camera(source.model, source.params, source.width, source.height)
    x, y = np.meshgrid(np.linspace(0, source.width, _GRID_LINES), np.linspace(0, source.height, _GRID_LINES))
    plane = np.asarray(lens.cam_from_img(np.stack([x.ravel(), y.ravel()], axis=1)), np.float64)
    directions = np.concatenate([plane, np.ones((len(plane), 1))], axis=1)
    directions = directions[np.isfinite(directions).all(axis=1)]
    return np.asarray(directions / np.linalg.norm(directions, axis=1, keepdims=True))


def _faces(width: int, height: int) -> tuple[LensView, ...]:
    """Views of a panorama: square pinholes of 90 degrees, with the panorama's pixel size in their middle."""
    focal = max(width / (2 * np.pi), height / np.pi)
    side = max(1, round(2 * focal))
    camera = Camera(np.eye(4), side, side, 0.5 * side, 0.5 * side, 0.5 * side, 0.5 * side)
    return tuple(
        LensView(camera, SourceLens(EQUIRECTANGULAR, (), width, height, rotation), face)
        for face, rotation in PANORAMA_FACES.items()
    )
