"""Dense block of a voxel field's grid under the edits below a patch: the domain of all patch computations.

Notation: vertices of the block are numbered from its lowest one, whose grid coordinates are `low`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.completion.surfaces.near_masks import close_gaps, fill_cavities, map_slabs, slices_around
from cagefield.compute.cancellation import check_cancelled
from cagefield.compute.parallel_parts import map_parts
from cagefield.fields.contraction import uncontract
from cagefield.fields.sh import C0, scale_sh_colors
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Float32, Mask

MIN_COEFFICIENT_DIFFERENCE = 0.01
"""Minimum visible difference of spherical-harmonics coefficients: at most a hundredth of the range of
colors.
"""

PART_ROWS = 16_384
"""Rows of coefficients that one thread computes at a time."""

SOLID_OPTICAL_DEPTH = 0.3
"""Minimum optical depth per voxel of a solid vertex."""

OCCUPIED_OPTICAL_DEPTH = 0.12
"""Minimum optical depth per voxel of fog that counts as occupied in gaps of solid vertices."""


NORMAL_DEVIATION_VERTICES = 1.2
"""Standard deviation of the Gaussian with which opacity is smoothed for normals, vertices."""

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
        closed = close_gaps(self.solid) & (self.depth > OCCUPIED_OPTICAL_DEPTH)
        check_cancelled()
        return fill_cavities(self.solid | closed)

    @cached_property
    def surface(self) -> Mask:
        """Mask [X,Y,Z] of the outermost solid vertices with a defined normal."""
        surface = self.solid & ndimage.binary_dilation(~self.occupied)
        surface[surface] = (self.normals_at(surface) ** 2).sum(axis=-1) > 0.25
        return surface

    @cached_property
    def _smooth_opacity(self) -> Float32:
        """Opacity [X,Y,Z] of vertices after a Gaussian filter."""
        values = map_slabs(lambda slab: np.float32(1.0) - np.exp(-slab), self.depth, 0)
        for axis in range(3):
            smooth = partial(ndimage.gaussian_filter1d, sigma=NORMAL_DEVIATION_VERTICES, axis=axis)
            values = map_slabs(smooth, values, 1 if axis == 0 else 0)
        return values

    def normals_at(self, mask: Mask) -> Float32:
        """Unit normals [N,3] at the vertices of a mask [X,Y,Z]; 0 without a gradient.

        Normals are against the gradient of the smoothed opacity, which is computed around the mask alone.
        """
        if min(self.shape) < 3:
            return np.zeros((np.count_nonzero(mask), 3), np.float32)
        around = slices_around(mask, NORMAL_REACH_VERTICES)
        if "_smooth_opacity" not in self.__dict__ and mask[around].size not in (0, mask.size):
            return replace(self, density=self.density[around]).normals_at(mask[around])
        vertices = np.nonzero(mask)
        slope = np.empty((len(vertices[0]), 3), np.float32)
        for axis, place in enumerate(vertices):
            before, after = np.maximum(place - 1, 0), np.minimum(place + 1, self.shape[axis] - 1)
            low, high = (
                self._smooth_opacity[tuple(end if n == axis else vertices[n] for n in range(3))]
                for end in (before, after)
            )
            slope[:, axis] = (low - high) / ((after - before) * np.float32(self.field.voxel_size[axis]))
        length = np.sqrt(np.einsum("na,na->n", slope, slope))[:, None]
        return np.asarray(slope / np.maximum(length, 1e-6), np.float32)

    def positions(self, mask: Mask) -> Array:
        """World positions [N,3] of the vertices of a mask [X,Y,Z]."""
        return self.world_positions(np.argwhere(mask))

    def world_positions(self, g: GridValues | NDArray[np.int64]) -> Array:
        """World positions [N,3] of block coordinates [N,3]."""
        center = 0.5 * (self.stride - 1)
        return world_positions(self.field, self.stride * np.asarray(g, np.float64) + self.low + center)

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
        is_scaled = ratio != 1.0
        sh, rows, gains = self.sh.copy(), self.slot[mask][is_scaled], ratio[is_scaled, None]

        def scale(part: slice) -> None:
            sh[rows[part]] = scale_sh_colors(sh[rows[part]], np.repeat(gains[part], 3, axis=1))

        map_parts(scale, len(rows), PART_ROWS)
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

    def compact(self) -> GridBlock:
        """Block with the coefficients of its own vertices alone; a cropped one has those of the whole."""
        has_color = self.slot >= 0
        slot = np.full(self.shape, -1, np.int64)
        slot[has_color] = np.arange(np.count_nonzero(has_color))
        return replace(self, slot=slot, sh=self.sh[self.slot[has_color]])

    def changed_from(self, other: GridBlock, tolerance: float = MIN_COEFFICIENT_DIFFERENCE) -> Mask:
        """Mask [X,Y,Z] of vertices whose density or color differs from an `other` block of the same place."""
        check_cancelled()
        changed = self.density != other.density
        both_colored = (self.slot >= 0) & (other.slot >= 0)
        rows, other_rows = self.slot[both_colored], other.slot[both_colored]

        def differs(part: slice) -> NDArray[np.bool_]:
            difference = np.abs(self.sh[rows[part]] - other.sh[other_rows[part]])
            return np.asarray(difference.max(axis=(1, 2)) > tolerance)

        changed[both_colored] |= np.concatenate(map_parts(differs, len(rows), PART_ROWS))
        return np.asarray(changed | ((self.slot >= 0) != (other.slot >= 0)))

    def to_layer(self) -> VoxelField:
        """Block as a layer of the field: its colored vertices and its two corners."""
        is_stored = self.slot >= 0
        is_stored[0, 0, 0] = is_stored[-1, -1, -1] = True
        slot = self.slot[is_stored]
        sh = np.zeros((len(slot), *self.sh.shape[1:]), np.float32)
        sh[slot >= 0] = self.sh[slot[slot >= 0]]
        density = np.where(slot >= 0, self.density[is_stored], np.float32(0.0))
        field = self.field
        return VoxelField(
            field.bounds, field.resolution, self.vertices[is_stored], density, sh, field.contracted
        )


_CACHED_PROPERTIES = [name for name, value in vars(GridBlock).items() if isinstance(value, cached_property)]
"""Properties of a block that do not depend on its colors: all that are cached."""

GridValues = NDArray[np.floating] | NDArray[np.bool_]


def world_positions(field: VoxelField, g: GridValues | NDArray[np.int64]) -> Array:
    """World positions [N,3] of grid coordinates [N,3]."""
    lower, upper = field.grid_bounds
    points = lower + np.asarray(g, np.float64) / (np.array(field.resolution) - 1) * (upper - lower)
    if not field.contracted:
        return np.asarray(points)
    return np.asarray(field.center + uncontract(points) * field.half_size)
