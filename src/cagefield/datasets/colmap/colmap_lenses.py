"""COLMAP's camera models as cameras: exactly where there is such a lens, else resampled at load.

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
from cagefield.datasets.undistortion import EQUIRECTANGULAR, IDENTITY, SourceLens, colmap_camera
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
"""How many parameters each camera model has; their order is COLMAP's of its numbers, from 0."""

MAX_PINHOLE_ANGLE = math.radians(60.0)
"""Angle to the axis up to which a resampled photo is a pinhole's; a wider one is a fisheye's."""

FACES: Final[dict[str, tuple[float, ...]]] = {
    "front": IDENTITY,
    "right": (0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0),
    "back": (-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0),
    "left": (0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0),
    "up": (1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0),
    "down": (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0),
}
"""The cube's faces that a panorama is shown as: rotations [9] from their axes (OpenCV) to the panorama's."""

_ONE_FOCAL = ("SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE",
              "SIMPLE_FISHEYE")  # fmt: skip
_FISHEYES = ("OPENCV_FISHEYE", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE", "SIMPLE_FISHEYE", "FISHEYE")
_FLIP = np.diag([1.0, -1.0, -1.0])
_GRID = 33  # lines of a photo's grid by which its angles and the share that is shown are measured


@dataclass(frozen=True)
class LensView:
    """A camera in the identity pose that shows a photo, or a face of it.

    `face` is empty where the camera shows the photo as it is. `source` is None where it has the photo's lens.
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
        """The view of a photo of `width` x `height` pixels."""
        if self.face:
            return next(view for view in _faces(width, height) if view.face == self.face)
        return replace(self, camera=self.camera.resized(width, height))

    def pose(self, c2w: FloatArray) -> FloatArray:
        """The camera's pose [4,4] where the photo's is `c2w`."""
        if self.source is None or self.source.rotation == IDENTITY:
            return c2w
        turn = np.eye(4)
        turn[:3, :3] = _FLIP @ np.array(self.source.rotation).reshape(3, 3) @ _FLIP
        return np.asarray(c2w @ turn)

    def name(self, photo: str) -> str:
        """The view's name: the photo's, with the face before the extension."""
        if not self.face:
            return photo
        stem, dot, extension = photo.rpartition(".")
        return f"{stem}.{self.face}.{extension}" if dot and "/" not in extension else f"{photo}.{self.face}"


def lens_views(model: str, params: tuple[float, ...], width: int, height: int) -> tuple[LensView, ...]:
    """The views that show a photo of `width` x `height` pixels of a COLMAP camera model: one, or six faces.

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
    exact = _exact(model, params)
    if exact is not None:
        fx, fy, cx, cy, lens, distortion = exact
        return (LensView(Camera(np.eye(4), width, height, fx, fy, cx, cy, lens, distortion)),)
    camera = _resampled_camera(model, params, width, height)
    return (LensView(camera, SourceLens(model, params, width, height)),)


def report_resampled(where: str, views: Sequence[LensView]) -> None:
    """Warns once for each camera model that photos are resampled, of `views` one for each view of a photo."""
    for model in dict.fromkeys(view.source.model for view in views if view.source is not None):
        some = [view for view in views if view.source is not None and view.source.model == model]
        if some[0].face:
            warn(
                f"{where}: {len(some) // len(FACES)} panoramas are shown as {len(FACES)} pictures each, "
                f"{', '.join(FACES)}, of {some[0].camera.width}x{some[0].camera.height} pixels"
            )
            continue
        share = min(shown_share(view) for view in dict.fromkeys(some))
        kind = "fisheye" if some[0].camera.model == "opencv_fisheye" else "pinhole"
        warn(
            f"{where}: {len(some)} photos of camera model {model} are undistorted at load, to a {kind}; "
            f"{share:.0%} of it is kept"
        )


def shown_share(view: LensView) -> float:
    """The share of the photo's area that its view shows, of those directions that the photo has."""
    source = view.source
    if source is None or view.face:
        return 1.0
    plane = _grid_directions(source)
    pixels, _ = view.camera.project(plane * (1.0, -1.0, -1.0))
    size = view.camera.width, view.camera.height
    with np.errstate(invalid="ignore"):
        inside = np.array(((pixels >= 0) & (pixels <= size)).all(axis=1))
    return float(inside.mean()) if len(inside) else 0.0


def _exact(
    model: str, params: tuple[float, ...]
) -> tuple[float, float, float, float, Lens, tuple[float, ...]] | None:
    """(fx, fy, cx, cy, lens, distortion) where a lens is the camera model's; None where none is."""
    p = (params[0], *params) if model in _ONE_FOCAL else params
    fx, fy, cx, cy, *rest = p
    distortion = tuple(rest)
    if model == "THIN_PRISM_FISHEYE" and not any(distortion[i] for i in (2, 3, 6, 7)):
        distortion = (*distortion[:2], *distortion[4:6])
    elif model == "FULL_OPENCV" and not any(distortion[5:]):
        distortion = distortion[:5]
    elif model in _FISHEYES:
        distortion = (*distortion, 0.0, 0.0, 0.0, 0.0)[:4]
    elif model in ("SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV"):
        distortion = (*distortion, 0.0, 0.0, 0.0)[:4] if distortion else ()
    else:
        return None
    lens: Lens = "opencv_fisheye" if "FISHEYE" in model else "opencv" if distortion else "pinhole"
    return fx, fy, cx, cy, lens, distortion


def _resampled_camera(model: str, params: tuple[float, ...], width: int, height: int) -> Camera:
    """A pinhole or fisheye of the photo's size, focal length and axis."""
    lens = colmap_camera(model, params, width, height)
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
    """Unit directions [N,3] of a grid all over the photo, where the lens has them."""
    lens = colmap_camera(source.model, source.params, source.width, source.height)
    x, y = np.meshgrid(np.linspace(0, source.width, _GRID), np.linspace(0, source.height, _GRID))
    plane = np.asarray(lens.cam_from_img(np.stack([x.ravel(), y.ravel()], axis=1)), np.float64)
    directions = np.concatenate([plane, np.ones((len(plane), 1))], axis=1)
    directions = directions[np.isfinite(directions).all(axis=1)]
    return np.asarray(directions / np.linalg.norm(directions, axis=1, keepdims=True))


def _faces(width: int, height: int) -> tuple[LensView, ...]:
    """Square pinholes of 90 degrees, in whose middle a pixel is as wide as the panorama's at its equator."""
    focal = max(width / (2 * np.pi), height / np.pi)
    side = max(1, round(2 * focal))
    camera = Camera(np.eye(4), side, side, 0.5 * side, 0.5 * side, 0.5 * side, 0.5 * side)
    return tuple(
        LensView(camera, SourceLens(EQUIRECTANGULAR, (), width, height, rotation), face)
        for face, rotation in FACES.items()
    )
