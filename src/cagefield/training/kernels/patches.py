"""The kernels of `cagefield.training.patches`."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

import quadrants as qd

from cagefield.rendering.kernels.grid import F32, I32, ivec3, vec3
from cagefield.rendering.kernels.ray_grid import empty_run, safe_inverse, slab


@qd.kernel(fastcache=True)
def touched_patches(
    touched: I32,
    patches: I32,
    n_patches: qd.i32,
    patch_size: qd.i32,
    views: I32,
    poses: F32,
    directions: F32,
    codes: I32,
    brick_dims: ivec3,
    lower: vec3,
    scale: vec3,
    resolution: ivec3,
    near: qd.f32,
):
    """Sets touched[p] to 1 where any ray of patch p meets an occupied block of a bounded grid, else 0."""
    for patch in range(n_patches):
        found = 0
        for r in range(patch_size * patch_size):
            view = patches[3 * patch]
            column = patches[3 * patch + 1] + r % patch_size
            row = patches[3 * patch + 2] + r // patch_size
            if found == 0 and row < views[4 * view + 3] and column < views[4 * view + 1]:
                m = 12 * view
                at = 3 * (views[4 * view + 2] + row * views[4 * view + 1] + column)
                l = vec3(directions[at], directions[at + 1], directions[at + 2])
                d = vec3(
                    poses[m] * l.x + poses[m + 1] * l.y + poses[m + 2] * l.z,
                    poses[m + 4] * l.x + poses[m + 5] * l.y + poses[m + 6] * l.z,
                    poses[m + 8] * l.x + poses[m + 9] * l.y + poses[m + 10] * l.z,
                )
                go = (vec3(poses[m + 3], poses[m + 7], poses[m + 11]) - lower) * scale
                gd = d * scale
                inverse = safe_inverse(gd)
                hit = slab(go, inverse, vec3(0.0, 0.0, 0.0), qd.cast(resolution - 1, qd.f32))
                t = qd.max(hit.x, near)
                nudge = 0.05 / qd.abs(gd).max()
                while t < hit.y and found == 0:
                    run = empty_run(codes, go + t * gd, inverse, ivec3(0, 0, 0), brick_dims)
                    if run < 0.0:
                        found = 1
                    t += run + nudge
        touched[patch] = found
