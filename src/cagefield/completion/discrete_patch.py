"""Patch of one discrete edit of a voxel field: inpainting of the support it uncovers, and relighting."""

from __future__ import annotations

from cagefield.completion.destination import Destination, FieldVertices, place_part
from cagefield.completion.inpainting.end_caps import close_cut_end
from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.lighting.light_change import apply_light
from cagefield.completion.removal import Removal, remove_part
from cagefield.completion.surfaces.block_union import embed_values
from cagefield.completion.surfaces.visibility import CameraVisibility
from cagefield.edits import Delete, Discrete, EditMap, Paste
from cagefield.edits.patch import Pasted, Patch
from cagefield.fields.voxel_field import VoxelField


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
    if not include_destination or isinstance(edit, Delete):
        placed = Destination.of_removal(removal)
    else:
        placed = place_part(removal, edit, FieldVertices(field, below, preserve_opacity))
    mask = placed.under.changed_from(placed.before) | embed_values(
        placed.before, removal.before, removal.inside
    )
    region, under = placed.under.crop_to_changes(mask, placed.region)
    if not include_destination or isinstance(edit, Delete | Paste):
        return Patch(region, under.to_layer())
    part_block = apply_light(removal.part_block, placed.part_light)
    if edit.fill != "none":
        part_block = close_cut_end(
            part_block, removal.inside_part, removal.context.removed, placed.part_light, below, visibility
        )
    part = placed.extract_part(part_block)
    return Patch(region, under.to_layer(), None if part is None else part.to_layer())
