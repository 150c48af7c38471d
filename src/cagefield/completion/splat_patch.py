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
    apply_bent_light,
    compute_bent_light,
    inpaint_shaded_support,
    light_box,
    light_edit,
)
from cagefield.completion.discrete_patch import compute_patch
from cagefield.completion.inpainting.splat_inpainting import NO_SPLATS, KnownSplats
from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.lighting.light_change import LightChange
from cagefield.completion.surfaces.grid_block import GridBlock, extract_block
from cagefield.completion.surfaces.patch_bounds import patch_box
from cagefield.completion.surfaces.splat_voxelization import choose_voxel_size, voxelize_splats
from cagefield.completion.surfaces.visibility import CameraVisibility
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

MIN_FILL_DIFFERENCE = 0.2
"""Splats stay where what was filled has the density that was there, and coefficients that differ by less."""


def build_splat_patch(
    field: SplatField,
    below: EditStack,
    edit: Edit,
    ambience: LightModel | None,
    *,
    settled: bool = True,
    sight: CameraVisibility | None = None,
) -> SplatPatch:
    """The patch of a discrete edit of splats under the edits below it; arguments as for `making.made_of`."""
    # Splats overlap: their seams are soft.
    edit = edit.replace(feather=0.0)
    field = with_pasted(field, below.append(edit))
    lit = ambience if ambience is not None and ambience.shows else LightModel((), ())
    place = settled and not edit.deleted
    moved = _crop_splats(
        field,
        moved_splats(field, below),
        _include_clone_source(edit, patch_box(edit, 0.0, lit.reach, falls=lit.falls)),
    )
    splats = where_they_are(field, moved)
    voxel = choose_voxel_size(splats, patch_box(edit, 0.0, lit.reach, settled=place, falls=lit.falls))
    box = patch_box(edit, voxel, lit.reach, settled=place, falls=lit.falls) + 3.0 * voxel * np.array(
        [[-1.0], [1.0]]
    )
    grid = voxelize_splats(splats, _include_clone_source(edit, box), voxel)
    after = None
    if edit.source is not None:
        pasted = _crop_splats(field, moved_splats(field, below.append(edit)), box)
        after = voxelize_splats(where_they_are(field, pasted), _include_clone_source(edit, box), voxel)
    made = compute_patch(
        grid, EditStack(), edit, ambience, settled=settled, sight=None if below.active else sight, after=after
    )
    known, new = KnownSplats.of(field, splats, grid, moved), NO_SPLATS
    fresh = made.under.differs(made.emptied, MIN_FILL_DIFFERENCE)
    if isinstance(edit.fill, Clone) and not edit.keep_source:
        new = known.cloned(made.under, edit.inner, edit.fill.source)
    elif made.support is not None:
        new = known.filled(made.under, fresh, made.work.region, edit.inner, made.support)
    part = None if made.part_light is None else _to_new_light(made.before, made.part_light)
    light = _to_new_light(made.under, made.light)
    return known.patch(field, made.work.region, fresh & ~made.inside, light, part, new)


def relight_splats(
    field: SplatField,
    below: EditStack,
    edit: Edit,
    ambience: LightModel,
    sight: CameraVisibility | None = None,
) -> Edit:
    """The edit that changes the light of splats under a continuous edit
    (`completion.continuous_relighting`)."""
    field = with_pasted(field, below)
    box = light_box(edit, 0.0, ambience.reach, ambience.falls)
    moved = _crop_splats(field, moved_splats(field, below), box)
    splats = where_they_are(field, moved)
    voxel = choose_voxel_size(splats, box)
    box = light_box(edit, voxel, ambience.reach, ambience.falls)
    region, grid = Cage.box(box.mean(axis=0), box[1] - box[0]), voxelize_splats(splats, box, voxel)
    block = extract_block(grid, EditStack(), box)
    bent = compute_bent_light(block, edit, ambience)
    relit, light = apply_bent_light(block, bent)
    known = KnownSplats.of(field, splats, grid, moved)
    new, gone = NO_SPLATS, np.zeros(block.shape, bool)
    if edit.fill == "surroundings":
        under, support = inpaint_shaded_support(
            relit, edit, bent, EditStack(), None if below.active else sight
        )
        if support is not None:
            gone = under.differs(relit, MIN_FILL_DIFFERENCE)
            new = known.filled(under, gone, region, edit.inner, support)
    return light_edit(edit, known.patch(field, region, gone, _to_new_light(block, light), None, new))


def _include_clone_source(edit: Edit, box: Array) -> Array:
    """A box [2,3], grown by the cage that an edit clones."""
    if not isinstance(edit.fill, Clone):
        return box
    source = edit.fill.source.aabb
    return np.stack([np.minimum(box[0], source[0]), np.maximum(box[1], source[1])])


def _crop_splats(field: SplatField, moved: MovedSplats, box: Array) -> MovedSplats:
    """Those of a field's splats that may reach into a box [2,3], half as large again."""
    box = box + 0.25 * (box[1] - box[0]) * np.array([[-1.0], [1.0]])

    def reaches(points: AnyArray, rows: NDArray[np.int64] | slice) -> Mask:
        reach = 3.0 * np.exp(field.log_scales[rows].max(axis=1, keepdims=True))
        return np.asarray(((points + reach >= box[0]) & (points - reach <= box[1])).all(axis=1))

    here = reaches(moved.points, moved.source)
    gains = None if moved.gains is None else moved.gains[here]
    left = moved.left | ~reaches(field.means, slice(None))
    return MovedSplats(left, moved.source[here], moved.points[here], moved.jacobian[here], gains)


def _to_new_light(block: GridBlock, light: LightChange | None) -> NewLight:
    """The light on a block; none at all where it stays."""
    return (light or LightChange(np.zeros(block.shape, bool), np.zeros(0))).on_grid(block)
