"""What no training photo showed of a field: the inside of things, and the surfaces on which they stand.

A ray of a photo shows what it meets while some of its light comes through. Vertices that no ray reached so
may have any density and colour, since no photo says anything of them; `cagefield.training.inpaint` gives
them plausible ones.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

import math
from collections.abc import Sequence

import numpy as np
import quadrants as qd
from numpy.typing import NDArray

from cagefield.cameras import Camera
from cagefield.devices import floats, ints
from cagefield.fields.voxel import VoxelField
from cagefield.loops import Deal, deal_of, dealt, turns
from cagefield.rendering import occupancy
from cagefield.rendering.grid import (
    F32,
    I32,
    U8,
    DeviceGrid,
    corner_slots,
    corner_weights,
    gather_density,
    ivec3,
    to_device,
    vec3,
)
from cagefield.rendering.kernels.ray_grid import is_occupied, safe_inverse, slab

mat3 = qd.types.matrix(3, 3, qd.f32)

LEAST_TRANSMITTANCE = 0.1
"""A ray shows what it meets until less than this share of its light comes through."""

STEP = 0.5
"""Distance between samples, voxels."""

MOST_RAYS = 4_000_000
"""Rays that are followed, about: of larger photos every second or third pixel each way."""


def unseen(field: VoxelField, cameras: Sequence[Camera]) -> NDArray[np.bool_]:
    """Vertices [nx,ny,nz] of a bounded field around which no ray of the cameras shows anything.

    Every cell that a ray crosses with at least LEAST_TRANSMITTANCE left is seen, and so are its 8 vertices:
    what is changed at unseen ones, a photo shows only through what hides them.
    """
    grid = DeviceGrid.from_field(field)
    bricks = occupancy.of_field(field)
    codes = to_device(bricks.codes)
    scale = (np.array(field.resolution) - 1) / (field.bounds[1] - field.bounds[0])
    seen = to_device(np.zeros(int(np.prod(field.resolution)), np.uint8))
    pixels = sum(camera.width * camera.height for camera in cameras)
    stride = max(1, math.ceil(math.sqrt(pixels / MOST_RAYS)))
    for camera in cameras:
        local = camera.local_directions().reshape(camera.height, camera.width, 3)[::stride, ::stride]
        _mark_seen(
            seen,
            deal_of(local.shape[0] * local.shape[1]),
            to_device(local.astype(np.float32)),
            local.shape[0] * local.shape[1],
            floats(camera.c2w[:3, :3]),
            floats(camera.origin),
            codes,
            ints(bricks.codes.shape),
            grid.index,
            grid.density,
            ints(field.resolution),
            floats(field.bounds[0]),
            floats(scale),
            float(STEP / scale.max()),
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


@qd.kernel(fastcache=True)
def _mark_seen(
    seen: U8,
    deal: Deal,
    directions: F32,
    rays: qd.i32,
    rotation: mat3,
    origin: vec3,
    codes: I32,
    brick_dims: ivec3,
    index: I32,
    density: F32,
    resolution: ivec3,
    lower: vec3,
    scale: vec3,
    step: qd.f32,
    least: qd.f32,
):
    """Writes 1 into `seen` [nx*ny*nz], at the first vertex of each cell, where rays of a camera come by."""
    for turn in range(turns(deal)):
        n = dealt(turn, deal)
        if n < rays:
            d = rotation @ vec3(directions[3 * n], directions[3 * n + 1], directions[3 * n + 2])
            go = (origin - lower) * scale
            gd = d * scale
            through = slab(go, safe_inverse(gd), vec3(0.0, 0.0, 0.0), qd.cast(resolution - 1, qd.f32))
            t = qd.max(through.x, 0.0) + 0.5 * step
            T = 1.0
            while t < through.y and least < T:
                g = go + t * gd
                cell = qd.max(qd.min(qd.cast(qd.floor(g), qd.i32), resolution - 2), 0)
                seen[(cell.x * resolution.y + cell.y) * resolution.z + cell.z] = qd.u8(1)
                if is_occupied(codes, g, brick_dims):
                    slots = corner_slots(index, cell, resolution.y, resolution.z)
                    raw = gather_density(density, slots, corner_weights(g - qd.cast(cell, qd.f32)))
                    if raw > 0.0:
                        T *= qd.exp(-raw * step)
                t += step
