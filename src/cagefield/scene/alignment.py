"""Alignment of a scene with the world: meters per unit and the direction that is up.

Both are values of the scene's manifest. The field, cameras and edits keep their coordinates; exports apply
the similarity x' = s R x, with s the meters per unit and R the shortest rotation of the up direction to the
axis nearest to it, before they turn that axis as the file's format has it.

A plane of surfels is found by RANSAC: Fischler and Bolles, "Random sample consensus" (1981); each surfel is a
candidate with its normal, and the best one is refined to the principal axes of its inliers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cagefield.edits.paste_placement import upright_turn
from cagefield.errors import SceneError
from cagefield.typing import Array

PLANE_CANDIDATES = 400
"""Maximum number of surfels whose planes are tried."""

PLANE_SAMPLES = 20_000
"""Maximum number of surfels that are counted on a plane."""

PLANE_DISTANCE_SHARE = 0.004
"""Maximum distance of an inlier from its plane, as a share of the diagonal of the surfels' central box; at
least the field's spacing."""

PLANE_COSINE = 0.9
"""Minimum cosine between the normals of an inlier and of its plane."""

MAX_TILT_DEGREES = 50.0
"""Maximum angle between a plane's normal and the direction that was up so far."""

MIN_PLANE_SHARE = 0.05
"""Minimum share of the surfels on a dominant plane."""

REFINEMENTS = 3
"""Number of rounds of a plane's refinement."""

MAX_UNIT_ERROR = 1e-12
"""Maximum difference from 1 of the length of a direction that stays as it is."""

MIN_SINE = 1e-6
"""Minimum sine of the angle between two edges of three points that make a plane."""


Direction = tuple[float, float, float]
"""A unit vector as a value that can be compared."""


@dataclass(frozen=True, eq=False)
class Alignment:
    """Meters per unit, and up [3], a unit vector; None where unknown.

    Raises:
        SceneError: a scale that is not above 0, or an up direction that is not 3 finite numbers, not all 0.
    """

    meters_per_unit: float | None = None
    up: Array | None = None

    def __post_init__(self) -> None:
        scale = self.meters_per_unit
        if scale is not None:
            if isinstance(scale, bool) or not isinstance(scale, (int, float)) or not 0.0 < scale < math.inf:
                raise SceneError(f"meters_per_unit is {scale!r:.40}; it must be a number above 0")
            object.__setattr__(self, "meters_per_unit", float(scale))
        if self.up is not None:
            object.__setattr__(self, "up", _direction(self.up))

    def __bool__(self) -> bool:
        return self.meters_per_unit is not None or self.up is not None

    @property
    def direction(self) -> Direction | None:
        """The up direction as a value, None where unknown."""
        if self.up is None:
            return None
        x, y, z = self.up.tolist()
        return x, y, z

    @property
    def matrix(self) -> Array:
        """Similarity [4,4] from the scene's coordinates to aligned ones."""
        matrix = np.eye(4)
        if self.up is not None:
            matrix[:3, :3] = upright_turn(self.up, nearest_axis(self.up)).as_matrix()
        matrix[:3, :3] *= self.meters_per_unit or 1.0
        return matrix

    def to_dict(self) -> dict[str, object]:
        """Values for a manifest, without those that are unknown."""
        values = {
            "meters_per_unit": self.meters_per_unit,
            "up": None if self.up is None else self.up.tolist(),
        }
        return {key: value for key, value in values.items() if value is not None}

    @classmethod
    def from_direction(cls, meters_per_unit: float | None, up: Direction | None) -> Alignment:
        """Alignment with an up direction that is a value, None where unknown."""
        return cls(meters_per_unit, None if up is None else np.array(up))

    @classmethod
    def from_value(cls, value: Any) -> Alignment:
        """Alignment of a manifest's value. Raises SceneError for anything that `to_dict` does not write."""
        if not isinstance(value, dict) or set(value) - {"meters_per_unit", "up"}:
            raise SceneError(f"alignment is {value!r:.80}; it must have meters_per_unit or up")
        return cls(value.get("meters_per_unit"), value.get("up"))


@dataclass(frozen=True)
class Plane:
    """Unit normal [3] of a plane, and the share of the surfels that lie on it."""

    normal: Array
    share: float


def nearest_axis(direction: ArrayLike) -> Array:
    """The signed unit axis [3] that is nearest to a direction [3]."""
    values = np.asarray(direction, np.float64)
    k = int(np.abs(values).argmax())
    return np.asarray(np.sign(values[k]) * np.eye(3)[k])


def meters_per_unit(first: ArrayLike, second: ArrayLike, meters: float) -> float:
    """Meters per unit, from two points [3], world units, and their distance in meters.

    Raises:
        SceneError: the points coincide, or a distance that is not above 0.
    """
    distance = float(np.linalg.norm(_point(second) - _point(first)))
    if not distance > 0.0:
        raise SceneError("the two points of a distance coincide; give two different ones")
    if not 0.0 < meters < math.inf:
        raise SceneError(f"the distance is {meters:g} m; it must be above 0")
    return meters / distance


def up_from_points(points: ArrayLike, toward: ArrayLike) -> Array:
    """Unit normal [3] of the plane of three points [3,3], on the side of a direction `toward` [3].

    Raises:
        SceneError: the points lie on a line.
    """
    a, b, c = (_point(point) for point in np.asarray(points, np.float64))
    normal = np.cross(b - a, c - a)
    length = float(np.linalg.norm(normal))
    if not length > MIN_SINE * float(np.linalg.norm(b - a) * np.linalg.norm(c - a)):
        raise SceneError("the three points of a plane lie on a line; give three that do not")
    return np.asarray(normal / length * (1.0 if normal @ np.asarray(toward) >= 0.0 else -1.0))


def dominant_plane(
    points: Array, normals: Array, toward: ArrayLike, spacing: float, *, seed: int = 0
) -> Plane | None:
    """The plane with the most surfels that faces a direction `toward` [3]; None where none does.

    points, normals [N,3]: the surfels; spacing: the field's `sample_spacing`, world units. Planes tilted by
    more than MAX_TILT_DEGREES from `toward`, as walls are, or with less than MIN_PLANE_SHARE of the surfels
    do not count.
    """
    toward = np.asarray(toward, np.float64)
    rng = np.random.default_rng(seed)
    if len(points) > PLANE_SAMPLES:
        rows = rng.choice(len(points), PLANE_SAMPLES, replace=False)
        points, normals = points[rows], normals[rows]
    facing = np.flatnonzero(normals @ toward > math.cos(math.radians(MAX_TILT_DEGREES)))
    if len(facing) < 3:
        return None
    central = np.percentile(points, [5, 95], axis=0)
    distance = max(PLANE_DISTANCE_SHARE * float(np.linalg.norm(central[1] - central[0])), spacing)
    candidates = rng.choice(facing, min(PLANE_CANDIDATES, len(facing)), replace=False)

    def inliers(point: Array, normal: Array) -> NDArray[np.bool_]:
        return np.asarray(
            (np.abs((points - point) @ normal) <= distance) & (normals @ normal >= PLANE_COSINE)
        )

    best = max(candidates, key=lambda row: int(inliers(points[row], normals[row]).sum()))
    point, normal = points[best], normals[best]
    for _ in range(REFINEMENTS):
        on = inliers(point, normal)
        if on.sum() < 3:
            return None
        point = points[on].mean(axis=0)
        axis = np.linalg.svd(points[on] - point, full_matrices=False)[2][2]
        normal = axis if axis @ toward >= 0.0 else -axis
    share = float(inliers(point, normal).mean())
    is_level = normal @ toward > math.cos(math.radians(MAX_TILT_DEGREES))
    return Plane(np.asarray(normal), share) if is_level and share >= MIN_PLANE_SHARE else None


def _point(values: ArrayLike) -> Array:
    point = np.asarray(values, np.float64)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise SceneError(f"a point is {point.tolist()!r:.60}; it must be 3 finite numbers")
    return point


def _direction(values: Any) -> Array:
    try:
        direction = np.array(values, np.float64)
    except (TypeError, ValueError, OverflowError):
        direction = np.empty(0)
    if direction.shape != (3,) or not np.isfinite(direction).all() or not np.abs(direction).max() > 0.0:
        given = values.tolist() if isinstance(values, np.ndarray) else values
        raise SceneError(f"up is {given!r:.60}; it must be 3 finite numbers that are not all 0")
    if not abs(np.linalg.norm(direction) - 1.0) < MAX_UNIT_ERROR:
        direction /= np.abs(direction).max()
        direction /= np.linalg.norm(direction)
    direction.setflags(write=False)
    return direction
