"""Grid blocks of a voxel field under edits: density and colors at the block's vertices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cagefield.completion.surfaces.grid_block import GridBlock, world_positions
from cagefield.compute.cancellation import check_cancelled
from cagefield.compute.parallel_parts import map_parts
from cagefield.edits import EditMap
from cagefield.edits.grade import grade_sh
from cagefield.edits.mapped_samples import SampleGrade
from cagefield.fields.sh_rotation import rotate_sh_each
from cagefield.fields.voxel_field import VoxelField
from cagefield.typing import Array, Float32

VERTICES_PER_BATCH = 1 << 18
"""Number of vertices that are mapped through the edits at a time."""


def extract_block(
    field: VoxelField, below: EditMap, box: Array, *, preserve_opacity: bool = True
) -> GridBlock:
    """Block that holds a world-space box [2,3], of a field under edits.

    Vertices that the edits leave alone are copied. Elsewhere density and colors are interpolated at
    canonical points, and colors are rotated; a vertex that the edits empty has neither. With
    `preserve_opacity` density is multiplied by |det J|^(1/3), the mean stretch over directions.
    """
    low, shape = vertex_range(field, box)
    return extract_vertices(field, below, low, shape, preserve_opacity=preserve_opacity)


def vertex_range(field: VoxelField, box: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(lowest vertex [3], number of vertices [3]) of the part of a field's grid that holds a box [2,3]."""
    corners = np.stack(np.meshgrid(*box.T, indexing="ij"), axis=-1).reshape(-1, 3)
    g = field.grid_coordinates(corners)
    last = np.array(field.resolution) - 1
    low = np.clip(np.floor(g.min(axis=0)).astype(np.int64) - 1, 0, np.maximum(last - 2, 0))
    high = np.minimum(np.ceil(g.max(axis=0)).astype(np.int64) + 1, last)
    # A normal needs three vertices along each axis.
    return low, np.minimum(np.maximum(high - low + 1, 3), last - low + 1)


def extract_vertices(
    field: VoxelField,
    below: EditMap,
    low: NDArray[np.int64],
    shape: NDArray[np.int64],
    *,
    preserve_opacity: bool = True,
) -> GridBlock:
    """Block of `shape` [3] vertices of a field under edits, from vertex `low` [3] on (`extract_block`)."""
    check_cancelled()
    block = _extract_stored(field, low, shape)
    if not below.steps:
        return block
    parts = [
        _sample_changed(
            block,
            below,
            np.arange(first, min(first + VERTICES_PER_BATCH, block.density.size)),
            preserve_opacity,
        )
        for first in range(0, block.density.size, VERTICES_PER_BATCH)
    ]
    rows, raw, sh = (np.concatenate(column) for column in zip(*parts, strict=True))
    # Keep colors and negative densities of empty vertices: the zero crossing places the surface at sub-voxel
    # precision.
    stored = (raw != 0.0) | sh.any(axis=(1, 2))
    density, slot = block.density.copy(), block.slot.copy()
    density.flat[rows], slot.flat[rows] = raw, -1
    slot.flat[rows[stored]] = len(block.sh) + np.arange(int(stored.sum()))
    return replace(block, density=density, slot=slot, sh=np.concatenate([block.sh, sh[stored]]))


def _extract_stored(field: VoxelField, low: NDArray[np.int64], shape: NDArray[np.int64]) -> GridBlock:
    """Block of the field without edits, from vertex `low` [3] on."""
    _, ny, nz = field.resolution
    # The stored vertices of a row of the block along z are neighbors in the field.
    first = ((np.arange(shape[0]) + low[0])[:, None] * ny + np.arange(shape[1]) + low[1]).reshape(-1)
    first = first * nz + low[2]
    begin, end = np.searchsorted(field.vertices, np.stack([first, first + shape[2]]))
    check_cancelled()
    count = end - begin
    rows = np.repeat(begin - np.cumsum(count) + count, count) + np.arange(count.sum())
    index = field.vertices[rows] + np.repeat(np.arange(len(first)) * shape[2] - first, count)
    density, slot = np.zeros(shape, np.float32), np.full(shape, -1, np.int64)
    density.flat[index] = field.density[rows]
    slot.flat[index] = np.arange(len(rows))
    sh = np.empty((len(rows), *field.sh.shape[1:]), np.float32)
    map_parts(lambda part: field.sh.take(rows[part], 0, sh[part]), len(rows), VERTICES_PER_BATCH)
    return GridBlock(field, low, density, slot, sh)


def _sample_changed(
    block: GridBlock, below: EditMap, rows: NDArray[np.int64], preserve_opacity: bool
) -> tuple[NDArray[np.int64], Float32, Float32]:
    """(rows [M], density [M], sh [M,K,3]) of the vertices among `rows` that the edits change."""
    points = world_positions(block.field, np.stack(np.unravel_index(rows, block.shape), axis=1) + block.low)
    in_boxes = np.zeros(len(rows), bool)
    for box in below.boxes:
        in_boxes |= ((points >= box[0]) & (points <= box[1])).all(axis=1)
    rows, points = rows[in_boxes], points[in_boxes]
    mapped = below.to_canonical(points)
    is_changed = (mapped.points != points).any(axis=1) | (mapped.layer != 0)
    if mapped.grade is not None:
        is_changed |= (mapped.grade.colors != np.eye(3)).any(axis=(1, 2)) | (mapped.grade.density != 1.0)
    sources = (block.field, *below.layers)
    jacobian = mapped.jacobian[is_changed]
    raw, sh = _sample_layers(sources, mapped.layer[is_changed], mapped.points[is_changed], jacobian)
    if mapped.grade is not None:
        raw, sh = _graded(raw, sh, mapped.grade.take(is_changed))
    return rows[is_changed], raw * _mean_stretch(jacobian) if preserve_opacity else raw, sh


def sample_edited_field(
    field: VoxelField,
    below: EditMap,
    points: Array,
    turn: Array | None = None,
    *,
    preserve_opacity: bool = True,
) -> tuple[Float32, Float32]:
    """(density [N] before its clamp, sh [N,K,3]) of a field under edits at points [N,3].

    Colors are rotated by the edits and then by the Jacobians `turn` [N,3,3]; density as in `extract_block`.
    """
    check_cancelled()
    mapped = below.to_canonical(points)
    jacobian = mapped.jacobian if turn is None else mapped.jacobian @ np.linalg.inv(turn)
    raw, sh = _sample_layers((field, *below.layers), mapped.layer, mapped.points, jacobian)
    if mapped.grade is not None:
        raw, sh = _graded(raw, sh, mapped.grade)
    return raw * _mean_stretch(jacobian) if preserve_opacity else raw, sh


def _graded(raw: Float32, sh: Float32, grade: SampleGrade) -> tuple[Float32, Float32]:
    """Density [N] and harmonics [N,K,3] after the grades of edits."""
    return raw * grade.density.astype(np.float32), grade_sh(sh, grade.colors)


def _sample_layers(
    sources: Sequence[VoxelField], layer: NDArray[np.int64], points: Array, jacobian: Array
) -> tuple[Float32, Float32]:
    """(density [N], rotated sh [N,K,3]) at canonical points of the source that `layer` [N] numbers."""
    density = np.zeros(len(points), np.float32)
    sh = np.zeros((len(points), *sources[0].sh.shape[1:]), np.float32)
    for number, source in enumerate(sources):
        points_of_layer = np.flatnonzero(layer == number)
        if len(points_of_layer):
            density[points_of_layer], coefficients = interpolate_field(source, points[points_of_layer])
            sh[points_of_layer] = rotate_sh_each(coefficients, _color_rotations(jacobian[points_of_layer]))
    return density, sh


def interpolate_field(field: VoxelField, points: Array) -> tuple[Float32, Float32]:
    """(density [N] before its clamp, sh [N,K,3]) of a field at canonical points [N,3]; 0 outside its grid."""
    check_cancelled()
    n = np.array(field.resolution)
    g = field.grid_coordinates(points)
    inside = ((g >= 0) & (g <= n - 1)).all(axis=1)
    base = np.clip(np.floor(g).astype(np.int64), 0, n - 2)
    fraction = g - base
    raw, sh = np.zeros(len(g)), np.zeros((len(g), *field.sh.shape[1:]))
    for corner in range(8):
        offset = np.array([corner & 1, corner >> 1 & 1, corner >> 2 & 1])
        slot, stored = field.lookup(base + offset)
        weight = np.where(offset == 1, fraction, 1 - fraction).prod(axis=1) * stored * inside
        raw += weight * field.density[slot]
        sh += weight[:, None, None] * field.sh[slot]
    return raw.astype(np.float32), sh.astype(np.float32)


def _mean_stretch(jacobian: Array) -> Float32:
    """|det J|^(1/3) [N]: the stretch |J d|, a mean over directions d."""
    return np.cbrt(np.abs(np.linalg.det(jacobian))).astype(np.float32)


def _color_rotations(jacobian: Array) -> Array:
    """Rotations [N,3,3] of colors from canonical to deformed space: transposed polar rotations of J."""
    u, _, v = np.linalg.svd(jacobian)
    return np.asarray(np.swapaxes(u @ v, 1, 2))
