"""Patch of one discrete edit of a voxel field: inpainting of the support it uncovers, and relighting."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cagefield.completion.edit_context import EditContext
from cagefield.completion.inpainting.cloning import clone_cage
from cagefield.completion.inpainting.end_caps import close_cut_end
from cagefield.completion.inpainting.support_inpainting import inpaint_support
from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.lighting.light_change import (
    MAX_TRUSTED_LOG_GAIN,
    LightChange,
    apply_light,
    is_reliable,
)
from cagefield.completion.lighting.shadow_strength import fit_shadow_strength
from cagefield.completion.surfaces.footprint import Footprint, build_footprint
from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.completion.surfaces.support_plane import Support
from cagefield.completion.surfaces.visibility import MIN_VIEWS, CameraVisibility, count_edited_views
from cagefield.edits import Delete, Discrete, EditMap, Paste
from cagefield.edits.options import Clone
from cagefield.edits.patch import Pasted, Patch
from cagefield.fields.voxel_field import VoxelField
from cagefield.typing import Mask

FREE_SPACE_VOXELS = 3.0
"""Distance in front of the rendered depth from which on a point lies in free space, voxels."""


@dataclass(frozen=True, eq=False)
class PatchResult:
    """Computed patch of a discrete edit.

    Attributes:
        context: the edit's context.
        under: the block with V^c emptied, inpainted and in its new light.
        light: the change of light on all but the part, None where light stays.
        part_light: the change of light on the part, None where light stays.
        support: the support that was inpainted, None if none was.
    """

    context: EditContext
    under: GridBlock
    light: LightChange | None
    part_light: LightChange | None
    support: Support | None

    @property
    def before(self) -> GridBlock:
        """Block as the edits below make it."""
        return self.context.before

    @property
    def inside(self) -> Mask:
        """Mask [X,Y,Z] of V^c."""
        return self.context.inside

    @cached_property
    def emptied(self) -> GridBlock:
        """Block with V^c emptied, in its new light, before inpainting."""
        return apply_light(self.context.emptied, self.light)


def compute_patch(
    field: VoxelField,
    below: EditMap,
    edit: Discrete,
    model: LightModel | None,
    *,
    include_destination: bool = True,
    visibility: CameraVisibility | None = None,
    preserve_opacity: bool = True,
    after: VoxelField | None = None,
    pasted: Pasted | None = None,
) -> PatchResult:
    """Patch of a discrete edit of a field under the edits below, on a grid block.

    A copy uncovers nothing and inpaints nothing; a paste moreover keeps its own light.

    Args:
        model: the light model, None to leave light as it is.
        include_destination: whether the part casts its shadow, and is relit, at its destination.
        visibility: visible surfaces of the field without edits, which are not inpainted.
        after: the field with a paste, if `edit` does not hold the paste's content.
    """
    context = EditContext.build(
        field, below, edit, model, include_destination, preserve_opacity, after, visibility, pasted
    )
    light = part_light = footprint = support = None
    active_model = model if model is not None and model.has_effect else None
    under, log_change, strength = context.emptied, np.zeros(len(context.light_surfels.points)), 1.0
    part_support = context.find_support() if not isinstance(edit, Paste) else None
    if active_model is not None:
        if part_support is not None:
            strength = fit_shadow_strength(
                context.removed,
                context.surroundings,
                context.before,
                edit.inner,
                context.visibility,
                active_model,
                part_support,
            )
        log_change = strength * context.light_change_without_part(active_model)
        light = LightChange.from_surfels(under, context.light_surfels, log_change, context.light_spacing)
        under = apply_light(under, light)
    if edit.fill == "surroundings" and edit.uncovers:
        support = part_support
    if support is not None:
        shaded = context.light_surfels.take(log_change > MAX_TRUSTED_LOG_GAIN)
        block_shaded = replace(shaded, points=under.block_coordinates(shaded.points))
        footprint = build_footprint(support, context.part, context.contact, block_shaded)
    if footprint is not None and visibility is not None:
        footprint = footprint.remove_free_space(
            count_edited_views(footprint.points(under), below, visibility, -FREE_SPACE_VOXELS * context.voxel)
            >= MIN_VIEWS
        )
        points = footprint.points(under)
        is_known = is_reliable(points, below, visibility, under, light) & ~edit.inner.contains(points)
        footprint = footprint.remove_known(is_known, context.part)
    if footprint is None or not footprint.hole.any():
        support = footprint = None
    else:
        under = inpaint_support(under, _with_light_change(footprint, under, light), context.inside)
    if isinstance(edit.fill, Clone) and edit.uncovers:
        cages = edit.inner, edit.fill.source
        under = clone_cage(under, below, cages, context.inside, context.surface, preserve_opacity)
    if active_model is not None and light is not None and context.include_destination:
        destination_light, part_light = context.light_change_at_destination(
            under, footprint, active_model, strength
        )
        under = apply_light(under, destination_light)
        light = light.combine(destination_light)
    return PatchResult(context, under, light, part_light, support)


def _with_light_change(footprint: Footprint, block: GridBlock, light: LightChange | None) -> Footprint:
    """Footprint with the log ratio of light on its surroundings."""
    if light is None:
        return footprint
    log_change = np.zeros(footprint.hole.shape)
    log_change[footprint.surroundings] = light.interpolate(
        block, footprint.points(block, footprint.surroundings)
    )
    return replace(footprint, log_light_change=log_change)


def build_patch(
    field: VoxelField,
    below: EditMap,
    edit: Discrete,
    model: LightModel | None,
    *,
    include_destination: bool = True,
    visibility: CameraVisibility | None = None,
    preserve_opacity: bool = True,
    pasted: Pasted | None = None,
) -> Patch:
    """Patch of a discrete edit of a voxel field; arguments as in `compute_patch`."""
    result = compute_patch(
        field,
        below,
        edit,
        model,
        include_destination=include_destination,
        visibility=visibility,
        preserve_opacity=preserve_opacity,
        pasted=pasted,
    )
    mask = result.under.changed_from(result.before) | result.inside
    region, under = result.under.crop_to_changes(mask, result.context.region)
    part_block = apply_light(result.before, result.part_light)
    if include_destination and not isinstance(edit, Delete | Paste) and edit.fill != "none":
        part_block = close_cut_end(
            part_block, result.inside, result.context.removed, result.part_light, below, visibility
        )
    part = result.context.extract_part(part_block, result.under)
    return Patch(region, under.to_layer(), None if part is None else part.to_layer())
