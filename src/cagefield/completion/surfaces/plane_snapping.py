"""Plane snapping of surfels: floors, tables and walls get the normal of their plane.

A field's surfaces have bumps that no photo shows, most of all where they have one color; light computed on
bumps is blotched. RANSAC finds the largest planes, and the surfels on them are moved onto them.

Source: Schnabel, Wahl and Klein, "Efficient RANSAC for point-cloud shape detection" (2007), for the search.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cagefield.completion.surfaces.surfels import Surfels
from cagefield.compute.cancellation import check_cancelled
from cagefield.typing import Array

MAX_PLANES = 4
"""Maximum number of planes."""

TRIALS_PER_PLANE = 120
"""RANSAC hypotheses per plane."""

MAX_SURFELS_PER_TRIAL = 4000
"""Maximum number of surfels on which hypotheses are scored."""

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
"""Maximum distance of a surfel inside a plane's extent from the centroid of its neighbors, as a share of
their mean distance.
"""


def snap_to_planes(
    surface: Surfels, voxel: float, *, seed: int = 0, edges: bool = False
) -> tuple[Surfels, NDArray[np.bool_]]:
    """(surfels [N], snapped to planes; mask [N] of the surfels on planes).

    A surfel on a plane gets the plane's normal, and its projection onto the plane. With `edges`, a surfel
    that is tilted or off its plane is snapped only if inliers of the plane surround it: a bump is snapped,
    the rounded edge of a table is not. `voxel` is in world units.
    """
    check_cancelled()
    points, normals = surface.points.copy(), surface.normals.copy()
    unassigned = np.ones(len(points), bool)
    rng = np.random.default_rng(seed)
    for _ in range(MAX_PLANES):
        rows = np.flatnonzero(unassigned)
        if len(rows) < MIN_INLIERS:
            break
        plane = _fit_plane(points[rows], normals[rows], voxel, rng)
        if plane is None:
            break
        center, normal = plane
        distance = (points[rows] - center) @ normal
        cosine = normals[rows] @ normal
        is_near = (np.abs(distance) < SNAP_DISTANCE_VOXELS * voxel) & (cosine > MIN_SNAP_COSINE)
        if edges:
            is_inlier = (
                is_near & (np.abs(distance) < INLIER_DISTANCE_VOXELS * voxel) & (cosine > MIN_INLIER_COSINE)
            )
            is_near = is_inlier | _is_surrounded(
                points[rows] - distance[:, None] * normal,
                is_near & ~is_inlier,
                is_inlier,
                NEIGHBOR_RADIUS_VOXELS * voxel,
            )
        is_near = rows[is_near]
        if len(is_near) < max(MIN_INLIERS, MIN_INLIER_SHARE * len(points)):
            break
        points[is_near] -= ((points[is_near] - center) @ normal)[:, None] * normal
        normals[is_near] = normal
        unassigned[is_near] = False
    return Surfels(points, normals), ~unassigned


def _is_surrounded(
    points: Array, candidate_mask: NDArray[np.bool_], is_inlier: NDArray[np.bool_], radius: float
) -> NDArray[np.bool_]:
    """Mask [N] of points on a plane, among `candidate_mask` [N], that inliers [N] surround."""
    is_inside = np.zeros(len(points), bool)
    candidates = np.flatnonzero(candidate_mask)
    if not len(candidates) or not is_inlier.any():
        return is_inside
    distance, rows = cKDTree(points[is_inlier]).query(
        points[candidates], k=[*range(1, MAX_NEIGHBORS + 1)], distance_upper_bound=radius, workers=-1
    )
    has_neighbor = np.isfinite(distance)
    count = np.maximum(has_neighbor.sum(axis=1), 1)
    offset = np.where(
        has_neighbor[..., None],
        points[is_inlier][np.where(has_neighbor, rows, 0)] - points[candidates, None],
        0.0,
    )
    centroid_distance = np.linalg.norm(offset.sum(axis=1), axis=1) / count
    is_inside[candidates] = has_neighbor[:, 0] & (
        centroid_distance
        < MAX_CENTROID_OFFSET_SHARE * np.where(has_neighbor, distance, 0.0).sum(axis=1) / count
    )
    return is_inside


def _fit_plane(
    points: Array, normals: Array, voxel: float, rng: np.random.Generator
) -> tuple[Array, Array] | None:
    """(point [3], normal [3]) of the plane with the most inliers, or None below MIN_INLIERS."""
    check_cancelled()
    sample = rng.choice(len(points), min(MAX_SURFELS_PER_TRIAL, len(points)), replace=False)
    hypotheses = rng.choice(len(points), min(TRIALS_PER_PLANE, len(points)), replace=False)
    distance = points[sample] @ normals[hypotheses].T - (points[hypotheses] * normals[hypotheses]).sum(axis=1)
    is_inlier = (np.abs(distance) < INLIER_DISTANCE_VOXELS * voxel) & (
        normals[sample] @ normals[hypotheses].T > MIN_INLIER_COSINE
    )
    best = hypotheses[int(np.argmax(is_inlier.sum(axis=0)))]
    center, normal = points[best], normals[best]
    for _ in range(3):
        is_inlier = (np.abs((points - center) @ normal) < INLIER_DISTANCE_VOXELS * voxel) & (
            normals @ normal > MIN_INLIER_COSINE
        )
        if is_inlier.sum() < MIN_INLIERS:
            return None
        center = points[is_inlier].mean(axis=0)
        axis = np.linalg.eigh(np.cov((points[is_inlier] - center).T))[1][:, 0]
        normal = axis if axis @ normal > 0.0 else -axis
    return center, normal
