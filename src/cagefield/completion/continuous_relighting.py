"""The light of a continuous edit: what it bends takes its contact shadows along.

A sample of the deformed field shows a canonical point; the light on that point is changed before the edit
takes it anywhere. So this light is an edit of its own, right before the continuous one, that moves nothing:
its patch shows the surroundings, and what is between the cages, in the light that falls on it once it is
bent. What the part stood on, or hung over, was hidden or in deep shade: it goes on there, as under a part
that is moved (`completion.inpainting.support_inpainting`). With F the edit's map to deformed space, the
light on a canonical point
p with normal n is multiplied by

    o'(F(p), F_*(n)) / o(p, n),

o the openness (`completion.lighting.ambient_occlusion`) among what is solid, o' among what is solid in
deformed space. It is smooth
and worked out on a grid of at most FINEST vertices an axis.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.completion.inpainting.support_inpainting import rebuilt
from cagefield.completion.lighting.ambient_occlusion import Ambience
from cagefield.completion.lighting.light_change import Lighting
from cagefield.completion.surfaces.footprint import footprint_of
from cagefield.completion.surfaces.grid_block import Block, block_of
from cagefield.completion.surfaces.patch_bounds import RIM, swept
from cagefield.completion.surfaces.plane_snapping import flattened
from cagefield.completion.surfaces.support_plane import Support, support_around
from cagefield.completion.surfaces.surface_color import steadied
from cagefield.completion.surfaces.surfels import Surfels, surfels_of
from cagefield.completion.surfaces.visibility import BEFORE, VIEWS, Sight
from cagefield.edits import Edit
from cagefield.edits.patch import Patch, SplatPatch
from cagefield.edits.stack import EditStack
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Mask
from cagefield.warps.forward import to_deformed

FINEST = 128
"""Vertices along the longest axis of the grid that the light is worked out on."""

DARK = 0.45
"""Where light is to grow by more than this (log) on what was beneath a part, that is filled. It may well be
behind the part for all cameras but the lowest ones."""

AROUND = 24.0
"""How far around what was in deep shade its surroundings are looked at, at least; voxels."""

UNSEEN = 0.03
"""The log of a change of light that is left out."""


def light_box(edit: Edit, voxel: float, reach: float, falls: Array) -> Array:
    """The box [2,3] (min, max) in which a continuous edit changes the light; arguments as of `patch_box`."""
    assert edit.outer is not None
    margin = 1.5 * reach + RIM * voxel
    return np.asarray(swept(edit.outer.aabb, falls) + margin * np.array([[-1.0], [1.0]]))


@dataclass(frozen=True, eq=False)
class Bent:
    """The light on a coarser block once a continuous edit has bent it.

    light: what the light on the block's vertices is multiplied by; log [N]: the same of the surface elements,
    without what a turn does.
    """

    block: Block
    surface: Surfels
    log: Array
    light: Lighting


def bending_light(block: Block, edit: Edit, ambience: Ambience) -> Bent:
    """What becomes of the light on a block that a continuous edit bends."""
    assert edit.outer is not None
    coarse = block.pooled(max(1, -(-max(block.shape) // FINEST))).reaching(edit.outer.aabb)
    surface, _ = flattened(surfels_of(coarse), max(coarse.spacing))
    if not len(surface.points):
        return Bent(coarse, surface, np.zeros(0), Lighting(np.zeros(coarse.shape, bool), np.zeros(0)))
    moved = to_deformed(edit.exact_warp, surface.points, coarse=True)
    bent = surface.turned(moved.points, moved.jacobian)
    turned = ambience.log_facing(bent) - ambience.log_facing(surface)
    log = ambience.log_light([bent], bent) - ambience.log_light([surface], surface)
    seen = np.where(np.abs(log) < UNSEEN, 0.0, log)
    light = Lighting.of(coarse, surface, seen, 2.0 * max(coarse.spacing))
    return Bent(coarse, surface, log - turned, light)


def bent_block(field: VoxelField, below: EditStack, edit: Edit, ambience: Ambience) -> Block:
    """The block of a voxel field, under the edits below, in which a continuous edit changes the light."""
    return block_of(
        field, below, light_box(edit, float(field.voxel_size.max()), ambience.reach, ambience.falls)
    )


def bent_voxels(
    field: VoxelField,
    below: EditStack,
    edit: Edit,
    ambience: Ambience,
    block: Block | None = None,
    sight: Sight | None = None,
) -> Edit | None:
    """The edit that changes the light of a voxel field under a continuous edit; None where none changes.

    `block` is its `bent_block`, where that is known. What cameras did see, by their `sight` of the field
    without edits, is not filled; nothing is unless the edit's `fill` is "surroundings".
    """
    box = light_box(edit, float(field.voxel_size.max()), ambience.reach, ambience.falls)
    block = block or bent_block(field, below, edit, ambience)
    bent = bending_light(block, edit, ambience)
    relit = in_light_of(block, bent)[0]
    if edit.fill == "surroundings":
        relit = filled(relit, edit, bent, below, sight)[0]
    changed = relit.differs(block)
    if not changed.any():
        return None
    region, relit = relit.around(changed, Cage.box(box.mean(axis=0), box[1] - box[0]))
    return light_edit(edit, Patch(region, relit.layer()))


def in_light_of(block: Block, bent: Bent) -> tuple[Block, Lighting]:
    """(the block in the light of what was bent, that light on its vertices)."""
    where = block.slot >= 0
    log = bent.light.at(bent.block, block.positions(where))
    log[np.abs(log) < UNSEEN] = 0.0
    return steadied(block, where, log).relit(where, np.exp(log)), Lighting(where, log)


def filled(
    block: Block, edit: Edit, bent: Bent, below: EditStack, sight: Sight | None
) -> tuple[Block, Support | None]:
    """(the block, in its new light, with what the part stood on going on where it was in deep shade, that).

    What was photographed there is noise, which the new light would bring out. The support is None where none
    goes on.
    """
    at = block.coordinates(bent.surface.points)
    dark = bent.log > DARK
    if not dark.any():
        return block, None
    # Not all that is bent: what is dark, and as much again around it.
    low, high = at[dark].min(axis=0), at[dark].max(axis=0)
    margin = max(AROUND, 0.5 * float((high - low).max()))
    first = np.maximum(np.floor(low - margin), 0.0).astype(np.int64)
    small = block.cropped(first, np.ceil(high + margin).astype(np.int64))
    inside = edit.inner.contains(small.positions(np.ones(small.shape, bool))).reshape(small.shape)
    support = _support(small, inside, edit, bent, at - first)
    if support is None:
        return block, None
    continued = _continued(small, inside, bent, at - first, dark, support, below, sight)
    if continued is None:
        return block, None
    part = tuple(slice(a, a + n) for a, n in zip(small.low - block.low, small.shape, strict=True))
    density, slot = block.density.copy(), block.slot.copy()
    density[part], slot[part] = continued.density, continued.slot
    whole = replace(block, density=density, slot=slot, sh=continued.sh)
    return whole, replace(support, point=support.point + first, members=support.members + first)


def _support(block: Block, inside: Mask, edit: Edit, bent: Bent, at: Array) -> Support | None:
    """What the part, `inside` [X,Y,Z], stands on, or hangs over, of the surfaces [N] at block coordinates."""
    part = block.solid & inside
    if not part.any():
        return None
    away = ndimage.distance_transform_edt(~inside)
    away = np.asarray(ndimage.map_coordinates(away, at.T, order=1, cval=np.inf))
    size = float(np.median(np.subtract(*edit.inner.aabb[::-1]))) / max(block.spacing)
    near = (away > 0.0) & (away < max(RIM, 0.5 * size))
    return support_around(part, bent.surface, at, near, max(bent.block.spacing))


def _continued(
    block: Block,
    inside: Mask,
    bent: Bent,
    at: Array,
    dark: NDArray[np.bool_],
    support: Support,
    below: EditStack,
    sight: Sight | None,
) -> Block | None:
    """The block with a support going on, by surfaces [N] at block coordinates, of which some are dark."""
    part = block.solid & inside
    unsure = Surfels(at[dark], bent.surface.normals[dark])
    footprint = footprint_of(support, part, np.zeros((0, 3)), unsure)
    if footprint is None:
        return None
    points = footprint.points(block)
    known = bent.light.at(bent.block, points) < DARK
    if sight is not None:
        # What an edit below made up under the part is filled again: there is more to go by now.
        where = below.to_canonical(points).points
        known &= sight.views_of(where, BEFORE * max(block.spacing)) >= VIEWS
    footprint = footprint.without(known, part)
    changed = np.zeros(footprint.hole.shape)
    changed[footprint.around] = bent.light.at(bent.block, footprint.points(block, footprint.around))
    return rebuilt(block, replace(footprint, changed=changed), inside, stays=True)


def light_edit(edit: Edit, patch: Patch | SplatPatch) -> Edit:
    """An edit that moves nothing and shows a patch, for what another one does."""
    low, high = patch.region.aabb
    nothing = Cage.box(low, 1e-6 * (high - low))
    return Edit.delete(nothing, name=edit.name).replace(fill="none", relight="none", patch=patch)
