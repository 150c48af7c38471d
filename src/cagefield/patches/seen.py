"""What of a field's surfaces its cameras see, in pairs of neighbours."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np
from scipy import ndimage

from cagefield.cameras import Camera
from cagefield.rendering.render_result import RenderResult
from cagefield.typing import Array

VIEWS, PIXELS = 28, 200
"""Pictures, and their longer edge in pixels."""

APART = (5, 14)
"""Distance of a pair, in pixels."""

EDGE = 0.03
"""A jump in depth between neighbouring pixels by this share of it is an edge."""


@dataclass(frozen=True)
class SeenPairs:
    """Pairs of neighbours on surfaces: points and unit normals [N,3] of both, world units.

    log_change [N] is the log of the second's mean colour over the first's.
    """

    points: Array
    normals: Array
    other_points: Array
    other_normals: Array
    log_change: Array


def seen_pairs(
    render: Callable[[Camera], RenderResult], cameras: Sequence[Camera], bounds: Array, *, seed: int = 0
) -> SeenPairs:
    """Pairs of neighbours in pictures with normals of a field, from some of its cameras.

    Without cameras it is looked at from around its bounds [2,3].
    """
    chance = np.random.default_rng(seed)
    picked = {int(n) for n in np.linspace(0, len(cameras) - 1, VIEWS)} if cameras else set()
    chosen = [cameras[n] for n in sorted(picked)] or around(bounds)
    found = [_pairs(render(smaller(camera)), smaller(camera), chance) for camera in chosen]
    return SeenPairs(*(np.concatenate([getattr(pair, f.name) for pair in found]) for f in fields(SeenPairs)))


def smaller(camera: Camera) -> Camera:
    """The camera with PIXELS along its longer edge."""
    share = PIXELS / max(camera.width, camera.height)
    return camera.resized(max(1, round(share * camera.width)), max(1, round(share * camera.height)))


def around(bounds: Array) -> list[Camera]:
    """VIEWS cameras around a box [2,3], a spiral on the upper half of a sphere."""
    centre, radius = bounds.mean(axis=0), 0.5 * float(np.linalg.norm(bounds[1] - bounds[0]))
    cameras = []
    for n in range(VIEWS):
        height = 0.1 + 0.8 * n / VIEWS
        aside = np.sqrt(1.0 - height**2) * np.array([np.cos(2.4 * n), np.sin(2.4 * n)])
        eye = centre + 2.5 * radius * np.array([*aside, height])
        cameras.append(Camera.look_at(tuple(eye), tuple(centre), width=PIXELS, height=PIXELS, fov_x=0.9))
    return cameras


def _pairs(picture: RenderResult, camera: Camera, chance: np.random.Generator) -> SeenPairs:
    """The pairs of one picture."""
    opacity, depth = picture.opacity, picture.depth
    if picture.normals is None:
        raise ValueError("pairs are found in pictures with normals")
    solid = (opacity > 0.98) & np.isfinite(depth)
    filled = np.where(solid, depth, 1e6)
    jump = ndimage.maximum_filter(filled, 3) - ndimage.minimum_filter(filled, 3)
    solid &= ~ndimage.binary_dilation(jump > EDGE * np.where(solid, depth, 1.0), iterations=1)
    origins, directions = camera.rays()
    points = origins + np.where(solid, depth, 0.0).reshape(-1, 1) * directions
    normals, rgb = picture.normals.reshape(-1, 3), picture.rgb.reshape(-1, 3)
    log = np.log(np.clip(rgb, 0.02, 1.0).mean(axis=1))
    y, x = np.nonzero(solid)
    distance, angle = chance.integers(*APART, len(x)), chance.uniform(0.0, 2.0 * np.pi, len(x))
    to_x = np.round(x + distance * np.cos(angle)).astype(int)
    to_y = np.round(y + distance * np.sin(angle)).astype(int)
    height, width = solid.shape
    kept = (to_x >= 0) & (to_x < width) & (to_y >= 0) & (to_y < height)
    first, second = (y * width + x)[kept], (to_y * width + to_x)[kept]
    away = points[second] - points[first]
    length = np.linalg.norm(away, axis=1)
    flat = np.abs((away * normals[first]).sum(axis=1)) < 0.25 * length
    alike = (normals[first] * normals[second]).sum(axis=1) > 0.95
    kept = solid.reshape(-1)[second] & flat & alike
    first, second = first[kept], second[kept]
    return SeenPairs(points[first], normals[first], points[second], normals[second], log[second] - log[first])
