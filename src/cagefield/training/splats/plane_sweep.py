"""Points on surfaces from photos with known poses, where the photos have texture.

Each photo gets an inverse depth for every pixel by plane sweeping against a few neighbours; those stay that
are clearly better than any other depth and that two other photos' own depths agree with. The agreeing
points are thinned until about as many are left as wanted, evenly as the cameras see them. What lies between
them and their photo is empty.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras import lenses
from cagefield.cameras.camera import Camera
from cagefield.rendering.splats.rasterizer import intrinsics, kernels, world_to_camera
from cagefield.typing import Array

NEIGHBOURS = 4
"""Photos that each photo is compared with."""

BEST_ANGLE = np.radians(8.0)
"""Between a photo and its neighbour, seen from what they show; those nearest to it are taken."""

ANGLES = np.radians((1.5, 35.0))
"""Neighbours have at least and at most this angle."""

DEPTHS = (32, 128)
"""Depths that are tried for each pixel, at least and at most: about one for each pixel of parallax."""

LEAST_SCORE = 0.6
"""Correlation of a depth that counts."""

LEAST_LEAD = 0.05
"""A depth's score over the best of others."""

AGREEMENT = 1.0
"""Steps of inverse depth by which photos that agree differ at most."""

AGREEING = 2
"""Other photos that must agree."""

CLEAR = 0.95
"""Share of a distance that is empty."""

CAUTION = 1.0
"""Steps of inverse depth by which what is empty ends sooner."""


@dataclass(frozen=True, eq=False)
class Surfaces:
    """What photos agree on.

    positions [M,3] and rgb [M,3] of points on surfaces; `empty` [V,H,W]: distances along the rays of each
    photo's pixels up to which there is nothing, 0 where nobody knows.
    """

    positions: Array
    rgb: NDArray[np.uint8]
    empty: NDArray[np.float32]


def find_surfaces(
    images: Sequence[NDArray[np.uint8]],
    cameras: Sequence[Camera],
    nearest: Sequence[float],
    middle: Sequence[float],
    wanted: int,
    seed: int = 0,
) -> Surfaces:
    """What photos of one size agree on, with about `wanted` points, or fewer.

    images [H,W,3] with their cameras; `nearest` and `middle` are each camera's least and usual depth of what
    it shows, in world units.
    """
    chosen = neighbours_of(cameras, middle)
    if (chosen < 0).all():
        none = np.zeros((len(images), *images[0].shape[:2]), np.float32)
        return Surfaces(np.zeros((0, 3)), np.zeros((0, 3), np.uint8), none)
    from cagefield.training.splats.kernels.plane_sweep import sweep

    grey = np.stack([image[..., :3].mean(axis=2).astype(np.float32) / 255.0 for image in images])
    views, height, width = grey.shape
    lens = [intrinsics(camera) for camera in cameras]
    directions = np.stack([_directions(camera) for camera in cameras]).astype(np.float32)
    rotations = np.stack([world_to_camera(camera) for camera in cameras])
    origins = np.stack([camera.origin for camera in cameras])
    count = _depth_count(cameras, chosen, nearest)
    inverse = np.stack([np.linspace(0.0, 1.0 / near, count) for near in nearest])
    found = np.empty((views, height, width, 3), np.float32)
    with kernels():
        sweep(
            grey,
            directions,
            rotations,
            origins,
            np.stack([one.focal for one in lens]),
            np.stack([one.centre for one in lens]),
            np.array([one.model for one in lens]),
            np.stack([one.coefficients for one in lens]),
            chosen,
            inverse,
            found,
        )
    step = inverse[:, 1]
    w = found[..., 0] * step[:, None, None]
    sure = (
        (found[..., 1] > LEAST_SCORE) & (found[..., 1] - found[..., 2] > LEAST_LEAD) & (w > 0.5 * step.min())
    )
    border = 3
    sure[:, :border] = sure[:, -border:] = False
    sure[:, :, :border] = sure[:, :, -border:] = False
    positions, colours, footprints = [], [], []
    empty = np.zeros((views, height * width), np.float32)
    for r in range(views):
        at = np.flatnonzero(sure[r])
        local = np.concatenate([directions[r].reshape(-1, 2)[at], np.ones((len(at), 1))], axis=1)
        depth = 1.0 / w[r].ravel()[at]
        points = (local * depth[:, None]) @ rotations[r] + origins[r]
        votes = np.zeros(len(points), np.int32)
        for n in chosen[r][chosen[r] >= 0]:
            votes += _agrees(points, cameras[n], rotations[n], w[n], sure[n], step[n])
        kept = votes >= AGREEING
        positions.append(points[kept])
        colours.append(images[r].reshape(-1, images[r].shape[-1])[at[kept], :3])
        footprints.append(depth[kept] / cameras[r].fx)
        distance = np.linalg.norm(local[kept], axis=1) / (w[r].ravel()[at[kept]] + CAUTION * step[r])
        empty[r, at[kept]] = CLEAR * distance
    everything, rgb, footprint = (
        np.concatenate(positions),
        np.concatenate(colours),
        np.concatenate(footprints),
    )
    # In units and axes of the cameras: those of the world are of no meaning.
    unit = float(np.median(footprint)) if len(footprint) else 1.0
    rows = _thinned((everything - origins[0]) @ rotations[0].T / unit, footprint / unit, wanted, seed)
    return Surfaces(everything[rows], rgb[rows], empty.reshape(views, height, width))


def neighbours_of(cameras: Sequence[Camera], middle: Sequence[float]) -> NDArray[np.int64]:
    """The neighbours [V,NEIGHBOURS] of each camera; -1 where there are fewer."""
    origins = np.stack([camera.origin for camera in cameras])
    chosen = np.full((len(cameras), NEIGHBOURS), -1)
    for r, camera in enumerate(cameras):
        target = camera.origin + middle[r] * camera.forward
        to_r, to_n = origins[r] - target, origins - target
        cosine = (to_n @ to_r) / np.maximum(np.linalg.norm(to_n, axis=1) * np.linalg.norm(to_r), 1e-30)
        angle = np.arccos(np.clip(cosine, -1.0, 1.0))
        ratio = np.linalg.norm(to_n, axis=1) / np.linalg.norm(to_r)
        sees = np.array([_inside(other, target[None])[0] for other in cameras])
        fits = sees & (angle > ANGLES[0]) & (angle < ANGLES[1]) & (ratio > 0.5) & (ratio < 2.0)
        rank = np.abs(np.log(np.maximum(angle, 1e-6) / BEST_ANGLE)) + np.abs(np.log(np.maximum(ratio, 1e-6)))
        order = [n for n in np.argsort(rank) if fits[n] and n != r][:NEIGHBOURS]
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


def _depth_count(cameras: Sequence[Camera], chosen: NDArray[np.int64], nearest: Sequence[float]) -> int:
    """Depths for steps of about a pixel of the usual neighbour."""
    parallax = [
        cameras[n].fx * float(np.linalg.norm(cameras[n].origin - cameras[r].origin)) / nearest[r]
        for r in range(len(cameras))
        for n in chosen[r]
        if n >= 0
    ]
    return int(np.clip(np.median(parallax), *DEPTHS))


def _inside(camera: Camera, points: Array) -> NDArray[np.bool_]:
    pixels, depth = camera.project(points)
    with np.errstate(invalid="ignore"):
        return np.asarray(
            (pixels >= 0).all(axis=1)
            & (pixels[:, 0] < camera.width)
            & (pixels[:, 1] < camera.height)
            & (depth > 0)
        )


def _agrees(
    points: Array,
    camera: Camera,
    rotation: Array,
    w: NDArray[np.float64],
    sure: NDArray[np.bool_],
    step: float,
) -> NDArray[np.bool_]:
    """True [N] where the camera's own inverse depth is that of the point."""
    pixels, _ = camera.project(points)
    depth = (points - camera.origin) @ rotation[2]
    inside = _inside(camera, points)
    at = np.where(inside[:, None], pixels, 0.0).astype(np.int64)
    with np.errstate(divide="ignore"):
        close = np.abs(w[at[:, 1], at[:, 0]] - 1.0 / depth) < AGREEMENT * step
    return np.asarray(inside & sure[at[:, 1], at[:, 0]] & close)


def _thinned(points: Array, footprint: Array, wanted: int, seed: int) -> NDArray[np.int64]:
    """Rows of about `wanted` points: one in each cell of a grid, finer where photos are nearer."""
    if len(points) <= wanted:
        return np.arange(len(points))
    order = np.random.default_rng(seed).permutation(len(points))
    size, rows = 1.0, order
    for _ in range(24):
        level = np.round(np.log2(size * footprint[order])).astype(np.int64)
        cells = np.floor(points[order] / np.exp2(level)[:, None]).astype(np.int64)
        rows = order[np.unique(np.concatenate([level[:, None], cells], axis=1), axis=0, return_index=True)[1]]
        if len(rows) <= wanted:
            break
        size *= max(1.1, (len(rows) / wanted) ** 0.4)
    return np.asarray(np.sort(rows))
