"""Kernel that marks the vertices visible in a photo."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.block_cyclic import Schedule, scheduled_item, turn_count
from cagefield.compute.quadrants import qd
from cagefield.rendering.voxels.kernels.grid import (
    F32,
    U8,
    GridArgs,
    corner_slots,
    corner_weights,
    gather_density,
    vec3,
)
from cagefield.rendering.voxels.kernels.ray_grid import OccupancyArgs, is_occupied, safe_inverse, slab

mat3 = qd.types.matrix(3, 3, qd.f32)


@qd.kernel(fastcache=True)
def mark_visible(
    visible: U8,
    deal: Schedule,
    directions: F32,
    rays: qd.i32,
    rotation: mat3,
    origin: vec3,
    grid: GridArgs,
    bricks: OccupancyArgs,
    step: qd.f32,
    min_transmittance: qd.f32,
):
    """Write 1 into `visible` [nx*ny*nz] at the first vertex of each cell with a visible ray segment."""
    for turn in range(turn_count(deal)):
        n = scheduled_item(turn, deal)
        if n < rays:
            d = rotation @ vec3(directions[3 * n], directions[3 * n + 1], directions[3 * n + 2])
            go = (origin - grid.lower) * grid.scale
            gd = d * grid.scale
            through = slab(go, safe_inverse(gd), vec3(0.0, 0.0, 0.0), qd.cast(grid.resolution - 1, qd.f32))
            t = qd.max(through.x, 0.0) + 0.5 * step
            T = 1.0
            while t < through.y and min_transmittance < T:
                g = go + t * gd
                cell = qd.max(qd.min(qd.cast(qd.floor(g), qd.i32), grid.resolution - 2), 0)
                visible[(cell.x * grid.resolution.y + cell.y) * grid.resolution.z + cell.z] = qd.u8(1)
                if is_occupied(bricks, g):
                    slots = corner_slots(grid.index, cell, grid.resolution.y, grid.resolution.z)
                    raw = gather_density(grid.density, slots, corner_weights(g - qd.cast(cell, qd.f32)))
                    if raw > 0.0:
                        T *= qd.exp(-raw * step)
                t += step
