"""Baked ambient occlusion of a scene as modeled: corners and gaps are darker."""

from __future__ import annotations

from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from cagefield.procedural.parts import Part, PlacedPrimitive


class EnclosingSurface(Protocol):
    """Closed surface around the parts, such as the walls of a room."""

    def distance(self, points: NDArray[np.float32]) -> NDArray[np.float32]:
        """Distance [N] of inside points [3,N] to the nearest wall, negative outside."""
        ...


class Occlusion:
    """Openness in [0,1] of surface points of the scene as modeled, from a lattice of distances.

    1 - sum_i w_i max(0, h_i - distance(p + h_i n)) / h_i: distances to other surfaces against those in open
    space.
    """

    taps = ((0.06, 0.45), (0.14, 0.35), (0.28, 0.2))

    def __init__(
        self,
        parts: tuple[Part, ...],
        enclosing: EnclosingSurface | None = None,
        spacing: float = 0.025,
        *,
        aligned_with: Occlusion | None = None,
    ) -> None:
        """Occlusion of `parts` inside `enclosing`, from a lattice with `spacing`.

        `aligned_with`: another occlusion of the same spacing, whose lattice this one's continues: where both
        have the same surfaces they are equal.
        """
        self._parts, self._enclosing, self.spacing, self._aligned_with = (
            parts,
            enclosing,
            spacing,
            aligned_with,
        )

    @cached_property
    def _lattice(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(origin [3], distances [X,Y,Z]) of the union of the parts, up to the reach of the last tap."""
        reach = self.reach
        lows = np.min([part.bounds[0] for part in self._parts], 0) - reach
        highs = np.max([part.bounds[1] for part in self._parts], 0) + reach
        if self._aligned_with is not None:
            node = self._aligned_with._lattice[0].astype(np.float64)
            lows = node + np.floor((lows - node) / self.spacing + 1e-3) * self.spacing
        axes = [np.arange(lo, hi + self.spacing, self.spacing) for lo, hi in zip(lows, highs, strict=True)]
        lattice = np.full([len(axis) for axis in axes], reach, np.float32)
        for part in self._parts:
            for primitive in part.primitives:
                placed = PlacedPrimitive.build(part, primitive)
                for number, center in enumerate(placed.shift):
                    half = np.abs(placed.linear[number]) @ placed.extent + np.float32(reach)
                    box = tuple(
                        slice(*np.searchsorted(axis, (c - h, c + h)))
                        for axis, c, h in zip(axes, center, half, strict=True)
                    )
                    grid = np.meshgrid(
                        *(axis[cut] for axis, cut in zip(axes, box, strict=True)), indexing="ij"
                    )
                    points = np.stack(grid).reshape(3, -1).astype(np.float32)
                    distance = placed.distance(points, np.full(points.shape[1], number))
                    lattice[box] = np.minimum(lattice[box], distance.reshape(grid[0].shape))
        return lows.astype(np.float32), lattice

    def __call__(self, points: NDArray[np.float32], normals: NDArray[np.float32]) -> NDArray[np.float32]:
        """Openness [N] at points [3,N] with unit normals [3,N], both as modeled."""
        openness = np.ones(points.shape[1], np.float32)
        for height, weight in self.taps:
            distance = self.distance(points + np.float32(height) * normals)
            openness -= np.float32(weight / height) * np.clip(height - distance, 0, height)
        return np.clip(openness, 0, 1)

    @property
    def reach(self) -> float:
        """Largest stored distance; `distance` is no larger."""
        return self.taps[-1][0] + self.spacing

    @property
    def bounds(self) -> NDArray[np.float32]:
        """Box [2,3] outside which no part is within `reach`."""
        origin, lattice = self._lattice
        size = np.array(lattice.shape, np.float32) - 1
        return np.stack([origin, origin + np.float32(self.spacing) * size])

    def distance(self, points: NDArray[np.float32]) -> NDArray[np.float32]:
        """Distance [N] of points [3,N] to the nearest surface as modeled, up to `reach`."""
        distance = self.distance_to_parts(points)
        if self._enclosing is not None:
            np.minimum(distance, self._enclosing.distance(points), out=distance)
        return distance

    def distance_to_parts(self, points: NDArray[np.float32]) -> NDArray[np.float32]:
        """Distance [N] of points [3,N] to the nearest part, without the enclosing surface, up to `reach`."""
        origin, lattice = self._lattice
        lattice_positions = (points - origin[:, None]) / np.float32(self.spacing)
        distance: NDArray[np.float32] = map_coordinates(lattice, lattice_positions, order=1, mode="nearest")
        return distance
