"""The kernels of `cagefield.rendering.voxels.mapped_lattice`."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.block_cyclic import Schedule, scheduled_item, turn_count
from cagefield.compute.quadrants import qd
from cagefield.edits.device.kernels.edit_maps import EditArgs, Nodes, map_sample
from cagefield.rendering.voxels.kernels.grid import U8, GridArgs, ivec3, to_grid, to_world, vec3

UNKNOWN = 1e30
"""Image of a point that was not mapped."""


@qd.kernel(fastcache=True)
def map_points(
    images: Nodes,
    deal: Schedule,
    starts: Nodes,
    started: qd.i32,
    wanted: U8,
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
        image = vec3(UNKNOWN, UNKNOWN, UNKNOWN)
        if n < images.shape[0] and wanted[n] > 0:
            at = lower + spacing * ivec3(n // (count.y * count.z), (n // count.z) % count.y, n % count.z)
            g = qd.cast(at, qd.f32)
            if started == 1:
                g = starts[n]
            p = to_world(g, grid, contracted)
            q, _v, _empty = map_sample(p, vec3(1.0, 0.0, 0.0), edits, flows)
            image = g
            if qd.abs(q - p).max() > 0.0:
                image = to_grid(q, grid, contracted)
        if n < images.shape[0]:
            images[n] = image


@qd.func
def differences(images: qd.template(), n: qd.i32, i: qd.i32, count: qd.i32, stride: qd.i32):
    """(larger first difference, second difference) of the images at point n, the i-th of an axis."""
    here = images[n]
    before = vec3(0.0, 0.0, 0.0)
    after = vec3(0.0, 0.0, 0.0)
    both = 0
    if i > 0:
        q = images[n - stride]
        if q.x < UNKNOWN:
            before = here - q
            both += 1
    if i < count - 1:
        q = images[n + stride]
        if q.x < UNKNOWN:
            after = q - here
            both += 1
    bend = vec3(0.0, 0.0, 0.0)
    if both == 2:
        bend = qd.abs(after - before)
    return qd.max(qd.abs(before), qd.abs(after)), bend
