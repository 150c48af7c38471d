"""Keyframed camera paths: cameras with a time between them, and the completed part of each edit at each.

Between keys the camera follows a smooth spline, or rests where both have one pose (`pose_splines`); the field
of view and the edits' parts follow monotone cubics, which never leave the range of the neighboring keys. A
loop continues from the last key to the first one, smoothly.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from cagefield.cameras.camera import Camera
from cagefield.cameras.pose_splines import PoseSpline
from cagefield.errors import CameraError

Floats = npt.NDArray[np.float64]

FOV_Y_RANGE_DEG = (0.2, 178.0)
"""Least and largest vertical field of view."""

SECONDS_RANGE = (0.01, 3600.0)
"""Least and longest time from a keyframe to the next."""


@dataclass(frozen=True)
class Keyframe:
    """Camera (c2w [16] row by row, vertical field of view), seconds to the next keyframe, parts of the edits.

    `parts` maps the number of an edit in the list, from 1, to its completed part; an edit without a part is
    complete, 1.
    """

    c2w: tuple[float, ...]
    fov_y_deg: float
    seconds: float = 2.0
    parts: Mapping[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Raise CameraError for a pose that is not rigid, and for numbers out of range."""
        object.__setattr__(self, "parts", MappingProxyType(dict(self.parts)))
        if len(self.c2w) != 16 or not all(map(math.isfinite, self.c2w)):
            raise CameraError("the camera (c2w) must hold 16 finite numbers, row by row")
        Camera(self.pose, 1, 1, 1.0, 1.0, 0.5, 0.5)
        if not FOV_Y_RANGE_DEG[0] <= self.fov_y_deg <= FOV_Y_RANGE_DEG[1]:
            raise CameraError(
                f"the field of view is {self.fov_y_deg:g}; give {FOV_Y_RANGE_DEG[0]:g} to "
                f"{FOV_Y_RANGE_DEG[1]:g} degrees"
            )
        if not SECONDS_RANGE[0] <= self.seconds <= SECONDS_RANGE[1]:
            raise CameraError(
                f"the time to the next key is {self.seconds:g} s; give {SECONDS_RANGE[0]:g} to "
                f"{SECONDS_RANGE[1]:g}"
            )
        for name, part in self.parts.items():
            if name < 1:
                raise CameraError(f"a part of edit {name} is given; edits are numbered from 1")
            if not 0.0 <= part <= 1.0:
                raise CameraError(f"the part of edit {name} is {part:g}; give 0 to 1")

    def __reduce__(self) -> tuple[Any, ...]:
        return Keyframe, (self.c2w, self.fov_y_deg, self.seconds, dict(self.parts))

    @property
    def pose(self) -> Floats:
        """Matrix c2w [4,4]."""
        return np.array(self.c2w).reshape(4, 4)


@dataclass(frozen=True)
class Still:
    """Image of a path: its camera, and the completed part of each edit in `parts`."""

    camera: Camera
    parts: dict[int, float]

    @property
    def fov_y_deg(self) -> float:
        """Vertical field of view."""
        return math.degrees(2.0 * math.atan(0.5 * self.camera.height / self.camera.fy))


class Timeline:
    """Interpolation between two or more keys: poses, fields of view and edits' parts by seconds from the
    first.

    `seconds` is the duration, from the first key to the last, or all round with `loop`.
    """

    def __init__(self, keys: Sequence[Keyframe], *, loop: bool) -> None:
        """Splines through the keys. Raises CameraError for fewer than two keys."""
        from scipy.interpolate import PchipInterpolator

        if len(keys) < 2:
            raise CameraError(f"a camera path with {len(keys)} keyframes does not move; record at least two")
        ring = [*keys, keys[0]] if loop else list(keys)
        times = np.concatenate([[0.0], np.cumsum([key.seconds for key in ring[:-1]])])
        self.seconds = float(times[-1])
        self._poses = PoseSpline([key.pose for key in ring], times, loop=loop)
        self._fovs = PchipInterpolator(times, [key.fov_y_deg for key in ring])
        self._parts = {
            name: PchipInterpolator(times, [key.parts.get(name, 1.0) for key in ring])
            for name in sorted({name for key in keys for name in key.parts})
        }

    def poses(self, times: Floats) -> Floats:
        """Matrices c2w [N,4,4] at times [N]."""
        return self._poses(np.asarray(times, np.float64))

    def fovs_y_deg(self, times: Floats) -> Floats:
        """Vertical fields of view [N] at times [N]."""
        return np.asarray(self._fovs(times))

    def parts(self, times: Floats) -> dict[int, Floats]:
        """Part [N] at times [N] of each edit that a key has a part of."""
        return {name: np.clip(curve(times), 0.0, 1.0) for name, curve in self._parts.items()}


def stills(keys: Sequence[Keyframe], *, loop: bool, fps: float, width: int, height: int) -> tuple[Still, ...]:
    """Images of a path at `fps`, from the first key to the last, or all round with `loop`.

    Raises:
        CameraError: fewer than one key, or more than 100,000 images.
    """
    if not keys:
        raise CameraError("a camera path needs at least one keyframe; record one")
    if len(keys) == 1:
        return (_build_still(keys[0].pose, keys[0].fov_y_deg, dict(keys[0].parts), width, height),)
    timeline = Timeline(keys, loop=loop)
    count = max(2, round(timeline.seconds * fps) + (0 if loop else 1))
    if count > 100_000:
        raise CameraError(f"the camera path has {count} pictures; make it shorter or lower its fps")
    times = np.linspace(0.0, timeline.seconds, count, endpoint=not loop)
    poses, fovs, parts = timeline.poses(times), timeline.fovs_y_deg(times), timeline.parts(times)
    return tuple(
        _build_still(
            poses[n],
            float(fovs[n]),
            {name: float(values[n]) for name, values in parts.items()},
            width,
            height,
        )
        for n in range(count)
    )


def _build_still(pose: Floats, fov_y_deg: float, parts: dict[int, float], width: int, height: int) -> Still:
    focal = 0.5 * height / math.tan(0.5 * math.radians(fov_y_deg))
    return Still(Camera(pose, width, height, focal, focal, 0.5 * width, 0.5 * height), parts)
