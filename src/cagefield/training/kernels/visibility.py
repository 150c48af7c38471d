"""The kernels of `cagefield.training.visibility`."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

import quadrants as qd

from cagefield.loops import Deal, dealt, turns
from cagefield.rendering.kernels.grid import (
    F32,
    I32,
    U8,
    corner_slots,
    corner_weights,
    gather_density,
    ivec3,
    vec3,
)
from cagefield.rendering.kernels.ray_grid import is_occupied, safe_inverse, slab

mat3 = qd.types.matrix(3, 3, qd.f32)


@qd.kernel(fastcache=True)
def mark_seen(
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
