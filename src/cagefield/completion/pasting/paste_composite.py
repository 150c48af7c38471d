"""What a paste is put over, shown with it: a layer of both.

The vertices of what is pasted get what the field shows at their place in V, turned, and as dense as V's map
will undo. Where both are dense densities add up, and colours are their mean, weighted with them; where one is
empty the other one is as it was. Densities below 0, which say how far a surface is, give way.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.completion.surfaces.grid_block import (
    VERTICES_PER_BATCH,
    GridBlock,
    extract_block,
    sample_edited_field,
    world_positions,
)
from cagefield.edits import Edit, EditStack
from cagefield.edits.patch import Pasted
from cagefield.fields.voxel_field import VoxelField
from cagefield.typing import Array, Float32, Mask
from cagefield.warps.hexahedron_map import HexahedronMap


def composite_paste(
    field: VoxelField, below: EditStack, edit: Edit, *, preserve_opacity: bool = True
) -> Pasted:
    """What an edit pastes, with what the field under the edits below shows around it in V.

    What is pasted itself where V covers nothing of the field.
    """
    pasted = edit.pasted
    if pasted is None or pasted.part is None or pasted.place is None:
        raise edit.unread()
    block = _layer_block(pasted.part)
    onto = HexahedronMap(edit.deformed, pasted.place)
    stored = ndimage.maximum_filter(_stored_mask(field), 3)
    parts = []
    for begin in range(0, block.density.size, VERTICES_PER_BATCH):
        some = np.arange(begin, min(begin + VERTICES_PER_BATCH, block.density.size))
        at = world_positions(field, np.stack(np.unravel_index(some, block.shape), axis=1) + block.low)
        inside, points, jacobian = _map_points(onto, at)
        near = _is_near(field, below, stored, points)
        if near.any():
            turn = np.asarray(np.linalg.inv(jacobian[near]), np.float64)
            raw, sh = sample_edited_field(field, below, points[near], turn, preserve_opacity=preserve_opacity)
            found = (raw != 0.0) | sh.any(axis=(1, 2))
            parts.append((some[inside][near][found], raw[found], sh[found]))
    if not any((raw > 0.0).any() for _, raw, _ in parts):
        return pasted
    where, raw, sh = (np.concatenate(column) for column in zip(*parts, strict=True))
    return replace(pasted, part=_blend_vertices(block, where, raw, sh).layer())


def _blend_vertices(block: GridBlock, where: NDArray[np.int64], raw: Float32, sh: Float32) -> GridBlock:
    """The block with densities [N] and harmonics [N,K,3] put into vertices, flat indices [N]."""
    density, slot = block.density.copy(), block.slot.copy()
    before, known = density.flat[where], slot.flat[where]
    own = np.zeros_like(sh)
    own[known >= 0] = block.sh[known[known >= 0]]
    both = (before > 0.0) & (raw > 0.0)
    density.flat[where] = np.where(both, before + raw, np.where(known < 0, raw, np.maximum(before, raw)))
    share = np.maximum(raw, 1e-6) / (
        np.maximum(raw, 1e-6) + np.where(known < 0, 0.0, np.maximum(before, 1e-6))
    )
    slot.flat[where] = len(block.sh) + np.arange(len(where))
    mixed = own + share.astype(np.float32)[:, None, None] * (sh - own)
    return replace(block, density=density, slot=slot, sh=np.concatenate([block.sh, mixed]))


def _map_points(onto: HexahedronMap, at: Array) -> tuple[Mask, Array, Array]:
    """(which [N] of some points have an image, the images [M,3], Jacobians [M,3,3]).

    Also of points outside of the cage where the map is affine: its faces are between vertices.
    """
    if onto.affine is None:
        return onto(at)
    A, b = onto.affine
    return np.ones(len(at), bool), at @ A.T + b, np.broadcast_to(A, (len(at), 3, 3))


def _stored_mask(field: VoxelField) -> Mask:
    stored = np.zeros(field.resolution, bool)
    stored.reshape(-1)[field.vertices] = True
    return stored


def _is_near(field: VoxelField, below: EditStack, stored: Mask, points: Array) -> Mask:
    """Which points [N,3] lie beside a vertex that is stored [X,Y,Z], or where edits reach."""
    last = np.array(field.resolution) - 1
    g = np.round(field.grid_coordinates(points)).astype(np.int64)
    near = ((g >= 0) & (g <= last)).all(axis=1)
    near &= stored[tuple(np.clip(g, 0, last).T)]
    for low, high in below.boxes:
        near |= ((points >= low) & (points <= high)).all(axis=1)
    return np.asarray(near)


def _layer_block(layer: VoxelField) -> GridBlock:
    """The block of a layer, whose first and last vertex are stored."""
    ends = np.stack(np.unravel_index(layer.vertices[[0, -1]], layer.resolution), axis=1)
    low, high = world_positions(layer, ends)
    block = extract_block(layer, EditStack(), np.stack([low, high]))
    return block.cropped(ends[0] - block.low, ends[1] - block.low)
