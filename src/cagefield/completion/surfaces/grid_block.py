"""A block of a voxel field's grid, as the edits before a patch make it: what patches are worked out on.

Notation: vertices of the block are numbered from its lowest one; `low` is that one's grid coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.edits import EditStack
from cagefield.fields.contraction import uncontract
from cagefield.fields.sh import C0, scale_sh_colors
from cagefield.fields.sh_rotation import rotate_sh_each
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Float32, Mask

VERTICES_PER_BATCH = 1 << 18
"""Vertices that are taken through the edits at a time."""

MIN_COEFFICIENT_DIFFERENCE = 0.01
"""A difference between colour coefficients that shows: a hundredth of the range, or less."""

SOLID_OPTICAL_DEPTH = 0.3
"""Optical depth per voxel from which on a vertex counts as solid."""

OCCUPIED_OPTICAL_DEPTH = 0.12
"""The same of a vertex that is more than air."""


@dataclass(frozen=True, eq=False)
class GridBlock:
    """Vertices [X,Y,Z] of a field's grid: density per world unit, and colours where there is density.

    slot [X,Y,Z] is the row of `sh` [M,K,3], -1 where a vertex has no colour. In a block of a `stride` above 1
    cells of so many vertices an axis stand for vertices (`pooled`), each at the cell's middle.
    """

    field: VoxelField
    low: NDArray[np.int64]
    density: Float32
    slot: NDArray[np.int64]
    sh: Float32
    stride: int = 1

    @property
    def shape(self) -> tuple[int, ...]:
        return self.density.shape

    @cached_property
    def vertices(self) -> NDArray[np.int64]:
        """Linear indices [X,Y,Z] of the vertices in the field's grid."""
        at = [np.arange(n) + first for n, first in zip(self.shape, self.low, strict=True)]
        _, ny, nz = self.field.resolution
        return np.asarray((at[0][:, None, None] * ny + at[1][:, None]) * nz + at[2])

    @cached_property
    def depth(self) -> Float32:
        """Optical depth [X,Y,Z] over a voxel's edge."""
        return np.maximum(self.density, 0.0) * np.float32(self.field.sample_spacing)

    @property
    def solid(self) -> Mask:
        """[X,Y,Z], True where the vertex is opaque."""
        return np.asarray(self.depth > SOLID_OPTICAL_DEPTH)

    @cached_property
    def matter(self) -> Mask:
        """[X,Y,Z], True where there is something: what is solid, the fog in its gaps, and what these enclose.

        Photos say nothing of what is behind a surface: fields are hollow there, or foggy.
        """
        solid = np.pad(self.solid, 2)
        closed = ndimage.binary_closing(solid, ndimage.generate_binary_structure(3, 2))[2:-2, 2:-2, 2:-2]
        return np.asarray(
            ndimage.binary_fill_holes(self.solid | (closed & (self.depth > OCCUPIED_OPTICAL_DEPTH)))
        )

    @cached_property
    def surface(self) -> Mask:
        """[X,Y,Z], the outermost solid vertices, where the normal is known."""
        known = (self.normals**2).sum(axis=-1) > 0.25
        return np.asarray(self.solid & ndimage.binary_dilation(~self.matter) & known)

    @cached_property
    def normals(self) -> Float32:
        """Unit normals [X,Y,Z,3], against the gradient of a smoothed opacity; 0 where that is flat."""
        if min(self.shape) < 3:
            return np.zeros((*self.shape, 3), np.float32)
        smooth = ndimage.gaussian_filter(1.0 - np.exp(-self.depth), 1.2)
        slope = -np.stack(np.gradient(smooth), axis=-1) / self.field.voxel_size
        length = np.linalg.norm(slope, axis=-1, keepdims=True)
        return np.asarray(slope / np.maximum(length, 1e-6), np.float32)

    def positions(self, where: Mask) -> Array:
        """World positions [N,3] of the vertices of a mask [X,Y,Z]."""
        middle = 0.5 * (self.stride - 1)
        return world_positions(self.field, self.stride * np.argwhere(where) + self.low + middle)

    def lookup(self, values: GridValues, points: Array, outside: float = 0.0) -> NDArray[np.float64]:
        """Values [X,Y,Z] of the block interpolated at world positions [N,3]."""
        at = self.coordinates(points).T
        return np.asarray(ndimage.map_coordinates(values, at, np.float64, order=1, cval=outside))

    def coordinates(self, points: Array) -> Array:
        """Coordinates [N,3] of world positions [N,3] in the block, its vertices apart by 1."""
        middle = 0.5 * (self.stride - 1)
        return np.asarray((self.field.grid_coordinates(points) - self.low - middle) / self.stride)

    @property
    def spacing(self) -> tuple[float, float, float]:
        """World distances of neighbours along x, y and z."""
        x, y, z = (self.stride * float(edge) for edge in self.field.voxel_size)
        return x, y, z

    def pooled(self, stride: int) -> GridBlock:
        """A block of cells of so many vertices an axis, each as dense as its densest; without colours."""
        if stride == 1:
            return self
        padding = [(0, -n % stride) for n in self.shape]
        x, y, z = (-(-n // stride) for n in self.shape)
        density = np.pad(self.density, padding).reshape(x, stride, y, stride, z, stride).max(axis=(1, 3, 5))
        known = np.pad(self.slot, padding, constant_values=-1)
        slot = np.minimum(known.reshape(x, stride, y, stride, z, stride).max(axis=(1, 3, 5)), 0)
        return replace(self, density=density, slot=slot, sh=self.sh[:1], stride=stride)

    def reaching(self, box: Array) -> GridBlock:
        """The block grown by empty vertices to hold a world-space box [2,3], also beyond the field's grid."""
        if self.field.contracted:
            return self
        g = (self.field.grid_coordinates(box) - self.low) / self.stride
        before = np.maximum(np.ceil(-g[0]), 0.0).astype(np.int64)
        after = np.maximum(np.ceil(g[1]).astype(np.int64) + 1 - np.array(self.shape), 0)
        padding = list(zip(before.tolist(), after.tolist(), strict=True))
        return replace(
            self,
            low=self.low - self.stride * before,
            density=np.pad(self.density, padding),
            slot=np.pad(self.slot, padding, constant_values=-1),
        )

    def around(self, changed: Mask, region: Cage) -> tuple[Cage, GridBlock]:
        """(the part of a region that shows the vertices of a mask [X,Y,Z], the block cropped to it)."""
        at, field = np.argwhere(changed), self.field
        if not len(at):
            return region, self
        first, last = at.min(axis=0), at.max(axis=0)
        # A vertex shows in the cells around it, which need their own vertices.
        low, high = world_positions(field, np.stack([first - 1, last + 1]) + self.low)
        if field.contracted and np.abs((np.stack([low, high]) - field.center) / field.half_size).max() > 1.0:
            return region, self
        return Cage.box(0.5 * (low + high), high - low), self.cropped(first - 2, last + 2)

    def with_density(self, where: Mask, density: Float32, *, slots: bool = False) -> GridBlock:
        """The block with the densities [N] at the vertices of a mask; those without colour become grey.

        Empty ones have no colour unless they get `slots`: beside a surface it shows.
        """
        values = self.density.copy()
        values[where] = density
        fresh = where & ((values > 0.0) | slots) & (self.slot < 0)
        slot = self.slot.copy()
        slot[fresh] = len(self.sh) + np.arange(int(fresh.sum()))
        sh = np.concatenate([self.sh, np.zeros((int(fresh.sum()), *self.sh.shape[1:]), np.float32)])
        return replace(self, density=values, slot=slot, sh=sh)

    def with_colours(self, where: Mask, rgb: Array) -> GridBlock:
        """The block with colours [N,3], the same in all directions, at the vertices of a mask with slots."""
        sh = self.sh.copy()
        rows = self.slot[where]
        sh[rows] = 0.0
        sh[rows, 0] = (rgb - 0.5) / C0
        return replace(self, sh=sh)

    def relit(self, where: Mask, ratio: Array) -> GridBlock:
        """The block with the colours at the vertices of a mask multiplied by ratios [N]."""
        sh = self.sh.copy()
        rows = self.slot[where]
        sh[rows] = scale_sh_colors(sh[rows], np.repeat(ratio[:, None], 3, axis=1))
        return replace(self, sh=sh)

    def colours(self, where: Mask) -> Array:
        """Colours [N,3], the mean over directions, at the vertices of a mask with slots."""
        return np.asarray(0.5 + C0 * self.sh[self.slot[where], 0], np.float64)

    def cropped(self, first: NDArray[np.int64], last: NDArray[np.int64]) -> GridBlock:
        """The vertices from `first` to `last` [3], both of them included, or as far as the block goes."""
        first, last = np.maximum(first, 0), np.minimum(last, np.array(self.shape) - 1)
        part = tuple(slice(a, b + 1) for a, b in zip(first, last, strict=True))
        return replace(self, low=self.low + first, density=self.density[part], slot=self.slot[part])

    def differs(self, other: GridBlock, noticed: float = MIN_COEFFICIENT_DIFFERENCE) -> Mask:
        """Vertices [X,Y,Z] where it has another density than a block of the same place, or other colours."""
        changed = self.density != other.density
        both = (self.slot >= 0) & (other.slot >= 0)
        apart = np.abs(self.sh[self.slot[both]] - other.sh[other.slot[both]]).max(axis=(1, 2))
        changed[both] |= apart > noticed
        return np.asarray(changed | ((self.slot >= 0) != (other.slot >= 0)))

    def layer(self) -> VoxelField:
        """The block as a layer of the field: the vertices with colours, and its two corners."""
        kept = self.slot >= 0
        kept[0, 0, 0] = kept[-1, -1, -1] = True
        slot = self.slot[kept]
        known = np.concatenate([self.sh, np.zeros((1, *self.sh.shape[1:]), np.float32)])
        sh = known[np.where(slot >= 0, slot, len(self.sh))]
        density = np.where(slot >= 0, self.density[kept], np.float32(0.0))
        field = self.field
        return VoxelField(field.bounds, field.resolution, self.vertices[kept], density, sh, field.contracted)


GridValues = NDArray[np.floating] | NDArray[np.bool_]


def extract_block(
    field: VoxelField, below: EditStack, box: Array, *, preserve_opacity: bool = True
) -> GridBlock:
    """The block that holds a world-space box [2,3], as edits make the field.

    Where these leave the field alone its vertices are taken as they are. Where they move it, density and
    colours are interpolated, and colours turned; where they leave nothing there is neither. What they stretch
    is thinner where they `preserve_opacity`, by the mean over directions, |det J|^(1/3).
    """
    corners = np.stack(np.meshgrid(*box.T, indexing="ij"), axis=-1).reshape(-1, 3)
    g = field.grid_coordinates(corners)
    last = np.array(field.resolution) - 1
    low = np.clip(np.floor(g.min(axis=0)).astype(np.int64) - 1, 0, np.maximum(last - 2, 0))
    high = np.minimum(np.ceil(g.max(axis=0)).astype(np.int64) + 1, last)
    # Normals need three vertices.
    shape = np.minimum(np.maximum(high - low + 1, 3), last - low + 1)
    block = _extract_stored(field, low, shape)
    if not below.active:
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
    # Empty vertices beside a surface keep their colours, and what makes it sharp: densities below zero.
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
    """The block of the field itself."""
    _, ny, nz = field.resolution
    rows = slice(*np.searchsorted(field.vertices, [low[0] * ny * nz, (low[0] + shape[0]) * ny * nz]))
    vertices = field.vertices[rows]
    at = np.stack([vertices // (ny * nz), vertices // nz % ny, vertices % nz], axis=1) - low
    inside = ((at >= 0) & (at < shape)).all(axis=1)
    place = tuple(at[inside].T)
    density, slot = np.zeros(shape, np.float32), np.full(shape, -1, np.int64)
    density[place] = field.density[rows][inside]
    slot[place] = np.arange(int(inside.sum()))
    return GridBlock(field, low, density, slot, field.sh[rows][inside])


def _sample_changed(
    block: GridBlock, below: EditStack, rows: NDArray[np.int64], preserve_opacity: bool
) -> tuple[NDArray[np.int64], Float32, Float32]:
    """(rows [M], density [M], sh [M,K,3]) of those of some vertices (flat indices) that the edits change."""
    points = world_positions(block.field, np.stack(np.unravel_index(rows, block.shape), axis=1) + block.low)
    near = np.zeros(len(rows), bool)
    for box in below.boxes:
        near |= ((points >= box[0]) & (points <= box[1])).all(axis=1)
    rows, points = rows[near], points[near]
    mapped = below.to_canonical(points)
    changed = (mapped.points != points).any(axis=1) | (mapped.layer != 0)
    sources = (block.field, *below.layers)
    jacobian = mapped.jacobian[changed]
    raw, sh = _sample_layers(sources, mapped.layer[changed], mapped.points[changed], jacobian)
    return rows[changed], raw * _mean_stretch(jacobian) if preserve_opacity else raw, sh


def sample_edited_field(
    field: VoxelField,
    below: EditStack,
    points: Array,
    turn: Array | None = None,
    *,
    preserve_opacity: bool = True,
) -> tuple[Float32, Float32]:
    """(density [N] before its clamp, sh [N,K,3]) of a field under edits at points [N,3].

    Colours are turned as the edits turn them and, after that, as the Jacobians `turn` [N,3,3] do; density as
    for `block_of`.
    """
    mapped = below.to_canonical(points)
    jacobian = mapped.jacobian if turn is None else mapped.jacobian @ np.linalg.inv(turn)
    raw, sh = _sample_layers((field, *below.layers), mapped.layer, mapped.points, jacobian)
    return raw * _mean_stretch(jacobian) if preserve_opacity else raw, sh


def _sample_layers(
    sources: Sequence[VoxelField], layer: NDArray[np.int64], points: Array, jacobian: Array
) -> tuple[Float32, Float32]:
    """(density [N], sh [N,K,3]) at canonical points of the sources that `layer` [N] says, colours turned."""
    density = np.zeros(len(points), np.float32)
    sh = np.zeros((len(points), *sources[0].sh.shape[1:]), np.float32)
    for number, source in enumerate(sources):
        here = np.flatnonzero(layer == number)
        if len(here):
            density[here], colours = interpolate_field(source, points[here])
            sh[here] = rotate_sh_each(colours, _color_rotations(jacobian[here]))
    return density, sh


def interpolate_field(field: VoxelField, points: Array) -> tuple[Float32, Float32]:
    """(density [N] before its clamp, sh [N,K,3]) of a field at canonical points; 0 outside of its grid."""
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
    """|det J|^(1/3) [N]: |J d|, in the mean over directions."""
    return np.cbrt(np.abs(np.linalg.det(jacobian))).astype(np.float32)


def _color_rotations(jacobian: Array) -> Array:
    """Rotations [N,3,3] of colours from canonical to deformed space: of J's polar decomposition, inverted."""
    u, _, v = np.linalg.svd(jacobian)
    return np.asarray(np.swapaxes(u @ v, 1, 2))
