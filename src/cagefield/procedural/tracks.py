"""Sparse points of a capture with known depth, as structure from motion finds them: where there is texture.

A candidate is a corner of a photo (the smaller eigenvalue of the structure tensor is large). It is a point
where other photos see it too: not hidden, by the true depth, from no very different side, and alike, by the
correlation of small patches of the surface, which reflections and highlights fail. Every sighting is off
by some pixels; the point is where the sightings' rays come closest, so its place has the error that follows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates, maximum_filter, minimum_filter, sobel

from cagefield.cameras import lenses
from cagefield.cameras.camera import Camera
from cagefield.typing import Array, Float32

NOISE = 0.7
"""Deviation of a sighting, in pixels along each axis."""

CORNER = 2e-5
"""Least eigenvalue of a corner's structure tensor, of grey values in [0,1]: twenty times the noise's."""

ALIKE = 0.6
"""Least correlation of the patches of two sightings."""

PATCH = 4
"""Half width in pixels of a patch, which is sampled at every other pixel."""

WIDEST_ANGLE_DEG = 50.0
"""Between the rays of two photos that match."""

SAME = 0.01
"""Relative difference up to which a distance agrees with the depth of a photo."""

MATCHED = 0.6
"""Share of the possible sightings that are found."""

LEAST_SIGHTINGS = 3
WORST_ERROR = 2.5
"""Pixels between a sighting and the point, root mean square, past which a point is dropped."""

LEAST_ANGLE_DEG = 1.5
"""Between the two most different rays of a point."""


@dataclass(frozen=True)
class Tracks:
    """Points [M,3] with colours and mean errors (pixels), and their sightings: point, view, pixel [S,2]."""

    positions: Array
    rgb: NDArray[np.uint8]
    errors: Array
    point: NDArray[np.intp]
    view: NDArray[np.intp]
    pixel: Array

    def __len__(self) -> int:
        return len(self.positions)


def tracks(
    photos: Sequence[NDArray[np.uint8]],
    depths: Sequence[Float32],
    cameras: Sequence[Camera],
    *,
    seed: int = 0,
    most: int = 250,
) -> Tracks:
    """The points that photos [H,W,3] show, up to `most` new ones a photo.

    depths [H,W]: true distances along the rays through the pixels' centres.
    """
    rng = np.random.RandomState(seed)
    greys = [gaussian_filter(photo.mean(axis=2, dtype=np.float32) / 255, 0.7) for photo in photos]
    positions: list[Array] = []
    colours: list[NDArray[np.uint8]] = []
    errors: list[Array] = []
    sightings: list[tuple[NDArray[np.intp], NDArray[np.intp], Array]] = []
    known = [np.empty((0, 2)) for _ in photos]
    count = 0
    for index, camera in enumerate(cameras):
        pixels = _corners(greys[index], depths[index], known[index], most)
        if not len(pixels):
            continue
        origins, directions = camera.rays(pixels)
        depth = depths[index][pixels[:, 1], pixels[:, 0], None]
        points = (origins + directions * depth).astype(np.float64)
        seen, at = _sightings(points, index, pixels, greys, depths, cameras)
        seen &= (rng.uniform(size=seen.shape) < MATCHED) | (np.arange(len(cameras)) == index)
        seen[seen.sum(axis=1) < LEAST_SIGHTINGS] = False
        at += rng.normal(0, NOISE, at.shape)
        where, error = _triangulated(points, seen, at, cameras)
        good = np.flatnonzero(error <= WORST_ERROR)
        which, view = np.nonzero(seen[good])
        positions.append(where[good])
        errors.append(error[good])
        colours.append(photos[index][pixels[good, 1], pixels[good, 0]])
        sightings.append((which + count, view, at[good][which, view]))
        for other in np.unique(view):
            known[other] = np.concatenate([known[other], at[good][seen[good][:, other], other]])
        count += len(good)
    if not count:
        empty = np.empty(0, np.intp)
        return Tracks(
            np.empty((0, 3)), np.empty((0, 3), np.uint8), np.empty(0), empty, empty, np.empty((0, 2))
        )
    point, view, pixel = (np.concatenate(column) for column in zip(*sightings, strict=True))
    return Tracks(
        np.concatenate(positions), np.concatenate(colours), np.concatenate(errors), point, view, pixel
    )


def _corners(grey: Float32, depth: Float32, known: Array, most: int) -> NDArray[np.intp]:
    """Pixels (column, row) [N,2] of the strongest corners that are not within 4 pixels of those known."""
    du, dv = sobel(grey, axis=1) / 8, sobel(grey, axis=0) / 8
    a, b, d = (gaussian_filter(product, 1.5) for product in (du * du, du * dv, dv * dv))
    least = (a + d) / 2 - np.sqrt(((a - d) / 2) ** 2 + b * b)
    edge = PATCH + 2
    smooth = maximum_filter(depth, 5) < (1 + 3 * SAME) * minimum_filter(depth, 5)
    peak = (least == maximum_filter(least, 5)) & (least > CORNER) & smooth
    peak[:edge] = peak[-edge:] = False
    peak[:, :edge] = peak[:, -edge:] = False
    if len(known):
        taken = np.zeros(grey.shape, bool)
        column, row = np.clip(known.astype(int), 0, (grey.shape[1] - 1, grey.shape[0] - 1)).T
        taken[row, column] = True
        peak &= ~maximum_filter(taken, 9)
    rows, columns = np.nonzero(peak)
    order = np.argsort(-least[rows, columns], kind="stable")[:most]
    return np.stack([columns[order], rows[order]], 1)


def _sightings(
    points: Array,
    index: int,
    pixels: NDArray[np.intp],
    greys: Sequence[Float32],
    depths: Sequence[Float32],
    cameras: Sequence[Camera],
) -> tuple[NDArray[np.bool_], Array]:
    """(which views [N,V] see points [N,3] found at pixels [N,2] of view `index`, and where [N,V,2])."""
    offsets = np.arange(-PATCH, PATCH + 1, 2)
    v, u = (grid.ravel() for grid in np.meshgrid(offsets, offsets, indexing="ij"))
    around = (pixels[:, None] + np.stack([u, v], 1)).reshape(-1, 2)

    def patches(grey: Float32, at: Array) -> Array:
        """Normalised patches [N,P] at positions [N P,2]."""
        values = map_coordinates(grey, (at[:, ::-1] - 0.5).T, order=1, mode="nearest").astype(np.float64)
        values = values.reshape(-1, len(u))
        values -= values.mean(axis=1, keepdims=True)
        return values / np.maximum(np.linalg.norm(values, axis=1, keepdims=True), 1e-9)

    own = (pixels + 0.5).astype(np.float64)
    model = patches(greys[index], (around + 0.5).astype(np.float64))
    origins, directions = cameras[index].rays(around)
    surface = origins + directions * depths[index][around[:, 1], around[:, 0], None]
    surface = surface.reshape(len(pixels), len(u), 3)
    rays = _units(points - cameras[index].origin)
    seen = np.zeros((len(points), len(cameras)), bool)
    at = np.zeros((len(points), len(cameras), 2))
    for view, camera in enumerate(cameras):
        if view == index:
            seen[:, view], at[:, view] = True, own
            continue
        position, ahead = camera.project(points)
        size = (camera.width - PATCH - 1, camera.height - PATCH - 1)
        inside = (ahead > 0) & (position > PATCH + 1).all(axis=1) & (position < size).all(axis=1)
        rows = np.flatnonzero(inside)
        column, row = position[rows].astype(int).T
        distance = np.linalg.norm(points[rows] - camera.origin, axis=1)
        rows = rows[np.abs(depths[view][row, column] - distance) < SAME * distance]
        angle = (_units(points[rows] - camera.origin) * rays[rows]).sum(axis=1)
        rows = rows[angle > np.cos(np.radians(WIDEST_ANGLE_DEG))]
        if not len(rows):
            continue
        there, _ = camera.project(surface[rows].reshape(-1, 3))
        alike = (patches(greys[view], np.nan_to_num(there)) * model[rows]).sum(axis=1)
        rows = rows[alike > ALIKE]
        seen[rows, view], at[rows, view] = True, position[rows]
    return seen, at


def _units(vectors: Array) -> Array:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _triangulated(
    guess: Array, seen: NDArray[np.bool_], at: Array, cameras: Sequence[Camera]
) -> tuple[Array, Array]:
    """(points [N,3] closest to the rays of their sightings, mean error [N] in pixels; inf for bad ones).

    Least squares of the distances to the rays over the distances to the cameras.
    """
    normal, right = np.zeros((len(guess), 3, 3)), np.zeros((len(guess), 3))
    rays = np.full((*seen.shape, 3), np.nan)
    for view, camera in enumerate(cameras):
        rows = np.flatnonzero(seen[:, view])
        if not len(rows):
            continue
        ray = _directions(camera, at[rows, view])
        rays[rows, view] = ray
        weight = 1 / np.linalg.norm(guess[rows] - camera.origin, axis=1) ** 2
        across = (np.eye(3) - ray[:, :, None] * ray[:, None, :]) * weight[:, None, None]
        normal[rows] += across
        right[rows] += across @ camera.origin
    error = np.full(len(guess), np.inf)
    where = guess.copy()
    chosen = np.flatnonzero(seen.any(axis=1))
    if not len(chosen):
        return where, error
    where[chosen] = np.linalg.solve(normal[chosen], right[chosen][..., None])[..., 0]
    square, total = np.zeros(len(guess)), seen.sum(axis=1)
    for view, camera in enumerate(cameras):
        rows = np.flatnonzero(seen[:, view])
        if len(rows):
            position, _ = camera.project(where[rows])
            square[rows] += np.nan_to_num(((position - at[rows, view]) ** 2).sum(axis=1), nan=np.inf)
    error[chosen] = np.sqrt(square[chosen] / total[chosen])
    for row in chosen:
        mine = rays[row, seen[row]]
        if (mine @ mine.T).min() > np.cos(np.radians(LEAST_ANGLE_DEG)):
            error[row] = np.inf
    return where, error


def _directions(camera: Camera, at: Array) -> Array:
    """Unit world directions [N,3] through pixel positions [N,2]."""
    image = (at - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
    local, _ = lenses.unproject(image, camera.model, camera.distortion)
    directions: Any = (local * (1.0, -1.0, -1.0)) @ camera.c2w[:3, :3].T
    return directions
