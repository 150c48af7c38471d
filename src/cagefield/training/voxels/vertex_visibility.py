"""Visibility of a field's vertices in the training photos.

A ray of a photo constrains the field up to the depth at which its transmittance falls below
MIN_TRANSMITTANCE.
Photos do not constrain vertices beyond that depth of every ray: the inside of objects, and the surfaces below
objects. `cagefield.training.voxels.inpainting` gives such vertices plausible densities and colors.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.compute.block_cyclic import block_cyclic_schedule
from cagefield.compute.device_buffers import to_device
from cagefield.compute.devices import floats
from cagefield.fields.voxel_field import VoxelField
from cagefield.rendering.voxels import occupancy
from cagefield.rendering.voxels.device_grid import DeviceGrid, occupancy_args
from cagefield.training.voxels.kernels.vertex_visibility import mark_visible

MIN_TRANSMITTANCE = 0.1
"""Transmittance of a ray below which it makes no vertex visible."""

STEP_VOXELS = 0.5
"""Distance between samples of a ray."""

MAX_RAYS = 4_000_000
"""Approximate maximum number of rays; larger photos are subsampled in both directions."""


def invisible_vertices(field: VoxelField, cameras: Sequence[Camera]) -> NDArray[np.bool_]:
    """Mask [nx,ny,nz] of a bounded field's vertices that no ray of the cameras reaches.

    A cell is visible where a ray crosses it with a transmittance of at least MIN_TRANSMITTANCE;
    the 8 vertices of a visible cell are visible.
    """
    grid = DeviceGrid.from_field(field)
    bricks_on_host = occupancy.of_field(field)
    bricks = occupancy_args(bricks_on_host, to_device(bricks_on_host.codes))
    visible = to_device(np.zeros(int(np.prod(field.resolution)), np.uint8))
    pixels = sum(camera.width * camera.height for camera in cameras)
    stride = max(1, math.ceil(math.sqrt(pixels / MAX_RAYS)))
    for camera in cameras:
        local = camera.local_directions().reshape(camera.height, camera.width, 3)[::stride, ::stride]
        mark_visible(
            visible,
            block_cyclic_schedule(local.shape[0] * local.shape[1]),
            to_device(local.astype(np.float32)),
            local.shape[0] * local.shape[1],
            floats(camera.c2w[:3, :3]),
            floats(camera.origin),
            grid.args,
            bricks,
            STEP_VOXELS / float(np.max(grid.args.scale)),
            MIN_TRANSMITTANCE,
        )
    cells = visible.to_numpy().reshape(field.resolution) > 0
    for axis in range(3):
        before, after = [slice(None)] * 3, [slice(None)] * 3
        before[axis], after[axis] = slice(None, -1), slice(1, None)
        vertices = cells.copy()
        vertices[tuple(after)] |= cells[tuple(before)]
        cells = vertices
    return ~cells
