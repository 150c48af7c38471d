"""The splats that a training begins with: round ones at sparse points and on surfaces, and a far background.

Where axes are chosen they are the first camera's: a turned world gets the same splats, turned. Sizes are the
root mean square distance to the three nearest neighbours; background splats lie on a sphere far around the
cameras and have the colour that the photos show in their direction. And what the photos know of empty space.
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
from cagefield.training.splats.plane_sweep import CLEAR, find_surfaces
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.splats.splat_state import SplatState
from cagefield.training.splats.training_views import TrainingView
from cagefield.typing import Array

FAR = 10.0
"""Radius of the background's sphere, in median distances of the cameras from the centre of interest."""

FIRST_OPACITY = 0.5

SURFACE_SHARE = 0.5
"""Surface points that a training begins with, in shares of the most splats that it may have."""

REACH = 0.25
"""Share of a photo's longer side within which known distances say something about unknown ones."""

NEARBY = 0.85
"""Share of the least known distance around it that a pixel takes."""

HEARSAY = 0.2
"""How sure that is."""

NEAREST_SHARE = 0.7
"""The least depth that a photo may show, over the 1 % quantile of the depths of known points in it."""

RANDOM = 4000
"""Random points, where a data set has none, at most."""

SWEPT_SIDE = 150
"""Least longer side of the photos that surface points are looked for in."""


class Seeds(NamedTuple):
    """The splats that a training begins with, and what each photo knows to be empty.

    The latter [2,H,W] by photo: distances along its pixels' rays, 0 where nobody knows, and how sure that is.
    """

    state: SplatState
    empty: list[NDArray[np.float32]]


def first_splats(dataset: Dataset, views: Sequence[TrainingView], config: SplatConfig, most: int) -> Seeds:
    """The splats that a training on photos begins with, at most `most`.

    At the data set's points; at points that the photos agree on by plane sweeping; and, of an unbounded
    capture, on a sphere far away. Where the data set has no points they are random ones.
    """
    from scipy.spatial.transform import Rotation

    points = dataset.points or random_points(dataset, min(most // 4, RANDOM), config.seed)
    positions, rgb = points.positions, points.rgb
    wanted = int(SURFACE_SHARE * most)
    swept, colours, empty = swept_points(views, positions, wanted, config.seed)
    _add_sightings(empty, views, dataset.points)
    empty = [spread(one) for one in empty]
    if dataset.points is None and len(swept) > len(positions):
        # Random ones have done what they are for: to say how deep the photos may be.
        positions, rgb = swept, colours
    else:
        positions, rgb = np.concatenate([positions, swept]), np.concatenate([rgb, colours])
    positions = positions.astype(np.float32)
    first = np.sort(np.unique(positions, axis=0, return_index=True)[1])
    positions = positions[first]
    far = None
    if dataset.unbounded and config.background > 0.0:
        unit = camera_scale([view.cameras[0] for view in views], dataset.bounds)
        count = max(200, int(config.background * min(len(positions), most)))
        far = background_seeds(views, dataset.bounds.mean(axis=0), unit, min(count, most // 4))
    left = most if far is None else most - len(far[0])
    if len(positions) > left:
        chosen = np.sort(np.random.default_rng(config.seed).permutation(len(positions))[:left])
        positions, first = positions[chosen], first[chosen]
    state = SplatState.new(
        positions,
        neighbour_distance(positions.astype(np.float64)),
        rgb[first].astype(np.float32) / 255.0,
        FIRST_OPACITY,
        config.sh_degree,
    )
    if far is not None:
        state.append(SplatState.new(*far, FIRST_OPACITY, config.sh_degree))
    axes = Rotation.from_matrix(views[0].cameras[0].c2w[:3, :3])
    state.quaternions[:] = np.roll(axes.as_quat(), 1)
    return Seeds(state, empty)


def neighbour_distance(positions: Array) -> Array:
    """Root mean square distance [N] to the three nearest other positions, extremes held back."""
    from scipy.spatial import cKDTree

    count = min(4, len(positions))
    if count < 2:
        return np.full(len(positions), 1.0)
    distances = cKDTree(positions).query(positions, count)[0][:, 1:]
    rms = np.sqrt((distances**2).mean(axis=1))
    high = float(np.quantile(distances, 0.99))
    return np.asarray(np.clip(rms, 1e-4 * max(high, 1e-30), high))


def seen_colours(
    views: Sequence[TrainingView], positions: Array
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """(mean rgb [N,3] in [0,1], number of photos [N]) of the photos that picture positions [N,3]."""
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


def sphere(count: int) -> Array:
    """Unit directions [N,3], even over the sphere. Source: the Fibonacci lattice (Gonzalez, 2010)."""
    k = np.arange(count) + 0.5
    height = 1.0 - 2.0 * k / count
    angle = np.pi * (1.0 + 5.0**0.5) * k
    ring = np.sqrt(1.0 - height**2)
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), height], axis=1)


def background_seeds(
    views: Sequence[TrainingView], centre: Array, distance: float, count: int
) -> tuple[Array, Array, NDArray[np.float32]]:
    """(positions, sigmas, rgb) of splats on the sphere of FAR distances, those that some photo shows."""
    # Photos show a part of the sphere: enough directions that about `count` are left.
    axes = views[0].cameras[0].c2w[:3, :3]
    trial = sphere(2000) @ axes.T
    share = max(0.02, float((seen_colours(views, centre + FAR * distance * trial)[1] > 0).mean()))
    directions = sphere(max(8, int(count / share))) @ axes.T
    positions = centre + FAR * distance * directions
    rgb, seen = seen_colours(views, positions)
    sigma = 0.5 * FAR * distance * np.sqrt(4.0 * np.pi / len(directions))
    kept = seen > 0
    return positions[kept], np.full(int(kept.sum()), sigma), rgb[kept]


def depths_seen(cameras: Sequence[Camera], positions: NDArray[Any]) -> list[tuple[float, float] | None]:
    """(least, usual) depth of the positions [N,3] that each camera shows, None where it shows too few."""
    found: list[tuple[float, float] | None] = []
    for camera in cameras:
        pixels, depth = camera.project(positions)
        with np.errstate(invalid="ignore"):
            seen = (
                (pixels >= 0).all(axis=1) & (pixels < (camera.width, camera.height)).all(axis=1) & (depth > 0)
            )
        near, usual = np.quantile(depth[seen], (0.01, 0.5)) if seen.sum() >= 20 else (0.0, 0.0)
        found.append((NEAREST_SHARE * float(near), float(usual)) if usual > 0 else None)
    return found


def in_front_of(camera: Camera, positions: NDArray[Any], depth: float) -> NDArray[np.bool_]:
    """True [N] where a position [N,3] is pictured by the camera at less than a depth."""
    local = (positions - camera.origin) @ camera.c2w[:3, :3]
    rows = np.flatnonzero((-local[:, 2] > 0) & (-local[:, 2] < depth))
    pixels, _ = camera.project(positions[rows])
    with np.errstate(invalid="ignore"):
        inside = (pixels >= 0).all(axis=1) & (pixels < (camera.width, camera.height)).all(axis=1)
    found = np.zeros(len(positions), bool)
    found[rows[inside]] = True
    return found


def swept_points(
    views: Sequence[TrainingView], positions: Array, wanted: int, seed: int
) -> tuple[Array, NDArray[np.uint8], list[NDArray[np.float32]]]:
    """Surface points (positions, rgb) by plane sweeping the photos, their depths guided by sparse points.

    And, by photo, the distances [H,W] up to which there is nothing.
    """
    sides = [max(camera.width, camera.height) for camera in views[0].cameras]
    level = max([level for level, side in enumerate(sides) if side >= SWEPT_SIDE], default=0)
    cameras = [view.level(level)[0] for view in views]
    empty = [np.zeros((camera.height, camera.width), np.float32) for camera in cameras]
    depths = depths_seen(cameras, positions)
    usable = [n for n, depth in enumerate(depths) if depth is not None]
    size = (cameras[0].width, cameras[0].height)
    usable = [n for n in usable if (cameras[n].width, cameras[n].height) == size]
    images = [_without_masked(views[n], level) for n in usable]
    if len(usable) < 3 or wanted < 1:
        return np.zeros((0, 3)), np.zeros((0, 3), np.uint8), empty
    known = [depth for n in usable if (depth := depths[n]) is not None]
    found = find_surfaces(
        images, [cameras[n] for n in usable], [d[0] for d in known], [d[1] for d in known], wanted, seed
    )
    for n, one in zip(usable, found.empty, strict=True):
        empty[n] = one
    return found.positions, found.rgb, empty


def _add_sightings(
    empty: Sequence[NDArray[np.float32]], views: Sequence[TrainingView], points: SparsePoints | None
) -> None:
    """Writes what sparse points that a photo is known to see say about empty space into its distances."""
    if points is None or not points.seen_by:
        return
    for view, distances in zip(views, empty, strict=True):
        camera = view.cameras[0]
        rows = np.flatnonzero([view.name in names for names in points.seen_by])
        pixels, depth = camera.project(points.positions[rows])
        with np.errstate(invalid="ignore"):
            inside = (
                (pixels >= 0).all(axis=1) & (pixels < (camera.width, camera.height)).all(axis=1) & (depth > 0)
            )
        height, width = distances.shape
        at = (pixels[inside] * (width / camera.width, height / camera.height)).astype(np.int64)
        known = CLEAR * np.linalg.norm(points.positions[rows[inside]] - camera.origin, axis=1)
        before = distances[at[:, 1], at[:, 0]]
        distances[at[:, 1], at[:, 0]] = np.where(before > 0, np.minimum(before, known), known)


def spread(distances: NDArray[np.float32]) -> NDArray[np.float32]:
    """Distances [2,H,W] up to which there is nothing, and how sure that is, from those [H,W] that are known.

    What has no texture lies mostly between things that have: a pixel of which nothing is known takes the
    least that is known around it, in a square that is as small as has it and at most REACH of the photo.
    """
    from scipy.ndimage import minimum_filter

    known = distances > 0
    filled, sure = distances.copy(), known.astype(np.float32)
    far = np.where(known, distances, np.inf).astype(np.float32)
    size, most = 3, REACH * max(distances.shape)
    while size <= most:
        around = minimum_filter(far, size, mode="nearest")
        new = (filled == 0) & np.isfinite(around)
        filled[new], sure[new] = NEARBY * around[new], HEARSAY
        size = 2 * size + 1
    return np.stack([filled, sure])


def _without_masked(view: TrainingView, level: int) -> NDArray[np.uint8]:
    """rgb [H,W,3] of a photo over white; pixels that its mask excludes are gray, without texture."""
    camera, tiles = view.level(level)
    pixels = _over_white(untiled(tiles, camera.width, camera.height))
    valid = view.valid_at(level)
    if valid is not None:
        pixels[~untiled(valid[:, None], camera.width, camera.height)[..., 0]] = 127
    return pixels


def _over_white(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """rgb of pixels with straight alpha, as they are without it."""
    if pixels.shape[2] == 3:
        return pixels
    alpha = pixels[..., 3:].astype(np.float32) / 255.0
    return (pixels[..., :3] * alpha + 255.0 * (1.0 - alpha) + 0.5).astype(np.uint8)


def camera_scale(cameras: Sequence[Camera], bounds: Array) -> float:
    """The median distance of the cameras from the middle of the bounds: the scene's own unit of length."""
    origins = np.stack([camera.origin for camera in cameras])
    median = float(np.median(np.linalg.norm(origins - bounds.mean(axis=0), axis=1)))
    return max(median, 0.1 * float(np.linalg.norm(bounds[1] - bounds[0])))
