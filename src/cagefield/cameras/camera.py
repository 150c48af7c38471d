"""Cameras: OpenGL axes (+x right, +y up, looks along -z); column i, row j has its center at (i+.5, j+.5).

A camera is a pose `c2w`, an image size, intrinsics in pixels and a lens model (see
`cagefield.cameras.lenses`).
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from cagefield.cameras import lenses
from cagefield.cameras.camera_checks import validate_number, validate_pose, validate_size
from cagefield.cameras.lenses import Lens
from cagefield.errors import CameraError

FloatArray = npt.NDArray[np.float64]
Float32Array = npt.NDArray[np.float32]

_MAX_BLIND_SHARE = (
    0.1  # above this share of pixels without a ray, coefficients and image do not belong together
)
FRONT_FOV_X = math.radians(45.0)
"""Horizontal field of view of `front_camera`."""

_OPENGL_TO_OPENCV = np.array([1.0, -1.0, -1.0])  # OpenGL camera axes <-> OpenCV camera axes


@dataclass(frozen=True, eq=False)
class Camera:
    """Camera: pose [4,4] float64, image size and intrinsics in pixels, lens model and its coefficients.

    `model` "pinhole" has no `distortion`; "opencv" has k1, k2, p1, p2 and optionally k3, k4 (radial, not the
    rational model's denominators); "opencv_fisheye" has k1..k4.

    Raises CameraError for a pose that is not finite or not rigid, and for impossible intrinsics.
    """

    c2w: FloatArray
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    model: Lens = "pinhole"
    distortion: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        def set_field(name: str, value: object) -> None:
            object.__setattr__(self, name, value)

        set_field("c2w", validate_pose(self.c2w))
        for name in ("width", "height"):
            set_field(name, validate_size(name, getattr(self, name)))
        for name in ("fx", "fy", "cx", "cy"):
            value = validate_number(name, getattr(self, name))
            if name in ("fx", "fy") and value <= 0:
                raise CameraError(f"{name} must be a positive focal length in pixels, got {value}")
            set_field(name, value)
        if self.model not in lenses.COEFFICIENTS:
            raise CameraError(f"model must be one of {', '.join(lenses.COEFFICIENTS)}, got {self.model!r}")
        allowed = lenses.COEFFICIENTS[self.model]
        if len(self.distortion) not in allowed:
            counts = " or ".join(str(n) for n in allowed)
            raise CameraError(
                f"a camera of model {self.model!r} takes {counts} distortion coefficients, "
                f"got {len(self.distortion)}"
            )
        set_field("distortion", tuple(validate_number("distortion", k) for k in self.distortion))

    @classmethod
    def from_fov(cls, c2w: npt.ArrayLike, width: int, height: int, fov_x: float) -> Camera:
        """Pinhole camera with square pixels and a central axis; `fov_x` is horizontal, in radians."""
        if not 0.0 < fov_x < math.pi:
            raise CameraError(
                f"fov_x must lie between 0 and pi radians, got {fov_x}; convert degrees with math.radians"
            )
        focal = 0.5 * validate_size("width", width) / math.tan(0.5 * fov_x)
        return cls(cast(FloatArray, c2w), width, height, focal, focal, 0.5 * width, 0.5 * height)

    @classmethod
    def from_opencv(
        cls,
        viewmat: npt.ArrayLike,
        K: npt.ArrayLike,
        width: int,
        height: int,
        *,
        model: Lens = "pinhole",
        distortion: Sequence[float] = (),
    ) -> Camera:
        """Camera from a world-to-camera matrix [4,4] in OpenCV axes and intrinsics K [3,3] in pixels.

        The convention of COLMAP and gsplat (+x right, +y down, +z forward); the principal point of K counts
        from the corner of the first pixel, whose center is at (.5, .5). Inverse of `viewmat` and `K`.

        Raises CameraError for other shapes, a pose that is not rigid, and a K with skew or another last row.
        """
        pose, intrinsics = (np.asarray(matrix, dtype=np.float64) for matrix in (viewmat, K))
        if pose.shape != (4, 4):
            raise CameraError(f"viewmat must have the shape [4,4], got {list(pose.shape)}")
        if intrinsics.shape != (3, 3):
            raise CameraError(f"K must have the shape [3,3], got {list(intrinsics.shape)}")
        rest = intrinsics - np.diag(np.diag(intrinsics))
        rest[:2, 2] = 0.0
        if np.any(rest != 0.0) or intrinsics[2, 2] != 1.0:
            raise CameraError(
                f"K must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], got {intrinsics.tolist()}; "
                "skew is not supported, undistort the photos"
            )
        rotation = validate_pose(pose)[:3, :3]
        c2w = np.eye(4)
        c2w[:3, :3] = rotation.T * _OPENGL_TO_OPENCV
        c2w[:3, 3] = -rotation.T @ pose[:3, 3]
        (fx, _, cx), (_, fy, cy), _ = intrinsics.tolist()
        return cls(c2w, width, height, fx, fy, cx, cy, model, tuple(distortion))

    @classmethod
    def look_at(
        cls,
        eye: npt.ArrayLike,
        target: npt.ArrayLike,
        up: npt.ArrayLike = (0.0, 0.0, 1.0),
        *,
        width: int,
        height: int,
        fov_x: float,
    ) -> Camera:
        """Pinhole camera at `eye` [3] that looks at `target` [3], with `up` [3] upwards in the image.

        Raises CameraError where eye and target coincide or `up` is parallel to the direction of view.
        """
        eye, target, up = (np.asarray(v, dtype=np.float64).reshape(3) for v in (eye, target, up))
        back = eye - target
        distance = np.linalg.norm(back)
        if not distance > 0:
            raise CameraError(f"target must differ from eye, both are {tuple(eye.tolist())}")
        back = back / distance
        right = np.cross(up, back)
        length = np.linalg.norm(right)
        if not length > 1e-9 * np.linalg.norm(up):
            raise CameraError(
                f"up {tuple(up.tolist())} is parallel to the direction of view; "
                "choose another up vector, (0, 1, 0) say"
            )
        right = right / length
        c2w = np.eye(4)
        c2w[:3] = np.stack([right, np.cross(back, right), back, eye], axis=1)
        return cls.from_fov(c2w, width, height, fov_x)

    @property
    def origin(self) -> FloatArray:
        """Position [3] of the camera in the world."""
        return self.c2w[:3, 3]

    @property
    def K(self) -> FloatArray:
        """Intrinsics [3,3] in pixels: [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @property
    def viewmat(self) -> FloatArray:
        """World-to-camera matrix [4,4] in OpenCV axes (+x right, +y down, +z forward), as in gsplat."""
        rotation = (self.c2w[:3, :3] * _OPENGL_TO_OPENCV).T
        viewmat = np.eye(4)
        viewmat[:3, :3] = rotation
        viewmat[:3, 3] = -rotation @ self.origin
        return viewmat

    @property
    def forward(self) -> FloatArray:
        """Unit world direction [3] of view."""
        return -self.c2w[:3, 2] / np.linalg.norm(self.c2w[:3, 2])

    def local_directions(self) -> Float32Array:
        """Unit camera-space directions [height*width,3] float32 of the pixel centers; read-only, cached.

        Row j*width+i belongs to pixel (i,j). Lens distortion is undone to rounding. A pixel outside the field
        of the lens (beyond the fold of its polynomial) gets the nearest direction inside, with one warning.

        Raises CameraError where more than a tenth of the pixels are outside the field.
        """
        return _local_directions(*self._intrinsics())

    def rays(self, pixels: npt.ArrayLike | None = None) -> tuple[Float32Array, Float32Array]:
        """World-space ray origins [N,3] and unit directions [N,3], float32, through pixel centers.

        `pixels` [N,2] holds integer (column i, row j); None means all of them, row by row.

        Raises CameraError for pixels that are not integers or lie outside the image.
        """
        if pixels is None:
            local = self.local_directions()
        else:
            ij = np.asarray(pixels)
            if ij.ndim != 2 or ij.shape[1] != 2 or not np.issubdtype(ij.dtype, np.integer):
                raise CameraError(
                    f"pixels must be integers [N,2] (column, row), got {ij.dtype} {list(ij.shape)}"
                )
            outside = np.any((ij < 0) | (ij >= (self.width, self.height)), axis=1)
            if outside.any():
                index = int(np.argmax(outside))
                raise CameraError(
                    f"pixels[{index}] = {tuple(ij[index].tolist())} is outside the image of "
                    f"{self.width}x{self.height}; columns come first, then rows"
                )
            if self.model == "pinhole":
                local = _unproject_pixels(ij + 0.5, *self._intrinsics()[2:])[0]
            else:
                local = self.local_directions()[ij[:, 1] * self.width + ij[:, 0]]
        directions = local @ self.c2w[:3, :3].T.astype(np.float32)
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        return np.tile(self.origin.astype(np.float32), (len(directions), 1)), directions

    def project(self, points: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Pixel positions [N,2] float64 (x, y; distorted) of world `points` [N,3], and depths [N] along -z.

        Positions are NaN where a point has no image: behind the camera or outside the field of the lens.
        Points on the ray of pixel (i,j) are at (i+.5, j+.5).
        """
        world = np.asarray(points, dtype=np.float64)
        if world.ndim != 2 or world.shape[1] != 3:
            raise CameraError(f"points must have the shape [N,3], got {list(world.shape)}")
        local = (world - self.origin) @ np.linalg.inv(self.c2w[:3, :3]).T * _OPENGL_TO_OPENCV
        image = lenses.project(local, self.model, self.distortion)
        return image * (self.fx, self.fy) + (self.cx, self.cy), local[:, 2]

    def resized(self, width: int, height: int) -> Camera:
        """Camera of an image of `width` x `height` with the same field of view: intrinsics scale with each
        side.
        """
        sx, sy = validate_size("width", width) / self.width, validate_size("height", height) / self.height
        return replace(
            self, width=width, height=height,
            fx=self.fx * sx, fy=self.fy * sy, cx=self.cx * sx, cy=self.cy * sy,
        )  # fmt: skip

    def downscaled(self, factor: int) -> Camera:
        """Camera of an image whose pixels are blocks of `factor` x `factor` pixels.

        Intrinsics are divided by exactly `factor`; left-over columns and rows (right, bottom) are dropped.
        """
        largest = min(self.width, self.height)
        if int(factor) != factor or not 1 <= factor <= largest:
            raise CameraError(
                f"factor must be a whole number from 1 to {largest} "
                f"(the image is {self.width}x{self.height}), got {factor}"
            )
        f = int(factor)
        return replace(
            self, width=self.width // f, height=self.height // f,
            fx=self.fx / f, fy=self.fy / f, cx=self.cx / f, cy=self.cy / f,
        )  # fmt: skip

    def with_c2w(self, c2w: npt.ArrayLike) -> Camera:
        """Camera in another pose."""
        return replace(self, c2w=cast(FloatArray, c2w))

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists for a JSON file; `from_dict` restores an equal camera, bit for bit."""
        return {
            "c2w": self.c2w.tolist(), "width": self.width, "height": self.height,
            "fx": self.fx, "fy": self.fy, "cx": self.cx, "cy": self.cy,
            "model": self.model, "distortion": list(self.distortion),
        }  # fmt: skip

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Camera:
        """Camera of the values from `to_dict`. Raises CameraError for keys that are missing or unknown."""
        required = ("c2w", "width", "height", "fx", "fy", "cx", "cy")
        known = (*required, "model", "distortion")
        for key in values:
            if key not in known:
                raise CameraError(f"unknown camera key {key!r}; known keys: {', '.join(known)}")
        for key in required:
            if key not in values:
                raise CameraError(f"a camera lacks the key {key!r}")
        distortion = values.get("distortion", ())
        if not isinstance(distortion, Sequence) or isinstance(distortion, str):
            raise CameraError(f"distortion must be a list of numbers, got {distortion!r}")
        return cls(**{**values, "distortion": tuple(distortion)})

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Camera):
            return NotImplemented
        return self._intrinsics() == other._intrinsics() and np.array_equal(self.c2w, other.c2w)

    def __hash__(self) -> int:
        return hash((self._intrinsics(), self.c2w.tobytes()))

    def _intrinsics(self) -> tuple[int, int, float, float, float, float, Lens, tuple[float, ...]]:
        return (self.width, self.height, self.fx, self.fy, self.cx, self.cy, self.model, self.distortion)


def turntable(
    center: npt.ArrayLike,
    radius: float,
    n: int,
    *,
    elevation: float,
    up: npt.ArrayLike = (0.0, 0.0, 1.0),
    width: int,
    height: int,
    fov_x: float,
) -> tuple[Camera, ...]:
    """`n` pinhole cameras evenly round a full circle at distance `radius` from `center` [3], looking at it.

    `elevation` (radians) is the angle of the cameras above the plane normal to `up`. The first camera is on
    the -y side (the -z side where `up` is along y); the circle runs counter-clockwise seen from above.
    """
    if n < 1:
        raise CameraError(f"n must be at least 1, got {n}")
    if not radius > 0:
        raise CameraError(f"radius must be positive, got {radius}")
    axis = np.asarray(up, dtype=np.float64).reshape(3)
    if not np.linalg.norm(axis) > 0:
        raise CameraError("up must not be zero")
    axis = axis / np.linalg.norm(axis)
    if not abs(elevation) < 0.5 * math.pi:
        raise CameraError(f"elevation must lie between -pi/2 and pi/2 radians, got {elevation}")
    front = np.array([0.0, -1.0, 0.0]) if abs(axis[1]) < 0.9 else np.array([0.0, 0.0, -1.0])
    front = front - (front @ axis) * axis
    front = front / np.linalg.norm(front)
    side = np.cross(axis, front)
    target = np.asarray(center, dtype=np.float64).reshape(3)
    azimuths = 2.0 * math.pi * np.arange(n) / n
    return tuple(
        Camera.look_at(
            target
            + radius * math.cos(elevation) * (math.cos(a) * front + math.sin(a) * side)
            + radius * math.sin(elevation) * axis,
            target,
            axis,
            width=width,
            height=height,
            fov_x=fov_x,
        )
        for a in azimuths
    )


def front_camera(bounds: npt.ArrayLike, up: npt.ArrayLike) -> Camera:
    """A pinhole camera of 400x400 pixels that sees the box `bounds` [2,3] whole, from a little above."""
    low, high = np.asarray(bounds, np.float64)
    radius = 0.6 * float(np.linalg.norm(high - low)) / math.sin(0.5 * FRONT_FOV_X)
    middle = 0.5 * (low + high)
    return turntable(middle, radius, 1, elevation=0.3, up=up, width=400, height=400, fov_x=FRONT_FOV_X)[0]


def _unproject_pixels(
    positions: npt.NDArray[Any],
    fx: float, fy: float, cx: float, cy: float, model: Lens, distortion: tuple[float, ...],
) -> tuple[Float32Array, npt.NDArray[np.bool_]]:  # fmt: skip
    """(unit OpenGL camera-space directions [N,3] of pixel positions [N,2], mask [N] of those within the
    lens's field).
    """
    directions, is_visible = lenses.unproject((positions - (cx, cy)) / (fx, fy), model, distortion)
    return (directions * _OPENGL_TO_OPENCV).astype(np.float32), is_visible


@lru_cache(maxsize=16)
def _local_directions(
    width: int, height: int,
    fx: float, fy: float, cx: float, cy: float, model: Lens, distortion: tuple[float, ...],
) -> Float32Array:  # fmt: skip
    columns, rows = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    positions = np.stack([columns.ravel(), rows.ravel()], axis=1)
    directions, is_visible = _unproject_pixels(positions, fx, fy, cx, cy, model, distortion)
    blind_count = int(np.count_nonzero(~is_visible))
    if blind_count:
        message = (
            f"{blind_count} of {width * height} pixels lie outside the field of the lens: model "
            f"{model!r} with "
            f"distortion {distortion} folds inside the image of {width}x{height}"
        )
        if blind_count > _MAX_BLIND_SHARE * width * height:
            raise CameraError(
                f"{message}; check that focal length, image size and coefficients belong together, "
                "or undistort the photos first"
            )
        warnings.warn(f"{message}; these pixels get the nearest direction the lens sees", stacklevel=3)
    directions.flags.writeable = False
    return directions
