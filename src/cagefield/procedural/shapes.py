"""Signed distance functions of the primitives, each in its own frame, float32.

Points are [3,N], one row per axis: numpy is several times faster on rows than on triples.
`distance` is the Euclidean distance, negative inside (a tapered Tube: a lower bound near its ends). `extent`
is the half size [3] of the box about the origin that holds the shape.
Source: Quilez, "Distance functions", for the boxes, tori and polygons.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np

from cagefield.typing import Float32

Polygon = tuple[tuple[float, float], ...]


class Shape(Protocol):
    """A solid around the origin."""

    @property
    def extent(self) -> tuple[float, float, float]: ...

    def distance(self, points: Float32) -> Float32: ...


def _length2(x: Float32, y: Float32) -> Float32:
    return np.sqrt(x * x + y * y)


def _clip01(x: Float32) -> Float32:
    return np.minimum(np.maximum(x, 0), 1)


def _length3(x: Float32, y: Float32, z: Float32) -> Float32:
    return np.sqrt(x * x + y * y + z * z)


@dataclass(frozen=True)
class Sphere:
    """Ball; an ellipsoid is a ball placed with three scales."""

    radius: float = 1.0

    @property
    def extent(self) -> tuple[float, float, float]:
        return (self.radius,) * 3

    def distance(self, points: Float32) -> Float32:
        return _length3(*points) - np.float32(self.radius)


@dataclass(frozen=True)
class Box:
    """Box of the given half sizes, edges rounded with `rounding` (within the half sizes)."""

    half: tuple[float, float, float]
    rounding: float = 0.0

    @property
    def extent(self) -> tuple[float, float, float]:
        return self.half

    def distance(self, points: Float32) -> Float32:
        x, y, z = np.abs(points) - (np.array(self.half, np.float32) - np.float32(self.rounding))[:, None]
        inside = np.minimum(np.maximum(np.maximum(x, y), z), 0)
        outside = _length3(np.maximum(x, 0), np.maximum(y, 0), np.maximum(z, 0))
        return outside + inside - np.float32(self.rounding)


@dataclass(frozen=True)
class Cylinder:
    """Cylinder about z, edges rounded with `rounding`."""

    radius: float
    half_height: float
    rounding: float = 0.0

    @property
    def extent(self) -> tuple[float, float, float]:
        return self.radius, self.radius, self.half_height

    def distance(self, points: Float32) -> Float32:
        r, z = _length2(points[0], points[1]), points[2]
        side = r - np.float32(self.radius - self.rounding)
        cap = np.abs(z) - np.float32(self.half_height - self.rounding)
        inside = np.minimum(np.maximum(side, cap), 0)
        return _length2(np.maximum(side, 0), np.maximum(cap, 0)) + inside - np.float32(self.rounding)


@dataclass(frozen=True)
class Torus:
    """Ring about z: a circle of radius `ring` swept by a disc of radius `radius`."""

    ring: float
    radius: float

    @property
    def extent(self) -> tuple[float, float, float]:
        return self.ring + self.radius, self.ring + self.radius, self.radius

    def distance(self, points: Float32) -> Float32:
        side = _length2(points[0], points[1]) - np.float32(self.ring)
        return _length2(side, points[2]) - np.float32(self.radius)


@dataclass(frozen=True)
class Tube:
    """Balls swept along a polyline; radii, one for all or one per point, run linearly in between."""

    points: tuple[tuple[float, float, float], ...]
    radii: tuple[float, ...]

    @property
    def extent(self) -> tuple[float, float, float]:
        path = np.abs(np.array(self.points)) + np.array(self._radii())[:, None]
        x, y, z = path.max(0)
        return float(x), float(y), float(z)

    def _radii(self) -> tuple[float, ...]:
        return self.radii * len(self.points) if len(self.radii) == 1 else self.radii

    def distance(self, points: Float32) -> Float32:
        path, radii = np.array(self.points, np.float32), np.array(self._radii(), np.float32)
        axis = np.diff(path, axis=0)
        inverse = (1 / (axis**2).sum(1)).astype(np.float32)
        nearest = np.empty(points.shape[1], np.float32)
        for block in _blocks(len(nearest), len(axis)):
            offset = points[:, None, block] - path[:-1].T[:, :, None]
            along = _clip01(np.einsum("md,dmn->mn", axis * inverse[:, None], offset))
            offset -= axis.T[:, :, None] * along
            gap = _length3(*offset) - (radii[:-1, None] + along * np.diff(radii)[:, None])
            gap.min(0, out=nearest[block])
        return nearest


def _blocks(count: int, width: int) -> Iterator[slice]:
    """Slices of range(count) for tables `width` wide that should stay in the cache."""
    size = max(65536 // width, 256)
    for start in range(0, count, size):
        yield slice(start, start + size)


@lru_cache(maxsize=256)
def _edges(polygon: Polygon, revolved: bool) -> tuple[Float32, ...]:
    """Columns [M,1] of a polygon's edges: start, extent, extent over squared length, y range, slope dx/dy."""
    starts = np.array(polygon, np.float64)
    ends = np.roll(starts, -1, axis=0)
    boundary = (starts[:, 0] != 0) | (ends[:, 0] != 0) | (not revolved)
    (ax, ay), (bx, by) = starts[boundary].T[..., None], ends[boundary].T[..., None]
    ex, ey = bx - ax, by - ay
    square = ex * ex + ey * ey
    # a level edge has no crossing: its range of y is empty
    slope = ex / np.where(ey == 0, 1, ey)
    table = (ax, ay, ex, ey, ex / square, ey / square, np.minimum(ay, by), np.maximum(ay, by), slope)
    return tuple(column.astype(np.float32) for column in table)


def polygon_distance(polygon: Polygon, x: Float32, y: Float32, *, revolved: bool = False) -> Float32:
    """Signed distance [N] to a closed polygon, negative inside; any orientation, may be concave.

    revolved: the polygon is turned about x = 0 and points have x >= 0, so edges on that axis are no boundary.
    """
    ax, ay, ex, ey, ux, uy, low, high, slope = _edges(polygon, revolved)
    distance = np.empty(x.shape, np.float32)
    for block in _blocks(len(x), len(ax)):
        level = y[block]
        wx, wy = x[block] - ax, level - ay
        along = _clip01(wx * ux + wy * uy)
        dx, dy = wx - ex * along, wy - ey * along
        # edges that the half-line from the point towards +x crosses: an odd number from inside
        crosses = (level >= low) & (level < high) & (wx < wy * slope)
        inside = np.logical_xor.reduce(crosses, axis=0)
        gap = np.sqrt((dx * dx + dy * dy).min(0))
        distance[block] = np.where(inside, -gap, gap)
    return distance


@dataclass(frozen=True)
class Extrusion:
    """Polygon of the xy plane with a thickness of 2 half_height along z, grown by `rounding` all round."""

    polygon: Polygon
    half_height: float
    rounding: float = 0.0

    @property
    def extent(self) -> tuple[float, float, float]:
        x, y = np.abs(np.array(self.polygon)).max(0) + self.rounding
        return float(x), float(y), self.half_height + self.rounding

    def distance(self, points: Float32) -> Float32:
        side = polygon_distance(self.polygon, points[0], points[1])
        cap = np.abs(points[2]) - np.float32(self.half_height)
        inside = np.minimum(np.maximum(side, cap), 0)
        return _length2(np.maximum(side, 0), np.maximum(cap, 0)) + inside - np.float32(self.rounding)


@dataclass(frozen=True)
class Revolution:
    """Polygon (radius, z) turned about the z axis, grown by `rounding`; edges on the axis close it."""

    polygon: Polygon
    rounding: float = 0.0

    @property
    def extent(self) -> tuple[float, float, float]:
        profile = np.abs(np.array(self.polygon)).max(0) + self.rounding
        return float(profile[0]), float(profile[0]), float(profile[1])

    def distance(self, points: Float32) -> Float32:
        radius = _length2(points[0], points[1])
        return polygon_distance(self.polygon, radius, points[2], revolved=True) - np.float32(self.rounding)


@dataclass(frozen=True)
class Leaf:
    """Pointed blade along x, `length` by `width`, bent down towards both ends by `bend` * x^2.

    A lower bound of the distance: that of the flat blade over the largest stretch of the bend.
    """

    length: float
    width: float
    thickness: float
    bend: float = 0.0

    @property
    def extent(self) -> tuple[float, float, float]:
        drop = abs(self.bend) * (self.length / 2 + self.thickness) ** 2
        return self.length / 2 + self.thickness, self.width / 2 + self.thickness, drop + self.thickness

    def distance(self, points: Float32) -> Float32:
        x, y = np.abs(points[0]), np.abs(points[1])
        z = points[2] + np.float32(self.bend) * x * x
        # the outline is where two discs of radius r overlap, their centers at y = -offset and y = offset
        a, b = self.length / 2, self.width / 2
        offset = (a * a - b * b) / (2 * b)
        radius = offset + b
        at_tip = (x - np.float32(a)) * np.float32(offset) > y * np.float32(a)
        side = np.where(
            at_tip,
            _length2(x - np.float32(a), y),
            _length2(x, y + np.float32(offset)) - np.float32(radius),
        )
        flat = _length2(np.maximum(side, 0), z)
        # the bend is a shear of slope k at the tips; (k + sqrt(k^2 + 4)) / 2 is its largest stretch
        k = 2 * abs(self.bend) * a
        return (flat - np.float32(self.thickness)) / np.float32((k + np.sqrt(k * k + 4)) / 2)
