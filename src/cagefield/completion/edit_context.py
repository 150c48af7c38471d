"""Context of one discrete edit: the block around V^c, its surfels, and their light without the part."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.surfaces.block_extraction import extract_block, extract_vertices
from cagefield.completion.surfaces.block_union import part_slices
from cagefield.completion.surfaces.footprint import CONTACT_DISTANCE_VOXELS
from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.completion.surfaces.near_masks import distances_near
from cagefield.completion.surfaces.patch_bounds import SUPPORT_DISTANCE_VOXELS, patch_box
from cagefield.completion.surfaces.plane_snapping import snap_to_planes
from cagefield.completion.surfaces.support_plane import Support, find_support
from cagefield.completion.surfaces.surfels import (
    Surfels,
    extract_surfels,
    prefer_visible,
)
from cagefield.completion.surfaces.visibility import CameraVisibility
from cagefield.edits import Discrete, EditMap, Paste, PreparedEdit, PreparedStack
from cagefield.edits.patch import Pasted
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Mask

LIGHT_SPACING_VOXELS = 2.0
"""Maximum distance of the surfels on which light is computed, voxels."""

LIGHT_SPACING_SHARE = 1.0 / 16.0
"""Maximum distance of these surfels as a share of the largest occlusion radius."""

PROBE_DEPTH_VOXELS = 0.75
"""Depth beneath a surfel at which its membership in the part is tested, voxels."""

MAX_SURFEL_VERTICES = 1 << 23
"""Maximum number of vertices of a grid all of whose surfels are found at once, 203 along each axis."""

MIN_LOG_CHANGE = 0.01
"""Minimum change of light (log); smaller ones are dropped."""


@dataclass(frozen=True, eq=False)
class EditContext:
    """Block around a discrete edit, before and after V^c is emptied.

    Attributes:
        edit: the edit.
        region: the cage outside which the patch changes nothing.
        before: the block as the edits below make it.
        emptied: the block with V^c emptied.
        inside: [X,Y,Z], mask of V^c.
        part: [X,Y,Z], mask of the solid vertices in V^c.
        visibility: the field's visible surfaces; None if unknown, or if edits below move the field.
        light_spacing: distance of the surfels on which light is computed, world units.
        surfels: `extract_field_surfels` of the field; None if unknown, or if edits below move the field.
        pasted: all surfels with a paste; None of another edit.
    """

    edit: Discrete
    region: Cage
    before: GridBlock
    emptied: GridBlock
    inside: Mask
    part: Mask
    visibility: CameraVisibility | None
    light_spacing: float
    surfels: Surfels | None = None
    pasted: Surfels | None = None

    @classmethod
    def build(
        cls,
        field: VoxelField,
        below: EditMap,
        edit: Discrete,
        model: LightModel | None,
        visibility: CameraVisibility | None = None,
        *,
        preserve_opacity: bool = True,
        surfels: Surfels | None = None,
        after: VoxelField | None = None,
        pasted: Pasted | None = None,
    ) -> EditContext:
        """Context of an edit of a field under the edits below, the same wherever the part is put down.

        model: the light model, None to leave light as it is; after: the field with a paste, or None to
        compose it from `pasted`, the content of the paste.
        """
        # The field's visible surfaces are not where the edits below have moved them.
        visibility, surfels = (None, None) if below.steps else (visibility, surfels)
        voxel = float(field.voxel_size.max())
        active_model = model if model is not None and model.has_effect else LightModel((), ())
        light_spacing = min(
            LIGHT_SPACING_VOXELS * voxel, LIGHT_SPACING_SHARE * active_model.max_radius or np.inf
        )
        box = patch_box(
            edit, voxel, active_model.max_radius, shadow_directions=active_model.shadow_directions
        )
        before = extract_block(field, below, box, preserve_opacity=preserve_opacity)
        region = Cage.box(box.mean(axis=0), box[1] - box[0] - 2.0 * voxel)
        if isinstance(edit, Paste):
            stack = PreparedStack() if after else below.followed_by(PreparedEdit(edit, pasted=pasted))
            block = extract_block(after or field, stack, box, preserve_opacity=preserve_opacity)
            none = np.zeros(before.shape, bool)
            return cls(
                edit,
                region,
                before,
                before,
                none,
                none,
                visibility,
                light_spacing,
                surfels,
                extract_surfels(block),
            )
        inside = _vertices_inside(before, edit.inner)
        emptied = before
        if edit.uncovers:
            # Keep negative densities: the trilinear zero crossing places the surface at sub-voxel precision.
            emptied = before.with_density(inside, np.minimum(before.density[inside], 0.0))
        return cls(
            edit,
            region,
            before,
            emptied,
            inside,
            before.solid & inside,
            visibility,
            light_spacing,
            surfels,
        )

    @cached_property
    def surface(self) -> Mask:
        """Mask [X,Y,Z] of the surface vertices outside V^c."""
        return np.asarray(self.emptied.surface & ~self.inside)

    @cached_property
    def remaining_coordinates(self) -> Array:
        """Block coordinates [N,3] of the surfels in `remaining`."""
        return self.before.block_coordinates(self.remaining.points)

    @cached_property
    def near_part(self) -> NDArray[np.bool_]:
        """Mask [N] of the surfels in `remaining` around V^c."""
        size = float(np.median(self.edit.inner.aabb[1] - self.edit.inner.aabb[0]))
        reach = max(SUPPORT_DISTANCE_VOXELS, 0.5 * size / self.voxel)
        return distances_near(self.inside, self.remaining_coordinates, reach) < reach

    @property
    def contact(self) -> Array:
        """Block coordinates [N,3] of the surfels in `remaining` that the part hides by contact."""
        near = self.remaining_coordinates[self.near_part]
        return near[distances_near(self.part, near, CONTACT_DISTANCE_VOXELS) < CONTACT_DISTANCE_VOXELS]

    def find_support(self) -> Support | None:
        """Support plane that the part stood on; None without one."""
        return find_support(self.part, self.remaining, self.remaining_coordinates, self.near_part, self.voxel)

    @property
    def voxel(self) -> float:
        """Longest edge of a voxel, world units."""
        return max(self.before.spacing)

    def surfels_of(self, block: GridBlock) -> Surfels:
        """Surfels of a block of the field, a voxel apart: visible ones where cameras see the surface."""
        if self.surfels is not None:
            return self.surfels.crop_to_block(block)
        return _extract_visible(block, self.visibility)

    @cached_property
    def _surfels(self) -> tuple[Surfels, NDArray[np.bool_]]:
        """(surfels before the edit, mask [N] of those of the part)."""
        surface = self.surfels_of(self.before)
        probes = surface.points - PROBE_DEPTH_VOXELS * self.voxel * surface.normals
        return surface, np.asarray(self.edit.inner.contains(probes) & (not isinstance(self.edit, Paste)))

    @cached_property
    def remaining(self) -> Surfels:
        """Surfels after the removal: all without the part, or all where the edit keeps its source."""
        surface, _ = self._surfels
        return self.surroundings if self.edit.uncovers else surface

    @cached_property
    def removed(self) -> Surfels:
        """Surfels of the part."""
        surface, part = self._surfels
        return surface.take(part)

    @cached_property
    def surroundings(self) -> Surfels:
        """Surfels of all but the part, also where the edit keeps its source."""
        surface, part = self._surfels
        return surface.take(~part)

    @cached_property
    def light_surfels(self) -> Surfels:
        """Surfels in `remaining`, downsampled to the spacing of the light."""
        return self.remaining.downsample(self.light_spacing)

    def light_change_without_part(self, model: LightModel) -> Array:
        """Log ratio of light [N] on `light_surfels` after the removal of the part.

        0 where the edit keeps its source.
        """
        if not self.edit.uncovers or not len(self.removed.points):
            return np.zeros(len(self.light_surfels.points))
        return -log_light_change(model, self.light_surfels, self.remaining, self.removed, self.voxel)


def extract_field_surfels(field: VoxelField, visibility: CameraVisibility) -> Surfels | None:
    """Surfels of a whole field, of which each edit takes those around it; None of a field too large."""
    shape = np.array(field.resolution)
    if shape.prod() > MAX_SURFEL_VERTICES:
        return None
    return _extract_visible(
        extract_vertices(field, PreparedStack(), np.zeros(3, np.int64), shape), visibility
    )


def _extract_visible(block: GridBlock, visibility: CameraVisibility | None) -> Surfels:
    """Surfels of a block, a voxel apart."""
    surface, voxel = extract_surfels(block), max(block.spacing)
    if visibility is not None:
        surface = prefer_visible(surface, visibility.surface.crop_to_block(block), voxel)
    return surface.downsample(voxel)


def _vertices_inside(block: GridBlock, cage: Cage) -> Mask:
    """Mask [X,Y,Z] of the vertices of a block inside a cage."""
    if block.field.contracted:  # where boxes have curved sides
        return cage.contains(block.positions(np.ones(block.shape, bool))).reshape(block.shape)
    low, high = cage.aabb
    corners = np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), axis=-1).reshape(-1, 3)
    g = block.block_coordinates(corners)
    first = np.clip(np.floor(g.min(axis=0)).astype(np.int64), 0, None)
    crop = block.crop(first, np.ceil(g.max(axis=0)).astype(np.int64))
    mask = np.zeros(block.shape, bool)
    if crop.density.size:
        found = cage.contains(crop.positions(np.ones(crop.shape, bool)))
        mask[part_slices(block, crop)] = found.reshape(crop.shape)
    return mask


def log_light_change(
    model: LightModel, surfels: Surfels, around: Surfels, added: Surfels, voxel: float
) -> Array:
    """Log ratio of the light [N] on surfels among `around` and `added` to that among `around` alone.

    `added` does not change openness far away.
    """
    near_rows = np.arange(len(surfels.points))
    if model.directional is None:
        near_rows = np.flatnonzero(
            added.distance(surfels.points, 2.0 * model.max_radius) < 2.0 * model.max_radius
        )
    rows, _ = snap_to_planes(surfels.take(near_rows), voxel, edges=True)
    log = np.zeros(len(surfels.points))
    log[near_rows] = model.log_light_change(around, added, rows)
    return np.where(np.abs(log) < MIN_LOG_CHANGE, 0.0, log)
