"""Floors, tables and walls: surface elements that lie on large planes are put on them.

A field's surfaces have bumps that nobody sees in its pictures, most of all where they have one colour; light
that is worked out on bumps is blotched. Where many surface elements share a plane they get its normal.

Source: Schnabel, Wahl and Klein, "Efficient RANSAC for point-cloud shape detection" (2007), for the search.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cagefield.completion.surfaces.surfels import Surfels
from cagefield.typing import Array

MAX_PLANES = 4
"""Maximum number of planes."""

TRIALS_PER_PLANE = 120
"""RANSAC hypotheses per plane."""

MAX_SURFELS_PER_TRIAL = 4000
"""Surface elements that are counted in a trial, at most."""

INLIER_DISTANCE_VOXELS = 1.5
"""Maximum distance of an inlier from its plane, voxels."""

MIN_INLIER_COSINE = 0.8
"""Minimum cosine between the normals of an inlier and of its plane."""

MIN_INLIER_SHARE = 0.08
"""Minimum number of surfels on a plane, as a share of all surfels."""

MIN_INLIERS = 40
"""Minimum number of surfels on a plane."""

SNAP_DISTANCE_VOXELS = 3.0
"""Maximum distance from its plane of a surfel that is moved onto the plane, voxels."""

MIN_SNAP_COSINE = 0.6
"""Minimum cosine between the normals of such a surfel and of its plane."""

NEIGHBOR_RADIUS_VOXELS = 8.0
"""Radius in which a surfel's neighbors on the plane are searched, voxels."""

MAX_NEIGHBORS = 24
"""Maximum number of such neighbors."""

MAX_CENTROID_OFFSET_SHARE = 0.5
"""A surfel lies inside a plane's extent if the centroid of its neighbors is nearer than this share of
their mean distance."""


def flattened(
    surface: Surfels, voxel: float, *, seed: int = 0, edges: bool = False
) -> tuple[Surfels, NDArray[np.bool_]]:
    """(the surface elements [N], those on planes with the planes' normals; which of them are on planes).

    With `edges`, what is tilted or off a plane is put on it only amid what surely lies on it: bumps are, and
    the rounded edge of a table, beyond which there is nothing, is not.
    """
    points, normals = surface.points.copy(), surface.normals.copy()
    left = np.ones(len(points), bool)
    chance = np.random.default_rng(seed)
    for _ in range(MAX_PLANES):
        rows = np.flatnonzero(left)
        if len(rows) < MIN_INLIERS:
            break
        found = _plane(points[rows], normals[rows], voxel, chance)
        if found is None:
            break
        centre, normal = found
        height = (points[rows] - centre) @ normal
        facing = normals[rows] @ normal
        on = (np.abs(height) < SNAP_DISTANCE_VOXELS * voxel) & (facing > MIN_SNAP_COSINE)
        if edges:
            sure = on & (np.abs(height) < INLIER_DISTANCE_VOXELS * voxel) & (facing > MIN_INLIER_COSINE)
            on = sure | _amid(
                points[rows] - height[:, None] * normal, on & ~sure, sure, NEIGHBOR_RADIUS_VOXELS * voxel
            )
        on = rows[on]
        if len(on) < max(MIN_INLIERS, MIN_INLIER_SHARE * len(points)):
            break
        points[on] -= ((points[on] - centre) @ normal)[:, None] * normal
        normals[on] = normal
        left[on] = False
    return Surfels(points, normals), ~left


def _amid(
    points: Array, which: NDArray[np.bool_], sure: NDArray[np.bool_], reach: float
) -> NDArray[np.bool_]:
    """Which of some surface elements' points [N] on a plane have others of it, that are sure, all around."""
    out = np.zeros(len(points), bool)
    at = np.flatnonzero(which)
    if not len(at) or not sure.any():
        return out
    found, rows = cKDTree(points[sure]).query(
        points[at], k=[*range(1, MAX_NEIGHBORS + 1)], distance_upper_bound=reach, workers=-1
    )
    near = np.isfinite(found)
    count = np.maximum(near.sum(axis=1), 1)
    away = np.where(near[..., None], points[sure][np.where(near, rows, 0)] - points[at, None], 0.0)
    aside = np.linalg.norm(away.sum(axis=1), axis=1) / count
    out[at] = near[:, 0] & (
        aside < MAX_CENTROID_OFFSET_SHARE * np.where(near, found, 0.0).sum(axis=1) / count
    )
    return out


def _plane(
    points: Array, normals: Array, voxel: float, chance: np.random.Generator
) -> tuple[Array, Array] | None:
    """(a point [3], the normal [3]) of the plane that most surface elements support, None where few do."""
    some = chance.choice(len(points), min(MAX_SURFELS_PER_TRIAL, len(points)), replace=False)
    tried = chance.choice(len(points), min(TRIALS_PER_PLANE, len(points)), replace=False)
    height = points[some] @ normals[tried].T - (points[tried] * normals[tried]).sum(axis=1)
    supports = (np.abs(height) < INLIER_DISTANCE_VOXELS * voxel) & (
        normals[some] @ normals[tried].T > MIN_INLIER_COSINE
    )
    best = tried[int(np.argmax(supports.sum(axis=0)))]
    centre, normal = points[best], normals[best]
    for _ in range(3):
        mine = (np.abs((points - centre) @ normal) < INLIER_DISTANCE_VOXELS * voxel) & (
            normals @ normal > MIN_INLIER_COSINE
        )
        if mine.sum() < MIN_INLIERS:
            return None
        centre = points[mine].mean(axis=0)
        across = np.linalg.eigh(np.cov((points[mine] - centre).T))[1][:, 0]
        normal = across if across @ normal > 0.0 else -across
    return centre, normal
