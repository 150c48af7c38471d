"""Destination of a part: the shadow that it casts there, and its own new light."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.completion.edit_context import MIN_LOG_CHANGE, log_light_change
from cagefield.completion.inpainting.feathering import feather_rim
from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.lighting.light_change import LightChange, apply_light
from cagefield.completion.removal import Removal
from cagefield.completion.surfaces.block_extraction import extract_vertices, vertex_range
from cagefield.completion.surfaces.block_union import VertexRange, embed_mask, extend_blocks
from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.completion.surfaces.patch_bounds import destination_box
from cagefield.completion.surfaces.surfels import (
    Surfels,
    concatenate_surfels,
)
from cagefield.compute.parallel_parts import run_both
from cagefield.edits import Discrete, EditMap
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.typing import Array
from cagefield.warps.hexahedron_map import HexahedronMap

SURFACE_MARGIN_VERTICES = 8
"""Margin of vertices that the surfaces of a block depend on: normals, and probes along them."""


class BlockSource(Protocol):
    """Source of the vertices of a grid beyond a block of it."""

    def vertices(self, box: Array) -> VertexRange:
        """Range of the vertices that hold a world-space box [2,3]."""

    def extract(self, low: NDArray[np.int64], shape: NDArray[np.int64]) -> GridBlock:
        """Block of `shape` [3] vertices from vertex `low` [3] on."""


@dataclass(frozen=True, eq=False)
class FieldVertices:
    """Vertices of a voxel field under the edits below."""

    field: VoxelField
    below: EditMap
    preserve_opacity: bool = True

    def vertices(self, box: Array) -> VertexRange:
        low, shape = vertex_range(self.field, box)
        return VertexRange(low, low + shape - 1)

    def extract(self, low: NDArray[np.int64], shape: NDArray[np.int64]) -> GridBlock:
        return extract_vertices(self.field, self.below, low, shape, preserve_opacity=self.preserve_opacity)


@dataclass(frozen=True, eq=False)
class Destination:
    """Block that holds V^c and V, with the part at its new place.

    Attributes:
        removal: the removal of the part, on a part of the block.
        edit: the edit, which says where the part is put down.
        region: the cage outside which nothing changes but in V.
        before: the block as the edits below make it.
        under: the block without the part, with its shadow.
        light: the change of light on all but the part, None where light stays.
        part_light: the change of light on the part, on the removal's `part_block`; None where light stays.
    """

    removal: Removal
    edit: Discrete
    region: Cage
    before: GridBlock
    under: GridBlock
    light: LightChange | None
    part_light: LightChange | None

    @classmethod
    def of_removal(cls, removal: Removal) -> Destination:
        """Destination of a part that is shown nowhere."""
        context = removal.context
        return cls(removal, context.edit, context.region, removal.before, removal.under, removal.light, None)

    def extract_part(self, block: GridBlock) -> GridBlock | None:
        """Block of the part as shown at its destination; None if it is unchanged.

        block: the removal's `part_block`, changed. The part is feathered into its destination. Vertices
        away from the part have no color.
        """
        feather, inside = self.edit.feather, self.removal.inside_part
        if block is self.removal.part_block and feather == 0.0:
            return None
        if feather > 0.0:
            block = feather_rim(block, self.under, _onto_deformed(self.edit), inside, feather)
        is_near = ndimage.binary_dilation(inside, iterations=2)
        vertices = np.argwhere(is_near)
        part = replace(block, slot=np.where(is_near, block.slot, -1))
        return part.crop(vertices.min(axis=0), vertices.max(axis=0)) if len(vertices) else part


def place_part(removal: Removal, edit: Discrete, source: BlockSource) -> Destination:
    """Destination of the part of a removal, of an edit that is no deletion.

    source: the vertices beyond the block of the removal.
    """
    context, model = removal.context, removal.model
    box = destination_box(
        edit,
        context.voxel,
        0.0 if model is None else model.max_radius,
        shadow_directions=None if model is None else model.shadow_directions,
    )
    near, region = VertexRange.from_block(removal.before), context.region
    if box is not None:
        near, region = source.vertices(box), _union(region, box, context.voxel)
    before, under = extend_blocks(removal.before, removal.under, near, source.extract)
    light = removal.light
    if before is not removal.before and light is not None:
        light = LightChange(embed_mask(before, removal.before, light.mask), light.log_ratio)
    if model is None or light is None:
        return Destination(removal, edit, region, before, under, light, None)
    remaining = concatenate_surfels([removal.remaining, _surfels_beyond(removal, before, near)])
    change, part_light = _light_change(removal, edit, remaining, under, model)
    under, light = apply_light(under, change), light.combine(change)
    return Destination(removal, edit, region, before, under, light, part_light)


def _union(region: Cage, box: Array, voxel: float) -> Cage:
    """Box around a region and a box [2,3] without its outermost voxels."""
    low, high = (np.stack([region.aabb, box + voxel * np.array([[1.0], [-1.0]])])[:, k] for k in (0, 1))
    low, high = low.min(axis=0), high.max(axis=0)
    return Cage.box(0.5 * (low + high), high - low)


def _surfels_beyond(removal: Removal, before: GridBlock, near: VertexRange) -> Surfels:
    """Surfels in a range of vertices of a block, beyond the block of a removal."""
    own = removal.before
    beyond = near.beyond(VertexRange.from_block(own))
    if beyond is None:
        return Surfels(np.zeros((0, 3)), np.zeros((0, 3)))
    context, crop = removal.context, beyond.grown(SURFACE_MARGIN_VERTICES)
    block = before.crop(crop.first - before.low, crop.last - before.low)
    surface = context.surfels_of(block)
    coordinates = own.block_coordinates(surface.points)
    is_own = ((coordinates >= 0.0) & (coordinates <= np.array(own.shape) - 1.0)).all(axis=1)
    return surface.take(np.asarray(~is_own))


def _light_change(
    removal: Removal, edit: Discrete, remaining: Surfels, under: GridBlock, model: LightModel
) -> tuple[LightChange, LightChange | None]:
    """(change of light on a block, on the part or None) with the part at its destination.

    remaining: surfels without the part; under: the block without it. A paste keeps its own light.
    """
    context = removal.context
    voxel, spacing = context.voxel, context.light_spacing
    light_surfels = remaining.downsample(spacing)
    if context.pasted is not None:
        added = context.pasted.take(remaining.distance(context.pasted.points) > 0.5 * voxel)
        log = log_light_change(model, light_surfels, remaining, added, voxel)
        return LightChange.from_surfels(under, light_surfels, log, spacing), None
    onto = _onto_deformed(edit)
    in_part, moved = _move(onto, context.removed)
    moved_solid = concatenate_surfels([moved, _move(onto, removal.cut_faces)[1]])
    change_log, log = run_both(
        lambda: log_light_change(model, light_surfels, remaining, moved_solid, voxel),
        lambda: model.log_light([remaining, moved_solid], moved) - removal.log_light_on_part[in_part],
    )
    log = np.where(np.abs(log) < MIN_LOG_CHANGE, 0.0, log)
    part, block = context.removed.take(in_part), removal.part_block
    return run_both(
        lambda: LightChange.from_surfels(under, light_surfels, removal.strength * change_log, spacing),
        lambda: LightChange.from_surfels(block, part, log, spacing, where=removal.inside_part),
    )


def _onto_deformed(edit: Discrete) -> HexahedronMap:
    """Map of V^c onto V."""
    return edit.map_between(edit.inner, edit.deformed).inverse


def _move(onto: HexahedronMap, surface: Surfels) -> tuple[NDArray[np.bool_], Surfels]:
    """(mask [N] of the surfels inside V^c, those surfels at the destination)."""
    inside, points, jacobian = onto(surface.points)
    return inside, surface.take(inside).transform(points, jacobian)
