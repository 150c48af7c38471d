"""Voxelization of splats: a voxel field on which patches of splats are computed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.cancellation import check_cancelled
from cagefield.fields.sh import C0
from cagefield.fields.splat_field import SplatField
from cagefield.fields.splat_grid import SplatGrid
from cagefield.fields.voxel_field import VoxelField
from cagefield.typing import Array

MAX_BOUNDS_VOXELS = 128
"""Voxels along the longest edge of the bounds of splats, for the fit of a light model."""

MIN_DEVIATION_VOXELS = 0.6
"""Minimum standard deviation of a splat, voxels: a thinner one falls between vertices."""

SPLAT_RADIUS_DEVIATIONS = 2.5
"""Radius around its mean in which a splat is evaluated, standard deviations."""

MIN_OPTICAL_DEPTH = 0.005
"""Optical depth per voxel below which a vertex is not stored."""

GRID_VERTEX_RANGE = (40, 112)
"""Minimum and maximum number of vertices along the longest edge of a grid."""


def max_voxel_size(box: Array) -> float:
    """Maximum edge of a voxel for a world-space box [2,3], world units."""
    return float((box[1] - box[0]).max()) / GRID_VERTEX_RANGE[0]


def choose_voxel_size(splats: SplatField, box: Array) -> float:
    """Edge of a voxel, world units, that resolves the splats in a world-space box [2,3]."""
    inside = ((splats.means >= box[0]) & (splats.means <= box[1])).all(axis=1)
    largest = max_voxel_size(box)
    smallest = largest * GRID_VERTEX_RANGE[0] / GRID_VERTEX_RANGE[1]
    if not inside.any():
        return largest
    return float(np.clip(splats.take(inside).sample_spacing, smallest, largest))


def voxelize_splats(splats: SplatField, box: Array, voxel: float, *, has_colors: bool = True) -> VoxelField:
    """Voxel field of splats in a world-space box [2,3]: density, and view-independent color, else gray.

    `voxel` is the edge of a voxel, world units; the box grows to a whole number of them.
    """
    count = np.maximum(np.ceil((box[1] - box[0]) / voxel).astype(np.int64), 2) + 1
    low = box.mean(axis=0) - 0.5 * voxel * (count - 1)
    return voxelize_vertices(splats, low, voxel, count, has_colors=has_colors)


def voxelize_vertices(
    splats: SplatField, low: Array, voxel: float, count: NDArray[np.int64], *, has_colors: bool = True
) -> VoxelField:
    """Voxel field of splats at `count` [3] vertices, `voxel` apart from `low` [3] (`voxelize_splats`)."""
    check_cancelled()
    bounds = low + voxel * (count - 1) * np.array([[0.0], [1.0]])
    wide = _widen_splats(splats, bounds, voxel)
    check_cancelled()
    grid = SplatGrid(wide, bounds[0], voxel, (int(count[0]), int(count[1]), int(count[2])))
    density = np.where(grid.covered(SPLAT_RADIUS_DEVIATIONS), grid.density(), np.float32(0.0))
    check_cancelled()
    is_stored = density * voxel > MIN_OPTICAL_DEPTH
    colors = grid.colors(is_stored) if has_colors else np.full((np.count_nonzero(is_stored), 3), 0.5)
    sh = ((colors[:, None] - 0.5) / C0).astype(np.float32)
    return VoxelField(bounds, grid.count, np.flatnonzero(is_stored), density[is_stored], sh)


def voxelize_bounds(splats: SplatField) -> VoxelField:
    """Gray voxel field of splats in their bounds, at the resolution of the fit of a light model."""
    edge = float((splats.bounds[1] - splats.bounds[0]).max())
    return voxelize_splats(splats, splats.bounds, edge / MAX_BOUNDS_VOXELS, has_colors=False)


def _widen_splats(splats: SplatField, bounds: Array, voxel: float) -> SplatField:
    """Splats that reach into a box [2,3], none thinner than MIN_DEVIATION_VOXELS."""
    scales = np.maximum(np.exp(splats.log_scales), np.float32(MIN_DEVIATION_VOXELS * voxel))
    radius = SPLAT_RADIUS_DEVIATIONS * scales.max(axis=1, keepdims=True)
    is_near = (splats.means + radius >= bounds[0]) & (splats.means - radius <= bounds[1])
    rows = np.flatnonzero(is_near.all(axis=1) & (splats.opacities > 0.02))
    return SplatField(
        splats.means[rows],
        np.log(scales[rows]),
        splats.quaternions[rows],
        splats.opacities[rows],
        splats.sh[rows, :1],
        bounds=bounds,
    )
