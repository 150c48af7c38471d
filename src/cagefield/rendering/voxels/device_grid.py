"""A VoxelField on the compute device: arrays, and the kernel functions that sample it.

Notation: g = grid coordinates (0 at the first vertex), *cell* = the cube between 8 vertices, *brick* =
4 x 4 x 4 cells. A vertex is stored under a *slot*; slot 0 is the empty vertex (density 0, color 0), so a
lookup needs no branch. Records are padded: `sh` has `sh_stride(K)` floats a slot, basis-major, rgb inner.
"""

from __future__ import annotations

import operator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.device_buffers import to_device
from cagefield.compute.devices import floats, ints
from cagefield.compute.quadrants import qd
from cagefield.fields.voxel_field import VoxelField
from cagefield.fields.voxel_layers import layer_slices, layer_x_offsets
from cagefield.rendering.voxels.kernels.grid import GridArgs
from cagefield.rendering.voxels.kernels.ray_grid import OccupancyArgs
from cagefield.rendering.voxels.occupancy import BRICK, Occupancy
from cagefield.typing import Array


@dataclass(frozen=True, eq=False)
class DeviceGrid:
    """A VoxelField's arrays on the device.

    Attributes:
        field: the field they come from.
        index: [nx*ny*nz] int32, slot of each vertex, 0 where empty; then those of the layers.
        density: [M+1] float32.
        sh: [(M+1) * K * 3] float32.
        layers: the field's layers behind it (`fields.voxel_layers`), and `base`, the grid without them.
    """

    field: VoxelField
    index: qd.ndarray
    density: qd.ndarray
    sh: qd.ndarray
    layers: tuple[VoxelField, ...] = ()
    base: DeviceGrid | None = None

    @cached_property
    def args(self) -> GridArgs:
        """The grid as kernels take it."""
        field = self.field
        transform = transform_of(field.bounds, field.resolution, field.contracted)
        return GridArgs(self.index, self.density, self.sh, ints(field.resolution), *transform)

    @classmethod
    def from_field(cls, field: VoxelField) -> DeviceGrid:
        """The arrays of a field, its slots ordered by brick so that neighbors lie close in memory."""
        vertices, density, sh = _by_brick(field)
        index = np.zeros(int(np.prod(field.resolution)), np.int32)
        index[vertices] = np.arange(1, len(vertices) + 1, dtype=np.int32)
        density = np.concatenate([np.zeros(1, np.float32), density])
        sh = np.concatenate([np.zeros((1, *sh.shape[1:]), np.float32), sh])
        return cls(field, to_device(index), to_device(density), to_device(sh))

    def with_layers(self, layers: tuple[VoxelField, ...]) -> DeviceGrid:
        """The grid with these layers in place of its own; itself where they are the same ones."""
        if len(layers) == len(self.layers) and all(map(operator.is_, layers, self.layers)):
            return self
        base = self.base or self
        if not layers:
            return base
        _, ny, nz = self.field.resolution
        places = layer_x_offsets(layers)
        slices = max(layer_slices(layer)[1] + place for layer, place in zip(layers, places, strict=True))
        first = int(np.prod(self.field.resolution))
        index = np.zeros(slices * ny * nz, np.int32)
        index[:first] = base.index.to_numpy()
        densities, colors = [base.density.to_numpy()], [base.sh.to_numpy()]
        stored = len(densities[0])
        for place, layer in dict(zip(places, layers, strict=True)).items():
            vertices, density, sh = _by_brick(layer)
            index[vertices + place * ny * nz] = np.arange(stored, stored + len(vertices), dtype=np.int32)
            stored += len(vertices)
            densities.append(density)
            colors.append(sh.reshape(-1))
        values, coefficients = np.concatenate(densities), np.concatenate(colors)
        return DeviceGrid(
            self.field, to_device(index), to_device(values), to_device(coefficients), layers, base
        )


def _by_brick(field: VoxelField) -> tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.float32]]:
    """(vertices [M], density [M], sh [M,K,3]) of a field, brick by brick."""
    order = brick_order(field.vertices, field.resolution)
    return field.vertices[order], field.density[order], field.sh[order]


def brick_order(vertices: NDArray[np.int64], resolution: tuple[int, int, int]) -> NDArray[np.int64]:
    """The permutation [M] that sorts linear vertex indices by brick, then by position inside the brick."""
    _, ny, nz = resolution
    x, rest = np.divmod(vertices, ny * nz)
    y, z = np.divmod(rest, nz)
    brick = ((x // BRICK) * (ny // BRICK + 1) + y // BRICK) * (nz // BRICK + 1) + z // BRICK
    return np.asarray(np.lexsort((vertices, brick)))


def transform_of(
    bounds: NDArray[np.float64], resolution: tuple[int, int, int], contracted: bool
) -> tuple[Array, Array, Array]:
    """Lower, scale and half of `GridArgs`; bounds [2,3] are those of the inner box where it is contracted."""
    n = np.array(resolution) - 1
    if contracted:
        return floats(bounds.mean(axis=0)), floats(2.0 / (bounds[1] - bounds[0])), floats(n / 4)
    return floats(bounds[0]), floats(n / (bounds[1] - bounds[0])), floats(n / 4)


def occupancy_args(occupancy: Occupancy, codes: Any = None) -> OccupancyArgs:
    """An occupancy as kernels take it; `codes` where they are on the device already."""
    flat = occupancy.codes.reshape(-1) if codes is None else codes
    return OccupancyArgs(flat, ints(occupancy.origin), ints(occupancy.codes.shape))
