"""Patch of one edit of splats: computed on a voxel grid, and transferred back to splats.

The splats around the edit are voxelized (`completion.surfaces.splat_voxelization`); inpainting and
relighting work on the grid as for voxel fields (`completion.discrete_patch`,
`completion.continuous_relighting`). The change of light is interpolated at the means of the splats;
inpainted surfaces get new splats (`completion.inpainting.splat_inpainting`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cagefield.completion.continuous_relighting import (
    CanonicalLight,
    apply_bent_light,
    compute_bent_light,
    inpaint_shaded_support,
    light_box,
    light_edit,
)
from cagefield.completion.destination import Destination, place_part
from cagefield.completion.inpainting.splat_inpainting import NO_SPLATS, KnownSplats, NewSplats
from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.lighting.light_change import LightChange
from cagefield.completion.removal import Removal, remove_part
from cagefield.completion.surfaces.block_extraction import extract_block, extract_vertices
from cagefield.completion.surfaces.block_union import VertexRange, embed_mask
from cagefield.completion.surfaces.grid_block import GridBlock, world_positions
from cagefield.completion.surfaces.patch_bounds import patch_box
from cagefield.completion.surfaces.splat_voxelization import (
    choose_voxel_size,
    voxelize_splats,
    voxelize_vertices,
)
from cagefield.completion.surfaces.visibility import CameraVisibility
from cagefield.compute.cancellation import check_cancelled
from cagefield.edits import Continuous, Delete, Discrete, Edit, EditMap, EditStack, Paste, PreparedEdit
from cagefield.edits.options import Clone
from cagefield.edits.patch import NewLight, Pasted, SplatPatch
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.cage import Cage
from cagefield.rendering.splats.bake_splats import where_they_are
from cagefield.rendering.splats.splat_motion import MovedSplats, moved_splats
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.typing import AnyArray, Array, Mask

MIN_FILL_DIFFERENCE = 0.2
"""Minimum change of spherical-harmonics coefficients, at unchanged density, for which splats are replaced."""


@dataclass(frozen=True, eq=False)
class SplatRemoval:
    """Removal of the part of a discrete edit of splats, the same wherever the part is put down.

    Attributes:
        removal: on a grid of the splats around V^c.
        scene: the field that patches name their sources in.
        field: all splats with the pastes beneath; moved: those that the edits below move.
        known: the splats around V^c with their colors, of which new ones are copies.
        is_new: [X,Y,Z], vertices of the removal's block whose splats are replaced.
        new: the new splats.
    """

    removal: Removal
    scene: SplatField
    field: SplatField
    moved: MovedSplats
    known: KnownSplats
    is_new: Mask
    new: NewSplats


def remove_splats(
    splats: SplatField | SplatSet,
    below: EditMap,
    edit: Discrete,
    model: LightModel | None,
    *,
    visibility: CameraVisibility | None = None,
    pasted: Pasted | None = None,
) -> SplatRemoval:
    """Removal of the part of a discrete edit of splats; arguments as in `remove_part`."""
    # No feathering: splats overlap, and their seams are soft.
    edit = edit.replace(feather=0.0)
    stack = below.followed_by(PreparedEdit(edit, pasted=pasted))
    splats = SplatSet.from_field(splats).with_pastes(stack)
    field = splats.field
    active_model = model if model is not None and model.has_effect else LightModel((), ())

    def patch_box_with(voxel: float) -> Array:
        return patch_box(
            edit, voxel, active_model.max_radius, shadow_directions=active_model.shadow_directions
        )

    all_moved = moved_splats(splats, below)
    moved = _crop_splats(field, all_moved, _include_clone_source(edit, patch_box_with(0.0)))
    placed = where_they_are(field, moved)
    voxel = choose_voxel_size(placed, patch_box_with(0.0))
    box = patch_box_with(voxel) + 3.0 * voxel * np.array([[-1.0], [1.0]])
    grid = voxelize_splats(placed, _include_clone_source(edit, box), voxel)
    after = None
    if isinstance(edit, Paste):
        shown = _crop_splats(field, moved_splats(splats, stack), box)
        after = voxelize_splats(where_they_are(field, shown), _include_clone_source(edit, box), voxel)
    removal = remove_part(
        grid, EditStack(), edit, model, visibility=None if below.steps else visibility, after=after
    )
    known, new = KnownSplats.from_moved(field, placed, grid, moved), NO_SPLATS
    is_new = removal.under.changed_from(removal.emptied, MIN_FILL_DIFFERENCE)
    if isinstance(edit.fill, Clone) and edit.uncovers:
        new = known.clone_cage(removal.under, edit.inner, edit.fill.source)
    elif removal.support is not None:
        new = known.fill_surface(removal.under, is_new, removal.context.region, edit.inner, removal.support)
    return SplatRemoval(removal, splats.scene, field, all_moved, known, is_new & ~removal.inside, new)


def build_splat_patch(
    splats: SplatField | SplatSet,
    below: EditMap,
    edit: Discrete,
    model: LightModel | None,
    *,
    include_destination: bool = True,
    visibility: CameraVisibility | None = None,
    pasted: Pasted | None = None,
    removal: SplatRemoval | None = None,
) -> SplatPatch:
    """Patch of a discrete edit of splats under the edits below; arguments as in `build_patch`.

    `removal` is its `remove_splats`, if that is known.
    """
    removed = removal or remove_splats(splats, below, edit, model, visibility=visibility, pasted=pasted)
    of_block = removed.removal
    placed = Destination.of_removal(of_block)
    if include_destination and not isinstance(edit, Delete):
        placed = place_part(of_block, edit.replace(feather=0.0), SplatVertices(removed))
    part = None if placed.part_light is None else _to_new_light(of_block.part_block, placed.part_light)
    is_new = embed_mask(placed.before, of_block.before, removed.is_new)
    light = _to_new_light(placed.under, placed.light)
    return removed.known.build_patch(removed.scene, placed.region, is_new, light, part, removed.new)


@dataclass(frozen=True, eq=False)
class SplatVertices:
    """Vertices of the grid of a removal, which goes on beyond the splats around V^c."""

    removed: SplatRemoval

    def vertices(self, box: Array) -> VertexRange:
        g = self.removed.removal.before.field.grid_coordinates(box)
        return VertexRange(np.floor(g[0]).astype(np.int64), np.ceil(g[1]).astype(np.int64))

    def extract(self, low: NDArray[np.int64], shape: NDArray[np.int64]) -> GridBlock:
        block, removed = self.removed.removal.before, self.removed
        ends = world_positions(block.field, np.stack([low, low + shape - 1]))
        moved = _crop_splats(removed.field, removed.moved, ends)
        placed = where_they_are(removed.field, moved)
        added = voxelize_vertices(placed, ends[0], float(block.field.voxel_size.max()), shape)
        dense = extract_vertices(added, EditStack(), np.zeros(3, np.int64), shape)
        return replace(block, low=low, density=dense.density, slot=dense.slot, sh=dense.sh)


@dataclass(frozen=True, eq=False)
class SplatBlock:
    """Splats of a box [2,3], as the edits below place them, the `block` of their density, and its light.

    `known` are those splats with their colors, `scene` the field that patches name their sources in.
    """

    box: Array
    block: GridBlock
    canonical: CanonicalLight
    known: KnownSplats
    scene: SplatField


def extract_splat_block(
    splats: SplatField | SplatSet, below: EditMap, edit: Continuous, model: LightModel
) -> SplatBlock:
    """Block of splats in which a continuous edit changes light, wherever the edit takes its content."""
    splats = SplatSet.from_field(splats).with_pastes(below)
    field = splats.field
    box = light_box(edit, 0.0, model.max_radius, model.shadow_directions)
    moved = _crop_splats(field, moved_splats(splats, below), box)
    check_cancelled()
    placed = where_they_are(field, moved)
    check_cancelled()
    voxel = choose_voxel_size(placed, box)
    box = light_box(edit, voxel, model.max_radius, model.shadow_directions)
    grid = voxelize_splats(placed, box, voxel)
    check_cancelled()
    known = KnownSplats.from_moved(field, placed, grid, moved)
    check_cancelled()
    block = extract_block(grid, EditStack(), box)
    return SplatBlock(box, block, CanonicalLight.from_block(block, edit, model), known, splats.scene)


def relight_splats(
    splats: SplatField | SplatSet,
    below: EditMap,
    edit: Continuous,
    model: LightModel,
    visibility: CameraVisibility | None = None,
    around: SplatBlock | None = None,
) -> PreparedEdit:
    """Edit that changes the light of splats under a continuous edit (`completion.continuous_relighting`).

    `around` is its `extract_splat_block`, if that is known.
    """
    around = around or extract_splat_block(splats, below, edit, model)
    block, known = around.block, around.known
    region = Cage.box(around.box.mean(axis=0), around.box[1] - around.box[0])
    bent = compute_bent_light(around.canonical, edit, model)
    relit, light = apply_bent_light(block, bent)
    new, is_new = NO_SPLATS, np.zeros(block.shape, bool)
    if edit.fill == "surroundings":
        under, support = inpaint_shaded_support(
            relit, edit, bent, EditStack(), None if below.steps else visibility
        )
        if support is not None:
            is_new = under.changed_from(relit, MIN_FILL_DIFFERENCE)
            new = known.fill_surface(under, is_new, region, edit.inner, support)
    return light_edit(
        edit, known.build_patch(around.scene, region, is_new, _to_new_light(block, light), None, new)
    )


def _include_clone_source(edit: Edit, box: Array) -> Array:
    """Box [2,3] that holds a box [2,3] and the cage that an edit clones."""
    if not isinstance(edit.fill, Clone):
        return box
    source = edit.fill.source.aabb
    return np.stack([np.minimum(box[0], source[0]), np.maximum(box[1], source[1])])


def _crop_splats(field: SplatField, moved: MovedSplats, box: Array) -> MovedSplats:
    """Splats whose extent reaches into a box [2,3] enlarged by half."""
    box = box + 0.25 * (box[1] - box[0]) * np.array([[-1.0], [1.0]])

    def is_near_box(points: AnyArray, rows: NDArray[np.int64] | slice) -> Mask:
        radius = 3.0 * np.exp(field.log_scales[rows].max(axis=1, keepdims=True))
        return np.asarray(((points + radius >= box[0]) & (points - radius <= box[1])).all(axis=1))

    is_near = is_near_box(moved.points, moved.source)
    return replace(moved.take(is_near), left=moved.left | ~is_near_box(field.means, slice(None)))


def _to_new_light(block: GridBlock, light: LightChange | None) -> NewLight:
    """Change of light on a block for splats; without values where light stays."""
    return (light or LightChange(np.zeros(block.shape, bool), np.zeros(0))).to_new_light(block)
