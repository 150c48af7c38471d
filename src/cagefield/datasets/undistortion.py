"""Resampling of photos through lenses that no `Camera` has (COLMAP's camera models), at load.

Notation: directions in OpenCV camera axes (x right, y down, z forward), pixel positions with (.5,.5) the
center of the first pixel. An EQUIRECTANGULAR photo of W x H pixels shows the longitude 2 pi (x / W - .5) from
the forward axis to the right, and the latitude pi (.5 - y / H).

Source: COLMAP, `src/colmap/sensor/models.h`, by pycolmap.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from cagefield.cameras.camera import Camera
from cagefield.errors import DatasetError

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

EQUIRECTANGULAR = "EQUIRECTANGULAR"

IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)

MAX_CACHED_PIXELS = 1 << 20
"""Maximum pixels of an image whose positions in the photo are cached for the next photo of the lens."""

MAX_RAY_ERROR = 1e-4
"""Maximum distance of unit directions before and after a round trip through a lens: beyond, its distortion
folds.
"""

_OPENGL_TO_OPENCV = np.array([1.0, -1.0, -1.0])


@dataclass(frozen=True)
class SourceLens:
    """Lens of a photo that a view's camera shows resampled.

    Attributes:
        model: COLMAP's camera model.
        params: its parameters, for a photo of `width` x `height` pixels.
        rotation: row by row [9], from the camera's axes to the photo's: not the identity for a panorama.
    """

    model: str
    params: tuple[float, ...]
    width: int
    height: int
    rotation: tuple[float, ...] = IDENTITY

    def positions(self, camera: Camera) -> npt.NDArray[np.float32]:
        """Positions [H,W,2] of the camera's pixel centers in the photo, shares of its width and height.

        NaN where the photo does not show the direction.
        """
        lens = replace(camera, c2w=np.eye(4))
        small = camera.width * camera.height <= MAX_CACHED_PIXELS
        return _cached_positions(self, lens) if small else _positions(self, lens)

    def project(self, directions: FloatArray) -> FloatArray:
        """Projection [N,2] of directions [N,3] in the photo's axes, shares of its width and height; NaN
        outside.

        Raises DatasetError where pycolmap is missing and needed, or does not take the parameters.
        """
        if self.model == EQUIRECTANGULAR:
            x, y, z = directions.T
            longitude, latitude = np.arctan2(x, z), np.arctan2(-y, np.hypot(x, z))
            return np.stack([0.5 + longitude / (2 * np.pi), 0.5 - latitude / np.pi], axis=1)
        lens = build_colmap_camera(self.model, self.params, self.width, self.height)
        shares = np.asarray(lens.img_from_cam(directions)) / (self.width, self.height)
        inside = np.array(np.isfinite(shares).all(axis=1))
        inside[inside] = ((shares[inside] >= 0) & (shares[inside] <= 1)).all(axis=1)
        plane = np.asarray(lens.cam_from_img(shares[inside] * (self.width, self.height)))
        unprojected = np.concatenate([plane, np.ones((len(plane), 1))], axis=1)
        unprojected /= np.linalg.norm(unprojected, axis=1, keepdims=True)
        unit_directions = directions[inside] / np.linalg.norm(directions[inside], axis=1, keepdims=True)
        with np.errstate(invalid="ignore"):
            inside[inside] = np.linalg.norm(unprojected - unit_directions, axis=1) <= MAX_RAY_ERROR
        return np.where(inside[:, None], shares, np.nan)

    def resample(
        self, pixels: npt.NDArray[np.uint8], camera: Camera, scale: tuple[float, float]
    ) -> npt.NDArray[np.uint8]:
        """Image [H,W,C] of the camera, bilinear in a photo's `pixels` [h,w,C]; 0 outside of the photo.

        `scale` is the whole photo's width and height in these pixels: shrinking drops left-over rows and
        columns.
        """
        positions = self.positions(camera).reshape(-1, 2)
        is_inside = np.isfinite(positions).all(axis=1)
        x, y = (positions[is_inside].astype(np.float64) * scale - 0.5).T
        left, top = np.floor(x).astype(np.intp), np.floor(y).astype(np.intp)
        fraction_x, fraction_y = (x - left)[:, None], (y - top)[:, None]
        source = pixels.astype(np.float32)
        if source.shape[2] == 4:
            source[..., :3] *= source[..., 3:] / 255.0

        def row(line: npt.NDArray[np.intp]) -> FloatArray:
            left_columns, right_columns = (
                self._clip_columns(left, pixels.shape[1]),
                self._clip_columns(left + 1, pixels.shape[1]),
            )
            lines = np.clip(line, 0, pixels.shape[0] - 1)
            return np.asarray(
                source[lines, left_columns] * (1 - fraction_x) + source[lines, right_columns] * fraction_x
            )

        colors = row(top) * (1 - fraction_y) + row(top + 1) * fraction_y
        if source.shape[2] == 4:
            colors[:, :3] *= 255.0 / np.maximum(colors[:, 3:], 1e-6)
        image = np.zeros((len(positions), pixels.shape[2]), np.uint8)
        image[is_inside] = np.rint(np.clip(colors, 0, 255)).astype(np.uint8)
        return image.reshape(camera.height, camera.width, -1)

    def resample_mask(
        self, valid: BoolArray | None, camera: Camera, scale: tuple[float, float] = (1, 1)
    ) -> BoolArray:
        """Pixels [H,W] of the camera that lie in the photo and whose nearest pixel there is `valid`."""
        positions = self.positions(camera)
        is_inside = np.array(np.isfinite(positions).all(axis=2))
        if valid is not None:
            columns, rows = (positions[is_inside].astype(np.float64) * scale).astype(np.intp).T
            rows = np.clip(rows, 0, valid.shape[0] - 1)
            is_inside[is_inside] = valid[rows, self._clip_columns(columns, valid.shape[1])]
        return np.asarray(is_inside)

    def _clip_columns(self, columns: npt.NDArray[np.intp], width: int) -> npt.NDArray[np.intp]:
        """Columns within the photo: wrapped around in a panorama, else clipped at the sides."""
        if self.model == EQUIRECTANGULAR:
            return np.asarray(columns % width)
        return np.asarray(np.clip(columns, 0, width - 1))


def build_colmap_camera(model: str, params: tuple[float, ...], width: int, height: int) -> Any:
    """pycolmap camera. Raises DatasetError where pycolmap is missing, or does not take the parameters."""
    try:
        import pycolmap
    except ImportError:
        raise DatasetError(
            f"photos of camera model {model} are undistorted by pycolmap; pip install -U pycolmap"
        ) from None
    try:
        return pycolmap.Camera(model=model, width=width, height=height, params=list(params))
    except Exception as error:  # pycolmap raises whatever C++ threw
        reason = " ".join(str(error).split())
        raise DatasetError(
            f"camera model {model} with {len(params)} parameters is no COLMAP camera ({reason:.120}); "
            "export it again"
        ) from None


def _positions(source: SourceLens, camera: Camera) -> npt.NDArray[np.float32]:
    directions = camera.local_directions().astype(np.float64) * _OPENGL_TO_OPENCV
    turned = directions @ np.array(source.rotation).reshape(3, 3).T
    return source.project(turned).astype(np.float32).reshape(camera.height, camera.width, 2)


_cached_positions = lru_cache(maxsize=8)(_positions)
