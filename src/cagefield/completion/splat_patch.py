"""The patch of one edit of splats: worked out on a grid, and given back to splats.

The splats around the edit are put on a voxel grid (`completion.surfaces.splat_voxelization`), where fill and
light are worked out
as for voxel fields (`completion.discrete_patch`, `completion.continuous_relighting`). What the
light is multiplied by is looked up at the
splats' means. What was filled is laid out with new splats (`completion.inpainting.splat_inpainting`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cagefield.completion.continuous_relighting import (
    bending_light,
    filled,
    in_light_of,
    light_box,
    light_edit,
)
from cagefield.completion.discrete_patch import made_of
from cagefield.completion.inpainting.splat_inpainting import NONE, KnownSplats
from cagefield.completion.lighting.ambient_occlusion import Ambience
from cagefield.completion.lighting.light_change import Lighting
from cagefield.completion.surfaces.grid_block import Block, block_of
from cagefield.completion.surfaces.patch_bounds import patch_box
from cagefield.completion.surfaces.splat_voxelization import voxel_for, voxelised
from cagefield.completion.surfaces.visibility import Sight
from cagefield.edits import Edit
from cagefield.edits.options import Clone
from cagefield.edits.patch import NewLight, SplatPatch
from cagefield.edits.stack import EditStack
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.cage import Cage
from cagefield.rendering.splats.bake_splats import where_they_are
from cagefield.rendering.splats.splat_motion import MovedSplats, moved_splats
from cagefield.rendering.splats.splat_provenance import with_pasted
from cagefield.typing import AnyArray, Array, Mask

OTHER = 0.2
"""Splats stay where what was filled has the density that was there, and coefficients that differ by less."""


def splat_patch_of(
    field: SplatField,
    below: EditStack,
    edit: Edit,
    ambience: Ambience | None,
    *,
    settled: bool = True,
    sight: Sight | None = None,
) -> SplatPatch:
    """The patch of a discrete edit of splats under the edits below it; arguments as for `making.made_of`."""
    # Splats overlap: their seams are soft.
    edit = edit.replace(feather=0.0)
    field = with_pasted(field, below.append(edit))
    lit = ambience if ambience is not None and ambience.shows else Ambience((), ())
    place = settled and not edit.deleted
    moved = _around(
        field, moved_splats(field, below), _box_of(edit, patch_box(edit, 0.0, lit.reach, falls=lit.falls))
    )
    splats = where_they_are(field, moved)
    voxel = voxel_for(splats, patch_box(edit, 0.0, lit.reach, settled=place, falls=lit.falls))
    box = patch_box(edit, voxel, lit.reach, settled=place, falls=lit.falls) + 3.0 * voxel * np.array(
        [[-1.0], [1.0]]
    )
    grid = voxelised(splats, _box_of(edit, box), voxel)
    after = None
    if edit.source is not None:
        pasted = _around(field, moved_splats(field, below.append(edit)), box)
        after = voxelised(where_they_are(field, pasted), _box_of(edit, box), voxel)
    made = made_of(
        grid, EditStack(), edit, ambience, settled=settled, sight=None if below.active else sight, after=after
    )
    known, new = KnownSplats.of(field, splats, grid, moved), NONE
    fresh = made.under.differs(made.emptied, OTHER)
    if isinstance(edit.fill, Clone) and not edit.keep_source:
        new = known.cloned(made.under, edit.inner, edit.fill.source)
    elif made.support is not None:
        new = known.filled(made.under, fresh, made.work.region, edit.inner, made.support)
    part = None if made.part_light is None else _new_light(made.before, made.part_light)
    light = _new_light(made.under, made.light)
    return known.patch(field, made.work.region, fresh & ~made.inside, light, part, new)


def bent_splats(
    field: SplatField, below: EditStack, edit: Edit, ambience: Ambience, sight: Sight | None = None
) -> Edit:
    """The edit that changes the light of splats under a continuous edit
    (`completion.continuous_relighting`)."""
    field = with_pasted(field, below)
    box = light_box(edit, 0.0, ambience.reach, ambience.falls)
    moved = _around(field, moved_splats(field, below), box)
    splats = where_they_are(field, moved)
    voxel = voxel_for(splats, box)
    box = light_box(edit, voxel, ambience.reach, ambience.falls)
    region, grid = Cage.box(box.mean(axis=0), box[1] - box[0]), voxelised(splats, box, voxel)
    block = block_of(grid, EditStack(), box)
    bent = bending_light(block, edit, ambience)
    relit, light = in_light_of(block, bent)
    known = KnownSplats.of(field, splats, grid, moved)
    new, gone = NONE, np.zeros(block.shape, bool)
    if edit.fill == "surroundings":
        under, support = filled(relit, edit, bent, EditStack(), None if below.active else sight)
        if support is not None:
            gone = under.differs(relit, OTHER)
            new = known.filled(under, gone, region, edit.inner, support)
    return light_edit(edit, known.patch(field, region, gone, _new_light(block, light), None, new))


def _box_of(edit: Edit, box: Array) -> Array:
    """A box [2,3], grown by the cage that an edit clones."""
    if not isinstance(edit.fill, Clone):
        return box
    source = edit.fill.source.aabb
    return np.stack([np.minimum(box[0], source[0]), np.maximum(box[1], source[1])])


def _around(field: SplatField, moved: MovedSplats, box: Array) -> MovedSplats:
    """Those of a field's splats that may reach into a box [2,3], half as large again."""
    box = box + 0.25 * (box[1] - box[0]) * np.array([[-1.0], [1.0]])

    def reaches(points: AnyArray, rows: NDArray[np.int64] | slice) -> Mask:
        reach = 3.0 * np.exp(field.log_scales[rows].max(axis=1, keepdims=True))
        return np.asarray(((points + reach >= box[0]) & (points - reach <= box[1])).all(axis=1))

    here = reaches(moved.points, moved.source)
    gains = None if moved.gains is None else moved.gains[here]
    left = moved.left | ~reaches(field.means, slice(None))
    return MovedSplats(left, moved.source[here], moved.points[here], moved.jacobian[here], gains)


def _new_light(block: Block, light: Lighting | None) -> NewLight:
    """The light on a block; none at all where it stays."""
    return (light or Lighting(np.zeros(block.shape, bool), np.zeros(0))).on_grid(block)
