"""Surface points from textured photos with known poses, by plane sweeping.

Each photo gets an inverse depth per pixel by plane sweeping against a few neighbors. A depth stays where its
score is clearly better than any other depth's and where the depths of two other photos agree with it. The
agreeing points are thinned to about the target number, evenly in the cameras' pixels. The space between the
points and their photo is free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras import lenses
from cagefield.cameras.camera import Camera
from cagefield.rendering.splats.rasterizer import intrinsics, world_to_camera
from cagefield.typing import Array

NEIGHBOR_COUNT = 4
"""Number of neighbors that each photo is compared with."""

BEST_ANGLE_RAD = np.radians(8.0)
"""Preferred angle between the viewing directions of a photo and its neighbor."""

ANGLE_RANGE_RAD = np.radians((1.5, 35.0))
"""Minimum and maximum angle of a neighbor."""

DEPTH_COUNT_RANGE = (32, 128)
"""Minimum and maximum number of depths per pixel; about one depth per pixel of parallax."""

MIN_CORRELATION = 0.6
"""Minimum correlation of an accepted depth."""

MIN_CORRELATION_LEAD = 0.05
"""Minimum lead of an accepted depth's score over the best other score."""

MAX_DIFFERENCE_STEPS = 1.0
"""Maximum difference of agreeing photos, in steps of inverse depth."""

MIN_AGREEING_PHOTOS = 2
"""Minimum number of other photos that agree."""

FREE_DISTANCE_SHARE = 0.95
"""Share of the distance to a surface that counts as free."""

FREE_MARGIN_STEPS = 1.0
"""Margin of the free distance, in steps of inverse depth."""


@dataclass(frozen=True, eq=False)
class SweptSurfaces:
    """Surface points and free space from plane sweeping.

    positions [M,3] and rgb [M,3] of surface points; `free_distances` [V,H,W] along the rays of each photo's
    pixels, 0 where unknown.
    """

    positions: Array
    rgb: NDArray[np.uint8]
    free_distances: NDArray[np.float32]


def sweep_surfaces(
    images: Sequence[NDArray[np.uint8]],
    cameras: Sequence[Camera],
    min_depths: Sequence[float],
    median_depths: Sequence[float],
    target_count: int,
    seed: int = 0,
) -> SweptSurfaces:
    """Surfaces of photos of one size, with about `target_count` points or fewer.

    `images` [H,W,3] with their cameras; `min_depths` and `median_depths` are the least and the median depth
    of each camera's content, in world units.
    """
    chosen = choose_neighbors(cameras, median_depths)
    if (chosen < 0).all():
        none = np.zeros((len(images), *images[0].shape[:2]), np.float32)
        return SweptSurfaces(np.zeros((0, 3)), np.zeros((0, 3), np.uint8), none)
    from cagefield.training.splats.kernels.plane_sweep import sweep

    gray = np.stack([image[..., :3].mean(axis=2).astype(np.float32) / 255.0 for image in images])
    views, height, width = gray.shape
    lens = [intrinsics(camera) for camera in cameras]
    directions = np.stack([_directions(camera) for camera in cameras]).astype(np.float32)
    rotations = np.stack([world_to_camera(camera) for camera in cameras])
    origins = np.stack([camera.origin for camera in cameras])
    count = _depth_count(cameras, chosen, min_depths)
    inverse = np.stack([np.linspace(0.0, 1.0 / near, count) for near in min_depths])
    sweep_result = np.empty((views, height, width, 3), np.float32)
    sweep(
        gray,
        directions,
        rotations,
        origins,
        np.stack([one.focal for one in lens]),
        np.stack([one.center for one in lens]),
        np.array([one.model for one in lens]),
        np.stack([one.coefficients for one in lens]),
        chosen,
        inverse,
        sweep_result,
    )
    step = inverse[:, 1]
    w = sweep_result[..., 0] * step[:, None, None]
    accepted = (
        (sweep_result[..., 1] > MIN_CORRELATION)
        & (sweep_result[..., 1] - sweep_result[..., 2] > MIN_CORRELATION_LEAD)
        & (w > 0.5 * step.min())
    )
    border = 3
    accepted[:, :border] = accepted[:, -border:] = False
    accepted[:, :, :border] = accepted[:, :, -border:] = False
    positions, colors, footprints = [], [], []
    free = np.zeros((views, height * width), np.float32)
    for r in range(views):
        at = np.flatnonzero(accepted[r])
        local = np.concatenate([directions[r].reshape(-1, 2)[at], np.ones((len(at), 1))], axis=1)
        depth = 1.0 / w[r].ravel()[at]
        points = (local * depth[:, None]) @ rotations[r] + origins[r]
        votes = np.zeros(len(points), np.int32)
        for n in chosen[r][chosen[r] >= 0]:
            votes += _agreement_mask(points, cameras[n], rotations[n], w[n], accepted[n], step[n])
        keep = votes >= MIN_AGREEING_PHOTOS
        positions.append(points[keep])
        colors.append(images[r].reshape(-1, images[r].shape[-1])[at[keep], :3])
        footprints.append(depth[keep] / cameras[r].fx)
        distance = np.linalg.norm(local[keep], axis=1) / (
            w[r].ravel()[at[keep]] + FREE_MARGIN_STEPS * step[r]
        )
        free[r, at[keep]] = FREE_DISTANCE_SHARE * distance
    all_positions, rgb, footprint = (
        np.concatenate(positions),
        np.concatenate(colors),
        np.concatenate(footprints),
    )
    # In units and axes of the cameras, so that the result does not depend on the world frame.
    unit = float(np.median(footprint)) if len(footprint) else 1.0
    rows = _thin_points(
        (all_positions - origins[0]) @ rotations[0].T / unit, footprint / unit, target_count, seed
    )
    return SweptSurfaces(all_positions[rows], rgb[rows], free.reshape(views, height, width))


def choose_neighbors(cameras: Sequence[Camera], median_depths: Sequence[float]) -> NDArray[np.int64]:
    """Neighbors [V,NEIGHBOR_COUNT] of each camera; -1 where there are fewer."""
    origins = np.stack([camera.origin for camera in cameras])
    chosen = np.full((len(cameras), NEIGHBOR_COUNT), -1)
    for r, camera in enumerate(cameras):
        target = camera.origin + median_depths[r] * camera.forward
        to_r, to_n = origins[r] - target, origins - target
        cosine = (to_n @ to_r) / np.maximum(np.linalg.norm(to_n, axis=1) * np.linalg.norm(to_r), 1e-30)
        angle = np.arccos(np.clip(cosine, -1.0, 1.0))
        ratio = np.linalg.norm(to_n, axis=1) / np.linalg.norm(to_r)
        sees = np.array([_inside(other, target[None])[0] for other in cameras])
        fits = (
            sees & (angle > ANGLE_RANGE_RAD[0]) & (angle < ANGLE_RANGE_RAD[1]) & (ratio > 0.5) & (ratio < 2.0)
        )
        rank = np.abs(np.log(np.maximum(angle, 1e-6) / BEST_ANGLE_RAD)) + np.abs(
            np.log(np.maximum(ratio, 1e-6))
        )
        order = [n for n in np.argsort(rank) if fits[n] and n != r][:NEIGHBOR_COUNT]
        chosen[r, : len(order)] = order
    return chosen


def _directions(camera: Camera) -> Array:
    """(x, y) of the pixels' directions (x, y, 1) [H,W,2] in camera axes x right, y down, z forward."""
    columns, rows = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    image = np.stack(
        [(columns.ravel() - camera.cx) / camera.fx, (rows.ravel() - camera.cy) / camera.fy], axis=1
    )
    local = lenses.unproject(image, camera.model, camera.distortion)[0]
    return np.asarray((local[:, :2] / np.maximum(local[:, 2:], 0.05)).reshape(camera.height, camera.width, 2))


def _depth_count(cameras: Sequence[Camera], chosen: NDArray[np.int64], min_depths: Sequence[float]) -> int:
    """Number of depths for steps of about one pixel of parallax in the median neighbor."""
    parallax = [
        cameras[n].fx * float(np.linalg.norm(cameras[n].origin - cameras[r].origin)) / min_depths[r]
        for r in range(len(cameras))
        for n in chosen[r]
        if n >= 0
    ]
    return int(np.clip(np.median(parallax), *DEPTH_COUNT_RANGE))


def _inside(camera: Camera, points: Array) -> NDArray[np.bool_]:
    pixels, depth = camera.project(points)
    with np.errstate(invalid="ignore"):
        return np.asarray(
            (pixels >= 0).all(axis=1)
            & (pixels[:, 0] < camera.width)
            & (pixels[:, 1] < camera.height)
            & (depth > 0)
        )


def _agreement_mask(
    points: Array,
    camera: Camera,
    rotation: Array,
    w: NDArray[np.float64],
    accepted: NDArray[np.bool_],
    step: float,
) -> NDArray[np.bool_]:
    """Mask [N] of points whose inverse depth equals that of the camera's own depth map."""
    pixels, _ = camera.project(points)
    depth = (points - camera.origin) @ rotation[2]
    inside = _inside(camera, points)
    at = np.where(inside[:, None], pixels, 0.0).astype(np.int64)
    with np.errstate(divide="ignore"):
        close = np.abs(w[at[:, 1], at[:, 0]] - 1.0 / depth) < MAX_DIFFERENCE_STEPS * step
    return np.asarray(inside & accepted[at[:, 1], at[:, 0]] & close)


def _thin_points(points: Array, footprint: Array, target_count: int, seed: int) -> NDArray[np.int64]:
    """Rows of about `target_count` points: one per cell of a grid that is finer where photos are nearer."""
    if len(points) <= target_count:
        return np.arange(len(points))
    order = np.random.default_rng(seed).permutation(len(points))
    size, rows = 1.0, order
    for _ in range(24):
        level = np.round(np.log2(size * footprint[order])).astype(np.int64)
        cells = np.floor(points[order] / np.exp2(level)[:, None]).astype(np.int64)
        rows = order[np.unique(np.concatenate([level[:, None], cells], axis=1), axis=0, return_index=True)[1]]
        if len(rows) <= target_count:
            break
        size *= max(1.1, (len(rows) / target_count) ** 0.4)
    return np.asarray(np.sort(rows))
