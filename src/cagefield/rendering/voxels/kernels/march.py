"""The fused renderer of a VoxelField: one march per ray, empty space leapt over, early stop.

Samples lie at t_in + (k + 1/2) h along each ray, h = `step` voxels; leaps move by whole steps, so that the
image does not depend on skipped space. In a contracted field the step is `step` voxels of contracted
length, so it grows with distance; the march ends half a voxel before infinity.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from dataclasses import dataclass

from cagefield.compute.block_cyclic import Schedule, scheduled_item, turn_count
from cagefield.compute.quadrants import qd
from cagefield.edits.device.kernels.edit_maps import EditArgs
from cagefield.rendering.voxels.kernels.edited_ray import (
    IN_PLACE,
    EditedRay,
    edited_ray,
)
from cagefield.rendering.voxels.kernels.grid import F32, GridArgs, sh_basis, vec3
from cagefield.rendering.voxels.kernels.ray_grid import safe_inverse, slab
from cagefield.rendering.voxels.kernels.ray_stretch import (
    MIN_LIGHT_LEFT,
    UNEDITED,
    EmptySpaceArgs,
    MarchArgs,
    MarchedRay,
    march_stretch,
)

mat3 = qd.types.matrix(3, 3, qd.f32)
ivec2 = qd.types.vector(2, qd.i32)
MARCH_TILE_PX = 8


@dataclass(frozen=True, eq=False)
class CameraArgs:
    """A camera as kernels take it: directions [N,3] of its pixels in camera space, and its pose."""

    directions: F32
    width: qd.i32
    rotation: mat3
    origin: vec3


@dataclass(frozen=True, eq=False)
class TileArgs:
    """The tiles, 8 x 8 pixels each, that are marched: `rows` of them from `first_row` on, of a rectangle.

    The rectangle has its top left pixel at `corner` (column, row) and `size` (columns, rows).
    """

    corner: ivec2
    size: ivec2
    first_row: qd.i32
    rows: qd.i32


@qd.kernel(fastcache=True)
def march_tiles(
    out: F32,
    deal: Schedule,
    camera: CameraArgs,
    tiles: TileArgs,
    march: MarchArgs,
    grid: GridArgs,
    space: EmptySpaceArgs,
    edits: EditArgs,
    K: qd.template(),
    contracted: qd.template(),
    edited: qd.template(),
    with_normals: qd.template(),
):
    """Marches rows of tiles of a rectangle of a camera's picture.

    out: [size.y * size.x, 8]: premultiplied rgb, opacity, sum of w t, and the premultiplied normal, 0 without
    `with_normals`. `edited`: UNEDITED to GRADED_BY_FLOWS.

    The part of a ray that may lie in edits is found first; its stretches are found one by one, each at its
    first sample in an occupied block.
    """
    across = (tiles.size.x + MARCH_TILE_PX - 1) // MARCH_TILE_PX
    qd.loop_config(block_dim=64)
    for turn in range(turn_count(deal)):
        n = scheduled_item(turn, deal)
        tile = n // (MARCH_TILE_PX * MARCH_TILE_PX)
        x = (tile % across) * MARCH_TILE_PX + n % MARCH_TILE_PX
        y = (tiles.first_row + tile // across) * MARCH_TILE_PX + (n // MARCH_TILE_PX) % MARCH_TILE_PX
        if tile < across * tiles.rows and x < tiles.size.x and y < tiles.size.y:
            pixel = (tiles.corner.y + y) * camera.width + tiles.corner.x + x
            d = camera.rotation @ vec3(
                camera.directions[3 * pixel],
                camera.directions[3 * pixel + 1],
                camera.directions[3 * pixel + 2],
            )
            basis = sh_basis(d, K)
            go = (camera.origin - grid.lower) * grid.scale
            gd = d * grid.scale
            inverse = safe_inverse(gd)
            ray = MarchedRay(
                origin=camera.origin, d=d, go=go, gd=gd, inverse=inverse, t=march.near, t_end=1e30, T=1.0
            )
            if qd.static(not contracted):
                lo = qd.cast(space.bricks.origin, qd.f32)
                hit = slab(go, inverse, lo, lo + 4.0 * qd.cast(space.bricks.dims, qd.f32))
                ray.t = qd.max(hit.x, march.near) + 0.5 * march.step
                ray.t_end = hit.y
            stretch = EditedRay(kind=IN_PLACE, until=1e30)
            if qd.static(edited == UNEDITED):
                march_stretch(
                    ray, stretch, basis,
                    march, grid, space, edits, K, contracted, edited, with_normals, False,
                )  # fmt: skip
            else:
                through = slab(go, inverse, space.edit_lower, space.edit_upper)
                ray.edit_in = 1e30
                if through.x <= through.y:
                    ray.edit_in = through.x
                ray.edit_out = through.y
                stretch.until = ray.edit_in
                while ray.t < ray.t_end and ray.T > MIN_LIGHT_LEFT:
                    if ray.t > stretch.until:
                        stretch = EditedRay(kind=IN_PLACE, until=1e30)
                        if ray.t <= ray.edit_out:
                            stretch = edited_ray(ray.t, camera.origin, d, edits)
                    if stretch.kind == IN_PLACE:
                        march_stretch(
                            ray, stretch, basis,
                            march, grid, space, edits, K, contracted, edited, with_normals, False,
                        )  # fmt: skip
                    else:
                        march_stretch(
                            ray, stretch, basis,
                            march, grid, space, edits, K, contracted, edited, with_normals, True,
                        )  # fmt: skip
            at = 8 * (y * tiles.size.x + x)
            for a in qd.static(range(3)):
                out[at + a] = ray.rgb[a]
                out[at + 5 + a] = ray.normal[a]
            out[at + 3] = 1.0 - ray.T
            out[at + 4] = ray.depth
