"""Grid bounds of a VoxelField's training, and their coordinates.

The first grid of a bounded scene fills the data set's box; each later one fills the bounding box of the
vertices stored before. Voxels of bounded scenes are cubes. All grids of an unbounded scene fill the
contracted space around a cube.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.datasets.views import Dataset, View
from cagefield.fields.contraction import uncontract
from cagefield.fields.frusta import in_frusta
from cagefield.training.voxels.grid_state import GridState

INITIAL_OPTICAL_DEPTH = 0.5
"""Optical depth of the first grid along its longest axis."""


@dataclass(frozen=True, eq=False)
class VoxelSpace:
    """Bounds of a training's grids.

    Attributes:
        bounds: [2,3] box of the first grid in world units; the uncontracted cube of a contracted grid.
        near: empty distance around each camera of an unbounded scene in world units, else 0.
        half_extent: half the longest edge of `bounds`.
    """

    bounds: NDArray[np.float64]
    contracted: bool
    near: float
    half_extent: float

    @classmethod
    def from_dataset(cls, dataset: Dataset, near: float) -> VoxelSpace:
        """Space of a data set; `near` is relative to the cameras' median distance to the box center."""
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
        """Gray grid of INITIAL_OPTICAL_DEPTH along the longest axis.

        An unbounded scene's stores only vertices within at least two views.
        """
        box, dims, keep = self.bounds, (resolution,) * 3, None
        if self.contracted:
            keep = _vertices_in_two_views(views, self.bounds, resolution, self.near)
        else:
            box, dims = _cubic_voxels(self.bounds, resolution)
        return GridState.dense(
            box,
            dims,
            opacity=INITIAL_OPTICAL_DEPTH / resolution,
            degree=degree,
            contracted=self.contracted,
            threads=threads,
            keep=keep,
        )

    def refine(self, grid: GridState, resolution: int, degree: int) -> GridState:
        """Grid resampled to `resolution` vertices along the longest axis and an SH degree."""
        if self.contracted:
            return grid.refine(self.bounds, (resolution,) * 3, degree)
        return grid.refine(*_cubic_voxels(grid.support_bounds(), resolution), degree)


def _cubic_voxels(
    box: NDArray[np.float64], resolution: int
) -> tuple[NDArray[np.float64], tuple[int, int, int]]:
    """(box enlarged to a whole number of cubic voxels [2,3], vertices per axis)."""
    voxel = float((box[1] - box[0]).max()) / (resolution - 1)
    n = np.maximum(np.ceil((box[1] - box[0]) / voxel - 1e-6).astype(int) + 1, 2)
    middle = box.mean(axis=0)
    grown = np.stack([middle - (n - 1) * voxel / 2, middle + (n - 1) * voxel / 2])
    return grown, (int(n[0]), int(n[1]), int(n[2]))


def _vertices_in_two_views(
    views: tuple[View, ...], bounds: NDArray[np.float64], resolution: int, near: float
) -> NDArray[np.bool_]:
    """Mask [resolution^3] of a contracted grid's vertices within the frusta of at least two views.

    A single view cannot distinguish a surface from a floater in front of its camera.
    """
    axis = np.linspace(-2.0, 2.0, resolution)
    c = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    points = uncontract(c) * ((bounds[1] - bounds[0]) / 2) + bounds.mean(axis=0)
    return in_frusta([view.camera for view in views], points, near, min_views=min(2, len(views)))
