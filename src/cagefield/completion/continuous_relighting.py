"""Relighting of a continuous edit: its bent content takes contact shadows along.

A sample of the deformed field shows a canonical point, whose light is changed before the edit maps it
anywhere. The change is an edit of its own, right before the continuous one, that moves nothing: its patch
shows the surroundings, and the content of the shell, in the light of the deformed scene. The support of the
part was hidden, or in deep shade, and is inpainted as under a part that is moved
(`completion.inpainting.support_inpainting`). With F the edit's map to deformed space, the light on a
canonical point p with normal n is multiplied by

    o'(F(p), F_*(n)) / o(p, n),

o the openness (`completion.lighting.ambient_occlusion`) in the canonical scene, o' in the deformed one. The
ratio is smooth, and is computed on a grid of at most MAX_VERTICES_PER_AXIS vertices an axis.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.completion.inpainting.support_inpainting import inpaint_support
from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.lighting.light_change import LightChange
from cagefield.completion.surfaces.block_extraction import extract_block
from cagefield.completion.surfaces.footprint import build_footprint
from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.completion.surfaces.patch_bounds import SUPPORT_DISTANCE_VOXELS, extrude_box
from cagefield.completion.surfaces.plane_snapping import snap_to_planes
from cagefield.completion.surfaces.support_plane import Support, find_support
from cagefield.completion.surfaces.surface_color import denoise_colors
from cagefield.completion.surfaces.surfels import Surfels, extract_surfels
from cagefield.completion.surfaces.visibility import DEPTH_TOLERANCE_VOXELS, MIN_VIEWS, CameraVisibility
from cagefield.edits import Continuous, Edit, EditMap, PreparedEdit
from cagefield.edits.patch import Patch, SplatPatch
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Mask
from cagefield.warps.forward import to_deformed

MAX_VERTICES_PER_AXIS = 128
"""Maximum number of vertices along the longest axis of the grid of the light."""

MIN_FILLED_LOG_GAIN = 0.45
"""Gain of light (log) above which the support beneath a part is inpainted: only the lowest cameras may see
it.
"""

MIN_MARGIN_VOXELS = 24.0
"""Minimum margin around surfaces in deep shade in which their support is searched, voxels."""

MIN_BENT_LOG_CHANGE = 0.03
"""Minimum change of light (log); smaller ones are dropped."""


def light_box(edit: Continuous, voxel: float, max_radius: float, shadow_directions: Array) -> Array:
    """World-space box [2,3] (min, max) in which a continuous edit changes light.

    Arguments as in `patch_box`.
    """
    margin = 1.5 * max_radius + SUPPORT_DISTANCE_VOXELS * voxel
    return np.asarray(extrude_box(edit.outer.aabb, shadow_directions) + margin * np.array([[-1.0], [1.0]]))


@dataclass(frozen=True, eq=False)
class BentLight:
    """Change of light by a continuous edit, on a coarse `block` with surfels `surface` [N].

    light: the change on the block's vertices; log [N]: its log ratio on the surfels, without the diffuse
    term.
    """

    block: GridBlock
    surface: Surfels
    log: Array
    light: LightChange


@dataclass(frozen=True, eq=False)
class CanonicalLight:
    """Light of a block in canonical space of a continuous edit, the same for all drags of its inner cage.

    block: the coarse block; log [N] and log_diffuse [N] of its surfels `surface` [N].
    """

    block: GridBlock
    surface: Surfels
    log: Array
    log_diffuse: Array

    @classmethod
    def from_block(cls, block: GridBlock, edit: Continuous, model: LightModel) -> CanonicalLight:
        """Light of a block that reaches as far as the outer cage of an edit."""
        coarse = block.pool(max(1, -(-max(block.shape) // MAX_VERTICES_PER_AXIS))).pad_to(edit.outer.aabb)
        surface, _ = snap_to_planes(extract_surfels(coarse), max(coarse.spacing))
        if not len(surface.points):
            return cls(coarse, surface, np.zeros(0), np.zeros(0))
        return cls(coarse, surface, model.log_light([surface], surface), model.log_diffuse(surface))


def compute_bent_light(canonical: CanonicalLight, edit: Continuous, model: LightModel) -> BentLight:
    """Change of light of a block by a continuous edit."""
    coarse, surface = canonical.block, canonical.surface
    if not len(surface.points):
        return BentLight(coarse, surface, np.zeros(0), LightChange(np.zeros(coarse.shape, bool), np.zeros(0)))
    moved = to_deformed(edit.exact_warp, surface.points, coarse=True)
    bent = surface.transform(moved.points, moved.jacobian)
    diffuse = model.log_diffuse(bent) - canonical.log_diffuse
    log = model.log_light([bent], bent) - canonical.log
    visible_log = np.where(np.abs(log) < MIN_BENT_LOG_CHANGE, 0.0, log)
    light = LightChange.from_surfels(coarse, surface, visible_log, 2.0 * max(coarse.spacing))
    return BentLight(coarse, surface, log - diffuse, light)


@dataclass(frozen=True, eq=False)
class VoxelBlock:
    """Block of a voxel field in which a continuous edit changes light, and its light before."""

    block: GridBlock
    canonical: CanonicalLight


def extract_voxel_block(field: VoxelField, below: EditMap, edit: Continuous, model: LightModel) -> VoxelBlock:
    """Block of a voxel field, under the edits below, in which a continuous edit changes light."""
    box = light_box(edit, float(field.voxel_size.max()), model.max_radius, model.shadow_directions)
    block = extract_block(field, below, box)
    return VoxelBlock(block, CanonicalLight.from_block(block, edit, model))


def relight_voxels(
    field: VoxelField,
    below: EditMap,
    edit: Continuous,
    model: LightModel,
    around: VoxelBlock | None = None,
    visibility: CameraVisibility | None = None,
) -> PreparedEdit | None:
    """Edit that changes the light of a voxel field under a continuous edit; None if no light changes.

    `around` is its `extract_voxel_block`, if that is known. With `fill` "surroundings" the support in deep
    shade is inpainted, except surfaces that cameras see by their `visibility` of the field without edits.
    """
    box = light_box(edit, float(field.voxel_size.max()), model.max_radius, model.shadow_directions)
    around = around or extract_voxel_block(field, below, edit, model)
    block, bent = around.block, compute_bent_light(around.canonical, edit, model)
    relit = apply_bent_light(block, bent)[0]
    if edit.fill == "surroundings":
        relit = inpaint_shaded_support(relit, edit, bent, below, visibility)[0]
    changed = relit.changed_from(block)
    if not changed.any():
        return None
    region, relit = relit.crop_to_changes(changed, Cage.box(box.mean(axis=0), box[1] - box[0]))
    return light_edit(edit, Patch(region, relit.to_layer()))


def apply_bent_light(block: GridBlock, bent: BentLight) -> tuple[GridBlock, LightChange]:
    """(block in the light of the deformed scene, change of light on the block's vertices)."""
    where = block.slot >= 0
    log = bent.light.interpolate(bent.block, block.positions(where))
    log[np.abs(log) < MIN_BENT_LOG_CHANGE] = 0.0
    return denoise_colors(block, where, log).scale_colors(where, np.exp(log)), LightChange(where, log)


def inpaint_shaded_support(
    block: GridBlock, edit: Continuous, bent: BentLight, below: EditMap, visibility: CameraVisibility | None
) -> tuple[GridBlock, Support | None]:
    """(block with the support inpainted where it was in deep shade, the support or None).

    The block is in its new light, which amplifies the noise of colors photographed in deep shade.
    """
    coordinates = block.block_coordinates(bent.surface.points)
    is_dark = bent.log > MIN_FILLED_LOG_GAIN
    if not is_dark.any():
        return block, None
    # Crop to the dark surfels and a margin of half their extent.
    low, high = coordinates[is_dark].min(axis=0), coordinates[is_dark].max(axis=0)
    margin = max(MIN_MARGIN_VOXELS, 0.5 * float((high - low).max()))
    first = np.maximum(np.floor(low - margin), 0.0).astype(np.int64)
    crop = block.crop(first, np.ceil(high + margin).astype(np.int64))
    inside = edit.inner.contains(crop.positions(np.ones(crop.shape, bool))).reshape(crop.shape)
    support = _find_part_support(crop, inside, edit, bent, coordinates - first)
    if support is None:
        return block, None
    inpainted = _inpaint_shaded(crop, inside, bent, coordinates - first, is_dark, support, below, visibility)
    if inpainted is None:
        return block, None
    slices = tuple(slice(a, a + n) for a, n in zip(crop.low - block.low, crop.shape, strict=True))
    density, slot = block.density.copy(), block.slot.copy()
    density[slices], slot[slices] = inpainted.density, inpainted.slot
    inpainted_block = replace(block, density=density, slot=slot, sh=inpainted.sh)
    return inpainted_block, replace(support, point=support.point + first, members=support.members + first)


def _find_part_support(
    block: GridBlock, inside: Mask, edit: Edit, bent: BentLight, coordinates: Array
) -> Support | None:
    """Support of the part, `inside` [X,Y,Z], among surfels at `coordinates` [N,3]; None without one."""
    part = block.solid & inside
    if not part.any():
        return None
    distance = ndimage.distance_transform_edt(~inside)
    distance = np.asarray(ndimage.map_coordinates(distance, coordinates.T, order=1, cval=np.inf))
    size = float(np.median(np.subtract(*edit.inner.aabb[::-1]))) / max(block.spacing)
    is_near = (distance > 0.0) & (distance < max(SUPPORT_DISTANCE_VOXELS, 0.5 * size))
    return find_support(part, bent.surface, coordinates, is_near, max(bent.block.spacing))


def _inpaint_shaded(
    block: GridBlock,
    inside: Mask,
    bent: BentLight,
    coordinates: Array,
    is_dark: NDArray[np.bool_],
    support: Support,
    below: EditMap,
    visibility: CameraVisibility | None,
) -> GridBlock | None:
    """Block with a support inpainted; None without a footprint.

    coordinates [N,3]: block coordinates of the surfels; is_dark [N]: mask of the surfels in deep shade.
    """
    part = block.solid & inside
    shaded = Surfels(coordinates[is_dark], bent.surface.normals[is_dark])
    footprint = build_footprint(support, part, np.zeros((0, 3)), shaded)
    if footprint is None:
        return None
    points = footprint.points(block)
    is_known = bent.light.interpolate(bent.block, points) < MIN_FILLED_LOG_GAIN
    if visibility is not None:
        # Inpainted layers of edits below are inpainted again: more of the surroundings is known here.
        canonical = below.to_canonical(points).points
        is_known &= (
            visibility.count_views(canonical, DEPTH_TOLERANCE_VOXELS * max(block.spacing)) >= MIN_VIEWS
        )
    footprint = footprint.remove_known(is_known, part)
    log_change = np.zeros(footprint.hole.shape)
    log_change[footprint.surroundings] = bent.light.interpolate(
        bent.block, footprint.points(block, footprint.surroundings)
    )
    return inpaint_support(block, replace(footprint, log_light_change=log_change), inside, keep_removed=True)


def light_edit(edit: Edit, patch: Patch | SplatPatch) -> PreparedEdit:
    """Edit that moves nothing and shows the patch with the light of another edit."""
    low, high = patch.region.aabb
    nothing = Cage.box(low, 1e-6 * (high - low))
    removal = Edit.delete(nothing, name=edit.name, fill="none", relight="none")
    return PreparedEdit(removal, patch, is_light=True)
