"""Removal of a part: the block around V^c without it, in its new light, with the support inpainted.

Nothing here depends on where the part is put down: all drags of an edit, and all stages of its patch, share
one removal.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cagefield.completion.edit_context import EditContext
from cagefield.completion.inpainting.cloning import clone_cage
from cagefield.completion.inpainting.support_inpainting import inpaint_support
from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.lighting.light_change import (
    MAX_TRUSTED_LOG_GAIN,
    LightChange,
    apply_light,
    is_reliable,
)
from cagefield.completion.lighting.shadow_strength import fit_shadow_strength
from cagefield.completion.surfaces.block_union import part_slices
from cagefield.completion.surfaces.footprint import Footprint, build_footprint
from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.completion.surfaces.near_masks import slices_around
from cagefield.completion.surfaces.support_plane import Support
from cagefield.completion.surfaces.surfels import Surfels, concatenate_surfels, extract_cut_faces
from cagefield.completion.surfaces.visibility import MIN_VIEWS, CameraVisibility, count_edited_views
from cagefield.compute.parallel_parts import run_both
from cagefield.edits import Discrete, EditMap, Paste
from cagefield.edits.options import Clone
from cagefield.edits.patch import Pasted
from cagefield.fields.voxel_field import VoxelField
from cagefield.typing import Array, Mask

PART_MARGIN_VERTICES = 12
"""Margin of vertices around V^c in which a part is inpainted and relit: its surfaces and their normals."""

FREE_SPACE_VOXELS = 3.0
"""Distance in front of the rendered depth from which on a point lies in free space, voxels."""


@dataclass(frozen=True, eq=False)
class Removal:
    """Block around V^c after the removal of the part.

    Attributes:
        context: the edit's context.
        model: the light model, None where light stays.
        under: the block with V^c emptied, inpainted and in its new light.
        light: the change of light on all but the part, None where light stays.
        footprint: the columns that were inpainted, None without any.
        strength: of the part's shade on its support.
    """

    context: EditContext
    model: LightModel | None
    under: GridBlock
    light: LightChange | None
    footprint: Footprint | None
    strength: float

    @property
    def before(self) -> GridBlock:
        """Block as the edits below make it."""
        return self.context.before

    @property
    def inside(self) -> Mask:
        """Mask [X,Y,Z] of V^c."""
        return self.context.inside

    @property
    def support(self) -> Support | None:
        """Support that was inpainted, None if none was."""
        return None if self.footprint is None else self.footprint.support

    @cached_property
    def emptied(self) -> GridBlock:
        """Block with V^c emptied, in its new light, before inpainting."""
        return apply_light(self.context.emptied, self.light)

    @cached_property
    def changed(self) -> Mask:
        """Mask [X,Y,Z] of the vertices that differ from those before, and those of V^c."""
        return np.asarray(self.under.changed_from(self.before) | self.inside)

    @cached_property
    def part_block(self) -> GridBlock:
        """The part of the block before around V^c; all of it where V^c lies beyond the field's grid."""
        if not self.inside.any():
            return self.before
        slices = slices_around(self.inside, PART_MARGIN_VERTICES)
        first, end = (np.array([getattr(each, name) for each in slices]) for name in ("start", "stop"))
        return self.before.crop(first, end - 1).compact()

    @cached_property
    def inside_part(self) -> Mask:
        """Mask [X,Y,Z] of V^c in `part_block`."""
        return self.inside[part_slices(self.before, self.part_block)]

    @cached_property
    def remaining(self) -> Surfels:
        """Surfels after the removal, those of the inpainted columns too."""
        context, footprint = self.context, self.footprint
        if footprint is None:
            return context.remaining
        points = footprint.points(self.under)
        inpainted = Surfels(points, np.broadcast_to(footprint.support.normal, points.shape))
        kept = context.remaining.take(~footprint.contains(context.remaining_coordinates))
        return concatenate_surfels([kept, inpainted])

    @cached_property
    def cut_faces(self) -> Surfels:
        """Surfels of the faces of V^c where they cut through the part: it is solid, not a shell."""
        return extract_cut_faces(self.before, self.context.edit.inner)

    @cached_property
    def log_light_on_part(self) -> Array:
        """Log brightness [N] of the part's surfels in its own place. Only with a light model."""
        assert self.model is not None
        context = self.context
        return self.model.log_light([context.surroundings, context.removed], context.removed)


def remove_part(
    field: VoxelField,
    below: EditMap,
    edit: Discrete,
    model: LightModel | None,
    *,
    visibility: CameraVisibility | None = None,
    preserve_opacity: bool = True,
    surfels: Surfels | None = None,
    after: VoxelField | None = None,
    pasted: Pasted | None = None,
) -> Removal:
    """Removal of the part of a discrete edit of a field under the edits below, on a grid block.

    A copy uncovers nothing and inpaints nothing; a paste moreover keeps its own light.

    Args:
        model: the light model, None to leave light as it is.
        visibility: visible surfaces of the field without edits, which are not inpainted.
        surfels: `extract_field_surfels` of the field, if they are known.
        after: the field with a paste, if `edit` does not hold the paste's content.
        pasted: the content of a paste.
    """
    context = EditContext.build(
        field,
        below,
        edit,
        model,
        visibility,
        preserve_opacity=preserve_opacity,
        surfels=surfels,
        after=after,
        pasted=pasted,
    )
    active_model = model if model is not None and model.has_effect else None
    _ = context.light_surfels  # known before two threads ask for them
    (part_support, strength), log_change = run_both(
        lambda: _find_support(context, active_model),
        lambda: _light_change_without_part(context, active_model),
    )
    log_change = strength * log_change
    support = part_support if edit.fill == "surroundings" and edit.uncovers else None
    (under, light), footprint = run_both(
        lambda: _with_new_light(context, active_model, log_change),
        lambda: _build_footprint(context, support, log_change),
    )
    if footprint is not None and visibility is not None:
        footprint = footprint.remove_free_space(
            count_edited_views(footprint.points(under), below, visibility, -FREE_SPACE_VOXELS * context.voxel)
            >= MIN_VIEWS
        )
        points = footprint.points(under)
        is_known = is_reliable(points, below, visibility, under, light) & ~edit.inner.contains(points)
        footprint = footprint.remove_known(is_known, context.part)
    if footprint is not None and not footprint.hole.any():
        footprint = None
    if footprint is not None:
        under = inpaint_support(under, _with_light_change(footprint, under, light), context.inside)
    if isinstance(edit.fill, Clone) and edit.uncovers:
        cages = edit.inner, edit.fill.source
        under = clone_cage(under, below, cages, context.inside, context.surface, preserve_opacity)
    return Removal(context, active_model, under, light, footprint, strength)


def _find_support(context: EditContext, model: LightModel | None) -> tuple[Support | None, float]:
    """(support that the part stood on, strength of its shade on it)."""
    support = None if isinstance(context.edit, Paste) else context.find_support()
    if support is None or model is None:
        return support, 1.0
    return support, fit_shadow_strength(
        context.removed,
        context.surroundings,
        context.before,
        context.edit.inner,
        context.visibility,
        model,
        support,
    )


def _light_change_without_part(context: EditContext, model: LightModel | None) -> Array:
    """Log ratio of light [N] on the context's `light_surfels` for a strength of 1; 0 where light stays."""
    if model is None:
        return np.zeros(len(context.light_surfels.points))
    return context.light_change_without_part(model)


def _with_new_light(
    context: EditContext, model: LightModel | None, log_change: Array
) -> tuple[GridBlock, LightChange | None]:
    """(block without the part in its new light, change of light or None), by logs [N] on surfels."""
    if model is None:
        return context.emptied, None
    under = context.emptied
    light = LightChange.from_surfels(under, context.light_surfels, log_change, context.light_spacing)
    return apply_light(under, light), light


def _build_footprint(context: EditContext, support: Support | None, log_change: Array) -> Footprint | None:
    """Footprint of the part on its support, deep shade by logs [N] included; None without one."""
    if support is None:
        return None
    shaded = context.light_surfels.take(log_change > MAX_TRUSTED_LOG_GAIN)
    shaded = replace(shaded, points=context.before.block_coordinates(shaded.points))
    return build_footprint(support, context.part, context.contact, shaded)


def _with_light_change(footprint: Footprint, block: GridBlock, light: LightChange | None) -> Footprint:
    """Footprint with the log ratio of light on its surroundings."""
    if light is None:
        return footprint
    log_change = np.zeros(footprint.hole.shape)
    log_change[footprint.surroundings] = light.interpolate(
        block, footprint.points(block, footprint.surroundings)
    )
    return replace(footprint, log_light_change=log_change)
