"""Free space around cameras: no splat may stand where a camera was, or between neighboring cameras.

A camera at o that sees nothing nearer than r has free space around it in every direction, not only within its
image: a held-out camera beside it may look into directions that no training photo shows. The free ball around
o has the radius BALL_SHARE r. Known surface points (sparse points, and points on which photos agree) end the
free space in their direction, so that a wall close behind a camera stays.

Notation: unit directions e; the free radius of a camera is a function of e, constant on cells of a sphere.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cagefield.cameras.camera import Camera
from cagefield.training.splats.initialization import fibonacci_sphere
from cagefield.training.splats.splat_state import SplatState
from cagefield.typing import Array

BALL_SHARE = 0.6
"""Radius of the free ball, relative to the least depth in the camera's image."""

SURFACE_SHARE = 0.8
"""Free distance towards a known surface, relative to the surface's distance."""

DIRECTION_CELLS = 96
"""Number of direction cells around a camera."""

MIN_POINTS = 2
"""Minimum number of surface points in a cell and its neighbors that end the free space."""

NEIGHBOR_CELLS = 7
"""Number of cells searched for surface points: the cell and its nearest neighbors."""

EXTENT_SIGMAS = 3.0
"""Extent of the ellipsoid of a splat that must not contain a camera."""


class FreeSpace:
    """Free space around cameras: centers [C,3] and free radii [C,DIRECTION_CELLS], world units."""

    def __init__(
        self, cameras: Sequence[Camera], nearest: Sequence[float | None], surfaces: NDArray[np.floating]
    ) -> None:
        """Free space of cameras with `nearest` depths; `surfaces` [M,3] are known surface points.

        `nearest` is the least depth in each camera's image, None where unknown. Midpoints of neighboring
        cameras count as cameras, with the smaller depth of the two.
        """
        known = [(camera.origin, depth) for camera, depth in zip(cameras, nearest, strict=True) if depth]
        self.centers: Array = np.array([origin for origin, _ in known]).reshape(-1, 3)
        depths = np.array([depth for _, depth in known], dtype=np.float64)
        if len(known) >= 2:
            distance, other = cKDTree(self.centers).query(self.centers, min(3, len(known)))
            first = np.repeat(np.arange(len(known)), other.shape[1] - 1)
            second, separation = other[:, 1:].ravel(), distance[:, 1:].ravel()
            between = np.minimum(depths[first], depths[second])
            is_neighbor = separation < between
            middles = 0.5 * (self.centers[first] + self.centers[second])[is_neighbor]
            self.centers = np.concatenate([self.centers, middles])
            depths = np.concatenate([depths, between[is_neighbor]])
        self.directions = fibonacci_sphere(DIRECTION_CELLS)
        self.neighbors = cKDTree(self.directions).query(self.directions, NEIGHBOR_CELLS)[1]
        self.radii = np.repeat(BALL_SHARE * depths[:, None], DIRECTION_CELLS, axis=1)
        self._shorten_at_surfaces(np.asarray(surfaces, np.float64))

    def _shorten_at_surfaces(self, surfaces: Array) -> None:
        """Shorten the radii at surface points [M,3]."""
        if not len(surfaces) or not len(self.centers):
            return
        tree, cells = cKDTree(surfaces), cKDTree(self.directions)
        for center, radii in zip(self.centers, self.radii, strict=True):
            rows = tree.query_ball_point(center, float(radii[0]) / SURFACE_SHARE)
            if len(rows) < MIN_POINTS:
                continue
            offset = surfaces[rows] - center
            distance = np.linalg.norm(offset, axis=1)
            cell = cells.query(offset / np.maximum(distance, 1e-300)[:, None])[1]
            order = np.argsort(distance)
            ends = np.full((DIRECTION_CELLS, MIN_POINTS), np.inf)
            counts = np.zeros(DIRECTION_CELLS, np.intp)
            for row in order.tolist():
                at = cell[row]
                if counts[at] < MIN_POINTS:
                    ends[at, counts[at]] = distance[row]
                    counts[at] += 1
            around = np.sort(ends[self.neighbors].reshape(DIRECTION_CELLS, -1), axis=1)[:, MIN_POINTS - 1]
            radii[:] = np.minimum(radii, SURFACE_SHARE * around)

    def occupied_mask(self, state: SplatState) -> NDArray[np.bool_]:
        """Mask [N] of splats with their mean in free space, or with a camera in their ellipsoid."""
        mask = np.zeros(len(state), dtype=bool)
        if not len(self.centers) or not len(state):
            return mask
        means = state.means.astype(np.float64)
        tree, cells = cKDTree(means), cKDTree(self.directions)
        for center, radii in zip(self.centers, self.radii, strict=True):
            rows = np.array(tree.query_ball_point(center, float(radii.max())), dtype=np.intp)
            if len(rows):
                offset = means[rows] - center
                distance = np.linalg.norm(offset, axis=1)
                cell = cells.query(offset / np.maximum(distance, 1e-300)[:, None])[1]
                mask[rows[distance < radii[cell]]] = True
        return mask | self._enclosing_mask(state, means)

    def _enclosing_mask(self, state: SplatState, means: Array) -> NDArray[np.bool_]:
        """Mask [N] of splats with a camera in their ellipsoid."""
        from cagefield.geometry.quaternions import rotation_matrices

        mask = np.zeros(len(means), dtype=bool)
        reach = EXTENT_SIGMAS * np.exp(state.log_scales.max(axis=1).astype(np.float64))
        distance, _ = cKDTree(self.centers).query(means)
        rows = np.flatnonzero(distance < reach)
        if not len(rows):
            return mask
        axes = rotation_matrices(state.quaternions[rows].astype(np.float64))
        scales = EXTENT_SIGMAS * np.exp(state.log_scales[rows].astype(np.float64))
        for center in self.centers:
            local = np.einsum("nji,nj->ni", axes, center - means[rows]) / scales
            mask[rows[(local * local).sum(axis=1) < 1.0]] = True
        return mask
