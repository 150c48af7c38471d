"""Splats on a voxel grid: where patches of splats are worked out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cagefield.fields.sh import C0
from cagefield.fields.splat_field import SplatField
from cagefield.fields.splat_mixture import SplatMixture
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.typing import Array, Mask

MAX_BOUNDS_VOXELS = 128
"""Voxels along the longest edge of the bounds of splats of which light is found out about."""

MIN_DEVIATION_VOXELS = 0.6
"""Least standard deviation of a splat, voxels: a thinner one would be missed between vertices."""

SPLAT_RADIUS_DEVIATIONS = 2.5
"""Standard deviations around its mean at which a splat is asked for."""

MIN_OPTICAL_DEPTH = 0.005
"""Optical depth per voxel that is left out."""

GRID_VERTEX_RANGE = (40, 112)
"""Vertices along the longest edge of a grid that splats are worked out on, at least and at most."""


def max_voxel_size(box: Array) -> float:
    """The largest edge that a voxel has for a world-space box [2,3]."""
    return float((box[1] - box[0]).max()) / GRID_VERTEX_RANGE[0]


def choose_voxel_size(splats: SplatField, box: Array) -> float:
    """The edge of a voxel, world units, that shows what splats in a world-space box [2,3] show."""
    inside = ((splats.means >= box[0]) & (splats.means <= box[1])).all(axis=1)
    most = max_voxel_size(box)
    least = most * GRID_VERTEX_RANGE[0] / GRID_VERTEX_RANGE[1]
    if not inside.any():
        return most
    return float(np.clip(splats.take(inside).sample_spacing, least, most))


def voxelize_splats(splats: SplatField, box: Array, voxel: float) -> VoxelField:
    """What splats are in a world-space box [2,3]: densities, and colours that are the same all around.

    `voxel` is a voxel's edge, world units; the box grows to a whole number of them.
    """
    count = np.maximum(np.ceil((box[1] - box[0]) / voxel).astype(np.int64), 2) + 1
    bounds = box.mean(axis=0) + 0.5 * voxel * (count - 1) * np.array([[-1.0], [1.0]])
    near = _widen_splats(splats, bounds, voxel)
    asked = _covered_vertices(near, bounds[0], voxel, count)
    points = (bounds[0] + voxel * np.argwhere(asked)).astype(np.float32)
    vertices = np.flatnonzero(asked)
    density, sh = np.zeros(0, np.float32), np.zeros((0, 1, 3), np.float32)
    if len(near) and len(points):
        mixture = SplatMixture.build(
            near.means, near.log_scales, near.quaternions, near.opacities, near.sh[:, :1]
        )
        density = mixture.grid_sigma(points)
        kept = density * voxel > MIN_OPTICAL_DEPTH
        density, vertices, points = density[kept], vertices[kept], points[kept]
        up = np.tile(np.array([0.0, 0.0, 1.0], np.float32), (len(points), 1, 1))
        sh = ((mixture.evaluate(points, up)[1] - 0.5) / C0).astype(np.float32)
    else:
        vertices = vertices[:0]
    return VoxelField(bounds, (int(count[0]), int(count[1]), int(count[2])), vertices, density, sh)


def voxelize_bounds(splats: SplatField) -> VoxelField:
    """What splats are in their bounds, as coarsely as light is found out about."""
    edge = float((splats.bounds[1] - splats.bounds[0]).max())
    return voxelize_splats(splats, splats.bounds, edge / MAX_BOUNDS_VOXELS)


def _widen_splats(splats: SplatField, bounds: Array, voxel: float) -> SplatField:
    """The splats that reach into a box, none thinner than a vertex can see."""
    scales = np.maximum(np.exp(splats.log_scales), np.float32(MIN_DEVIATION_VOXELS * voxel))
    reach = SPLAT_RADIUS_DEVIATIONS * scales.max(axis=1, keepdims=True)
    seen = (splats.means + reach >= bounds[0]) & (splats.means - reach <= bounds[1])
    rows = np.flatnonzero(seen.all(axis=1) & (splats.opacities > 0.02))
    return SplatField(
        splats.means[rows],
        np.log(scales[rows]),
        splats.quaternions[rows],
        splats.opacities[rows],
        splats.sh[rows, :1],
        bounds=bounds,
    )


def _covered_vertices(splats: SplatField, low: Array, voxel: float, count: NDArray[np.int64]) -> Mask:
    """Vertices [X,Y,Z] of a grid that the boxes of splats cover."""
    axes = rotation_matrices(splats.quaternions.astype(np.float64))
    half = SPLAT_RADIUS_DEVIATIONS * np.sqrt(
        np.einsum("nij,nj->ni", axes**2, np.exp(2.0 * splats.log_scales))
    )
    first = np.clip(np.ceil((splats.means - half - low) / voxel).astype(np.int64), 0, count)
    end = np.clip(np.floor((splats.means + half - low) / voxel).astype(np.int64) + 1, 0, count)
    # Boxes as differences at their corners, whose sums along the axes count how many cover a vertex.
    steps = np.zeros(count + 1, np.int32)
    for corner in range(8):
        upper = np.array([corner & 1, corner >> 1 & 1, corner >> 2 & 1], bool)
        sign = -1 if int(upper.sum()) % 2 else 1
        np.add.at(steps, tuple(np.where(upper, end, first).T), sign)
    covering = steps.cumsum(0).cumsum(1).cumsum(2)[:-1, :-1, :-1]
    return np.asarray(covering > 0)
