"""Initial splats of a training: isotropic splats at sparse points and on surfaces, and a far background.

Local axes are the first camera's, so a rotated world gets equally rotated splats. Sigmas are the root mean
square distance to the three nearest neighbors. Background splats lie on a sphere far around the cameras, in
the color of the photos in their direction. The module also collects the photos' knowledge of free space.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.datasets.sfm.sparse_points import random_points
from cagefield.datasets.views import Dataset, SparsePoints
from cagefield.rendering.splats.rasterizer import untiled
from cagefield.training.splats.plane_sweep import FREE_DISTANCE_SHARE, sweep_surfaces
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.splats.splat_state import SplatState
from cagefield.training.splats.training_views import TrainingView
from cagefield.typing import Array

BACKGROUND_RADIUS_DISTANCES = 10.0
"""Radius of the background sphere, in median distances of the cameras from the center of interest."""

INITIAL_OPACITY = 0.5
"""Opacity of an initial splat."""

SURFACE_SPLAT_SHARE = 0.5
"""Initial surface splats, as a share of the maximum number of splats."""

INFERENCE_SIDE_SHARE = 0.25
"""Maximum window of the inference from known free distances, relative to the photo's longer side."""

INFERRED_DISTANCE_SHARE = 0.85
"""Inferred free distance, relative to the least known one in the window."""

INFERRED_CONFIDENCE = 0.2
"""Confidence of an inferred free distance."""

MIN_DEPTH_SHARE = 0.7
"""Minimum depth of a photo's content, relative to the 1 % quantile of its known points' depths."""

MAX_RANDOM_POINTS = 4000
"""Maximum number of random points for a data set without points."""

MIN_SWEEP_SIDE_PIXELS = 150
"""Minimum longer side of the photo level used for plane sweeping."""


class InitialSplats(NamedTuple):
    """Initial splats of a training, and the free space of each photo.

    `free_space` has [2,H,W] per photo: free distances along the pixels' rays, 0 where unknown, and
    confidences.
    """

    state: SplatState
    free_space: list[NDArray[np.float32]]


def initialize_splats(
    dataset: Dataset, views: Sequence[TrainingView], config: SplatConfig, max_splats: int
) -> InitialSplats:
    """Initial splats of a training on photos, at most `max_splats`, with the photos' free space.

    Splats lie at the data set's points (random ones without), at points from plane sweeping, and, for an
    unbounded capture, on a far sphere.
    """
    from scipy.spatial.transform import Rotation

    points = dataset.points or random_points(dataset, min(max_splats // 4, MAX_RANDOM_POINTS), config.seed)
    positions, rgb = points.positions, points.rgb
    target_count = int(SURFACE_SPLAT_SHARE * max_splats)
    sweep_positions, colors, free_distances = sweep_surface_points(
        views, positions, target_count, config.seed
    )
    _add_sparse_points(free_distances, views, dataset.points)
    free_distances = [infer_free_distances(one) for one in free_distances]
    if dataset.points is None and len(sweep_positions) > len(positions):
        # Random points only bound the depths of the plane sweep.
        positions, rgb = sweep_positions, colors
    else:
        positions, rgb = np.concatenate([positions, sweep_positions]), np.concatenate([rgb, colors])
    positions = positions.astype(np.float32)
    first = np.sort(np.unique(positions, axis=0, return_index=True)[1])
    positions = positions[first]
    far = None
    if dataset.unbounded and config.background_share > 0.0:
        unit = median_camera_distance([view.cameras[0] for view in views], dataset.bounds)
        count = max(200, int(config.background_share * min(len(positions), max_splats)))
        far = build_background(views, dataset.bounds.mean(axis=0), unit, min(count, max_splats // 4))
    remaining = max_splats if far is None else max_splats - len(far[0])
    if len(positions) > remaining:
        chosen = np.sort(np.random.default_rng(config.seed).permutation(len(positions))[:remaining])
        positions, first = positions[chosen], first[chosen]
    state = SplatState.new(
        positions,
        neighbor_spacing(positions.astype(np.float64)),
        rgb[first].astype(np.float32) / 255.0,
        INITIAL_OPACITY,
        config.sh_degree,
    )
    if far is not None:
        state.append(SplatState.new(*far, INITIAL_OPACITY, config.sh_degree))
    axes = Rotation.from_matrix(views[0].cameras[0].c2w[:3, :3])
    state.quaternions[:] = np.roll(axes.as_quat(), 1)
    return InitialSplats(state, free_distances)


def neighbor_spacing(positions: Array) -> Array:
    """Root mean square distance [N] to the three nearest other positions, clipped at the extremes."""
    from scipy.spatial import cKDTree

    count = min(4, len(positions))
    if count < 2:
        return np.full(len(positions), 1.0)
    distances = cKDTree(positions).query(positions, count)[0][:, 1:]
    rms = np.sqrt((distances**2).mean(axis=1))
    high = float(np.quantile(distances, 0.99))
    return np.asarray(np.clip(rms, 1e-4 * max(high, 1e-30), high))


def mean_photo_colors(
    views: Sequence[TrainingView], positions: Array
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """(mean rgb [N,3] in [0,1], number of photos [N]) over the photos that contain positions [N,3]."""
    sums, counts = np.zeros((len(positions), 3)), np.zeros(len(positions), np.int32)
    for view in views:
        camera, tiles = view.level(len(view.cameras) - 1)
        across = -(-camera.width // 16)
        pixels, depth = camera.project(positions)
        with np.errstate(invalid="ignore"):
            inside = (
                (pixels >= 0).all(axis=1)
                & (pixels[:, 0] < camera.width)
                & (pixels[:, 1] < camera.height)
                & (depth > 0)
            )
        at = pixels[inside].astype(np.int64)
        tile = at[:, 1] // 16 * across + at[:, 0] // 16
        sums[inside] += tiles[tile, :3, at[:, 1] % 16 * 16 + at[:, 0] % 16] / 255.0
        counts[inside] += 1
    return (sums / np.maximum(counts, 1)[:, None]).astype(np.float32), counts


def fibonacci_sphere(count: int) -> Array:
    """Unit directions [N,3], evenly distributed. Source: the Fibonacci lattice (Gonzalez, 2010)."""
    k = np.arange(count) + 0.5
    height = 1.0 - 2.0 * k / count
    angle = np.pi * (1.0 + 5.0**0.5) * k
    ring = np.sqrt(1.0 - height**2)
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), height], axis=1)


def build_background(
    views: Sequence[TrainingView], center: Array, distance: float, count: int
) -> tuple[Array, Array, NDArray[np.float32]]:
    """(positions, sigmas, rgb) of background splats in the directions that some photo shows."""
    # Photos show a part of the sphere: take enough directions that about `count` remain.
    axes = views[0].cameras[0].c2w[:3, :3]
    trial = fibonacci_sphere(2000) @ axes.T
    share = max(
        0.02,
        float(
            (mean_photo_colors(views, center + BACKGROUND_RADIUS_DISTANCES * distance * trial)[1] > 0).mean()
        ),
    )
    directions = fibonacci_sphere(max(8, int(count / share))) @ axes.T
    positions = center + BACKGROUND_RADIUS_DISTANCES * distance * directions
    rgb, visible = mean_photo_colors(views, positions)
    sigma = 0.5 * BACKGROUND_RADIUS_DISTANCES * distance * np.sqrt(4.0 * np.pi / len(directions))
    keep = visible > 0
    return positions[keep], np.full(int(keep.sum()), sigma), rgb[keep]


def depth_ranges(cameras: Sequence[Camera], positions: NDArray[Any]) -> list[tuple[float, float] | None]:
    """(least, median) depth of the positions [N,3] in each camera's image; None for fewer than 20."""
    ranges: list[tuple[float, float] | None] = []
    for camera in cameras:
        pixels, depth = camera.project(positions)
        with np.errstate(invalid="ignore"):
            visible = (
                (pixels >= 0).all(axis=1) & (pixels < (camera.width, camera.height)).all(axis=1) & (depth > 0)
            )
        near, median = np.quantile(depth[visible], (0.01, 0.5)) if visible.sum() >= 20 else (0.0, 0.0)
        ranges.append((MIN_DEPTH_SHARE * float(near), float(median)) if median > 0 else None)
    return ranges


def closer_mask(camera: Camera, positions: NDArray[Any], depth: float) -> NDArray[np.bool_]:
    """Mask [N] of positions [N,3] within the camera's image at less than a depth."""
    depths = (camera.origin - positions) @ camera.c2w[:3, 2]
    rows = np.flatnonzero((depths > 0) & (depths < depth))
    pixels, _ = camera.project(positions[rows])
    with np.errstate(invalid="ignore"):
        inside = (pixels >= 0).all(axis=1) & (pixels < (camera.width, camera.height)).all(axis=1)
    mask = np.zeros(len(positions), bool)
    mask[rows[inside]] = True
    return mask


def sweep_surface_points(
    views: Sequence[TrainingView], positions: Array, target_count: int, seed: int
) -> tuple[Array, NDArray[np.uint8], list[NDArray[np.float32]]]:
    """(positions, rgb, free distances [H,W] by photo) of surface points from plane sweeping.

    Sparse `positions` give the depth surfaces.
    """
    sides = [max(camera.width, camera.height) for camera in views[0].cameras]
    level = max([level for level, side in enumerate(sides) if side >= MIN_SWEEP_SIDE_PIXELS], default=0)
    cameras = [view.level(level)[0] for view in views]
    free_distances = [np.zeros((camera.height, camera.width), np.float32) for camera in cameras]
    depths = depth_ranges(cameras, positions)
    usable = [n for n, depth in enumerate(depths) if depth is not None]
    size = (cameras[0].width, cameras[0].height)
    usable = [n for n in usable if (cameras[n].width, cameras[n].height) == size]
    images = [_unmasked_rgb(views[n], level) for n in usable]
    if len(usable) < 3 or target_count < 1:
        return np.zeros((0, 3)), np.zeros((0, 3), np.uint8), free_distances
    known = [depth for n in usable if (depth := depths[n]) is not None]
    surfaces = sweep_surfaces(
        images, [cameras[n] for n in usable], [d[0] for d in known], [d[1] for d in known], target_count, seed
    )
    for n, one in zip(usable, surfaces.free_distances, strict=True):
        free_distances[n] = one
    return surfaces.positions, surfaces.rgb, free_distances


def _add_sparse_points(
    free_distances: Sequence[NDArray[np.float32]], views: Sequence[TrainingView], points: SparsePoints | None
) -> None:
    """Write the free distances in front of sparse points into the photos that observe the points."""
    if points is None or not points.seen_by:
        return
    for view, distances in zip(views, free_distances, strict=True):
        camera = view.cameras[0]
        rows = np.flatnonzero([view.name in names for names in points.seen_by])
        pixels, depth = camera.project(points.positions[rows])
        with np.errstate(invalid="ignore"):
            inside = (
                (pixels >= 0).all(axis=1) & (pixels < (camera.width, camera.height)).all(axis=1) & (depth > 0)
            )
        height, width = distances.shape
        at = (pixels[inside] * (width / camera.width, height / camera.height)).astype(np.int64)
        known = FREE_DISTANCE_SHARE * np.linalg.norm(points.positions[rows[inside]] - camera.origin, axis=1)
        before = distances[at[:, 1], at[:, 0]]
        distances[at[:, 1], at[:, 0]] = np.where(before > 0, np.minimum(before, known), known)


def infer_free_distances(distances: NDArray[np.float32]) -> NDArray[np.float32]:
    """(free distance, confidence) [2,H,W] from known free distances [H,W], 0 where unknown.

    Textureless regions mostly lie between textured ones: an unknown pixel takes INFERRED_DISTANCE_SHARE of
    the least known distance in the smallest window that has one, of at most INFERENCE_SIDE_SHARE of the
    photo.
    """
    from scipy.ndimage import minimum_filter

    known = distances > 0
    filled, sure = distances.copy(), known.astype(np.float32)
    far = np.where(known, distances, np.inf).astype(np.float32)
    size, max_splats = 3, INFERENCE_SIDE_SHARE * max(distances.shape)
    while size <= max_splats:
        around = minimum_filter(far, size, mode="nearest")
        new = (filled == 0) & np.isfinite(around)
        filled[new], sure[new] = INFERRED_DISTANCE_SHARE * around[new], INFERRED_CONFIDENCE
        size = 2 * size + 1
    return np.stack([filled, sure])


def _unmasked_rgb(view: TrainingView, level: int) -> NDArray[np.uint8]:
    """rgb [H,W,3] of a photo over white; masked pixels are gray, without texture."""
    camera, tiles = view.level(level)
    pixels = _over_white(untiled(tiles, camera.width, camera.height))
    valid = view.valid_at(level)
    if valid is not None:
        pixels[~untiled(valid[:, None], camera.width, camera.height)[..., 0]] = 127
    return pixels


def _over_white(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """rgb [H,W,3] of pixels with straight alpha over white; pixels without alpha are unchanged."""
    if pixels.shape[2] == 3:
        return pixels
    alpha = pixels[..., 3:].astype(np.float32) / 255.0
    return (pixels[..., :3] * alpha + 255.0 * (1.0 - alpha) + 0.5).astype(np.uint8)


def median_camera_distance(cameras: Sequence[Camera], bounds: Array) -> float:
    """Median distance of the cameras from the center of the bounds: the scene's unit of length."""
    origins = np.stack([camera.origin for camera in cameras])
    median = float(np.median(np.linalg.norm(origins - bounds.mean(axis=0), axis=1)))
    return max(median, 0.1 * float(np.linalg.norm(bounds[1] - bounds[0])))
