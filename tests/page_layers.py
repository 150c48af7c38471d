"""Patches made by hand, for tests of what draws them."""

from __future__ import annotations

import numpy as np

from cagefield.edits.patch import Patch
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.typing import Array
from page_fields import lumps


def block_layer(field: VoxelField, box: Array, seed: int = 0) -> VoxelField:
    """A layer of a field of `page_fields.lumps`: other lumps in the block that holds a world-space box [2,3].

    A third of the block along y is as the field's, another empty: layers have no vertices there.
    """
    corners = np.stack(np.meshgrid(*box.T, indexing="ij"), axis=-1).reshape(-1, 3)
    g = field.grid_coordinates(corners)
    low = np.maximum(np.floor(g.min(axis=0)).astype(int) - 1, 0)
    high = np.minimum(np.ceil(g.max(axis=0)).astype(int) + 1, np.array(field.resolution) - 1)
    other = lumps(field.sh_degree, field.contracted, field.resolution, seed + 50)
    vertices, density, sh = [], [], []
    y_ends = low[1] + (high[1] - low[1]) * np.array([1, 2]) // 3
    for source, first, last in ((field, low[1], y_ends[0]), (other, y_ends[1], high[1])):
        at = np.stack(np.unravel_index(source.vertices, source.resolution), axis=1)
        inside = ((at >= low) & (at <= high)).all(axis=1) & (at[:, 1] >= first) & (at[:, 1] <= last)
        vertices.append(source.vertices[inside])
        density.append(source.density[inside])
        sh.append(source.sh[inside])
    ends = np.ravel_multi_index(tuple(np.stack([low, high], axis=1)), field.resolution)
    bare = ends[~np.isin(ends, np.concatenate(vertices))]
    vertices.append(bare)
    density.append(np.zeros(len(bare), np.float32))
    sh.append(np.zeros((len(bare), *field.sh.shape[1:]), np.float32))
    every = np.concatenate(vertices)
    order = np.argsort(every)
    return VoxelField(
        field.bounds,
        field.resolution,
        every[order],
        np.concatenate(density)[order],
        np.concatenate(sh)[order],
        field.contracted,
    )


def patch_by_hand(field: VoxelField, cage: Cage, *, part: bool, margin: float = 0.3, seed: int = 0) -> Patch:
    """A patch with other lumps around a cage, and in it where the `part` has a layer."""
    box = cage.aabb + margin * np.array([[-1.0], [1.0]])
    region = Cage.box(box.mean(axis=0), box[1] - box[0])
    inner = block_layer(field, cage.aabb, seed + 1) if part else None
    return Patch(region, block_layer(field, box, seed), inner)
