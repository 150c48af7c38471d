"""Dense block of a voxel field's grid under the edits below a patch: the domain of all patch computations.

Notation: vertices of the block are numbered from its lowest one, whose grid coordinates are `low`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.completion.surfaces.near_masks import slices_around
from cagefield.compute.cancellation import check_cancelled
from cagefield.edits import EditMap
from cagefield.edits.grade import grade_sh
from cagefield.edits.mapped_samples import SampleGrade
from cagefield.fields.contraction import uncontract
from cagefield.fields.sh import C0, scale_sh_colors
from cagefield.fields.sh_rotation import rotate_sh_each
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Float32, Mask

VERTICES_PER_BATCH = 1 << 18
"""Number of vertices that are mapped through the edits at a time."""

MIN_COEFFICIENT_DIFFERENCE = 0.01
"""Minimum visible difference of spherical-harmonics coefficients: at most a hundredth of the range of
colors.
"""

SOLID_OPTICAL_DEPTH = 0.3
"""Minimum optical depth per voxel of a solid vertex."""

OCCUPIED_OPTICAL_DEPTH = 0.12
"""Minimum optical depth per voxel of fog that counts as occupied in gaps of solid vertices."""


NORMAL_REACH_VERTICES = 7
"""Vertices around one that its normal depends on: the support of the Gaussian, and of the gradient."""


@dataclass(frozen=True, eq=False)
class GridBlock:
    """Dense vertices [X,Y,Z] of a field's grid: density per world unit, and colors where stored.

    Attributes:
        low: [3], grid coordinates of vertex (0, 0, 0).
        density: [X,Y,Z], before the clamp at 0.
        slot: [X,Y,Z], row of `sh` of a vertex, -1 without color.
        sh: [M,K,3], spherical-harmonics coefficients.
        stride: vertices per cell and axis; above 1 each cell stands for one vertex at the cell's center
            (`pool`).
    """

    field: VoxelField
    low: NDArray[np.int64]
    density: Float32
    slot: NDArray[np.int64]
    sh: Float32
    stride: int = 1

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of vertices along x, y and z."""
        return self.density.shape

    @cached_property
    def vertices(self) -> NDArray[np.int64]:
        """Linear indices [X,Y,Z] of the vertices in the field's grid."""
        axes = [np.arange(n) + first for n, first in zip(self.shape, self.low, strict=True)]
        _, ny, nz = self.field.resolution
        return np.asarray((axes[0][:, None, None] * ny + axes[1][:, None]) * nz + axes[2])

    @cached_property
    def depth(self) -> Float32:
        """Optical depth [X,Y,Z] over the edge of a voxel."""
        return np.maximum(self.density, 0.0) * np.float32(self.field.sample_spacing)

    @property
    def solid(self) -> Mask:
        """Mask [X,Y,Z] of opaque vertices."""
        return np.asarray(self.depth > SOLID_OPTICAL_DEPTH)

    @cached_property
    def occupied(self) -> Mask:
        """Mask [X,Y,Z] of solid vertices, of fog in their gaps, and of cavities that these enclose.

        Photos do not constrain the density behind a surface: fields are hollow there, or foggy.
        """
        check_cancelled()
        solid = np.pad(self.solid, 2)
        closed = ndimage.binary_closing(solid, ndimage.generate_binary_structure(3, 2))[2:-2, 2:-2, 2:-2]
        return np.asarray(
            ndimage.binary_fill_holes(self.solid | (closed & (self.depth > OCCUPIED_OPTICAL_DEPTH)))
        )

    @cached_property
    def surface(self) -> Mask:
        """Mask [X,Y,Z] of the outermost solid vertices with a defined normal."""
        has_normal = (self.normals**2).sum(axis=-1) > 0.25
        return np.asarray(self.solid & ndimage.binary_dilation(~self.occupied) & has_normal)

    @cached_property
    def normals(self) -> Float32:
        """Unit normals [X,Y,Z,3], against the gradient of the smoothed opacity; 0 without a gradient."""
        if min(self.shape) < 3:
            return np.zeros((*self.shape, 3), np.float32)
        check_cancelled()
        smooth = ndimage.gaussian_filter(1.0 - np.exp(-self.depth), 1.2)
        check_cancelled()
        slope = -np.stack(np.gradient(smooth), axis=-1) / self.field.voxel_size.astype(np.float32)
        check_cancelled()
        length = np.sqrt(np.einsum("xyza,xyza->xyz", slope, slope))[..., None]
        return np.asarray(slope / np.maximum(length, 1e-6), np.float32)

    def normals_at(self, mask: Mask) -> Float32:
        """Unit normals [N,3] at the vertices of a mask [X,Y,Z]: `normals`, computed around the mask alone."""
        around = slices_around(mask, NORMAL_REACH_VERTICES)
        if "normals" in self.__dict__ or not mask[around].size:
            return self.normals[mask]
        return replace(self, density=self.density[around]).normals[mask[around]]

    def positions(self, mask: Mask) -> Array:
        """World positions [N,3] of the vertices of a mask [X,Y,Z]."""
        center = 0.5 * (self.stride - 1)
        return world_positions(self.field, self.stride * np.argwhere(mask) + self.low + center)

    def interpolate(self, values: GridValues, points: Array, outside: float = 0.0) -> NDArray[np.float64]:
        """Trilinear interpolation [N] of `values` [X,Y,Z] at world positions [N,3]."""
        coordinates = self.block_coordinates(points).T
        return np.asarray(ndimage.map_coordinates(values, coordinates, np.float64, order=1, cval=outside))

    def block_coordinates(self, points: Array) -> Array:
        """Block coordinates [N,3] of world positions [N,3]; neighboring vertices have distance 1."""
        center = 0.5 * (self.stride - 1)
        return np.asarray((self.field.grid_coordinates(points) - self.low - center) / self.stride)

    @property
    def spacing(self) -> tuple[float, float, float]:
        """Distances of neighboring vertices along x, y and z, world units."""
        x, y, z = (self.stride * float(edge) for edge in self.field.voxel_size)
        return x, y, z

    def pool(self, stride: int) -> GridBlock:
        """Block of cells of stride^3 vertices, each with their largest density; without colors."""
        if stride == 1:
            return self
        padding = [(0, -n % stride) for n in self.shape]
        x, y, z = (-(-n // stride) for n in self.shape)
        density = np.pad(self.density, padding).reshape(x, stride, y, stride, z, stride).max(axis=(1, 3, 5))
        padded_slot = np.pad(self.slot, padding, constant_values=-1)
        slot = np.minimum(padded_slot.reshape(x, stride, y, stride, z, stride).max(axis=(1, 3, 5)), 0)
        return replace(self, density=density, slot=slot, sh=self.sh[:1], stride=stride)

    def pad_to(self, box: Array) -> GridBlock:
        """Block padded with empty vertices to hold a world-space box [2,3], also outside the field's grid."""
        if self.field.contracted:
            return self
        grid = (self.field.grid_coordinates(box) - self.low) / self.stride
        before = np.maximum(np.ceil(-grid[0]), 0.0).astype(np.int64)
        after = np.maximum(np.ceil(grid[1]).astype(np.int64) + 1 - np.array(self.shape), 0)
        padding = list(zip(before.tolist(), after.tolist(), strict=True))
        return replace(
            self,
            low=self.low - self.stride * before,
            density=np.pad(self.density, padding),
            slot=np.pad(self.slot, padding, constant_values=-1),
        )

    def crop_to_changes(self, mask: Mask, region: Cage) -> tuple[Cage, GridBlock]:
        """(cage around the cells of the vertices of a mask [X,Y,Z], block cropped to that cage).

        `region` and the whole block without any such vertex, or outside the uniform part of an unbounded
        field.
        """
        check_cancelled()
        vertices, field = np.argwhere(mask), self.field
        if not len(vertices):
            return region, self
        first, last = vertices.min(axis=0), vertices.max(axis=0)
        # A vertex changes the cells around it, which need all of their vertices.
        low, high = world_positions(field, np.stack([first - 1, last + 1]) + self.low)
        if field.contracted and np.abs((np.stack([low, high]) - field.center) / field.half_size).max() > 1.0:
            return region, self
        return Cage.box(0.5 * (low + high), high - low), self.crop(first - 2, last + 2)

    def with_density(self, mask: Mask, density: Float32, *, slots: bool = False) -> GridBlock:
        """Block with densities [N] at the vertices of a mask [X,Y,Z]; new vertices are gray.

        An empty vertex gets no color except with `slots`: the color shows beside a surface.
        """
        values = self.density.copy()
        values[mask] = density
        is_new = mask & ((values > 0.0) | slots) & (self.slot < 0)
        slot = self.slot.copy()
        slot[is_new] = len(self.sh) + np.arange(int(is_new.sum()))
        sh = np.concatenate([self.sh, np.zeros((int(is_new.sum()), *self.sh.shape[1:]), np.float32)])
        return replace(self, density=values, slot=slot, sh=sh)

    def with_colors(self, mask: Mask, rgb: Array) -> GridBlock:
        """Block with view-independent colors [N,3] at the vertices of a mask [X,Y,Z] with slots."""
        sh = self.sh.copy()
        rows = self.slot[mask]
        sh[rows] = 0.0
        sh[rows, 0] = (rgb - 0.5) / C0
        return self.with_coefficients(sh)

    def scale_colors(self, mask: Mask, ratio: Array) -> GridBlock:
        """Block with colors multiplied by `ratio` [N] at the vertices of a mask [X,Y,Z] with slots."""
        sh = self.sh.copy()
        rows = self.slot[mask]
        sh[rows] = scale_sh_colors(sh[rows], np.repeat(ratio[:, None], 3, axis=1))
        return self.with_coefficients(sh)

    def with_coefficients(self, sh: Float32) -> GridBlock:
        """Block with other coefficients [M,K,3], and all that was computed from its density."""
        block = replace(self, sh=sh)
        block.__dict__.update(
            {name: self.__dict__[name] for name in _CACHED_PROPERTIES if name in self.__dict__}
        )
        return block

    def mean_colors(self, mask: Mask) -> Array:
        """Colors [N,3], means over directions, at the vertices of a mask [X,Y,Z] with slots."""
        return np.asarray(0.5 + C0 * self.sh[self.slot[mask], 0], np.float64)

    def crop(self, first: NDArray[np.int64], last: NDArray[np.int64]) -> GridBlock:
        """Block of the vertices from `first` to `last` [3], both included and clipped to the block."""
        first, last = np.maximum(first, 0), np.minimum(last, np.array(self.shape) - 1)
        slices = tuple(slice(a, b + 1) for a, b in zip(first, last, strict=True))
        return replace(self, low=self.low + first, density=self.density[slices], slot=self.slot[slices])

    def changed_from(self, other: GridBlock, tolerance: float = MIN_COEFFICIENT_DIFFERENCE) -> Mask:
        """Mask [X,Y,Z] of vertices whose density or color differs from an `other` block of the same place."""
        check_cancelled()
        changed = self.density != other.density
        both_colored = (self.slot >= 0) & (other.slot >= 0)
        difference = np.abs(self.sh[self.slot[both_colored]] - other.sh[other.slot[both_colored]]).max(
            axis=(1, 2)
        )
        changed[both_colored] |= difference > tolerance
        return np.asarray(changed | ((self.slot >= 0) != (other.slot >= 0)))

    def to_layer(self) -> VoxelField:
        """Block as a layer of the field: its colored vertices and its two corners."""
        is_stored = self.slot >= 0
        is_stored[0, 0, 0] = is_stored[-1, -1, -1] = True
        slot = self.slot[is_stored]
        rows = np.concatenate([self.sh, np.zeros((1, *self.sh.shape[1:]), np.float32)])
        sh = rows[np.where(slot >= 0, slot, len(self.sh))]
        density = np.where(slot >= 0, self.density[is_stored], np.float32(0.0))
        field = self.field
        return VoxelField(
            field.bounds, field.resolution, self.vertices[is_stored], density, sh, field.contracted
        )


_CACHED_PROPERTIES = [name for name, value in vars(GridBlock).items() if isinstance(value, cached_property)]
"""Properties of a block that do not depend on its colors: all that are cached."""

GridValues = NDArray[np.floating] | NDArray[np.bool_]


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


def world_positions(field: VoxelField, g: GridValues | NDArray[np.int64]) -> Array:
    """World positions [N,3] of grid coordinates [N,3]."""
    lower, upper = field.grid_bounds
    points = lower + np.asarray(g, np.float64) / (np.array(field.resolution) - 1) * (upper - lower)
    if not field.contracted:
        return np.asarray(points)
    return np.asarray(field.center + uncontract(points) * field.half_size)


def _extract_stored(field: VoxelField, low: NDArray[np.int64], shape: NDArray[np.int64]) -> GridBlock:
    """Block of the field without edits, from vertex `low` [3] on."""
    _, ny, nz = field.resolution
    rows = slice(*np.searchsorted(field.vertices, [low[0] * ny * nz, (low[0] + shape[0]) * ny * nz]))
    vertices = field.vertices[rows]
    positions = np.stack([vertices // (ny * nz), vertices // nz % ny, vertices % nz], axis=1) - low
    inside = ((positions >= 0) & (positions < shape)).all(axis=1)
    index = tuple(positions[inside].T)
    density, slot = np.zeros(shape, np.float32), np.full(shape, -1, np.int64)
    density[index] = field.density[rows][inside]
    slot[index] = np.arange(int(inside.sum()))
    return GridBlock(field, low, density, slot, field.sh[rows][inside])


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
