"""Context of one discrete edit: the block around its cages, its surfels, and the change of light on them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.completion.inpainting.feathering import feather_rim
from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.lighting.light_change import LightChange
from cagefield.completion.surfaces.footprint import CONTACT_DISTANCE_VOXELS, Footprint
from cagefield.completion.surfaces.grid_block import GridBlock, extract_block
from cagefield.completion.surfaces.patch_bounds import SUPPORT_DISTANCE_VOXELS, patch_box
from cagefield.completion.surfaces.plane_snapping import snap_to_planes
from cagefield.completion.surfaces.support_plane import Support, find_support
from cagefield.completion.surfaces.surfels import (
    Surfels,
    concatenate_surfels,
    extract_cut_faces,
    extract_surfels,
    prefer_visible,
)
from cagefield.completion.surfaces.visibility import CameraVisibility
from cagefield.edits import Delete, Discrete, EditMap, Paste, PreparedEdit, PreparedStack
from cagefield.edits.patch import Pasted
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Mask
from cagefield.warps.hexahedron_map import HexahedronMap

LIGHT_SPACING_VOXELS = 2.0
"""Maximum distance of the surfels on which light is computed, voxels."""

LIGHT_SPACING_SHARE = 1.0 / 16.0
"""Maximum distance of these surfels as a share of the largest occlusion radius."""

PROBE_DEPTH_VOXELS = 0.75
"""Depth beneath a surfel at which its membership in the part is tested, voxels."""

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
        include_destination: whether the part is shown at its new place, and casts its shadow there.
        visibility: the field's visible surfaces; None if unknown, or if edits below move the field.
        light_spacing: distance of the surfels on which light is computed, world units.
        pasted: all surfels with a paste; None of another edit.
    """

    edit: Discrete
    region: Cage
    before: GridBlock
    emptied: GridBlock
    inside: Mask
    part: Mask
    include_destination: bool
    visibility: CameraVisibility | None
    light_spacing: float
    pasted: Surfels | None = None

    @classmethod
    def build(
        cls,
        field: VoxelField,
        below: EditMap,
        edit: Discrete,
        model: LightModel | None,
        include_destination: bool,
        preserve_opacity: bool,
        after: VoxelField | None,
        visibility: CameraVisibility | None,
        pasted: Pasted | None = None,
    ) -> EditContext:
        """Context of an edit of a field under the edits below.

        model: the light model, None to leave light as it is; after: the field with a paste, or None to
        compose it from `pasted`, the content of the paste.
        """
        # The field's visible surfaces are not where the edits below have moved them.
        visibility = None if below.steps else visibility
        include_destination = include_destination and not isinstance(edit, Delete)
        voxel = float(field.voxel_size.max())
        active_model = model if model is not None and model.has_effect else LightModel((), ())
        light_spacing = min(
            LIGHT_SPACING_VOXELS * voxel, LIGHT_SPACING_SHARE * active_model.max_radius or np.inf
        )
        box = patch_box(
            edit,
            voxel,
            active_model.max_radius,
            include_destination=include_destination,
            shadow_directions=active_model.shadow_directions,
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
                include_destination,
                visibility,
                light_spacing,
                extract_surfels(block),
            )
        inside = edit.inner.contains(before.positions(np.ones(before.shape, bool))).reshape(before.shape)
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
            include_destination,
            visibility,
            light_spacing,
        )

    @cached_property
    def surface(self) -> Mask:
        """Mask [X,Y,Z] of the surface vertices outside V^c."""
        return np.asarray(self.emptied.surface & ~self.inside)

    @cached_property
    def remaining_coordinates(self) -> Array:
        """Block coordinates [N,3] of the surfels in `remaining`."""
        return self.before.block_coordinates(self.remaining.points)

    def _distance_from(self, mask: Mask, spacing: float = 1.0) -> Array:
        """Distances [N] of the surfels in `remaining` from the vertices of a mask [X,Y,Z]."""
        if not mask.any():
            return np.full(len(self.remaining_coordinates), np.inf)
        distance = ndimage.distance_transform_edt(~mask, sampling=spacing)
        return np.asarray(
            ndimage.map_coordinates(distance, self.remaining_coordinates.T, order=1, mode="nearest")
        )

    @cached_property
    def near_part(self) -> NDArray[np.bool_]:
        """Mask [N] of the surfels in `remaining` around V^c."""
        size = float(np.median(self.edit.inner.aabb[1] - self.edit.inner.aabb[0]))
        return np.asarray(
            self._distance_from(self.inside) < max(SUPPORT_DISTANCE_VOXELS, 0.5 * size / self.voxel)
        )

    @property
    def contact(self) -> Array:
        """Block coordinates [N,3] of the surfels in `remaining` that the part hides by contact."""
        return self.remaining_coordinates[
            self.near_part & (self._distance_from(self.part) < CONTACT_DISTANCE_VOXELS)
        ]

    def find_support(self) -> Support | None:
        """Support plane that the part stood on; None without one."""
        return find_support(self.part, self.remaining, self.remaining_coordinates, self.near_part, self.voxel)

    @property
    def voxel(self) -> float:
        """Longest edge of a voxel, world units."""
        return max(self.before.spacing)

    @cached_property
    def _surfels(self) -> tuple[Surfels, NDArray[np.bool_]]:
        """(surfels before the edit, mask [N] of those of the part)."""
        surface = extract_surfels(self.before)
        if self.visibility is not None:
            surface = prefer_visible(surface, self.visibility.surface.crop_to_block(self.before), self.voxel)
        surface = surface.downsample(self.voxel)
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
        return -_log_light_change(model, self.light_surfels, self.remaining, self.removed, self.voxel)

    def light_change_at_destination(
        self, under: GridBlock, footprint: Footprint | None, model: LightModel, strength: float
    ) -> tuple[LightChange, LightChange | None]:
        """(change of light on a block, on the part or None) with the part at its destination.

        under: the block without the part; footprint: its inpainted columns; strength: of the part's shade
        on it. A paste keeps its own light.
        """
        remaining = self.remaining
        if footprint is not None:
            points = footprint.points(under)
            inpainted = Surfels(points, np.broadcast_to(footprint.support.normal, points.shape))
            remaining = concatenate_surfels(
                [remaining.take(~footprint.contains(self.remaining_coordinates)), inpainted]
            )
        light_surfels = remaining.downsample(self.light_spacing)
        if self.pasted is not None:
            added = self.pasted.take(remaining.distance(self.pasted.points) > 0.5 * self.voxel)
            log = _log_light_change(model, light_surfels, remaining, added, self.voxel)
            return LightChange.from_surfels(under, light_surfels, log, self.light_spacing), None
        part, moved = self._move(self.removed)
        # With its cut faces: the part is solid at its destination, not a shell.
        moved_solid = concatenate_surfels(
            [moved, self._move(extract_cut_faces(self.before, self.edit.inner))[1]]
        )
        log = strength * _log_light_change(model, light_surfels, remaining, moved_solid, self.voxel)
        change = LightChange.from_surfels(under, light_surfels, log, self.light_spacing)
        before = [self.surroundings, self.removed]
        log = model.log_light([remaining, moved_solid], moved) - model.log_light(before, part)
        log = np.where(np.abs(log) < MIN_LOG_CHANGE, 0.0, log)
        on_part = LightChange.from_surfels(self.before, part, log, self.light_spacing)
        mask = on_part.mask & self.inside
        return change, LightChange(mask, on_part.log_ratio[self.inside[on_part.mask]])

    @property
    def _onto_deformed(self) -> HexahedronMap:
        """Map of V^c onto V."""
        return self.edit.map_between(self.edit.inner, self.edit.deformed).inverse

    def _move(self, surface: Surfels) -> tuple[Surfels, Surfels]:
        """(surfels inside V^c, the same surfels at the destination)."""
        inside, points, jacobian = self._onto_deformed(surface.points)
        part = surface.take(inside)
        return part, part.transform(points, jacobian)

    def extract_part(self, block: GridBlock, destination: GridBlock) -> GridBlock | None:
        """Block of the part as shown at its destination; None if it is unchanged.

        The part is feathered into `destination`. Vertices away from the part have no color.
        """
        feather = self.edit.feather if self.include_destination and not isinstance(self.edit, Paste) else 0.0
        if block is self.before and feather == 0.0:
            return None
        if feather > 0.0:
            block = feather_rim(block, destination, self._onto_deformed, self.inside, feather)
        is_near = ndimage.binary_dilation(self.inside, iterations=2)
        vertices = np.argwhere(is_near)
        part = replace(block, slot=np.where(is_near, block.slot, -1))
        return part.crop(vertices.min(axis=0), vertices.max(axis=0)) if len(vertices) else part


def _log_light_change(
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
