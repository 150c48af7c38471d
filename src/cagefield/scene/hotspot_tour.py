"""Tour of a scene's hotspots: cameras of a video that flies from one to the next and stops at each.

A flight turns about the points that two views look at: the point goes straight, the eye's direction from it
turns at an even rate, its distance changes evenly in the logarithm, and u = 3 t^2 - 2 t^3 eases both ends.
The scene's up direction stays up, so that the roll of a hotspot's camera is not seen. Exported pages fly in
the same way (`web/src/viewer/flight.ts`). `tour_keys` has the tour as keyframes of a camera path.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from cagefield.cameras.camera import Camera
from cagefield.cameras.keyframes import SECONDS_RANGE, Keyframe
from cagefield.errors import CameraError, SceneError
from cagefield.scene.hotspots import Hotspot, HotspotView, resolved_view
from cagefield.typing import Array

FLIGHT_SECONDS = 2.5
"""Seconds from one hotspot to the next."""

FLIGHT_KEYS = 4
"""Keyframes on the way of a flight, where it is a camera path."""

MAX_TOUR_KEYS = 500
"""Maximum number of keyframes of a tour; the editor's paths have no more."""

MAX_FRAMES = 100_000
MIN_POLE_ANGLE = 0.02
"""Smallest angle between a view's axis and the vertical, radians; as the pages' orbit has it."""


class Pose(NamedTuple):
    """Eye [3] and target [3] of a view, world units, and its vertical field of view, degrees."""

    eye: Array
    target: Array
    fov_y_deg: float


def pose_of(view: HotspotView, around: ArrayLike) -> Pose:
    """Pose of a view; its target is the point of the camera's axis that is nearest to `around` [3]."""
    c2w = np.array(view.c2w).reshape(4, 4)
    eye, forward = c2w[:3, 3], -c2w[:3, 2]
    distance = max(float((np.asarray(around) - eye) @ forward), 1e-3)
    return Pose(eye, eye + distance * forward, view.fov_y_deg)


def between(one: Pose, other: Pose, t: float, up: ArrayLike) -> Pose:
    """Pose at a share t of [0,1] of the flight between two."""
    u = t * t * (3.0 - 2.0 * t)
    target = one.target + u * (other.target - one.target)
    a, b = one.eye - one.target, other.eye - other.target
    lengths = np.linalg.norm(a), np.linalg.norm(b)
    distance = float(lengths[0]) ** (1.0 - u) * float(lengths[1]) ** u
    return Pose(
        target + distance * _turned(a / lengths[0], b / lengths[1], u, np.asarray(up, np.float64)),
        target,
        one.fov_y_deg + u * (other.fov_y_deg - one.fov_y_deg),
    )


def tour_cameras(
    hotspots: Sequence[Hotspot],
    first: Camera,
    up: ArrayLike,
    *,
    stop_seconds: float,
    fps: float,
    width: int,
    height: int,
) -> tuple[Camera, ...]:
    """Cameras of a tour: a stop at each hotspot, and a flight of FLIGHT_SECONDS from each to the next.

    `first` is the view in which the scene opens, from which views without a camera are derived.

    Raises:
        SceneError: no hotspots, a stop that is not from 0 to 600 seconds, more than MAX_FRAMES frames.
    """
    if not hotspots:
        raise SceneError("the scene has no hotspots; add one with `cagefield hotspot`, or in the editor")
    if not 0.0 <= stop_seconds <= 600.0:
        raise SceneError(f"the stop is {stop_seconds:g} s; give 0 to 600")
    poses = [pose_of(resolved_view(hotspot, first, up), hotspot.position) for hotspot in hotspots]
    stops, flights = max(1, round(stop_seconds * fps)), max(1, round(FLIGHT_SECONDS * fps))
    count = len(poses) * stops + (len(poses) - 1) * flights
    if count > MAX_FRAMES:
        raise SceneError(f"the tour has {count} pictures; lower its fps or the stops")
    sequence = [poses[0]] * stops
    for one, other in itertools.pairwise(poses):
        sequence += [between(one, other, n / (flights + 1), up) for n in range(1, flights + 1)]
        sequence += [other] * stops
    return tuple(_camera(pose, up, width, height) for pose in sequence)


def tour_keys(
    hotspots: Sequence[Hotspot], first: Camera, up: ArrayLike, *, stop_seconds: float
) -> tuple[Keyframe, ...]:
    """Camera path of a tour: two keyframes of one pose at each hotspot, FLIGHT_KEYS on the way to the next.

    The path rests at a hotspot for `stop_seconds`; a tour of so many hotspots that it would have more than
    MAX_TOUR_KEYS flies straight, without keyframes on the way. `first` as in `tour_cameras`.

    Raises:
        SceneError: no hotspots, a stop that is not from .01 to 600 seconds.
    """
    if not hotspots:
        raise SceneError("the scene has no hotspots; add one with `cagefield hotspot`, or in the editor")
    if not SECONDS_RANGE[0] <= stop_seconds <= 600.0:
        raise SceneError(f"the stop is {stop_seconds:g} s; give {SECONDS_RANGE[0]:g} to 600")
    poses = [pose_of(resolved_view(hotspot, first, up), hotspot.position) for hotspot in hotspots]
    between_keys = FLIGHT_KEYS if len(poses) * (2 + FLIGHT_KEYS) <= MAX_TOUR_KEYS else 0
    step = FLIGHT_SECONDS / (between_keys + 1)
    keys: list[Keyframe] = []
    for number, pose in enumerate(poses):
        if number:
            ways = [n / (between_keys + 1) for n in range(1, between_keys + 1)]
            keys += [_key(between(poses[number - 1], pose, way, up), up, step) for way in ways]
        keys += [_key(pose, up, stop_seconds), _key(pose, up, step)]
    return tuple(keys)


def _key(pose: Pose, up: ArrayLike, seconds: float) -> Keyframe:
    camera = _camera(pose, up, 100, 100)
    return Keyframe(tuple(camera.c2w.reshape(-1).tolist()), pose.fov_y_deg, seconds)


def _turned(a: Array, b: Array, u: float, up: Array) -> Array:
    """Unit vector [3] at a share u of the turn from unit vector a to b; opposite ones turn about `up`."""
    angle = math.acos(float(np.clip(a @ b, -1.0, 1.0)))
    if angle < 1e-9:
        return b
    axis = np.cross(a, b)
    length = float(np.linalg.norm(axis))
    axis = axis / length if length > 1e-9 else up / np.linalg.norm(up)
    c, s = math.cos(u * angle), math.sin(u * angle)
    return np.asarray(c * a + s * np.cross(axis, a) + (1.0 - c) * float(axis @ a) * axis)


def _camera(pose: Pose, up: ArrayLike, width: int, height: int) -> Camera:
    """Camera of a pose; its field of view is that of the picture's shorter side."""
    half = math.tan(0.5 * math.radians(pose.fov_y_deg)) * width / min(width, height)
    fov_x = 2.0 * math.atan(half)
    up = np.asarray(up, np.float64)
    try:
        return Camera.look_at(pose.eye, pose.target, up, width=width, height=height, fov_x=fov_x)
    except CameraError:
        aside = np.roll(up, 1)
        eye = pose.eye + MIN_POLE_ANGLE * float(np.linalg.norm(pose.eye - pose.target)) * aside
        return Camera.look_at(eye, pose.target, up, width=width, height=height, fov_x=fov_x)
