"""Lower bounds of the distance to a procedural scene for many points at once, from a lattice of cells.

Every cell stores the distance of its center to all surfaces and the primitives near it: only these primitives
are evaluated at the points in the cell. Far from surfaces the lattice alone is read.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.procedural.parts import PlacedPrimitive
from cagefield.typing import Float32, Int

CELL_SIZE = 0.05
"""Edge of a cell, world units."""

MAX_BOUND = 0.3
"""Largest bound in the lattice, world units; larger distances are not stored."""


@dataclass(frozen=True)
class NearestSurfaces:
    """Signed bounds [N] <= distance to the nearest surface, negative inside; its primitive (-1: none near)
    and instance.
    """

    bound: Float32
    primitive: Int
    instance: Int


class DistanceCells:
    """Signed lower bounds of the distance to placed primitives; equal to the distance within CELL_SIZE of
    surfaces.

    They are equal for parts that are scaled uniformly and shapes whose `distance` is Euclidean; other
    primitives are bounded by the distance in their own frame times their smallest scale.
    """

    def __init__(self, placed: Sequence[PlacedPrimitive]) -> None:
        self.placed = tuple(placed)
        self.bounds = _bounds(self.placed)
        self._origin = (self.bounds[0] - CELL_SIZE).astype(np.float32)
        self._shape = np.ceil((self.bounds[1] + CELL_SIZE - self._origin) / CELL_SIZE).astype(np.intp)
        self._least_scales = [
            np.linalg.svd(item.linear, compute_uv=False)[:, -1].astype(np.float32) for item in self.placed
        ]
        lower_bounds = np.full(int(self._shape.prod()), MAX_BOUND, np.float32)
        cells, primitives, instances = [], [], []
        for index, item in enumerate(self.placed):
            for instance in range(len(item.shift)):
                near, gap = self._cells_around(index, instance)
                lower_bounds[near] = np.minimum(lower_bounds[near], gap)
                near_cells = near[gap <= CELL_SIZE + _HALF_DIAGONAL]
                cells.append(near_cells)
                primitives.append(np.full(len(near_cells), index))
                instances.append(np.full(len(near_cells), instance))
        self._least = lower_bounds
        cell = np.concatenate(cells)
        order = np.argsort(cell, kind="stable")
        self._primitives = np.concatenate(primitives)[order]
        self._instances = np.concatenate(instances)[order]
        counts = np.bincount(cell, minlength=len(lower_bounds))
        self._counts = counts
        self._starts = np.cumsum(counts) - counts

    def __call__(self, points: Float32) -> NearestSurfaces:
        """Bounds at points [3,N] float32, world units, and the nearest primitives within CELL_SIZE."""
        count = points.shape[1]
        primitive, instance = np.full(count, -1, np.intp), np.zeros(count, np.intp)
        low, high = self.bounds.astype(np.float32)[..., None]
        bound = np.linalg.norm(points - np.clip(points, low, high), axis=0).astype(np.float32)
        place = np.floor((points - self._origin[:, None]) / np.float32(CELL_SIZE)).astype(np.intp)
        rows = np.flatnonzero(((place >= 0) & (place < self._shape[:, None])).all(0))
        cell = np.ravel_multi_index(tuple(place[:, rows]), tuple(self._shape))
        center = self._origin[:, None] + (place[:, rows] + np.float32(0.5)) * np.float32(CELL_SIZE)
        coarse = self._least[cell] - np.linalg.norm(points[:, rows] - center, axis=0)
        np.maximum(bound[rows], coarse, out=coarse)
        bound[rows] = coarse
        near = np.flatnonzero(coarse < CELL_SIZE)
        rows, cell = rows[near], cell[near]
        gap, nearest_primitive, nearest_instance = self._evaluate_cells(
            np.ascontiguousarray(points[:, rows]), cell
        )
        bound[rows] = np.where(gap < CELL_SIZE, gap, np.maximum(bound[rows], np.float32(CELL_SIZE)))
        primitive[rows], instance[rows] = nearest_primitive, nearest_instance
        return NearestSurfaces(bound, primitive, instance)

    def _evaluate_cells(self, points: Float32, cell: Int) -> tuple[Float32, Int, Int]:
        """(distance [N], primitive, instance) of the nearest of the primitives stored in each point's
        cell.
        """
        counts = self._counts[cell]
        row = np.repeat(np.arange(len(cell)), counts)
        pair = np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts) + self._starts[cell][row]
        primitives, instances = self._primitives[pair], self._instances[pair]
        gap = np.empty(len(row), np.float32)
        order = np.argsort(primitives, kind="stable")
        edges = np.flatnonzero(np.diff(primitives[order], prepend=-1))
        for rows in np.split(order, edges[1:]) if len(order) else ():
            index = primitives[rows[0]]
            gap[rows] = self._gap(int(index), points[:, row[rows]], instances[rows])
        best = np.full(len(cell), np.inf, np.float32)
        np.minimum.at(best, row, gap)
        nearest_primitive, nearest_instance = np.full(len(cell), -1, np.intp), np.zeros(len(cell), np.intp)
        is_nearest = np.flatnonzero((gap == best[row]) & (gap < CELL_SIZE))
        nearest_primitive[row[is_nearest]], nearest_instance[row[is_nearest]] = (
            primitives[is_nearest],
            instances[is_nearest],
        )
        return best, nearest_primitive, nearest_instance

    def _gap(self, index: int, points: Float32, instance: Int) -> Float32:
        """Bound [N] of one primitive's instances at points [3,N]."""
        item = self.placed[index]
        local = item.local(np.ascontiguousarray(points), instance)
        gap: Float32 = item.primitive.shape.distance(local) * self._least_scales[index][instance]
        return gap

    def _cells_around(self, index: int, instance: int) -> tuple[Int, Float32]:
        """(cells, bounds of one instance at their centers) within MAX_BOUND of its box."""
        item = self.placed[index]
        half = np.abs(item.linear[instance]) @ item.extent + MAX_BOUND
        axes = []
        for axis in range(3):
            first, last = (
                (item.shift[instance, axis] + sign * half[axis] - self._origin[axis]) / CELL_SIZE
                for sign in (-1, 1)
            )
            axes.append(np.arange(max(int(first), 0), min(int(last) + 1, self._shape[axis])))
        places = np.stack(np.meshgrid(*axes, indexing="ij")).reshape(3, -1)
        centers = (self._origin[:, None] + (places + 0.5) * CELL_SIZE).astype(np.float32)
        gap = self._gap(index, centers, np.full(centers.shape[1], instance))
        return np.ravel_multi_index(tuple(places), tuple(self._shape)), gap


_HALF_DIAGONAL = CELL_SIZE * 3**0.5 / 2


def _bounds(placed: Sequence[PlacedPrimitive]) -> NDArray[np.float64]:
    """Box [2,3] that holds the primitives."""
    reach = [np.abs(item.linear) @ item.extent for item in placed]
    low = np.min([(item.shift - r).min(0) for item, r in zip(placed, reach, strict=True)], axis=0)
    high = np.max([(item.shift + r).max(0) for item, r in zip(placed, reach, strict=True)], axis=0)
    return np.stack([low, high]).astype(np.float64)
