"""Surface elements: where cameras see a block's surfaces, to a fraction of a voxel.

Openness and shadows are about distances of a few voxels, for which a grid's vertices are too coarse. So a
surface is a set of points with normals, each where a ray along its normal is half stopped. A part that is
moved takes its own along, and the shade of the part on itself stays as it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from cagefield.completion.surfaces.grid_block import GridBlock, world_positions
from cagefield.geometry import hexahedron
from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Mask

FAR_DISTANCE = 1e9
"""A distance beyond all reaches."""

MAX_BEHIND_COSINE = -0.5
"""Cosine between a surface's normal and the way from it to a point, from which on down that is behind it."""

MIN_PASSED_SHARE = 0.9
"""Share of a way within which a surface must lie that the way passes through."""

HALF_OPTICAL_DEPTH = float(np.log(2.0))
"""Optical depth that stops half of the light."""

PROBE_START_VOXELS = 1.5
"""Distance in front of a surface vertex at which the search of its surface begins, voxels."""

PROBE_STEP_VOXELS = 0.25
"""Step of that search, voxels."""

PROBE_COUNT = 17
"""Number of steps of that search."""

SMOOTHING_NEIGHBORS = 12
"""Number of surfels over which a normal is averaged."""

SMOOTHING_ROUNDS = 2
"""Number of rounds of that average."""


class DistanceFunction(Protocol):
    """Distances [M] of points [M,3] to the nearest surface, FAR beyond a reach; world units."""

    def __call__(self, points: Array, reach: float = ...) -> NDArray[np.float64]: ...


CELL_OFFSET_SHARE = 0.37
"""Where the cells of a grid begin, as a share of one."""

MAX_CELLS_PER_AXIS = 256
"""Cells along the longest axis of a grid of distances, at most."""

HIDDEN_DEPTH_VOXELS = 8.0
"""Depth beneath a visible surface up to which a block's own surfels are dropped, voxels."""

DUPLICATE_DISTANCE_VOXELS = 1.5
"""Distance from a visible surface up to which a block's own surfels are duplicates, voxels."""

MIN_SMOOTHING_COSINE = 0.7
"""Least cosine between normals that are much the same."""


@dataclass(frozen=True, eq=False)
class Surfels:
    """Surface elements: points [N,3] and unit normals [N,3], outwards, world units."""

    points: Array
    normals: Array

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.points)

    def sided(self, points: Array, reach: float = np.inf) -> tuple[Array, NDArray[np.bool_]]:
        """(distances [M] of points [M,3] to the nearest surface, which of them [M] are behind that).

        FAR and False beyond `reach`.
        """
        out, behind = np.full(len(points), FAR_DISTANCE), np.zeros(len(points), bool)
        if len(self.points) and len(points):
            found, nearest = self._tree.query(points, distance_upper_bound=reach, workers=-1)
            near = np.flatnonzero(np.isfinite(found))
            out[near] = found[near]
            away = points[near] - self.points[nearest[near]]
            behind[near] = (away * self.normals[nearest[near]]).sum(axis=1) < MAX_BEHIND_COSINE * found[near]
        return out, behind

    def distance(self, points: Array, reach: float = np.inf) -> NDArray[np.float64]:
        """Distances [M] of points [M,3] to the nearest surface: 0 behind it, FAR beyond `reach`."""
        found, behind = self.sided(points, reach)
        return np.where(behind, 0.0, found)

    def nearness(self, at: Surfels, reaches: Sequence[float]) -> Array:
        """max(0, 1 - D(p + r n) / r) [M,R] at surface elements (p, n) [M], for reaches r that grow.

        D is 0 behind a surface that the way along the normal passed through. What is thin is seen from one
        side only, often: what lies before its other side is behind it, and nothing was passed on the way.
        """
        inside, free, last = np.zeros(len(at.points), bool), np.zeros(len(at.points)), 0.0
        out = np.zeros((len(at.points), len(reaches)))
        for k, reach in enumerate(reaches):
            found, behind = self.sided(at.points + reach * at.normals, reach)
            # The surface itself is as near as the way is long.
            inside = behind & (inside | (free < MIN_PASSED_SHARE * (reach - last)))
            free, last = found, reach
            out[:, k] = np.clip(1.0 - np.where(inside, 0.0, found) / reach, 0.0, 1.0)
        return out

    def nearest(self, points: Array, count: int, reach: float) -> tuple[Array, NDArray[np.int64]]:
        """(distances [M,K], rows [M,K]) of the nearest to points [M,3]: inf and N where there are fewer."""
        found, rows = self._tree.query(
            points, k=[*range(1, count + 1)], distance_upper_bound=reach, workers=-1
        )
        return np.asarray(found), np.asarray(rows)

    def take(self, rows: Mask | NDArray[np.int64]) -> Surfels:
        """Some of them."""
        return Surfels(self.points[rows], self.normals[rows])

    def within(self, block: GridBlock) -> Surfels:
        """Those that lie in a block."""
        at = block.coordinates(self.points)
        return self.take(np.asarray(((at >= 0.0) & (at <= np.array(block.shape) - 1.0)).all(axis=1)))

    def turned(self, points: Array, jacobian: Array) -> Surfels:
        """The same once a map with Jacobians [N,3,3] has taken them to points [N,3].

        Normals go with the transposed inverse.
        """
        normals = np.einsum("nji,nj->ni", np.linalg.inv(jacobian), self.normals)
        return Surfels(points, normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12))

    def thinned(self, edge: float) -> Surfels:
        """Means of those that share a cell of an edge, and the axis that they face along the most."""
        if not len(self.points):
            return self
        # Surfaces often lie at whole numbers, where rounding would decide on their cells.
        cell = np.floor(self.points / edge + CELL_OFFSET_SHARE).astype(np.int64)
        # Ranks in place of numbers: what is seen of an unbounded scene may be millions of cells away.
        cell = np.stack([np.unique(column, return_inverse=True)[1] for column in cell.T], axis=1)
        axis = np.argmax(np.abs(self.normals), axis=1)
        side = 2 * axis + (np.take_along_axis(self.normals, axis[:, None], axis=1)[:, 0] > 0.0)
        size = cell.max(axis=0) + 1
        key = np.ravel_multi_index((*cell.T, side), (*size, 6))
        _, group, count = np.unique(key, return_inverse=True, return_counts=True)
        points, normals = (
            np.stack([np.bincount(group, values[:, k]) for k in range(3)], axis=1) / count[:, None]
            for values in (self.points, self.normals)
        )
        return Surfels(points, normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12))


def build_distance_grid(surfaces: Sequence[Surfels], edge: float) -> DistanceFunction:
    """The distance to the nearest of some surfaces on a grid of cells of an edge, both sides alike.

    For long walks: once it is made a look-up costs next to nothing.
    """
    points = np.concatenate([each.points for each in surfaces])
    if not len(points):
        return lambda points, reach=np.inf: np.full(len(points), FAR_DISTANCE)
    low, high = points.min(axis=0), points.max(axis=0)
    edge = max(edge, float((high - low).max()) / MAX_CELLS_PER_AXIS)
    cell = np.round((points - low) / edge).astype(np.int64)
    found = np.zeros(cell.max(axis=0) + 1, bool)
    found[tuple(cell.T)] = True
    values = ndimage.distance_transform_edt(~found, sampling=edge)

    def distance(points: Array, reach: float = np.inf) -> NDArray[np.float64]:
        at = ((points - low) / edge).T
        inside = np.clip(at, 0.0, np.array(found.shape)[:, None] - 1.0)
        beyond = edge * np.linalg.norm(at - inside, axis=0)
        return np.asarray(ndimage.map_coordinates(values, inside, np.float64, order=1) + beyond)

    return distance


def concatenate_surfels(surfaces: Sequence[Surfels]) -> Surfels:
    """The surfaces as one."""
    return Surfels(
        np.concatenate([each.points for each in surfaces]),
        np.concatenate([each.normals for each in surfaces]),
    )


def prefer_visible(surface: Surfels, seen: Surfels, voxel: float) -> Surfels:
    """What is seen of surfaces, and a block's own where nothing is seen of them.

    What is seen is where it seems to be: where a surface is fog, the solid vertices beneath it are not it.
    """
    if not len(seen.points) or not len(surface.points):
        return surface
    found, nearest = seen.nearest(surface.points, 1, HIDDEN_DEPTH_VOXELS * voxel)
    near = np.isfinite(found[:, 0])
    row = np.where(near, nearest[:, 0], 0)
    beneath = ((surface.points - seen.points[row]) * seen.normals[row]).sum(axis=1) < 0.0
    same = (surface.normals * seen.normals[row]).sum(axis=1) > 0.0
    covered = near & (beneath & same | (found[:, 0] < DUPLICATE_DISTANCE_VOXELS * voxel))
    return concatenate_surfels([seen, surface.take(~covered)])


def extract_surfels(block: GridBlock) -> Surfels:
    """The surfaces of a block."""
    at = np.argwhere(block.surface)
    if not len(at):
        return Surfels(np.zeros((0, 3)), np.zeros((0, 3)))
    normals = block.normals[tuple(at.T)].astype(np.float64)
    along = normals / np.array(block.spacing)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    steps = PROBE_START_VOXELS - PROBE_STEP_VOXELS * np.arange(PROBE_COUNT)
    depth = np.stack(
        [
            ndimage.map_coordinates(block.depth, (at + step * along).T, order=1, mode="nearest")
            for step in steps
        ]
    )
    passed = np.cumsum(PROBE_STEP_VOXELS * depth, axis=0)
    full = passed >= np.minimum(HALF_OPTICAL_DEPTH, 0.5 * passed[-1])
    first = np.argmax(full, axis=0)
    each = np.arange(len(at))
    # Between two steps the depth that is passed grows evenly.
    short = np.minimum(HALF_OPTICAL_DEPTH, 0.5 * passed[-1]) - np.where(
        first > 0, passed[first - 1, each], 0.0
    )
    share = np.clip(short / np.maximum(PROBE_STEP_VOXELS * depth[first, each], 1e-9), 0.0, 1.0)
    g = at + (steps[first] - PROBE_STEP_VOXELS * (share - 0.5))[:, None] * along
    middle = 0.5 * (block.stride - 1)
    points = world_positions(block.field, block.stride * g + block.low + middle)
    return Surfels(points, _smooth_normals(points, normals, 2.5 * max(block.spacing)))


def extract_cut_faces(block: GridBlock, cage: Cage) -> Surfels:
    """The faces of a cage where they cut through what is solid in a block, a voxel apart."""
    solid, edge = block.solid.astype(np.float32), max(block.spacing)
    found = [Surfels(np.zeros((0, 3)), np.zeros((0, 3)))]
    for axis, side in product(range(3), (0.0, 1.0)):
        lengths = np.linalg.norm(hexahedron.jacobian(cage.corners, np.full((1, 3), 0.5))[0], axis=0)
        count = np.ceil(lengths / edge).astype(np.int64)
        count[axis] = 1
        u = (np.stack(np.unravel_index(np.arange(count.prod()), count), axis=1) + 0.5) / count
        u[:, axis] = side
        at = hexahedron.points(cage.corners, u)
        inside = block.lookup(solid, at) > 0.5
        normals = np.linalg.inv(hexahedron.jacobian(cage.corners, u[inside]))[:, axis] * (2.0 * side - 1.0)
        found.append(Surfels(at[inside], normals / np.linalg.norm(normals, axis=1, keepdims=True)))
    return concatenate_surfels(found)


def _smooth_normals(points: Array, normals: Array, reach: float) -> Array:
    """Unit normals [N,3], each a mean of those of points [N,3] nearby that face much the same way."""
    count = min(SMOOTHING_NEIGHBORS, len(points))
    found, rows = cKDTree(points).query(
        points, k=[*range(1, count + 1)], distance_upper_bound=reach, workers=-1
    )
    near = np.isfinite(found)
    rows = np.where(near, rows, 0)
    for _ in range(SMOOTHING_ROUNDS):
        normals = average_normals(normals, normals[rows], near, MIN_SMOOTHING_COSINE)
    return normals


def average_normals(normals: Array, beside: Array, near: Mask, cosine: float) -> Array:
    """Unit normals [N,3]: means of those `beside` [N,K,3], `near` [N,K], that face much the same way."""
    alike = near & (np.einsum("nki,ni->nk", beside, normals) > cosine)
    mean = np.einsum("nki,nk->ni", beside, alike.astype(np.float64))
    length = np.linalg.norm(mean, axis=1, keepdims=True)
    return np.where(length > 1e-6, mean / np.maximum(length, 1e-12), normals)
