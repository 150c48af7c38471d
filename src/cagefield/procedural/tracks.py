"""Simulated sparse points of a capture with known depth, as structure from motion finds them on texture.

A candidate is a corner of a photo (the smaller eigenvalue of the structure tensor is large). It becomes a
point where other photos observe it too: visible by the true depth, from a similar direction, and similar by
the correlation of small surface patches, which reflections and highlights fail. Every observation is off by
some pixels; the point is where the observations' rays come closest, so its position has the resulting error.
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

OBSERVATION_NOISE_PIXELS = 0.7
"""Standard deviation of an observation along each axis."""

MIN_CORNER_EIGENVALUE = 2e-5
"""Minimum smaller eigenvalue of a corner's structure tensor, of gray values in [0,1]: twenty times the
noise's.
"""

MIN_PATCH_CORRELATION = 0.6
"""Minimum correlation of the patches of two observations."""

PATCH_HALF_WIDTH_PIXELS = 4
"""Half width of a patch, which is sampled at every other pixel."""

MAX_MATCH_ANGLE_DEG = 50.0
"""Maximum angle between the rays of two photos that match."""

MAX_RELATIVE_DEPTH_ERROR = 0.01
"""Maximum relative difference of a distance from the depth of a photo."""

OBSERVATION_SHARE = 0.6
"""Share of the possible observations that are found."""

MIN_TRACK_OBSERVATIONS = 3
MAX_POINT_ERROR_PIXELS = 2.5
"""Maximum root mean square distance between a point and its observations."""

MIN_TRIANGULATION_ANGLE_DEG = 1.5
"""Minimum angle between the two most different rays of a point."""


@dataclass(frozen=True)
class Tracks:
    """Points [M,3] with colors and mean errors (pixels), and their observations: point, view, pixel [S,2]."""

    positions: Array
    rgb: NDArray[np.uint8]
    errors: Array
    point: NDArray[np.intp]
    view: NDArray[np.intp]
    pixel: Array

    def __len__(self) -> int:
        return len(self.positions)


def simulate_tracks(
    photos: Sequence[NDArray[np.uint8]],
    depths: Sequence[Float32],
    cameras: Sequence[Camera],
    *,
    seed: int = 0,
    max_points: int = 250,
) -> Tracks:
    """Tracks of the points that photos [H,W,3] show, up to `max_points` new ones a photo.

    depths [H,W]: true distances along the rays through the pixels' centers.
    """
    rng = np.random.RandomState(seed)
    gray_images = [gaussian_filter(photo.mean(axis=2, dtype=np.float32) / 255, 0.7) for photo in photos]
    positions: list[Array] = []
    colors: list[NDArray[np.uint8]] = []
    errors: list[Array] = []
    observations: list[tuple[NDArray[np.intp], NDArray[np.intp], Array]] = []
    known_pixels = [np.empty((0, 2)) for _ in photos]
    count = 0
    for index, camera in enumerate(cameras):
        pixels = _corners(gray_images[index], depths[index], known_pixels[index], max_points)
        if not len(pixels):
            continue
        origins, directions = camera.rays(pixels)
        depth = depths[index][pixels[:, 1], pixels[:, 0], None]
        points = (origins + directions * depth).astype(np.float64)
        is_observed, pixel_positions = _observations(points, index, pixels, gray_images, depths, cameras)
        is_observed &= (rng.uniform(size=is_observed.shape) < OBSERVATION_SHARE) | (
            np.arange(len(cameras)) == index
        )
        is_observed[is_observed.sum(axis=1) < MIN_TRACK_OBSERVATIONS] = False
        pixel_positions += rng.normal(0, OBSERVATION_NOISE_PIXELS, pixel_positions.shape)
        estimates, error = _triangulate(points, is_observed, pixel_positions, cameras)
        good_rows = np.flatnonzero(error <= MAX_POINT_ERROR_PIXELS)
        point_rows, view = np.nonzero(is_observed[good_rows])
        positions.append(estimates[good_rows])
        errors.append(error[good_rows])
        colors.append(photos[index][pixels[good_rows, 1], pixels[good_rows, 0]])
        observations.append((point_rows + count, view, pixel_positions[good_rows][point_rows, view]))
        for other in np.unique(view):
            known_pixels[other] = np.concatenate(
                [known_pixels[other], pixel_positions[good_rows][is_observed[good_rows][:, other], other]]
            )
        count += len(good_rows)
    if not count:
        empty = np.empty(0, np.intp)
        return Tracks(
            np.empty((0, 3)), np.empty((0, 3), np.uint8), np.empty(0), empty, empty, np.empty((0, 2))
        )
    point, view, pixel = (np.concatenate(column) for column in zip(*observations, strict=True))
    return Tracks(
        np.concatenate(positions), np.concatenate(colors), np.concatenate(errors), point, view, pixel
    )


def _corners(gray: Float32, depth: Float32, known_pixels: Array, max_points: int) -> NDArray[np.intp]:
    """Pixels (column, row) [N,2] of the strongest corners at least 4 pixels from the known ones."""
    du, dv = sobel(gray, axis=1) / 8, sobel(gray, axis=0) / 8
    a, b, d = (gaussian_filter(product, 1.5) for product in (du * du, du * dv, dv * dv))
    min_eigenvalue = (a + d) / 2 - np.sqrt(((a - d) / 2) ** 2 + b * b)
    edge = PATCH_HALF_WIDTH_PIXELS + 2
    smooth = maximum_filter(depth, 5) < (1 + 3 * MAX_RELATIVE_DEPTH_ERROR) * minimum_filter(depth, 5)
    peak = (
        (min_eigenvalue == maximum_filter(min_eigenvalue, 5))
        & (min_eigenvalue > MIN_CORNER_EIGENVALUE)
        & smooth
    )
    peak[:edge] = peak[-edge:] = False
    peak[:, :edge] = peak[:, -edge:] = False
    if len(known_pixels):
        is_taken = np.zeros(gray.shape, bool)
        column, row = np.clip(known_pixels.astype(int), 0, (gray.shape[1] - 1, gray.shape[0] - 1)).T
        is_taken[row, column] = True
        peak &= ~maximum_filter(is_taken, 9)
    rows, columns = np.nonzero(peak)
    order = np.argsort(-min_eigenvalue[rows, columns], kind="stable")[:max_points]
    return np.stack([columns[order], rows[order]], 1)


def _observations(
    points: Array,
    index: int,
    pixels: NDArray[np.intp],
    gray_images: Sequence[Float32],
    depths: Sequence[Float32],
    cameras: Sequence[Camera],
) -> tuple[NDArray[np.bool_], Array]:
    """(mask [N,V] of the views that see points [N,3] found at pixels [N,2] of view `index`, pixel positions
    [N,V,2]).
    """
    offsets = np.arange(-PATCH_HALF_WIDTH_PIXELS, PATCH_HALF_WIDTH_PIXELS + 1, 2)
    v, u = (grid.ravel() for grid in np.meshgrid(offsets, offsets, indexing="ij"))
    around = (pixels[:, None] + np.stack([u, v], 1)).reshape(-1, 2)

    def patches(gray: Float32, pixel_positions: Array) -> Array:
        """Normalized patches [N,P] at positions [N P,2]."""
        values = map_coordinates(gray, (pixel_positions[:, ::-1] - 0.5).T, order=1, mode="nearest").astype(
            np.float64
        )
        values = values.reshape(-1, len(u))
        values -= values.mean(axis=1, keepdims=True)
        return values / np.maximum(np.linalg.norm(values, axis=1, keepdims=True), 1e-9)

    own_pixels = (pixels + 0.5).astype(np.float64)
    model = patches(gray_images[index], (around + 0.5).astype(np.float64))
    origins, directions = cameras[index].rays(around)
    surface = origins + directions * depths[index][around[:, 1], around[:, 0], None]
    surface = surface.reshape(len(pixels), len(u), 3)
    rays = _units(points - cameras[index].origin)
    is_observed = np.zeros((len(points), len(cameras)), bool)
    pixel_positions = np.zeros((len(points), len(cameras), 2))
    for view, camera in enumerate(cameras):
        if view == index:
            is_observed[:, view], pixel_positions[:, view] = True, own_pixels
            continue
        position, ahead = camera.project(points)
        size = (camera.width - PATCH_HALF_WIDTH_PIXELS - 1, camera.height - PATCH_HALF_WIDTH_PIXELS - 1)
        inside = (
            (ahead > 0) & (position > PATCH_HALF_WIDTH_PIXELS + 1).all(axis=1) & (position < size).all(axis=1)
        )
        rows = np.flatnonzero(inside)
        column, row = position[rows].astype(int).T
        distance = np.linalg.norm(points[rows] - camera.origin, axis=1)
        rows = rows[np.abs(depths[view][row, column] - distance) < MAX_RELATIVE_DEPTH_ERROR * distance]
        angle = (_units(points[rows] - camera.origin) * rays[rows]).sum(axis=1)
        rows = rows[angle > np.cos(np.radians(MAX_MATCH_ANGLE_DEG))]
        if not len(rows):
            continue
        projected, _ = camera.project(surface[rows].reshape(-1, 3))
        correlation = (patches(gray_images[view], np.nan_to_num(projected)) * model[rows]).sum(axis=1)
        rows = rows[correlation > MIN_PATCH_CORRELATION]
        is_observed[rows, view], pixel_positions[rows, view] = True, position[rows]
    return is_observed, pixel_positions


def _units(vectors: Array) -> Array:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _triangulate(
    initial: Array, is_observed: NDArray[np.bool_], pixel_positions: Array, cameras: Sequence[Camera]
) -> tuple[Array, Array]:
    """(points [N,3] closest to the rays of their observations, mean error [N] in pixels; inf for bad points).

    Least squares of the distances to the rays over the distances to the cameras.
    """
    normal, right = np.zeros((len(initial), 3, 3)), np.zeros((len(initial), 3))
    rays = np.full((*is_observed.shape, 3), np.nan)
    for view, camera in enumerate(cameras):
        rows = np.flatnonzero(is_observed[:, view])
        if not len(rows):
            continue
        ray = _directions(camera, pixel_positions[rows, view])
        rays[rows, view] = ray
        weight = 1 / np.linalg.norm(initial[rows] - camera.origin, axis=1) ** 2
        across = (np.eye(3) - ray[:, :, None] * ray[:, None, :]) * weight[:, None, None]
        normal[rows] += across
        right[rows] += across @ camera.origin
    error = np.full(len(initial), np.inf)
    estimates = initial.copy()
    chosen = np.flatnonzero(is_observed.any(axis=1))
    if not len(chosen):
        return estimates, error
    estimates[chosen] = np.linalg.solve(normal[chosen], right[chosen][..., None])[..., 0]
    square, total = np.zeros(len(initial)), is_observed.sum(axis=1)
    for view, camera in enumerate(cameras):
        rows = np.flatnonzero(is_observed[:, view])
        if len(rows):
            position, _ = camera.project(estimates[rows])
            square[rows] += np.nan_to_num(
                ((position - pixel_positions[rows, view]) ** 2).sum(axis=1), nan=np.inf
            )
    error[chosen] = np.sqrt(square[chosen] / total[chosen])
    for row in chosen:
        point_rays = rays[row, is_observed[row]]
        if (point_rays @ point_rays.T).min() > np.cos(np.radians(MIN_TRIANGULATION_ANGLE_DEG)):
            error[row] = np.inf
    return estimates, error


def _directions(camera: Camera, pixel_positions: Array) -> Array:
    """Unit world directions [N,3] through pixel positions [N,2]."""
    image = (pixel_positions - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
    local, _ = lenses.unproject(image, camera.model, camera.distortion)
    directions: Any = (local * (1.0, -1.0, -1.0)) @ camera.c2w[:3, :3].T
    return directions
