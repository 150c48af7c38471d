"""The kernels of `cagefield.rendering.voxels.occupancy_discontinuous`."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.block_cyclic import Schedule, scheduled_item, turn_count
from cagefield.compute.quadrants import qd
from cagefield.edits.device.kernels.edit_maps import EditArgs, map_sample
from cagefield.rendering.voxels.kernels.grid import (
    I32,
    U8,
    GridArgs,
    contract_velocity,
    ivec3,
    to_grid,
    to_world,
    uncontract,
    vec3,
)
from cagefield.rendering.voxels.kernels.occupancy_queries import MOST_CELLS, are_dense, is_blocked, is_dense
from cagefield.rendering.voxels.kernels.ray_grid import OccupancyArgs

IDENTITY_TOLERANCE = 1e-3
"""Largest difference, in cells, of an image from its point, and of a reach from 1, where a map is the
identity."""


@qd.kernel(fastcache=True)
def occupied_corners(
    out: U8,
    deal: Schedule,
    bricks: OccupancyArgs,
    lower: ivec3,
    count: ivec3,
    spacing: qd.i32,
    grid: GridArgs,
    edits: EditArgs,
    contracted: qd.template(),
    flows: qd.template(),
):
    for turn in range(turn_count(deal)):
        n = scheduled_item(turn, deal)
        if n < count.x * count.y * count.z:
            i = n // (count.y * count.z)
            j = (n // count.z) % count.y
            k = n % count.z
            g = qd.cast(lower + spacing * ivec3(i, j, k), qd.f32)
            image, reach, place = probe(g, grid, edits, contracted, flows)
            found = 0
            r = qd.min(reach * (0.5 * qd.cast(spacing, qd.f32)) + 0.5, MOST_CELLS)
            if place > 0:
                found = is_dense(image, r, place, grid)
            elif place == 0:
                found = is_blocked(image, r, bricks)
            out[n] = qd.cast(found, qd.u8)


@qd.kernel(fastcache=True)
def dense_blocks(
    out: U8,
    deal: Schedule,
    candidates: I32,
    lower: ivec3,
    grid: GridArgs,
    edits: EditArgs,
    contracted: qd.template(),
    flows: qd.template(),
):
    for turn in range(turn_count(deal)):
        n = scheduled_item(turn, deal)
        if n < out.shape[0]:
            block = ivec3(candidates[3 * n], candidates[3 * n + 1], candidates[3 * n + 2])
            low = lower + 2 * block
            found = 0
            k = 0
            while k < 27 and found == 0:
                vertex = low + ivec3(k % 3, (k // 3) % 3, k // 9)
                g = qd.cast(vertex, qd.f32)
                image, reach, place = probe(g, grid, edits, contracted, flows)
                if place >= 0 and qd.max(qd.abs(image - g), qd.abs(reach - 1.0)).max() <= IDENTITY_TOLERANCE:
                    found = are_dense(qd.max(vertex - 1, low), qd.min(vertex + 1, low + 2), place, grid)
                elif place >= 0:
                    r = qd.min(0.5 * reach, MOST_CELLS) + 1e-3
                    found = is_dense(image, r, place, grid)
                k += 1
            out[n] = qd.cast(found, qd.u8)


@qd.func
def probe(g: vec3, grid: GridArgs, edits: EditArgs, contracted: qd.template(), flows: qd.template()):
    """(image, reach, place) of grid coordinates g: image in grid coordinates, reach = row sums of |J|."""
    p = to_world(g, grid, contracted)
    c = g / grid.half - 2.0
    reach = vec3(0.0, 0.0, 0.0)
    image = g
    place = 0
    for a in range(3):
        # One cell along grid axis a, as a world-space displacement.
        e = vec3(0.0, 0.0, 0.0)
        if a == 0:
            e.x = 1.0
        elif a == 1:
            e.y = 1.0
        else:
            e.z = 1.0
        d = e / grid.scale
        if qd.static(contracted):
            d = (
                (uncontract(c + 0.01 * e / grid.half) - uncontract(c - 0.01 * e / grid.half))
                * 50.0
                / grid.scale
            )
        length = qd.max(d.norm(), 1e-20)
        q, v, place = map_sample(p, d / length, edits, flows)
        along = v * length * grid.scale
        if qd.static(contracted):
            along = contract_velocity((q - grid.lower) * grid.scale, along) * grid.half
        image = to_grid(q, grid, contracted)
        reach += qd.abs(along)
    return image, reach, place
