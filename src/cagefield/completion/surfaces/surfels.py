"""Surfels (surface elements): a block's visible surfaces, to a fraction of a voxel.

Occlusion and shadows depend on distances of a few voxels, for which the vertices of a grid are too coarse.
A surface is a set of points with normals, each where a ray against its normal has lost half of its light. A
moved part takes its own surfels along, which leaves the part's shade on itself as it is.
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

from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.compute.cancellation import check_cancelled
from cagefield.compute.parallel_parts import map_parts
from cagefield.geometry import hexahedron
from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Float32, Mask

FAR_DISTANCE = 1e9
"""Distance that stands for "beyond the search radius"."""

MAX_BEHIND_COSINE = -0.5
"""Maximum cosine between a surface's normal and the offset of a point that is behind the surface."""

MIN_PASSED_SHARE = 0.9
"""Share of a segment within which a surface must lie for the segment to cross the surface."""

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
    """Distances [M] of points [M,3] to the nearest surface, FAR_DISTANCE beyond `radius`; world units."""

    def __call__(self, points: Array, radius: float = ...) -> NDArray[np.float64]: ...


CELL_OFFSET_SHARE = 0.37
"""Offset of the cells of `Surfels.downsample`, as a share of a cell's edge."""

MAX_CELL_KEY = 2.0**62
"""Number of cells of `Surfels.downsample` that an index of 64 bits holds."""

MAX_CELLS_PER_AXIS = 256
"""Maximum number of cells of a distance grid along its longest axis."""

HIDDEN_DEPTH_VOXELS = 8.0
"""Depth beneath a visible surface up to which a block's own surfels are dropped, voxels."""

DUPLICATE_DISTANCE_VOXELS = 1.5
"""Distance from a visible surface up to which a block's own surfels are duplicates, voxels."""

PART_POINTS = 2048
"""Points of one part of a computation, between which it can be cancelled."""

MIN_SMOOTHING_COSINE = 0.7
"""Minimum cosine between normals that are averaged."""


@dataclass(frozen=True, eq=False)
class Surfels:
    """Points [N,3], world units, and unit normals [N,3], outwards, of surfels."""

    points: Array
    normals: Array

    @cached_property
    def _tree(self) -> cKDTree:
        # Built in half the time of a balanced tree; queries take no longer.
        return cKDTree(self.points, balanced_tree=False, compact_nodes=False)

    def distances_and_sides(self, points: Array, radius: float = np.inf) -> tuple[Array, NDArray[np.bool_]]:
        """(distances [M] of points [M,3] to the nearest surfel, mask [M] of points behind that surfel).

        FAR_DISTANCE and False beyond `radius`, world units.
        """
        distance, behind = np.full(len(points), FAR_DISTANCE), np.zeros(len(points), bool)
        if len(self.points) and len(points):
            distances, rows = self.nearest(points, 1, radius)
            nearest_distance, nearest = distances[:, 0], rows[:, 0]
            in_radius = np.flatnonzero(np.isfinite(nearest_distance))
            distance[in_radius] = nearest_distance[in_radius]
            offset = points[in_radius] - self.points[nearest[in_radius]]
            behind[in_radius] = (offset * self.normals[nearest[in_radius]]).sum(
                axis=1
            ) < MAX_BEHIND_COSINE * nearest_distance[in_radius]
        return distance, behind

    def distance(self, points: Array, radius: float = np.inf) -> NDArray[np.float64]:
        """Distances [M] of points [M,3] to the surface: 0 behind it, FAR_DISTANCE beyond `radius`."""
        distances, behind = self.distances_and_sides(points, radius)
        return np.where(behind, 0.0, distances)

    def occlusion_terms(self, surfels: Surfels, radii: Sequence[float]) -> Array:
        """Occlusion terms max(0, 1 - D(p + r n) / r) [M,R] at surfels (p, n) [M], for increasing radii r.

        D is 0 behind a surface that the segment along the normal crossed. A thin object is often seen from
        one side only: a point before the unseen side is behind the seen one, without a crossing.
        """
        is_inside, free_distance, last_radius = (
            np.zeros(len(surfels.points), bool),
            np.zeros(len(surfels.points)),
            0.0,
        )
        terms = np.zeros((len(surfels.points), len(radii)))
        for k, radius in enumerate(radii):
            distance, behind = self.distances_and_sides(surfels.points + radius * surfels.normals, radius)
            # The surface of the surfel itself is one segment away.
            is_inside = behind & (is_inside | (free_distance < MIN_PASSED_SHARE * (radius - last_radius)))
            free_distance, last_radius = distance, radius
            terms[:, k] = np.clip(1.0 - np.where(is_inside, 0.0, distance) / radius, 0.0, 1.0)
        return terms

    def nearest(self, points: Array, count: int, radius: float) -> tuple[Array, NDArray[np.int64]]:
        """(distances [M,K], rows [M,K]) of the K nearest surfels of points [M,3].

        A neighbor beyond `radius`, world units, has distance inf and row N.
        """
        distances = np.empty((len(points), count))
        rows = np.empty((len(points), count), np.int64)
        tree, neighbors = self._tree, [*range(1, count + 1)]

        def query(part: slice) -> None:
            check_cancelled()
            distances[part], rows[part] = tree.query(points[part], k=neighbors, distance_upper_bound=radius)

        map_parts(query, len(points), PART_POINTS)
        return distances, rows

    def take(self, rows: Mask | NDArray[np.int64]) -> Surfels:
        """Surfels of the given rows or mask."""
        return Surfels(self.points[rows], self.normals[rows])

    def crop_to_block(self, block: GridBlock) -> Surfels:
        """Surfels inside a block."""
        coordinates = block.block_coordinates(self.points)
        return self.take(
            np.asarray(((coordinates >= 0.0) & (coordinates <= np.array(block.shape) - 1.0)).all(axis=1))
        )

    def transform(self, points: Array, jacobian: Array) -> Surfels:
        """Surfels at points [N,3], mapped with Jacobians J [N,3,3]; normals transform with J^-T."""
        normals = np.einsum("nji,nj->ni", np.linalg.inv(jacobian), self.normals)
        return Surfels(points, normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12))

    def downsample(self, edge: float) -> Surfels:
        """Mean surfels of cells of `edge`, world units.

        A cell has one for each dominant axis and sign of its normals.
        """
        check_cancelled()
        if not len(self.points):
            return self
        # Surfaces often lie at whole numbers, where rounding errors would decide on their cells.
        cell = np.floor(self.points / edge + CELL_OFFSET_SHARE).astype(np.int64)
        cell -= cell.min(axis=0)
        if np.prod(cell.max(axis=0) + 1.0) * 6.0 >= MAX_CELL_KEY:
            # Ranks instead of indices: surfaces of an unbounded scene may be millions of cells away.
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
    """Distance function to the nearest of some surfels, sampled on a grid of cells of `edge`, world units.

    The distance is unsigned. A look-up takes constant time, which pays off for long ray marches.
    """
    check_cancelled()
    points = np.concatenate([each.points for each in surfaces])
    if not len(points):
        return lambda points, radius=np.inf: np.full(len(points), FAR_DISTANCE)
    low, high = points.min(axis=0), points.max(axis=0)
    edge = max(edge, float((high - low).max()) / MAX_CELLS_PER_AXIS)
    cell = np.round((points - low) / edge).astype(np.int64)
    occupied = np.zeros(cell.max(axis=0) + 1, bool)
    occupied[tuple(cell.T)] = True
    values = ndimage.distance_transform_edt(~occupied, sampling=edge)

    def distance(points: Array, radius: float = np.inf) -> NDArray[np.float64]:
        cells = ((points - low) / edge).T
        inside = np.clip(cells, 0.0, np.array(occupied.shape)[:, None] - 1.0)
        outside_distance = edge * np.linalg.norm(cells - inside, axis=0)
        return np.asarray(ndimage.map_coordinates(values, inside, np.float64, order=1) + outside_distance)

    return distance


def concatenate_surfels(surfaces: Sequence[Surfels]) -> Surfels:
    """All surfels of a sequence as one set."""
    return Surfels(
        np.concatenate([each.points for each in surfaces]),
        np.concatenate([each.normals for each in surfaces]),
    )


def prefer_visible(surface: Surfels, visible: Surfels, voxel: float) -> Surfels:
    """Visible surfels, and a block's own where no visible one covers them; `voxel` in world units.

    A visible surfel lies at the apparent surface: where a surface is foggy, the solid vertices beneath are
    not.
    """
    if not len(visible.points) or not len(surface.points):
        return surface
    distance, nearest = visible.nearest(surface.points, 1, HIDDEN_DEPTH_VOXELS * voxel)
    has_neighbor = np.isfinite(distance[:, 0])
    row = np.where(has_neighbor, nearest[:, 0], 0)
    is_beneath = ((surface.points - visible.points[row]) * visible.normals[row]).sum(axis=1) < 0.0
    faces_alike = (surface.normals * visible.normals[row]).sum(axis=1) > 0.0
    is_covered = has_neighbor & (
        is_beneath & faces_alike | (distance[:, 0] < DUPLICATE_DISTANCE_VOXELS * voxel)
    )
    return concatenate_surfels([visible, surface.take(~is_covered)])


def extract_surfels(block: GridBlock) -> Surfels:
    """Surfels of a block, at half transmittance along the normals of its surface vertices."""
    check_cancelled()
    vertices = np.argwhere(block.surface)
    if not len(vertices):
        return Surfels(np.zeros((0, 3)), np.zeros((0, 3)))
    normals = block.normals_at(block.surface).astype(np.float64)
    direction = normals / np.array(block.spacing)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)

    def find(part: slice) -> Array:
        return _half_transmittance(block.depth, vertices[part], direction[part])

    g = np.concatenate(map_parts(find, len(vertices), PART_POINTS))
    points = block.world_positions(g)
    return Surfels(points, _smooth_normals(points, normals, 2.5 * max(block.spacing)))


def _half_transmittance(depth: Float32, vertices: NDArray[np.int64], direction: Array) -> Array:
    """Block coordinates [N,3] at which rays against a `direction` [N,3] of vertices lose half of their light.

    depth [X,Y,Z]: optical depth over the edge of a voxel; directions are unit vectors of block coordinates.
    """
    steps = PROBE_START_VOXELS - PROBE_STEP_VOXELS * np.arange(PROBE_COUNT)
    places = vertices + steps[:, None, None] * direction
    values = ndimage.map_coordinates(depth, np.moveaxis(places, -1, 0), order=1, mode="nearest")
    optical_depth = np.cumsum(PROBE_STEP_VOXELS * values, axis=0)
    half = np.minimum(HALF_OPTICAL_DEPTH, 0.5 * optical_depth[-1])
    first = np.argmax(optical_depth >= half, axis=0)
    rows = np.arange(len(vertices))
    # Optical depth grows linearly between two steps.
    missing = half - np.where(first > 0, optical_depth[first - 1, rows], 0.0)
    share = np.clip(missing / np.maximum(PROBE_STEP_VOXELS * values[first, rows], 1e-9), 0.0, 1.0)
    return vertices + (steps[first] - PROBE_STEP_VOXELS * (share - 0.5))[:, None] * direction


def extract_cut_faces(block: GridBlock, cage: Cage) -> Surfels:
    """Surfels, a voxel apart, of a cage's faces where they cut through solid vertices of a block."""
    solid, edge = block.solid.astype(np.float32), max(block.spacing)
    faces = [Surfels(np.zeros((0, 3)), np.zeros((0, 3)))]
    for axis, side in product(range(3), (0.0, 1.0)):
        lengths = np.linalg.norm(hexahedron.jacobian(cage.corners, np.full((1, 3), 0.5))[0], axis=0)
        count = np.ceil(lengths / edge).astype(np.int64)
        count[axis] = 1
        u = (np.stack(np.unravel_index(np.arange(count.prod()), count), axis=1) + 0.5) / count
        u[:, axis] = side
        points = hexahedron.points(cage.corners, u)
        is_solid = block.interpolate(solid, points) > 0.5
        normals = np.linalg.inv(hexahedron.jacobian(cage.corners, u[is_solid]))[:, axis] * (2.0 * side - 1.0)
        faces.append(Surfels(points[is_solid], normals / np.linalg.norm(normals, axis=1, keepdims=True)))
    return concatenate_surfels(faces)


def _smooth_normals(points: Array, normals: Array, radius: float) -> Array:
    """Unit normals [N,3], averaged over points [N,3] within `radius` that face similarly."""
    count = min(SMOOTHING_NEIGHBORS, len(points))
    distances, rows = Surfels(points, normals).nearest(points, count, radius)
    in_radius = np.isfinite(distances)
    rows = np.where(in_radius, rows, 0)
    for _ in range(SMOOTHING_ROUNDS):
        before = normals

        def average(part: slice, before: Array = before) -> Array:
            return average_normals(before[part], before[rows[part]], in_radius[part], MIN_SMOOTHING_COSINE)

        normals = np.concatenate(map_parts(average, len(points), PART_POINTS))
    return normals


def average_normals(normals: Array, neighbors: Array, mask: Mask, min_cosine: float) -> Array:
    """Unit normals [N,3]: averages of the neighbors [N,K,3] in `mask` [N,K].

    Neighbors below `min_cosine` do not count.
    """
    is_similar = mask & (np.einsum("nki,ni->nk", neighbors, normals) > min_cosine)
    mean = np.einsum("nki,nk->ni", neighbors, is_similar.astype(np.float64))
    length = np.linalg.norm(mean, axis=1, keepdims=True)
    return np.where(length > 1e-6, mean / np.maximum(length, 1e-12), normals)
