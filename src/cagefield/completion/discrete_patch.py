"""What one discrete edit took away is filled, and light goes along: on a block of a voxel field's grid."""

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
from cagefield.edits import Edit
from cagefield.edits.options import Clone
from cagefield.edits.patch import Patch
from cagefield.edits.stack import EditStack
from cagefield.fields.voxel_field import VoxelField
from cagefield.typing import Mask

FREE_SPACE_VOXELS = 3.0
"""What is so much before what a camera shows, in voxels, is air."""


@dataclass(frozen=True, eq=False)
class PatchResult:
    """What was worked out for a discrete edit.

    before: the block as the edits below make it; under: with V^c emptied, filled and in its new light; inside
    [X,Y,Z]: V^c; light: on all but the part, and part_light: on the part, None where these stay as they were;
    support: what was filled, None where nothing was.
    """

    work: EditContext
    under: GridBlock
    light: LightChange | None
    part_light: LightChange | None
    support: Support | None

    @property
    def before(self) -> GridBlock:
        return self.work.before

    @property
    def inside(self) -> Mask:
        return self.work.inside

    @cached_property
    def emptied(self) -> GridBlock:
        """The block with V^c emptied, in its new light, before it is filled."""
        return apply_light(self.work.emptied, self.light)


def compute_patch(
    field: VoxelField,
    below: EditStack,
    edit: Edit,
    ambience: LightModel | None,
    *,
    settled: bool = True,
    sight: CameraVisibility | None = None,
    preserve_opacity: bool = True,
    after: VoxelField | None = None,
) -> PatchResult:
    """What a discrete edit of a field makes of it, under the edits below; `ambience` None leaves the light.

    A copy is not filled, as nothing is uncovered. Unless it is `settled`, the part casts no shadow where it
    is moved to, and keeps the light that it had. A paste keeps that in any case, and takes nothing away;
    `after` is the field with it, where the edit does not say that. What cameras did see, by their `sight` of
    the field without edits, is not filled.
    """
    work = EditContext.of(field, below, edit, ambience, settled, preserve_opacity, after, sight)
    lighting = part_light = footprint = support = None
    lit = ambience if ambience is not None and ambience.shows else None
    under, logs, strength = work.emptied, np.zeros(len(work.lit.points)), 1.0
    found = work.support() if edit.source is None else None
    if lit is not None:
        if found is not None:
            strength = fit_shadow_strength(
                work.gone, work.others, work.before, edit.inner, work.sight, lit, found
            )
        logs = strength * work.without_part(lit)
        lighting = LightChange.of(under, work.lit, logs, work.apart)
        under = apply_light(under, lighting)
    if edit.fill == "surroundings" and not edit.keep_source:
        support = found
    if support is not None:
        dark = work.lit.take(logs > MAX_TRUSTED_LOG_GAIN)
        unsure = replace(dark, points=under.coordinates(dark.points))
        footprint = build_footprint(support, work.part, work.close, unsure)
    if footprint is not None and sight is not None:
        footprint = footprint.without_air(
            count_edited_views(footprint.points(under), below, sight, -FREE_SPACE_VOXELS * work.voxel)
            >= MIN_VIEWS
        )
        points = footprint.points(under)
        known = is_reliable(points, below, sight, under, lighting) & ~edit.inner.contains(points)
        footprint = footprint.without(known, work.part)
    if footprint is None or not footprint.hole.any():
        support = footprint = None
    else:
        under = inpaint_support(under, _with_light_change(footprint, under, lighting), work.inside)
    if isinstance(edit.fill, Clone) and not edit.keep_source:
        cages = edit.inner, edit.fill.source
        under = clone_cage(under, below, cages, work.inside, work.surface, preserve_opacity)
    if lit is not None and lighting is not None and work.settled:
        cast, part_light = work.cast(under, footprint, lit, strength)
        under = apply_light(under, cast)
        lighting = lighting.plus(cast)
    return PatchResult(work, under, lighting, part_light, support)


def _with_light_change(footprint: Footprint, block: GridBlock, light: LightChange | None) -> Footprint:
    """The footprint that knows by how much the light on the columns around was changed."""
    if light is None:
        return footprint
    changed = np.zeros(footprint.hole.shape)
    changed[footprint.around] = light.at(block, footprint.points(block, footprint.around))
    return replace(footprint, changed=changed)


def build_patch(
    field: VoxelField,
    below: EditStack,
    edit: Edit,
    ambience: LightModel | None,
    *,
    settled: bool = True,
    sight: CameraVisibility | None = None,
    preserve_opacity: bool = True,
) -> Patch:
    """The patch of a discrete edit of a voxel field, as `made_of` works it out."""
    made = compute_patch(
        field, below, edit, ambience, settled=settled, sight=sight, preserve_opacity=preserve_opacity
    )
    changed = made.under.differs(made.before) | made.inside
    region, under = made.under.around(changed, made.work.region)
    whole = apply_light(made.before, made.part_light)
    if settled and edit.source is None and edit.fill != "none" and not edit.deleted:
        whole = close_cut_end(whole, made.inside, made.work.gone, made.part_light, below, sight)
    part = made.work.shown_part(whole, made.under)
    return Patch(region, under.layer(), None if part is None else part.layer())
