"""Photos through lenses that no `Camera` has, resampled to one at load; COLMAP's camera models.

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
"""Pixels of a picture whose positions in the photo are kept for the next photo of the lens."""

MAX_RAY_ERROR = 1e-4
"""Distance of unit directions that a lens gives there and back: beyond, its distortion folds."""

_FLIP = np.array([1.0, -1.0, -1.0])


@dataclass(frozen=True)
class SourceLens:
    """The lens of a photo that a view's camera shows resampled.

    Attributes:
        model: COLMAP's camera model. params: its parameters, for a photo of `width` x `height` pixels.
        rotation: row by row [9], from the camera's axes to the photo's: not the identity for a panorama.
    """

    model: str
    params: tuple[float, ...]
    width: int
    height: int
    rotation: tuple[float, ...] = IDENTITY

    def positions(self, camera: Camera) -> npt.NDArray[np.float32]:
        """Positions [H,W,2] of the camera's pixel centers in the photo, shares of its width and height.

        NaN where the photo has no such direction.
        """
        lens = replace(camera, c2w=np.eye(4))
        small = camera.width * camera.height <= MAX_CACHED_PIXELS
        return _cached_positions(self, lens) if small else _positions(self, lens)

    def project(self, directions: FloatArray) -> FloatArray:
        """Shares [N,2] of the photo's width and height of directions [N,3] in the photo's axes; NaN outside.

        Raises DatasetError where pycolmap is missing and needed, or does not take the parameters.
        """
        if self.model == EQUIRECTANGULAR:
            x, y, z = directions.T
            longitude, latitude = np.arctan2(x, z), np.arctan2(-y, np.hypot(x, z))
            return np.stack([0.5 + longitude / (2 * np.pi), 0.5 - latitude / np.pi], axis=1)
        lens = colmap_camera(self.model, self.params, self.width, self.height)
        shares = np.asarray(lens.img_from_cam(directions)) / (self.width, self.height)
        inside = np.array(np.isfinite(shares).all(axis=1))
        inside[inside] = ((shares[inside] >= 0) & (shares[inside] <= 1)).all(axis=1)
        plane = np.asarray(lens.cam_from_img(shares[inside] * (self.width, self.height)))
        back = np.concatenate([plane, np.ones((len(plane), 1))], axis=1)
        back /= np.linalg.norm(back, axis=1, keepdims=True)
        there = directions[inside] / np.linalg.norm(directions[inside], axis=1, keepdims=True)
        with np.errstate(invalid="ignore"):
            inside[inside] = np.linalg.norm(back - there, axis=1) <= MAX_RAY_ERROR
        return np.where(inside[:, None], shares, np.nan)

    def resampled(
        self, pixels: npt.NDArray[np.uint8], camera: Camera, scale: tuple[float, float]
    ) -> npt.NDArray[np.uint8]:
        """The camera's picture [H,W,C] of a photo's `pixels` [h,w,C], linear in them; 0 where it has none.

        `scale` are the photo's whole width and height in these pixels: shrinking drops what is left over.
        """
        at = self.positions(camera).reshape(-1, 2)
        seen = np.isfinite(at).all(axis=1)
        x, y = (at[seen].astype(np.float64) * scale - 0.5).T
        left, top = np.floor(x).astype(np.intp), np.floor(y).astype(np.intp)
        across, down = (x - left)[:, None], (y - top)[:, None]
        source = pixels.astype(np.float32)
        if source.shape[2] == 4:
            source[..., :3] *= source[..., 3:] / 255.0

        def row(line: npt.NDArray[np.intp]) -> FloatArray:
            one, other = self._columns(left, pixels.shape[1]), self._columns(left + 1, pixels.shape[1])
            lines = np.clip(line, 0, pixels.shape[0] - 1)
            return np.asarray(source[lines, one] * (1 - across) + source[lines, other] * across)

        found = row(top) * (1 - down) + row(top + 1) * down
        if source.shape[2] == 4:
            found[:, :3] *= 255.0 / np.maximum(found[:, 3:], 1e-6)
        picture = np.zeros((len(at), pixels.shape[2]), np.uint8)
        picture[seen] = np.rint(np.clip(found, 0, 255)).astype(np.uint8)
        return picture.reshape(camera.height, camera.width, -1)

    def resampled_mask(
        self, valid: BoolArray | None, camera: Camera, scale: tuple[float, float] = (1, 1)
    ) -> BoolArray:
        """The camera's pixels [H,W] that the photo has, where the nearest of its pixels is `valid`."""
        at = self.positions(camera)
        seen = np.array(np.isfinite(at).all(axis=2))
        if valid is not None:
            columns, rows = (at[seen].astype(np.float64) * scale).astype(np.intp).T
            rows = np.clip(rows, 0, valid.shape[0] - 1)
            seen[seen] = valid[rows, self._columns(columns, valid.shape[1])]
        return np.asarray(seen)

    def _columns(self, columns: npt.NDArray[np.intp], width: int) -> npt.NDArray[np.intp]:
        """Columns of the photo's pixels: a panorama goes on at its other side."""
        if self.model == EQUIRECTANGULAR:
            return np.asarray(columns % width)
        return np.asarray(np.clip(columns, 0, width - 1))


def colmap_camera(model: str, params: tuple[float, ...], width: int, height: int) -> Any:
    """The pycolmap camera. Raises DatasetError where pycolmap is missing, or does not take the parameters."""
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
    directions = camera.local_directions().astype(np.float64) * _FLIP
    turned = directions @ np.array(source.rotation).reshape(3, 3).T
    return source.project(turned).astype(np.float32).reshape(camera.height, camera.width, 2)


_cached_positions = lru_cache(maxsize=8)(_positions)
