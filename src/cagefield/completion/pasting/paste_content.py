"""Content of a paste: a cage of another scene, as a layer of this scene's grid or as splats.

A layer (`fields.voxel_layers`) may hold anything in its block. The content of V^c in the other scene is put
there by a similarity T(p) = q + s (p - p0), and V shows it through the map onto the cage T(V^c). One voxel
of the other scene becomes one of this grid, so that vertices are copied; they are resampled if they do not
fit, or if the ratio of the grids is no integer. T does not rotate, hence colors stay. With
`preserve_opacity` density is divided by s, which is a factor of |J| of the map.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.completion.surfaces.block_extraction import (
    VERTICES_PER_BATCH,
    extract_block,
    sample_edited_field,
)
from cagefield.completion.surfaces.grid_block import SOLID_OPTICAL_DEPTH, GridBlock, world_positions
from cagefield.edits import Edit, EditMap, EditStack
from cagefield.edits.patch import Pasted
from cagefield.errors import EditError
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.rendering.splats.bake_splats import baked_splats
from cagefield.rendering.splats.splitting import split_for_edits
from cagefield.typing import Array, Mask

MARGIN_VERTICES = 2
"""Margin of vertices around T(V^c)."""

MAX_RATIO_DIFFERENCE = 1e-6
"""Maximum relative difference of edges of voxels of one size."""


@dataclass(frozen=True)
class SourceContent:
    """Another scene: its field, its edits with their patches, and its `preserve_opacity`."""

    field: VoxelField | SplatField
    edits: EditMap
    preserve_opacity: bool = True


def extract_content(
    content: SourceContent, cage: Cage, field: VoxelField | SplatField, *, preserve_opacity: bool = True
) -> Pasted:
    """Content of a cage of another scene, as a paste into a field.

    Raises EditError if one field has voxels and the other splats, or if the cage is empty.
    """
    check_kinds(content.field, field)
    if isinstance(field, SplatField) and isinstance(content.field, SplatField):
        return Pasted(splats=_extract_splats(content.field, content, cage, field))
    source = cast(VoxelField, content.field)
    return _extract_voxels(source, content, cage, cast(VoxelField, field), preserve_opacity)


def check_kinds(source: VoxelField | SplatField, field: VoxelField | SplatField) -> None:
    """Raise EditError if the content of one kind of field cannot be pasted into the other."""
    if isinstance(field, SplatField):
        if not isinstance(source, SplatField):
            raise EditError(
                "it holds voxels and this scene splats; export it as splats"
                " (cagefield export SCENE -o THING.ply) and paste that file"
            )
        if field.discs and not source.discs:
            raise EditError(
                "it holds splats of three axes and this scene the discs of 2DGS; paste discs, or paste both"
                " into a scene of splats"
            )
    elif isinstance(source, SplatField):
        raise EditError(
            "it holds splats and this scene voxels; bake it (cagefield bake SCENE -o VOXELS) and paste that"
            " scene"
        )


def content_box(field: VoxelField | SplatField) -> Array:
    """World-space box [2,3] of the content of a field; the bounds of an unbounded field, and of splats."""
    if isinstance(field, SplatField) or field.contracted:
        return np.asarray(field.bounds)
    solid = field.vertices[field.density * field.sample_spacing > SOLID_OPTICAL_DEPTH]
    if not len(solid):
        return np.asarray(field.bounds)
    vertices = np.stack(np.unravel_index(solid, field.resolution), axis=1)
    last = np.array(field.resolution) - 1
    low, high = (
        np.maximum(vertices.min(axis=0) - MARGIN_VERTICES, 0),
        np.minimum(vertices.max(axis=0) + MARGIN_VERTICES, last),
    )
    return world_positions(field, np.stack([low, high]))


def _extract_voxels(
    source: VoxelField, content: SourceContent, cage: Cage, field: VoxelField, preserve_opacity: bool
) -> Pasted:
    """Content of a cage of voxels, as a layer of the field."""
    placement = _GridPlacement.from_cage(source, cage, field)
    block = placement.copy_vertices(content) if placement.is_aligned else placement.resample(content)
    if not (block.density > 0.0).any():
        raise EditError("its cage holds nothing of that scene; move it over something (inner)")
    density = block.density / np.float32(placement.scale if preserve_opacity else 1.0)
    sh = _resize_harmonics(block.sh, field.sh.shape[1])
    layer = GridBlock(field, block.low, density, block.slot, sh).to_layer()
    return Pasted(
        part=layer, place=Cage(placement.transform(cage.corners), pivot=placement.transform(cage.pivot))
    )


@dataclass(frozen=True, eq=False)
class _GridPlacement:
    """Similarity T that puts vertex `first` [3] of the source's grid on vertex `low` [3] of the field's.

    shape [3]: vertices of the field's block; scale: s; ratio [3]: voxels of the source along one of the
    block.
    """

    source: VoxelField
    field: VoxelField
    first: NDArray[np.int64]
    low: NDArray[np.int64]
    shape: NDArray[np.int64]
    scale: float
    ratio: Array

    @classmethod
    def from_cage(cls, source: VoxelField, cage: Cage, field: VoxelField) -> _GridPlacement:
        """Placement of a cage of the source in the field. Raises EditError if the field is too small."""
        voxel, source_voxel = field.voxel_size, source.voxel_size
        low, last = np.zeros(3, np.int64), np.array(field.resolution) - 1
        if field.contracted:
            low, last = -(-last // 4), 3 * last // 4
        box = cage.aabb
        center = (np.array(source.resolution) - 1) / 2.0
        first = np.floor((box[0] - source.center) / source_voxel + center).astype(np.int64) - MARGIN_VERTICES
        source_start = _uniform_position(source, first)
        available = (last - low - MARGIN_VERTICES - 1) * voxel
        if (available <= 0.0).any():
            raise EditError(
                "this scene's grid is too small to hold anything from another one; train it finer"
            )
        scale = float(min((voxel / source_voxel).max(), (available / (box[1] - source_start)).min()))
        shape = np.ceil(scale * (box[1] - source_start) / voxel).astype(np.int64) + MARGIN_VERTICES
        return cls(
            source, field, first, low, np.minimum(shape, last - low + 1), scale, voxel / scale / source_voxel
        )

    @property
    def is_aligned(self) -> bool:
        """Whether vertices of the source lie on vertices of the field."""
        inside = True
        if self.source.contracted:
            ends = np.stack([self.first, self.first + self.shape])
            quarter = (np.array(self.source.resolution) - 1) / 4.0
            inside = bool(((ends >= quarter) & (ends <= 3.0 * quarter)).all())
        return inside and bool(
            (np.abs(self.ratio - 1.0) * self.shape < MAX_RATIO_DIFFERENCE * self.shape.max()).all()
        )

    def transform(self, points: Array) -> Array:
        """T of points [N,3]."""
        start, end = (
            _uniform_position(self.source, self.first),
            world_positions(self.field, self.low[None])[0],
        )
        return np.asarray(end + self.scale * (points - start))

    def copy_vertices(self, content: SourceContent) -> GridBlock:
        """Block of copies of the source's vertices."""
        ends = np.stack([self.first + 1, self.first + self.shape - 2])
        last = np.array(self.source.resolution) - 1
        box = world_positions(self.source, np.clip(ends, 0, last))
        block = extract_block(self.source, content.edits, box, preserve_opacity=content.preserve_opacity)
        skipped = np.maximum(self.first - block.low, 0)
        block = block.crop(skipped, self.first + self.shape - 1 - block.low)
        return replace(block, low=block.low - self.first + self.low)

    def resample(self, content: SourceContent) -> GridBlock:
        """Block of samples of the source at the vertices of the field's grid."""
        density, slot = np.zeros(self.shape, np.float32), np.full(self.shape, -1, np.int64)
        start, edge = _uniform_position(self.source, self.first), self.field.voxel_size / self.scale
        rows_near = np.flatnonzero(self._near_mask(content, start, edge))
        count, sh = 0, []
        for begin in range(0, len(rows_near), VERTICES_PER_BATCH):
            rows = rows_near[begin : begin + VERTICES_PER_BATCH]
            vertices = np.stack(np.unravel_index(rows, self.shape), axis=1)
            values, coefficients = sample_edited_field(
                self.source, content.edits, start + vertices * edge, preserve_opacity=content.preserve_opacity
            )
            is_stored = (values != 0.0) | coefficients.any(axis=(1, 2))
            density.flat[rows] = values
            slot.flat[rows[is_stored]] = count + np.arange(int(is_stored.sum()))
            count += int(is_stored.sum())
            sh.append(coefficients[is_stored])
        none = np.zeros((0, *self.source.sh.shape[1:]), np.float32)
        return GridBlock(self.field, self.low, density, slot, np.concatenate([none, *sh]))

    def _near_mask(self, content: SourceContent, start: Array, edge: Array) -> Mask:
        """Mask [X,Y,Z] of the block's vertices beside a stored vertex of the source, or in its edits."""
        stored = np.zeros(self.source.resolution, bool)
        stored.reshape(-1)[self.source.vertices] = True
        stored = ndimage.maximum_filter(stored, 3)
        mask = np.zeros(self.shape, bool)
        nx, *plane_shape = self.shape
        plane_vertices = np.stack(
            np.meshgrid(*(np.arange(n) for n in plane_shape), indexing="ij"), axis=-1
        ).reshape(-1, 2)
        last = np.array(self.source.resolution) - 1
        for x in range(nx):
            points = (
                start + np.concatenate([np.full((len(plane_vertices), 1), x), plane_vertices], axis=1) * edge
            )
            g = np.round(self.source.grid_coordinates(points)).astype(np.int64)
            inside = ((g >= 0) & (g <= last)).all(axis=1)
            plane = inside & stored[tuple(np.clip(g, 0, last).T)]
            for box in content.edits.boxes:
                plane |= ((points >= box[0]) & (points <= box[1])).all(axis=1)
            mask[x] = plane.reshape(plane_shape)
        return mask


def _uniform_position(field: VoxelField, vertex: NDArray[np.int64]) -> Array:
    """World position [3] of a vertex; of an unbounded field as if all voxels had one size."""
    return np.asarray(field.center + (vertex - (np.array(field.resolution) - 1) / 2.0) * field.voxel_size)


def _extract_splats(source: SplatField, content: SourceContent, cage: Cage, field: SplatField) -> SplatField:
    """Splats in a cage of another scene; those that its faces cut are split."""
    edited = baked_splats(source, content.edits, preserve_opacity=content.preserve_opacity)
    edited = split_for_edits(edited, EditStack([Edit.delete(cage)])).field
    inside = cage.contains(edited.means.astype(np.float64))
    if not inside.any():
        raise EditError("its cage holds nothing of that scene; move it over something (inner)")
    content_splats = edited.take(inside)
    return replace(content_splats, antialiased=field.antialiased, discs=field.discs)


def _resize_harmonics(sh: NDArray[np.float32], terms: int) -> NDArray[np.float32]:
    """Coefficients [N,terms,3]: truncated, or padded with zeros."""
    out = np.zeros((len(sh), terms, 3), np.float32)
    count = min(terms, sh.shape[1])
    out[:, :count] = sh[:, :count]
    return out
