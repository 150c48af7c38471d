"""The light of a continuous edit: what it bends takes its contact shadows along.

A sample of the deformed field shows a canonical point; the light on that point is changed before the edit
takes it anywhere. So this light is an edit of its own, right before the continuous one, that moves nothing:
its patch shows the surroundings, and what is between the cages, in the light that falls on it once it is
bent. With F the edit's map to deformed space, the light on a canonical point p with normal n is multiplied by

    o'(F(p), F_*(n)) / o(p, n),

o the openness (`patches.light`) among what is solid, o' among what is solid in deformed space. It is smooth
and worked out on a grid of at most FINEST vertices an axis.
"""

from __future__ import annotations

import numpy as np

from cagefield.cages import Cage
from cagefield.edits import Edit
from cagefield.edits.patch import Patch, SplatPatch
from cagefield.edits.stack import EditStack
from cagefield.fields.voxel import VoxelField
from cagefield.patches.block import Block, block_of
from cagefield.patches.extent import RIM, swept
from cagefield.patches.light import Ambience, Lighting
from cagefield.patches.planes import flattened
from cagefield.patches.surfels import surfels_of
from cagefield.typing import Array
from cagefield.warps.forward import to_deformed

FINEST = 128
"""Vertices along the longest axis of the grid that the light is worked out on."""

UNSEEN = 0.03
"""The log of a change of light that is left out."""


def light_box(edit: Edit, voxel: float, reach: float, falls: Array) -> Array:
    """The box [2,3] (min, max) in which a continuous edit changes the light; arguments as of `patch_box`."""
    assert edit.outer is not None
    margin = 1.5 * reach + RIM * voxel
    return np.asarray(swept(edit.outer.aabb, falls) + margin * np.array([[-1.0], [1.0]]))


def bending_light(block: Block, edit: Edit, ambience: Ambience) -> tuple[Block, Lighting]:
    """(a coarser block, what the light on it is multiplied by) once a continuous edit has bent a block."""
    assert edit.outer is not None
    coarse = block.pooled(max(1, -(-max(block.shape) // FINEST))).reaching(edit.outer.aabb)
    surface, _ = flattened(surfels_of(coarse), max(coarse.spacing))
    if not len(surface.points):
        return coarse, Lighting(np.zeros(coarse.shape, bool), np.zeros(0))
    moved = to_deformed(edit.exact_warp, surface.points, coarse=True)
    bent = surface.turned(moved.points, moved.jacobian)
    log = ambience.log_light([bent], bent) - ambience.log_light([surface], surface)
    log = np.where(np.abs(log) < UNSEEN, 0.0, log)
    return coarse, Lighting.of(coarse, surface, log, 2.0 * max(coarse.spacing))


def bent_block(field: VoxelField, below: EditStack, edit: Edit, ambience: Ambience) -> Block:
    """The block of a voxel field, under the edits below, in which a continuous edit changes the light."""
    return block_of(
        field, below, light_box(edit, float(field.voxel_size.max()), ambience.reach, ambience.falls)
    )


def bent_voxels(
    field: VoxelField, below: EditStack, edit: Edit, ambience: Ambience, block: Block | None = None
) -> Edit | None:
    """The edit that changes the light of a voxel field under a continuous edit; None where none changes.

    `block` is its `bent_block`, where that is known.
    """
    box = light_box(edit, float(field.voxel_size.max()), ambience.reach, ambience.falls)
    block = block or bent_block(field, below, edit, ambience)
    coarse, light = bending_light(block, edit, ambience)
    where = block.slot >= 0
    log = light.at(coarse, block.positions(where))
    log[np.abs(log) < UNSEEN] = 0.0
    relit = block.relit(where, np.exp(log))
    changed = relit.differs(block)
    if not changed.any():
        return None
    region, relit = relit.around(changed, Cage.box(box.mean(axis=0), box[1] - box[0]))
    return light_edit(edit, Patch(region, relit.layer()))


def light_edit(edit: Edit, patch: Patch | SplatPatch) -> Edit:
    """An edit that moves nothing and shows a patch, for what another one does."""
    low, high = patch.region.aabb
    nothing = Cage.box(low, 1e-6 * (high - low))
    return Edit.delete(nothing, name=edit.name).replace(fill="none", relight="none", patch=patch)
