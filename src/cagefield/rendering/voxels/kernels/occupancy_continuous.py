"""The kernels of `cagefield.rendering.voxels.occupancy_continuous`."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.block_cyclic import Schedule, scheduled_item, turn_count
from cagefield.compute.quadrants import qd
from cagefield.edits.device.kernels.edit_maps import Nodes
from cagefield.rendering.voxels.kernels.grid import I32, U8, GridArgs, ivec3, vec3
from cagefield.rendering.voxels.kernels.mapped_lattice import UNKNOWN, differences
from cagefield.rendering.voxels.kernels.occupancy_queries import MOST_CELLS, is_blocked, is_dense
from cagefield.rendering.voxels.kernels.ray_grid import OccupancyArgs


@qd.kernel(fastcache=True)
def occupied_points(
    out: U8,
    deal: Schedule,
    images: Nodes,
    bricks: OccupancyArgs,
    count: ivec3,
    most: qd.f32,
):
    for turn in range(turn_count(deal)):
        n = scheduled_item(turn, deal)
        if n < images.shape[0]:
            found = 0
            image = images[n]
            if image.x < UNKNOWN:
                i = n // (count.y * count.z)
                j = (n // count.z) % count.y
                k = n % count.z
                x_reach, _x = differences(images, n, i, count.x, count.y * count.z)
                y_reach, _y = differences(images, n, j, count.y, count.z)
                z_reach, _z = differences(images, n, k, count.z, 1)
                r = qd.min(0.5 * (x_reach + y_reach + z_reach) + 0.5, most)
                empty = 0
                b = (qd.cast(qd.floor(image), qd.i32) - bricks.origin) >> 2
                if b.min() >= 0 and (bricks.dims - b).min() > 0:
                    # Every brick nearer than this code says is empty.
                    code = bricks.codes[(b.x * bricks.dims.y + b.y) * bricks.dims.z + b.z]
                    if r.max() < qd.cast(4 * ((code >> 8) - 1), qd.f32):
                        empty = 1
                if empty == 0:
                    found = is_blocked(image, r, bricks)
            out[n] = qd.cast(found, qd.u8)


@qd.kernel(fastcache=True)
def dense_blocks(
    out: U8,
    deal: Schedule,
    candidates: I32,
    images: Nodes,
    count: ivec3,
    grid: GridArgs,
):
    for turn in range(turn_count(deal)):
        c = scheduled_item(turn, deal)
        if c < out.shape[0]:
            i = candidates[3 * c]
            j = candidates[3 * c + 1]
            k = candidates[3 * c + 2]
            corners = qd.Matrix.zero(qd.f32, 8, 3)
            reach = vec3(0.0, 0.0, 0.0)
            bend = vec3(0.0, 0.0, 0.0)
            for corner in qd.static(range(8)):
                x = i + (corner >> 2 & 1)
                y = j + (corner >> 1 & 1)
                z = k + (corner & 1)
                n = (x * count.y + y) * count.z + z
                for a in qd.static(range(3)):
                    corners[corner, a] = images[n][a]
                _x, x_bend = differences(images, n, x, count.x, count.y * count.z)
                _y, y_bend = differences(images, n, y, count.y, count.z)
                _z, z_bend = differences(images, n, z, count.z, 1)
                bend = qd.max(bend, x_bend + y_bend + z_bend)
            for a in qd.static(range(3)):
                along_x = 0.0
                along_y = 0.0
                along_z = 0.0
                for low in qd.static((0, 1, 2, 3)):
                    along_x = qd.max(along_x, qd.abs(corners[low + 4, a] - corners[low, a]))
                for low in qd.static((0, 1, 4, 5)):
                    along_y = qd.max(along_y, qd.abs(corners[low + 2, a] - corners[low, a]))
                for low in qd.static((0, 2, 4, 6)):
                    along_z = qd.max(along_z, qd.abs(corners[low + 1, a] - corners[low, a]))
                reach[a] = 0.25 * (along_x + along_y + along_z)
            r = qd.min(reach + 0.25 * bend, MOST_CELLS) + 1e-3
            found = 0
            at = 0
            while at < 27 and found == 0:
                part = 0.5 * vec3(at // 9, (at // 3) % 3, at % 3)
                image = vec3(0.0, 0.0, 0.0)
                for corner in qd.static(range(8)):
                    up = ivec3(corner >> 2 & 1, corner >> 1 & 1, corner & 1)
                    w = qd.abs(1.0 - up - part)
                    for a in qd.static(range(3)):
                        image[a] += w.x * w.y * w.z * corners[corner, a]
                found = is_dense(image, r, 0, grid)
                at += 1
            out[c] = qd.cast(found, qd.u8)
