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

from cagefield.completion.inpainting.support_inpainting import inpaint_support
from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.lighting.light_change import LightChange
from cagefield.completion.surfaces.footprint import build_footprint
from cagefield.completion.surfaces.grid_block import GridBlock, extract_block
from cagefield.completion.surfaces.patch_bounds import SUPPORT_DISTANCE_VOXELS, extrude_box
from cagefield.completion.surfaces.plane_snapping import flattened
from cagefield.completion.surfaces.support_plane import Support, find_support
from cagefield.completion.surfaces.surface_color import denoise_colors
from cagefield.completion.surfaces.surfels import Surfels, extract_surfels
from cagefield.completion.surfaces.visibility import DEPTH_TOLERANCE_VOXELS, MIN_VIEWS, CameraVisibility
from cagefield.edits import Edit
from cagefield.edits.patch import Patch, SplatPatch
from cagefield.edits.stack import EditStack
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Mask
from cagefield.warps.forward import to_deformed

MAX_VERTICES_PER_AXIS = 128
"""Vertices along the longest axis of the grid that the light is worked out on."""

MIN_FILLED_LOG_GAIN = 0.45
"""Where light is to grow by more than this (log) on what was beneath a part, that is filled. It may well be
behind the part for all cameras but the lowest ones."""

MIN_MARGIN_VOXELS = 24.0
"""How far around what was in deep shade its surroundings are looked at, at least; voxels."""

MIN_BENT_LOG_CHANGE = 0.03
"""The log of a change of light that is left out."""


def light_box(edit: Edit, voxel: float, reach: float, falls: Array) -> Array:
    """The box [2,3] (min, max) in which a continuous edit changes the light; arguments as of `patch_box`."""
    assert edit.outer is not None
    margin = 1.5 * reach + SUPPORT_DISTANCE_VOXELS * voxel
    return np.asarray(extrude_box(edit.outer.aabb, falls) + margin * np.array([[-1.0], [1.0]]))


@dataclass(frozen=True, eq=False)
class BentLight:
    """The light on a coarser block once a continuous edit has bent it.

    light: what the light on the block's vertices is multiplied by; log [N]: the same of the surface elements,
    without what a turn does.
    """

    block: GridBlock
    surface: Surfels
    log: Array
    light: LightChange


def compute_bent_light(block: GridBlock, edit: Edit, ambience: LightModel) -> BentLight:
    """What becomes of the light on a block that a continuous edit bends."""
    assert edit.outer is not None
    coarse = block.pooled(max(1, -(-max(block.shape) // MAX_VERTICES_PER_AXIS))).reaching(edit.outer.aabb)
    surface, _ = flattened(extract_surfels(coarse), max(coarse.spacing))
    if not len(surface.points):
        return BentLight(coarse, surface, np.zeros(0), LightChange(np.zeros(coarse.shape, bool), np.zeros(0)))
    moved = to_deformed(edit.exact_warp, surface.points, coarse=True)
    bent = surface.turned(moved.points, moved.jacobian)
    turned = ambience.log_facing(bent) - ambience.log_facing(surface)
    log = ambience.log_light([bent], bent) - ambience.log_light([surface], surface)
    seen = np.where(np.abs(log) < MIN_BENT_LOG_CHANGE, 0.0, log)
    light = LightChange.of(coarse, surface, seen, 2.0 * max(coarse.spacing))
    return BentLight(coarse, surface, log - turned, light)


def extract_bent_block(field: VoxelField, below: EditStack, edit: Edit, ambience: LightModel) -> GridBlock:
    """The block of a voxel field, under the edits below, in which a continuous edit changes the light."""
    return extract_block(
        field, below, light_box(edit, float(field.voxel_size.max()), ambience.reach, ambience.falls)
    )


def relight_voxels(
    field: VoxelField,
    below: EditStack,
    edit: Edit,
    ambience: LightModel,
    block: GridBlock | None = None,
    sight: CameraVisibility | None = None,
) -> Edit | None:
    """The edit that changes the light of a voxel field under a continuous edit; None where none changes.

    `block` is its `bent_block`, where that is known. What cameras did see, by their `sight` of the field
    without edits, is not filled; nothing is unless the edit's `fill` is "surroundings".
    """
    box = light_box(edit, float(field.voxel_size.max()), ambience.reach, ambience.falls)
    block = block or extract_bent_block(field, below, edit, ambience)
    bent = compute_bent_light(block, edit, ambience)
    relit = apply_bent_light(block, bent)[0]
    if edit.fill == "surroundings":
        relit = inpaint_shaded_support(relit, edit, bent, below, sight)[0]
    changed = relit.differs(block)
    if not changed.any():
        return None
    region, relit = relit.around(changed, Cage.box(box.mean(axis=0), box[1] - box[0]))
    return light_edit(edit, Patch(region, relit.layer()))


def apply_bent_light(block: GridBlock, bent: BentLight) -> tuple[GridBlock, LightChange]:
    """(the block in the light of what was bent, that light on its vertices)."""
    where = block.slot >= 0
    log = bent.light.at(bent.block, block.positions(where))
    log[np.abs(log) < MIN_BENT_LOG_CHANGE] = 0.0
    return denoise_colors(block, where, log).relit(where, np.exp(log)), LightChange(where, log)


def inpaint_shaded_support(
    block: GridBlock, edit: Edit, bent: BentLight, below: EditStack, sight: CameraVisibility | None
) -> tuple[GridBlock, Support | None]:
    """(the block, in its new light, with what the part stood on going on where it was in deep shade, that).

    What was photographed there is noise, which the new light would bring out. The support is None where none
    goes on.
    """
    at = block.coordinates(bent.surface.points)
    dark = bent.log > MIN_FILLED_LOG_GAIN
    if not dark.any():
        return block, None
    # Not all that is bent: what is dark, and as much again around it.
    low, high = at[dark].min(axis=0), at[dark].max(axis=0)
    margin = max(MIN_MARGIN_VOXELS, 0.5 * float((high - low).max()))
    first = np.maximum(np.floor(low - margin), 0.0).astype(np.int64)
    small = block.cropped(first, np.ceil(high + margin).astype(np.int64))
    inside = edit.inner.contains(small.positions(np.ones(small.shape, bool))).reshape(small.shape)
    support = _find_part_support(small, inside, edit, bent, at - first)
    if support is None:
        return block, None
    continued = _inpaint_shaded(small, inside, bent, at - first, dark, support, below, sight)
    if continued is None:
        return block, None
    part = tuple(slice(a, a + n) for a, n in zip(small.low - block.low, small.shape, strict=True))
    density, slot = block.density.copy(), block.slot.copy()
    density[part], slot[part] = continued.density, continued.slot
    whole = replace(block, density=density, slot=slot, sh=continued.sh)
    return whole, replace(support, point=support.point + first, members=support.members + first)


def _find_part_support(
    block: GridBlock, inside: Mask, edit: Edit, bent: BentLight, at: Array
) -> Support | None:
    """What the part, `inside` [X,Y,Z], stands on, or hangs over, of the surfaces [N] at block coordinates."""
    part = block.solid & inside
    if not part.any():
        return None
    away = ndimage.distance_transform_edt(~inside)
    away = np.asarray(ndimage.map_coordinates(away, at.T, order=1, cval=np.inf))
    size = float(np.median(np.subtract(*edit.inner.aabb[::-1]))) / max(block.spacing)
    near = (away > 0.0) & (away < max(SUPPORT_DISTANCE_VOXELS, 0.5 * size))
    return find_support(part, bent.surface, at, near, max(bent.block.spacing))


def _inpaint_shaded(
    block: GridBlock,
    inside: Mask,
    bent: BentLight,
    at: Array,
    dark: NDArray[np.bool_],
    support: Support,
    below: EditStack,
    sight: CameraVisibility | None,
) -> GridBlock | None:
    """The block with a support going on, by surfaces [N] at block coordinates, of which some are dark."""
    part = block.solid & inside
    unsure = Surfels(at[dark], bent.surface.normals[dark])
    footprint = build_footprint(support, part, np.zeros((0, 3)), unsure)
    if footprint is None:
        return None
    points = footprint.points(block)
    known = bent.light.at(bent.block, points) < MIN_FILLED_LOG_GAIN
    if sight is not None:
        # What an edit below made up under the part is filled again: there is more to go by now.
        where = below.to_canonical(points).points
        known &= sight.views_of(where, DEPTH_TOLERANCE_VOXELS * max(block.spacing)) >= MIN_VIEWS
    footprint = footprint.without(known, part)
    changed = np.zeros(footprint.hole.shape)
    changed[footprint.around] = bent.light.at(bent.block, footprint.points(block, footprint.around))
    return inpaint_support(block, replace(footprint, changed=changed), inside, stays=True)


def light_edit(edit: Edit, patch: Patch | SplatPatch) -> Edit:
    """An edit that moves nothing and shows a patch, for what another one does."""
    low, high = patch.region.aabb
    nothing = Cage.box(low, 1e-6 * (high - low))
    return Edit.delete(nothing, name=edit.name).replace(fill="none", relight="none", patch=patch)
