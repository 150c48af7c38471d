"""Free space around cameras: no splat may stand where a camera was, or between cameras side by side.

A camera at o that sees nothing nearer than r has free space around it in every direction, not only in its
picture: a held-out camera beside it looks into what no training photo shows. The ball around o has the
radius BALL_SHARE r, where nothing is known to stand within it: points on surfaces (sparse points, and points
on which photos agree) end the free space in their direction, so that a wall close behind a camera stays.

Notation: unit directions e; the free radius of a camera is a function of e, constant on cells of a sphere.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cagefield.cameras.camera import Camera
from cagefield.training.splats.initialization import sphere
from cagefield.training.splats.splat_state import SplatState
from cagefield.typing import Array

BALL_SHARE = 0.6
"""Radius of the free ball over the nearest depth that the camera sees."""

SURFACE_SHARE = 0.8
"""Free distance towards a known surface over the distance of the surface."""

CELLS = 96
"""Directions into which a camera's surroundings are divided."""

MIN_POINTS = 2
"""Points on surfaces in a cell and its neighbors, from which on a surface ends the free space."""

NEIGHBOR_CELLS = 7
"""A cell and its nearest neighbors, in which surfaces are looked for."""

SIGMAS = 3.0
"""Extent of a splat: a camera must not lie in the ellipsoid of so many standard deviations."""


class FreeSpace:
    """Free space around cameras: centers [C,3] and free radii [C,CELLS], world units."""

    def __init__(
        self, cameras: Sequence[Camera], nearest: Sequence[float | None], surfaces: NDArray[np.floating]
    ) -> None:
        """`nearest` is each camera's least seen depth, None where unknown; `surfaces` [M,3] are known points.

        Midpoints of neighboring cameras count as cameras, with the smaller depth of the two.
        """
        known = [(camera.origin, depth) for camera, depth in zip(cameras, nearest, strict=True) if depth]
        self.centers: Array = np.array([origin for origin, _ in known]).reshape(-1, 3)
        depths = np.array([depth for _, depth in known], dtype=np.float64)
        if len(known) >= 2:
            distance, other = cKDTree(self.centers).query(self.centers, min(3, len(known)))
            first = np.repeat(np.arange(len(known)), other.shape[1] - 1)
            second, apart = other[:, 1:].ravel(), distance[:, 1:].ravel()
            between = np.minimum(depths[first], depths[second])
            near = apart < between
            middles = 0.5 * (self.centers[first] + self.centers[second])[near]
            self.centers = np.concatenate([self.centers, middles])
            depths = np.concatenate([depths, between[near]])
        self.directions = sphere(CELLS)
        self.neighbors = cKDTree(self.directions).query(self.directions, NEIGHBOR_CELLS)[1]
        self.radii = np.repeat(BALL_SHARE * depths[:, None], CELLS, axis=1)
        self._end_at(np.asarray(surfaces, np.float64))

    def _end_at(self, surfaces: Array) -> None:
        """Shortens radii where surfaces stand nearer."""
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
            ends = np.full((CELLS, MIN_POINTS), np.inf)
            counts = np.zeros(CELLS, np.intp)
            for row in order.tolist():
                at = cell[row]
                if counts[at] < MIN_POINTS:
                    ends[at, counts[at]] = distance[row]
                    counts[at] += 1
            around = np.sort(ends[self.neighbors].reshape(CELLS, -1), axis=1)[:, MIN_POINTS - 1]
            radii[:] = np.minimum(radii, SURFACE_SHARE * around)

    def occupied(self, state: SplatState) -> NDArray[np.bool_]:
        """Splats [N] whose mean is in free space, or whose ellipsoid has a camera in it."""
        found = np.zeros(len(state), dtype=bool)
        if not len(self.centers) or not len(state):
            return found
        means = state.means.astype(np.float64)
        tree, cells = cKDTree(means), cKDTree(self.directions)
        for center, radii in zip(self.centers, self.radii, strict=True):
            rows = np.array(tree.query_ball_point(center, float(radii.max())), dtype=np.intp)
            if len(rows):
                offset = means[rows] - center
                distance = np.linalg.norm(offset, axis=1)
                cell = cells.query(offset / np.maximum(distance, 1e-300)[:, None])[1]
                found[rows[distance < radii[cell]]] = True
        return found | self._surrounds(state, means)

    def _surrounds(self, state: SplatState, means: Array) -> NDArray[np.bool_]:
        """Splats [N] with a camera in their ellipsoid."""
        from cagefield.geometry.quaternions import rotation_matrices

        found = np.zeros(len(means), dtype=bool)
        reach = SIGMAS * np.exp(state.log_scales.max(axis=1).astype(np.float64))
        distance, _ = cKDTree(self.centers).query(means)
        rows = np.flatnonzero(distance < reach)
        if not len(rows):
            return found
        axes = rotation_matrices(state.quaternions[rows].astype(np.float64))
        scales = SIGMAS * np.exp(state.log_scales[rows].astype(np.float64))
        for center in self.centers:
            local = np.einsum("nji,nj->ni", axes, center - means[rows]) / scales
            found[rows[(local * local).sum(axis=1) < 1.0]] = True
        return found
