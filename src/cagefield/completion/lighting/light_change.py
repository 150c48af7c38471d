"""Change of light on a grid block: the ratio of new to old light at the block's vertices."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.completion.surfaces.surface_color import denoise_colors
from cagefield.completion.surfaces.surfels import Surfels
from cagefield.completion.surfaces.visibility import (
    DEPTH_TOLERANCE_VOXELS,
    MIN_VIEWS,
    CameraVisibility,
    count_edited_views,
)
from cagefield.compute.cancellation import check_cancelled
from cagefield.compute.parallel_parts import map_parts
from cagefield.edits import EditMap
from cagefield.edits.patch import NewLight
from cagefield.typing import AnyArray, Array, Mask

MAX_TRUSTED_LOG_GAIN = 0.6
"""Gain of light (log) above which the photographed color is noise, and is inpainted."""

LIGHT_NEIGHBORS = 8
"""Number of surfels over which the light on a vertex is averaged."""

PART_VERTICES = 16_384
"""Number of vertices whose light one thread computes at a time."""

FACING_LOG_WEIGHT = 3.0
"""Log weight of a surfel with the normal of the vertex over one at a right angle to it."""

CELL_VERTICES = 2
"""Vertices along the edge of a cell by which vertices without a change of light are found."""

MAX_LIGHT_DEPTH_VOXELS = 10.0
"""Maximum distance between a surface and a vertex in the surface's light, voxels."""


@dataclass(frozen=True, eq=False)
class LightChange:
    """Log of the ratio of light [N] on the vertices of a mask [X,Y,Z] of a block."""

    mask: Mask
    log_ratio: Array

    @classmethod
    def from_surfels(
        cls, block: GridBlock, surface: Surfels, logs: Array, spacing: float, *, where: Mask | None = None
    ) -> LightChange:
        """Change of light on a block's colored vertices, from log ratios [N] on surfels [N].

        spacing: distance of the surfels, world units. Vertices within MAX_LIGHT_DEPTH_VOXELS of a surface,
        mostly beneath it, show through it, as fields are foggy there. With a mask `where` [X,Y,Z] only of
        its vertices.
        """
        check_cancelled()
        changed_rows = np.flatnonzero(logs)
        mask, log = np.zeros(block.shape, bool), np.zeros(0)
        if len(changed_rows):
            radius = MAX_LIGHT_DEPTH_VOXELS * max(block.spacing)
            mask = _vertices_near(block, surface, logs) & (block.slot >= 0)
            if where is not None:
                mask &= where
            points, normals = block.positions(mask), block.normals_at(mask)

            def mean_logs(part: slice) -> Array:
                return _mean_logs(surface, logs, points[part], normals[part], radius, spacing)

            log = np.concatenate(map_parts(mean_logs, len(points), PART_VERTICES))
            has_surfel = np.isfinite(log)
            mask[mask], log = has_surfel, log[has_surfel]
        return cls(mask, log)

    def combine(self, other: LightChange) -> LightChange:
        """Product of two changes of light on the same block."""
        mask = self.mask | other.mask
        dense = np.zeros(mask.shape)
        for each in (self, other):
            dense[each.mask] += each.log_ratio
        return LightChange(mask, dense[mask])

    def interpolate(self, block: GridBlock, points: Array) -> Array:
        """Log ratio [N] at world points [N,3], from the vertices around that have one; 0 without any."""
        check_cancelled()
        total = block.interpolate(self.mask.astype(np.float32), points)
        return np.asarray(block.interpolate(self.to_array(block), points) / np.maximum(total, 1e-3))

    def to_new_light(self, block: GridBlock) -> NewLight:
        """Change of light for splats, on a regular grid; not of contracted fields."""
        corner = np.zeros(block.shape, bool)
        corner[0, 0, 0] = True
        values = self.to_array(block).astype(np.float32)
        return NewLight(
            block.positions(corner)[0], np.array(block.spacing), values, self.mask.astype(np.float32)
        )

    def to_array(self, block: GridBlock) -> Array:
        """Log ratio [X,Y,Z]; 0 outside the mask."""
        values = np.zeros(block.shape)
        values[self.mask] = self.log_ratio
        return values


def _vertices_near(block: GridBlock, surface: Surfels, logs: Array) -> Mask:
    """Mask [X,Y,Z] of the vertices whose light may change with log ratios [N] on surfels.

    The light of all others stays: none of the surfels from which it is averaged (`_mean_logs`) has changed.
    Decided by cells of CELL_VERTICES^3 vertices: with h the distance of a cell's middle to its vertices, a
    changed surfel is among the K nearest ones of a vertex only if it is at most 2 h further from the middle
    than the K-th nearest.
    """
    mask, changed = np.zeros(block.shape, bool), surface.take(np.flatnonzero(logs))
    g = block.block_coordinates(changed.points)
    low = np.maximum(np.floor(g.min(axis=0) - MAX_LIGHT_DEPTH_VOXELS).astype(np.int64), 0)
    high = np.minimum(np.ceil(g.max(axis=0) + MAX_LIGHT_DEPTH_VOXELS).astype(np.int64) + 1, block.shape)
    count = -(np.minimum(low - high, 0) // CELL_VERTICES)
    if not count.all():
        return mask
    middles = low + CELL_VERTICES * np.argwhere(np.ones(count, bool)) + 0.5 * (CELL_VERTICES - 1)
    points = block.world_positions(middles)
    h = _cell_radii(block, middles, points)
    radius = MAX_LIGHT_DEPTH_VOXELS * max(block.spacing) + float(h.max())
    to_changed = changed.nearest(points, 1, radius)[0][:, 0]
    near = np.flatnonzero(np.isfinite(to_changed))
    to_last = surface.nearest(points[near], LIGHT_NEIGHBORS, radius)[0][:, -1]
    may_change = np.zeros(len(points), bool)
    may_change[near] = to_changed[near] <= to_last + 2.0 * h[near]
    cells = may_change.reshape(count)
    for axis in range(3):
        cells = np.repeat(cells, CELL_VERTICES, axis=axis)
    box = tuple(slice(first, end) for first, end in zip(low, high, strict=True))
    mask[box] = cells[tuple(slice(0, n) for n in high - low)]
    return mask


def _cell_radii(block: GridBlock, middles: Array, points: Array) -> Array:
    """Distances [N] of the middles of cells to their vertices, world units; contracted fields have many.

    middles [N,3]: block coordinates of the middles; points [N,3]: their world positions.
    """
    reach = 0.5 * (CELL_VERTICES - 1)
    if not block.field.contracted:
        return np.full(len(points), reach * float(np.linalg.norm(block.spacing)))
    corners = (middles + reach * np.array(signs) for signs in product((-1.0, 1.0), repeat=3))
    distances = [np.linalg.norm(block.world_positions(each) - points, axis=1) for each in corners]
    return np.asarray(np.max(distances, axis=0))


def _mean_logs(
    surface: Surfels, logs: Array, points: Array, normals: AnyArray, radius: float, spacing: float
) -> Array:
    """Means [M] of log ratios [N] over the surfels around vertices at points [M,3] with normals [M,3].

    NaN where no surfel is within `radius`, world units.
    """
    distance, rows = surface.nearest(points, LIGHT_NEIGHBORS, radius)
    has_surfel = np.isfinite(distance[:, 0])
    distance, rows = distance[has_surfel], rows[has_surfel]
    rows = np.where(np.isfinite(distance), rows, rows[:, :1])
    # Around an edge each side has its own light; a thin object shows the vertices of both sides.
    facing = np.abs(np.einsum("nkc,nc->nk", surface.normals[rows], normals[has_surfel]))
    weight = np.exp(-0.5 * (distance**2 - distance[:, :1] ** 2) / spacing**2 + FACING_LOG_WEIGHT * facing)
    means = np.full(len(points), np.nan)
    means[has_surfel] = (weight * logs[rows]).sum(axis=1) / weight.sum(axis=1)
    return means


def apply_light(block: GridBlock, light: LightChange | None) -> GridBlock:
    """Block whose colors are denoised and multiplied by a change of light; None changes nothing."""
    if light is None:
        return block
    return denoise_colors(block, light.mask, light.log_ratio).scale_colors(
        light.mask, np.exp(light.log_ratio)
    )


def is_reliable(
    points: Array, below: EditMap, visibility: CameraVisibility, block: GridBlock, light: LightChange | None
) -> NDArray[np.bool_]:
    """Mask [N] of surface points [N,3] that cameras saw well enough for the new light of a block.

    A point is reliable if MIN_VIEWS cameras see it, and its light gains at most MAX_TRUSTED_LOG_GAIN.
    """
    is_seen = (
        count_edited_views(points, below, visibility, DEPTH_TOLERANCE_VOXELS * max(block.spacing))
        >= MIN_VIEWS
    )
    return is_seen if light is None else is_seen & (light.interpolate(block, points) < MAX_TRUSTED_LOG_GAIN)
