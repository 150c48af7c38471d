"""A VoxelField on the compute device: arrays, and the kernel functions that sample it.

Notation: g = grid coordinates (0 at the first vertex), *cell* = the cube between 8 vertices, *brick* =
4 x 4 x 4 cells. A vertex is stored under a *slot*; slot 0 is the empty vertex (density 0, color 0), so a
lookup needs no branch. `sh` has 3 K floats a slot, basis-major, rgb inner.
"""

from __future__ import annotations

import operator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.device_buffers import for_kernels
from cagefield.compute.devices import floats, ints
from cagefield.fields.voxel_field import VoxelField
from cagefield.fields.voxel_layers import layer_slices, layer_x_offsets
from cagefield.rendering.voxels.kernels.grid import GridArgs
from cagefield.rendering.voxels.kernels.ray_grid import OccupancyArgs
from cagefield.rendering.voxels.layer_slots import LayerSlots
from cagefield.rendering.voxels.occupancy import Occupancy
from cagefield.typing import Array


@dataclass(frozen=True, eq=False)
class DeviceGrid:
    """A VoxelField's arrays on the device.

    Attributes:
        field: the field they come from.
        index: [nx*ny*nz] int32, slot of each vertex, 0 where empty; then those of the layers.
        density: [S] float32, S the number of slots, or more.
        sh: [S * K * 3] float32.
        layers: the field's layers behind it (`fields.voxel_layers`).
        slots: the arrays that grids of the field share.
    """

    field: VoxelField
    index: Any
    density: Any
    sh: Any
    layers: tuple[VoxelField, ...]
    slots: LayerSlots

    @cached_property
    def args(self) -> GridArgs:
        """The grid as kernels take it."""
        field = self.field
        transform = transform_of(field.bounds, field.resolution, field.contracted)
        return GridArgs(self.index, self.density, self.sh, ints(field.resolution), *transform)

    @classmethod
    def from_field(cls, field: VoxelField) -> DeviceGrid:
        """The arrays of a field, its slots ordered by brick so that neighbors lie close in memory."""
        return cls._of(field, (), LayerSlots(field))

    @classmethod
    def _of(cls, field: VoxelField, layers: tuple[VoxelField, ...], slots: LayerSlots) -> DeviceGrid:
        density, sh, numbers = slots.store(layers)
        _, ny, nz = field.resolution
        places = layer_x_offsets(layers)
        ends = [layer_slices(layer)[1] + place for layer, place in zip(layers, places, strict=True)]
        index = np.zeros(max([field.resolution[0], *ends]) * ny * nz, np.int32)
        index[: len(slots.index)] = slots.index
        for place, layer, own in zip(places, layers, numbers, strict=True):
            index[layer.vertices + place * ny * nz] = own
        return cls(field, for_kernels(index), for_kernels(density), for_kernels(sh), layers, slots)

    def with_layers(self, layers: tuple[VoxelField, ...]) -> DeviceGrid:
        """The grid with these layers in place of its own; itself where they are the same ones."""
        if len(layers) == len(self.layers) and all(map(operator.is_, layers, self.layers)):
            return self
        return self._of(self.field, layers, self.slots)


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
