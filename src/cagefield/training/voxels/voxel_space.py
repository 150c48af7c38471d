"""Where a VoxelField's training has its grids: the box they fill, and how rays come into their coordinates.

A bounded scene's first grid fills the data set's box; each later one fills what of the one before is stored.
Their voxels are cubes. An unbounded scene's grids all fill the contracted space around a cube.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.datasets.views import Dataset, View
from cagefield.fields.contraction import uncontract
from cagefield.fields.frusta import in_frusta
from cagefield.training.voxels.grid_state import GridState

FIRST_DEPTH = 0.5
"""Optical depth of the first grid along its longest axis."""


@dataclass(frozen=True, eq=False)
class VoxelSpace:
    """The box of a training's grids.

    Attributes:
        bounds: [2,3] world units, of the first grid; where `contracted`, the cube that is not contracted.
        near: distance from a camera within which an unbounded scene is empty, else 0.
        reach: half the longest edge of `bounds`.
    """

    bounds: NDArray[np.float64]
    contracted: bool
    near: float
    reach: float

    @classmethod
    def of(cls, dataset: Dataset, near: float) -> VoxelSpace:
        """The space of a data set; `near` is relative to the cameras' median distance to its middle."""
        bounds = np.array(dataset.bounds, dtype=np.float64)
        distance = 0.0
        if dataset.unbounded:
            half = (bounds[1] - bounds[0]).max() / 2
            middle = bounds.mean(axis=0)
            bounds = np.stack([middle - half, middle + half])
            distance = near * float(
                np.median([np.linalg.norm(view.camera.origin - middle) for view in dataset.train])
            )
        return cls(bounds, dataset.unbounded, distance, float((bounds[1] - bounds[0]).max()) / 2)

    def first_grid(self, views: tuple[View, ...], resolution: int, degree: int, threads: int) -> GridState:
        """A grey grid of this resolution and SH degree, FIRST_DEPTH deep optically.

        Of an unbounded scene's, the vertices that the views show are stored.
        """
        box, dims, keep = self.bounds, (resolution,) * 3, None
        if self.contracted:
            keep = _seen_vertices(views, self.bounds, resolution, self.near)
        else:
            box, dims = _cubic_voxels(self.bounds, resolution)
        return GridState.dense(
            box,
            dims,
            opacity=FIRST_DEPTH / resolution,
            degree=degree,
            contracted=self.contracted,
            threads=threads,
            keep=keep,
        )

    def refined(self, grid: GridState, resolution: int, degree: int) -> GridState:
        """What a grid stores, on one with this resolution along its longest axis and this SH degree."""
        if self.contracted:
            return grid.refined(self.bounds, (resolution,) * 3, degree)
        return grid.refined(*_cubic_voxels(grid.support(), resolution), degree)


def _cubic_voxels(
    box: NDArray[np.float64], resolution: int
) -> tuple[NDArray[np.float64], tuple[int, int, int]]:
    """The box, grown so that cubic voxels fill it, and its vertices: `resolution` along the longest axis."""
    voxel = float((box[1] - box[0]).max()) / (resolution - 1)
    n = np.maximum(np.ceil((box[1] - box[0]) / voxel - 1e-6).astype(int) + 1, 2)
    middle = box.mean(axis=0)
    grown = np.stack([middle - (n - 1) * voxel / 2, middle + (n - 1) * voxel / 2])
    return grown, (int(n[0]), int(n[1]), int(n[2]))


def _seen_vertices(
    views: tuple[View, ...], bounds: NDArray[np.float64], resolution: int, near: float
) -> NDArray[np.bool_]:
    """Vertices [resolution^3] of a contracted grid that at least two views have in their picture.

    What fewer views see cannot be told from a floater in front of a camera.
    """
    axis = np.linspace(-2.0, 2.0, resolution)
    c = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    points = uncontract(c) * ((bounds[1] - bounds[0]) / 2) + bounds.mean(axis=0)
    return in_frusta([view.camera for view in views], points, near, least=min(2, len(views)))
