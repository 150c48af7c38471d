"""Composite of a paste with the field beneath it, as one layer.

Each vertex of the paste gets the field's density and color at its position in V, rotated, with density
corrected for the stretch of V's map. Where both are dense, densities add up, and colors are averaged with
densities as weights; where one is empty, the other stays. Negative densities, which place a surface at
sub-voxel precision, yield.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.completion.surfaces.block_extraction import (
    VERTICES_PER_BATCH,
    extract_block,
    sample_edited_field,
)
from cagefield.completion.surfaces.grid_block import GridBlock, world_positions
from cagefield.edits import EditMap, EditStack, Paste
from cagefield.edits.patch import Pasted
from cagefield.fields.voxel_field import VoxelField
from cagefield.typing import Array, Float32, Mask
from cagefield.warps.hexahedron_map import HexahedronMap


def composite_paste(
    field: VoxelField, below: EditMap, edit: Paste, pasted: Pasted, *, preserve_opacity: bool = True
) -> Pasted:
    """Content of a paste, composited with the field under the edits below in V.

    The paste's own content where V covers no part of the field.
    """
    if pasted.part is None or pasted.place is None:
        raise edit.unread()
    block = _layer_block(pasted.part)
    onto = edit.map_between(pasted.place, edit.deformed).inverse
    stored = ndimage.maximum_filter(_stored_mask(field), 3)
    parts = []
    for begin in range(0, block.density.size, VERTICES_PER_BATCH):
        rows = np.arange(begin, min(begin + VERTICES_PER_BATCH, block.density.size))
        points_in_paste = world_positions(
            field, np.stack(np.unravel_index(rows, block.shape), axis=1) + block.low
        )
        is_mapped, points, jacobian = _map_points(onto, points_in_paste)
        is_near = _is_near(field, below, stored, points)
        if is_near.any():
            inverse_jacobian = np.asarray(np.linalg.inv(jacobian[is_near]), np.float64)
            density, sh = sample_edited_field(
                field, below, points[is_near], inverse_jacobian, preserve_opacity=preserve_opacity
            )
            is_stored = (density != 0.0) | sh.any(axis=(1, 2))
            parts.append((rows[is_mapped][is_near][is_stored], density[is_stored], sh[is_stored]))
    if not any((density > 0.0).any() for _, density, _ in parts):
        return pasted
    where, density, sh = (np.concatenate(column) for column in zip(*parts, strict=True))
    return replace(pasted, part=_blend_vertices(block, where, density, sh).to_layer())


def _blend_vertices(
    block: GridBlock, vertices: NDArray[np.int64], density_below: Float32, sh: Float32
) -> GridBlock:
    """Block with densities [N] and coefficients [N,K,3] blended into vertices `where` [N], flat indices."""
    density, slot = block.density.copy(), block.slot.copy()
    paste_density, paste_slot = density.flat[vertices], slot.flat[vertices]
    paste_sh = np.zeros_like(sh)
    paste_sh[paste_slot >= 0] = block.sh[paste_slot[paste_slot >= 0]]
    both_dense = (paste_density > 0.0) & (density_below > 0.0)
    density.flat[vertices] = np.where(
        both_dense,
        paste_density + density_below,
        np.where(paste_slot < 0, density_below, np.maximum(paste_density, density_below)),
    )
    weight = np.maximum(density_below, 1e-6) / (
        np.maximum(density_below, 1e-6) + np.where(paste_slot < 0, 0.0, np.maximum(paste_density, 1e-6))
    )
    slot.flat[vertices] = len(block.sh) + np.arange(len(vertices))
    mixed = paste_sh + weight.astype(np.float32)[:, None, None] * (sh - paste_sh)
    return replace(block, density=density, slot=slot, sh=np.concatenate([block.sh, mixed]))


def _map_points(onto: HexahedronMap, points: Array) -> tuple[Mask, Array, Array]:
    """(mask [N] of the points with an image, images [M,3], Jacobians [M,3,3]).

    An affine map extends beyond the cage, whose faces lie between vertices.
    """
    if onto.affine is None:
        return onto(points)
    A, b = onto.affine
    return np.ones(len(points), bool), points @ A.T + b, np.broadcast_to(A, (len(points), 3, 3))


def _stored_mask(field: VoxelField) -> Mask:
    """Mask [X,Y,Z] of the stored vertices of a field."""
    stored = np.zeros(field.resolution, bool)
    stored.reshape(-1)[field.vertices] = True
    return stored


def _is_near(field: VoxelField, below: EditMap, stored: Mask, points: Array) -> Mask:
    """Mask [N] of points [N,3] beside a vertex of `stored` [X,Y,Z], or in the boxes of edits."""
    last = np.array(field.resolution) - 1
    g = np.round(field.grid_coordinates(points)).astype(np.int64)
    is_near_stored = ((g >= 0) & (g <= last)).all(axis=1)
    is_near_stored &= stored[tuple(np.clip(g, 0, last).T)]
    for low, high in below.boxes:
        is_near_stored |= ((points >= low) & (points <= high)).all(axis=1)
    return np.asarray(is_near_stored)


def _layer_block(layer: VoxelField) -> GridBlock:
    """Block of a layer, whose first and last vertex are stored."""
    ends = np.stack(np.unravel_index(layer.vertices[[0, -1]], layer.resolution), axis=1)
    low, high = world_positions(layer, ends)
    block = extract_block(layer, EditStack(), np.stack([low, high]))
    return block.crop(ends[0] - block.low, ends[1] - block.low)
