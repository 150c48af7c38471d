"""What no training photo showed of a field: the inside of things, and the surfaces on which they stand.

A ray of a photo shows what it meets while some of its light comes through. Vertices that no ray reached so
may have any density and colour, since no photo says anything of them; `cagefield.training.voxels.inpainting`
gives
them plausible ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.compute.block_cyclic import block_cyclic_schedule
from cagefield.compute.devices import floats
from cagefield.fields.voxel_field import VoxelField
from cagefield.rendering.voxels import occupancy
from cagefield.rendering.voxels.device_grid import DeviceGrid, occupancy_args, to_device
from cagefield.training.voxels.kernels.vertex_visibility import mark_seen

LEAST_TRANSMITTANCE = 0.1
"""A ray shows what it meets until less than this share of its light comes through."""

STEP = 0.5
"""Distance between samples, voxels."""

MOST_RAYS = 4_000_000
"""Rays that are followed, about: of larger photos every second or third pixel each way."""


def unseen_vertices(field: VoxelField, cameras: Sequence[Camera]) -> NDArray[np.bool_]:
    """Vertices [nx,ny,nz] of a bounded field around which no ray of the cameras shows anything.

    Every cell that a ray crosses with at least LEAST_TRANSMITTANCE left is seen, and so are its 8 vertices:
    what is changed at unseen ones, a photo shows only through what hides them.
    """
    grid = DeviceGrid.from_field(field)
    found = occupancy.of_field(field)
    bricks = occupancy_args(found, to_device(found.codes))
    seen = to_device(np.zeros(int(np.prod(field.resolution)), np.uint8))
    pixels = sum(camera.width * camera.height for camera in cameras)
    stride = max(1, math.ceil(math.sqrt(pixels / MOST_RAYS)))
    for camera in cameras:
        local = camera.local_directions().reshape(camera.height, camera.width, 3)[::stride, ::stride]
        mark_seen(
            seen,
            block_cyclic_schedule(local.shape[0] * local.shape[1]),
            to_device(local.astype(np.float32)),
            local.shape[0] * local.shape[1],
            floats(camera.c2w[:3, :3]),
            floats(camera.origin),
            grid.args,
            bricks,
            STEP / float(np.max(grid.args.scale)),
            LEAST_TRANSMITTANCE,
        )
    cells = seen.to_numpy().reshape(field.resolution) > 0
    for axis in range(3):
        before, after = [slice(None)] * 3, [slice(None)] * 3
        before[axis], after[axis] = slice(None, -1), slice(1, None)
        vertices = cells.copy()
        vertices[tuple(after)] |= cells[tuple(before)]
        cells = vertices
    return ~cells
