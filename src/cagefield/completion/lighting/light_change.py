"""The change of light on a grid block's vertices."""

from __future__ import annotations

from dataclasses import dataclass

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
from cagefield.edits.patch import NewLight
from cagefield.edits.stack import EditStack
from cagefield.typing import Array, Mask

MAX_TRUSTED_LOG_GAIN = 0.6
"""Where light is to grow by more than this (log), what was photographed there is noise: it is filled."""

LIGHT_NEIGHBORS = 8
"""Surface elements that the light on a vertex is the mean of."""

FACING_LOG_WEIGHT = 3.0
"""How much more surface elements count for a vertex that face as it does: e^FACING across an edge."""

MAX_LIGHT_DEPTH_VOXELS = 10.0
"""How far from a surface what shows is lit as it is; voxels."""


@dataclass(frozen=True, eq=False)
class LightChange:
    """The light on some vertices (`where` [X,Y,Z]) of a block: the log of what it is multiplied by, [N]."""

    where: Mask
    log_ratio: Array

    @classmethod
    def of(cls, block: GridBlock, surface: Surfels, logs: Array, apart: float) -> LightChange:
        """The light on a block's coloured vertices, by the logs [N] of its surface, so far apart.

        What lies within DEEP of a surface, mostly beneath it, shows through it, as fields are foggy there.
        """
        changed = np.flatnonzero(logs)
        where, log = np.zeros(block.shape, bool), np.zeros(0)
        if len(changed):
            reach = MAX_LIGHT_DEPTH_VOXELS * max(block.spacing)
            g = block.coordinates(surface.points[changed])
            low = np.maximum(np.floor(g.min(axis=0) - MAX_LIGHT_DEPTH_VOXELS).astype(np.int64), 0)
            high = np.ceil(g.max(axis=0) + MAX_LIGHT_DEPTH_VOXELS).astype(np.int64) + 1
            part = tuple(slice(a, max(a, b)) for a, b in zip(low, high, strict=True))
            where[part] = block.slot[part] >= 0
            found, rows = surface.nearest(block.positions(where), LIGHT_NEIGHBORS, reach)
            near = np.isfinite(found[:, 0])
            found, rows = found[near], rows[near]
            where[where] = near
            rows = np.where(np.isfinite(found), rows, rows[:, :1])
            # Around an edge each side has a light of its own; what is thin shows the vertices of both sides.
            facing = np.abs(np.einsum("nkc,nc->nk", surface.normals[rows], block.normals[where]))
            weight = np.exp(-0.5 * (found**2 - found[:, :1] ** 2) / apart**2 + FACING_LOG_WEIGHT * facing)
            log = (weight * logs[rows]).sum(axis=1) / weight.sum(axis=1)
        return cls(where, log)

    def plus(self, other: LightChange) -> LightChange:
        """Both lights, on vertices of the same block."""
        where = self.where | other.where
        dense = np.zeros(where.shape)
        for each in (self, other):
            dense[each.where] += each.log_ratio
        return LightChange(where, dense[where])

    def at(self, block: GridBlock, points: Array) -> Array:
        """The log of the ratio [N] at points [N,3]: that of the vertices around, 0 where there are none."""
        total = block.lookup(self.where.astype(np.float32), points)
        return np.asarray(block.lookup(self.dense(block), points) / np.maximum(total, 1e-3))

    def on_grid(self, block: GridBlock) -> NewLight:
        """The same, for splats. Not of contracted fields."""
        first = np.zeros(block.shape, bool)
        first[0, 0, 0] = True
        values = self.dense(block).astype(np.float32)
        return NewLight(
            block.positions(first)[0], np.array(block.spacing), values, self.where.astype(np.float32)
        )

    def dense(self, block: GridBlock) -> Array:
        """The log of the ratio [X,Y,Z], 0 elsewhere."""
        out = np.zeros(block.shape)
        out[self.where] = self.log_ratio
        return out


def apply_light(block: GridBlock, light: LightChange | None) -> GridBlock:
    if light is None:
        return block
    return denoise_colors(block, light.where, light.log_ratio).relit(light.where, np.exp(light.log_ratio))


def is_reliable(
    points: Array, below: EditStack, sight: CameraVisibility, block: GridBlock, light: LightChange | None
) -> NDArray[np.bool_]:
    """Which surface points [N,3] cameras saw well enough for a block's new light."""
    known = count_edited_views(points, below, sight, DEPTH_TOLERANCE_VOXELS * max(block.spacing)) >= MIN_VIEWS
    return known if light is None else known & (light.at(block, points) < MAX_TRUSTED_LOG_GAIN)
