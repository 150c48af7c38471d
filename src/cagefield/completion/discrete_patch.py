"""Patch of one discrete edit of a voxel field: inpainting of the support it uncovers, and relighting."""

from __future__ import annotations

from cagefield.completion.destination import Destination, FieldVertices, place_part
from cagefield.completion.inpainting.end_caps import close_cut_end
from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.lighting.light_change import apply_light
from cagefield.completion.removal import Removal, remove_part
from cagefield.completion.surfaces.block_union import embed_mask
from cagefield.completion.surfaces.visibility import CameraVisibility
from cagefield.compute.parallel_parts import run_both
from cagefield.edits import Delete, Discrete, EditMap, Paste
from cagefield.edits.patch import Pasted, Patch
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage


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
    removal: Removal | None = None,
) -> Patch:
    """Patch of a discrete edit of a voxel field under the edits below.

    Args:
        model: the light model, None to leave light as it is.
        include_destination: whether the part casts its shadow, and is relit, at its destination.
        visibility: visible surfaces of the field without edits, which are not inpainted.
        pasted: the content of a paste.
        removal: the `remove_part` of the edit, if that is known.
    """
    removal = removal or remove_part(
        field, below, edit, model, visibility=visibility, preserve_opacity=preserve_opacity, pasted=pasted
    )
    shows_part = include_destination and not isinstance(edit, Delete | Paste)
    if not include_destination or isinstance(edit, Delete):
        placed = Destination.of_removal(removal)
    else:
        placed = place_part(removal, edit, FieldVertices(field, below, preserve_opacity))
    (region, under), part = run_both(
        lambda: _changed_under(placed), lambda: _part(placed, below, visibility) if shows_part else None
    )
    return Patch(region, under, part)


def _changed_under(placed: Destination) -> tuple[Cage, VoxelField]:
    """(cage around all changes, layer there without the part)."""
    inside = embed_mask(placed.before, placed.removal.before, placed.removal.inside)
    mask = placed.under.changed_from(placed.before) | inside
    region, under = placed.under.crop_to_changes(mask, placed.region)
    return region, under.to_layer()


def _part(placed: Destination, below: EditMap, visibility: CameraVisibility | None) -> VoxelField | None:
    """Layer of the part as shown at its destination; None if it is unchanged."""
    removal, light = placed.removal, placed.part_light
    block = apply_light(removal.part_block, light)
    if placed.edit.fill != "none":
        block = close_cut_end(block, removal.inside_part, removal.context.removed, light, below, visibility)
    part = placed.extract_part(block)
    return None if part is None else part.to_layer()
