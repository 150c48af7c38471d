"""Occupancy of a canonical field within reach of a point, inside Quadrants kernels.

Points and reaches r are in grid coordinates; all of the box [point - r, point + r] is searched.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.quadrants import qd
from cagefield.rendering.voxels.kernels.grid import GridArgs, ivec3, vec3
from cagefield.rendering.voxels.kernels.ray_grid import OccupancyArgs

MOST_CELLS = 12.0
"""Largest r, in cells; twice that in a coarse pass. Where a map squeezes more, no farther is searched."""


@qd.func
def is_blocked(image: vec3, r: vec3, bricks: OccupancyArgs):
    """1 where an occupied block lies within r of an image, grid coordinates, else 0."""
    first = qd.max(qd.cast(qd.floor((image - r) * 0.5), qd.i32) - (bricks.origin >> 1), 0)
    last = qd.min(qd.cast(qd.floor((image + r) * 0.5), qd.i32) - (bricks.origin >> 1), 2 * bricks.dims - 1)
    found = 0
    x = first.x >> 1
    while x <= last.x >> 1 and found == 0:
        in_x = axis_mask(x, first.x, last.x, 0xF0)
        for y in range(first.y >> 1, (last.y >> 1) + 1):
            in_xy = in_x & axis_mask(y, first.y, last.y, 0xCC)
            for z in range(first.z >> 1, (last.z >> 1) + 1):
                code = bricks.codes[(x * bricks.dims.y + y) * bricks.dims.z + z]
                found |= code & in_xy & axis_mask(z, first.z, last.z, 0xAA)
        x += 1
    return qd.min(found, 1)


@qd.func
def axis_mask(brick: qd.i32, first: qd.i32, last: qd.i32, upper: qd.i32):
    """Bits of a brick's sub-blocks from the block `first` to `last` along an axis.

    `upper` are the bits of its second sub-blocks.
    """
    bits = 0xFF
    if first > 2 * brick:
        bits = upper
    if last <= 2 * brick:
        bits = bits & ~upper
    return bits


@qd.func
def is_dense(image: vec3, r: vec3, place: qd.i32, grid: GridArgs):
    """1 where a cell within r of an image, grid coordinates, holds density, else 0.

    The place is that of the layer that is searched, 0 for the field.
    """
    first = qd.cast(qd.floor(image - r), qd.i32)
    last = qd.cast(qd.floor(image + r), qd.i32) + 1
    return are_dense(first, last, place, grid)


@qd.func
def are_dense(first: ivec3, last: ivec3, place: qd.i32, grid: GridArgs):
    """1 where one of the vertices from `first` to `last` holds density in the layer at a place, else 0.

    Slices of the grid that the layer does not store may be those of the next layer, or lie past the index,
    which is not read there.
    """
    slices = grid.index.shape[0] // (grid.resolution.y * grid.resolution.z)
    low = qd.max(first, 0)
    high = qd.min(last, grid.resolution - 1)
    found = 0
    x = low.x
    while x <= qd.min(high.x, slices - 1 - place) and found == 0:
        for y in range(low.y, high.y + 1):
            for z in range(low.z, high.z + 1):
                vertex = ((x + place) * grid.resolution.y + y) * grid.resolution.z + z
                if grid.density[grid.index[vertex]] > 0.0:
                    found = 1
        x += 1
    return found
