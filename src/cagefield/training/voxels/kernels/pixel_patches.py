"""Kernel that finds the pixel patches whose rays meet an occupied block."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.quadrants import qd
from cagefield.rendering.voxels.kernels.grid import I32, GridArgs, vec3
from cagefield.rendering.voxels.kernels.ray_grid import OccupancyArgs, empty_run, safe_inverse, slab
from cagefield.training.voxels.kernels.ray_batches import PatchArgs, PhotoArgs


@qd.kernel(fastcache=True)
def touched_patches(
    touched: I32, patches: PatchArgs, photos: PhotoArgs, grid: GridArgs, bricks: OccupancyArgs, near: qd.f32
):
    """Set touched[p] to 1 where any ray of patch p meets an occupied block of a bounded grid, else to 0."""
    for patch in range(patches.count):
        found = 0
        for r in range(patches.size * patches.size):
            view = patches.patches[3 * patch]
            column = patches.patches[3 * patch + 1] + r % patches.size
            row = patches.patches[3 * patch + 2] + r // patches.size
            if found == 0 and row < photos.views[4 * view + 3] and column < photos.views[4 * view + 1]:
                m = 12 * view
                at = 3 * (photos.views[4 * view + 2] + row * photos.views[4 * view + 1] + column)
                l = vec3(photos.directions[at], photos.directions[at + 1], photos.directions[at + 2])
                d = vec3(
                    photos.poses[m] * l.x + photos.poses[m + 1] * l.y + photos.poses[m + 2] * l.z,
                    photos.poses[m + 4] * l.x + photos.poses[m + 5] * l.y + photos.poses[m + 6] * l.z,
                    photos.poses[m + 8] * l.x + photos.poses[m + 9] * l.y + photos.poses[m + 10] * l.z,
                )
                go = (
                    vec3(photos.poses[m + 3], photos.poses[m + 7], photos.poses[m + 11]) - grid.lower
                ) * grid.scale
                gd = d * grid.scale
                inverse = safe_inverse(gd)
                hit = slab(go, inverse, vec3(0.0, 0.0, 0.0), qd.cast(grid.resolution - 1, qd.f32))
                t = qd.max(hit.x, near)
                nudge = 0.05 / qd.abs(gd).max()
                while t < hit.y and found == 0:
                    run = empty_run(bricks, go + t * gd, inverse)
                    if run < 0.0:
                        found = 1
                    t += run + nudge
        touched[patch] = found
