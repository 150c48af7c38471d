"""Regions of an image, and the elements in them.

Regions are in shares of the image: (0, 0) its upper left and (1, 1) its lower right corner. They are
rasterized at the size of the camera, and an element belongs to a region where the pixel of one of its
positions does.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from PIL import Image, ImageDraw
from scipy import ndimage

from cagefield.cameras.camera import Camera
from cagefield.errors import CagefieldError
from cagefield.selection.element_positions import DeformedPositions
from cagefield.typing import Array, Float32, Mask

Points = Sequence[tuple[float, float]]

MAX_REGION_POINTS = 4096
"""Points of a lasso or a stroke, at most."""

MAX_SHARE = 10
"""Points of a region are at most so many widths or heights beside the image."""


class Region(Protocol):
    """A region of an image."""

    def raster(self, width: int, height: int) -> Mask:
        """[H,W], True for the pixels in the region."""


@dataclass(frozen=True)
class Rectangle:
    """Rectangle between two opposite corners, shares of the image. Raises CagefieldError for NaN."""

    first: tuple[float, float]
    second: tuple[float, float]

    def __post_init__(self) -> None:
        _check((self.first, self.second), "rectangle", 2)

    def raster(self, width: int, height: int) -> Mask:
        corners = np.array([self.first, self.second]) * (width, height)
        (left, top), (right, bottom) = corners.min(axis=0), corners.max(axis=0)
        x, y = np.arange(width) + 0.5, np.arange(height) + 0.5
        return np.asarray(((y >= top) & (y <= bottom))[:, None] & ((x >= left) & (x <= right))[None, :])


@dataclass(frozen=True)
class Lasso:
    """Closed polygon of 3 or more points; even-odd rule. Raises CagefieldError for fewer or NaN."""

    points: Points

    def __post_init__(self) -> None:
        _check(self.points, "lasso", 3)

    def raster(self, width: int, height: int) -> Mask:
        vertices = np.array(self.points) * (width, height)
        following = np.roll(vertices, -1, axis=0)
        x, y = np.arange(width) + 0.5, np.arange(height) + 0.5
        inside = np.zeros((height, width), bool)
        for (x0, y0), (x1, y1) in zip(vertices, following, strict=True):
            rows = np.flatnonzero((y0 > y) != (y1 > y))
            if len(rows):
                crossing = x0 + (y[rows] - y0) / (y1 - y0) * (x1 - x0)
                inside[rows] ^= x[None, :] >= crossing[:, None]
        return inside


@dataclass(frozen=True)
class Stroke:
    """Brush stroke: all within `radius`, a share of the image's height, of a polyline of 1 or more points.

    Raises CagefieldError for no points, NaN, or a radius outside (0, 1].
    """

    points: Points
    radius: float

    def __post_init__(self) -> None:
        _check(self.points, "brush stroke", 1)
        if not 0.0 < self.radius <= 1.0:
            raise CagefieldError(f"a brush's radius is a share of the height in (0, 1], not {self.radius:g}")

    def raster(self, width: int, height: int) -> Mask:
        image = Image.new("1", (width, height))
        draw = ImageDraw.Draw(image)
        radius = self.radius * height
        at = [(x * width, y * height) for x, y in self.points]
        for (x0, y0), (x1, y1) in itertools.pairwise(at):
            length = float(np.hypot(x1 - x0, y1 - y0))
            if length > 0.0:
                nx, ny = -(y1 - y0) / length * radius, (x1 - x0) / length * radius
                draw.polygon(
                    [(x0 + nx, y0 + ny), (x1 + nx, y1 + ny), (x1 - nx, y1 - ny), (x0 - nx, y0 - ny)], 1
                )
        for x, y in at:
            draw.ellipse((x - radius, y - radius, x + radius, y + radius), 1)
        return np.array(image, dtype=bool)


def elements_in_region(
    region: Region,
    camera: Camera,
    positions: DeformedPositions,
    count: int,
    *,
    depth: Float32 | None = None,
    tolerance: Array | float = 0.0,
) -> Mask:
    """Mask [count] of the elements with a position in a region of the camera's image.

    `depth` [H,W] is the distance along the unit ray of each pixel of that image, infinite where most light
    passes: only positions at most `tolerance` behind it count, world units, one or one for each position.
    None takes all that is behind the region. A position is compared with the furthest depth of the pixels
    around its own, so that edges of a surface count.
    """
    at = pixels_of(camera, positions.points)
    rows = np.flatnonzero(at[:, 0] >= 0)
    x, y = at[rows].T
    inside = region.raster(camera.width, camera.height)[y, x]
    rows, x, y = rows[inside], x[inside], y[inside]
    if depth is not None:
        if depth.shape != (camera.height, camera.width):
            raise CagefieldError(
                f"depth must be [{camera.height}, {camera.width}] like the image, got {list(depth.shape)}"
            )
        distance = np.linalg.norm(positions.points[rows] - camera.origin, axis=1)
        reach = np.broadcast_to(np.asarray(tolerance, np.float64), len(positions.points))[rows]
        rows = rows[distance <= _furthest_around(depth)[y, x] + reach]
    out = np.zeros(count, bool)
    out[positions.element[rows]] = True
    return out


def pixels_of(camera: Camera, points: Array) -> np.ndarray[tuple[int, int], np.dtype[np.int64]]:
    """Pixels (column, row) [N,2] of points [N,3]; (-1, -1) outside of the image."""
    projected, along = camera.project(points)
    with np.errstate(invalid="ignore"):
        pixel = np.floor(projected)
        inside = (along > 0.0) & ((pixel >= 0) & (pixel < (camera.width, camera.height))).all(axis=1)
    return np.where(inside[:, None], pixel, -1.0).astype(np.int64)


def _furthest_around(depth: Float32) -> Float32:
    """Maximum [H,W] of the 3 x 3 pixels around each that are finite; infinite where the pixel itself is."""
    finite = np.where(np.isfinite(depth), depth, -np.inf)
    return np.where(np.isfinite(depth), ndimage.maximum_filter(finite, 3, mode="nearest"), np.inf)


def _check(points: Points, noun: str, least: int) -> None:
    if not least <= len(points) <= MAX_REGION_POINTS:
        raise CagefieldError(
            f"a {noun} has {least} to {MAX_REGION_POINTS} points, got {len(points)}; draw it again"
        )
    if not (np.abs(np.array(points, dtype=np.float64)) <= MAX_SHARE).all():
        raise CagefieldError(
            f"points of a {noun} must be shares of the image from -{MAX_SHARE} to {MAX_SHARE}"
        )
