"""Occupied blocks under maps that jump, as those of discrete edits do, from the maps' Jacobians.

A probe at a lattice point p maps it to canonical space and looks for an occupied cell within

    r = |J|_inf * spacing / 2

of the image (L-infinity norm), which covers the images of all points nearer to p than to another lattice
point, to first order. The first pass probes block corners (spacing 2 cells, half a cell added) against
occupied blocks, and takes the neighbours' corners too; the second probes the 27 cell corners of each block
that passed (spacing 1) against the densities themselves. A coarse look is the first pass alone, by bricks.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from collections.abc import Callable

import numpy as np
import quadrants as qd
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.devices import ints
from cagefield.fields.voxel import VoxelField
from cagefield.loops import Deal, deal_of, dealt, turns
from cagefield.rendering.grid import (
    F32,
    I32,
    U8,
    DeviceGrid,
    contract_velocity,
    ivec3,
    to_grid,
    to_world,
    transform_of,
    uncontract_point,
    vec3,
)
from cagefield.rendering.kernels.occupancy_queries import MOST_CELLS, is_blocked, is_dense
from cagefield.rendering.occupancy import BRICK, Occupancy, cubes
from cagefield.warps.device_stack import DeviceStack
from cagefield.warps.kernels.edit_maps import Nodes, Params, map_sample


def near_bricks(
    canonical: Occupancy,
    grid: DeviceGrid,
    stack: DeviceStack,
    lower: NDArray[np.int64],
    count: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """The bricks [count] with an occupied corner or one beside it, the first at grid coordinates `lower`."""
    return _near(canonical, grid.field, stack, lower, count, BRICK)


def occupied_blocks(
    canonical: Occupancy,
    grid: DeviceGrid,
    stack: DeviceStack,
    lower: NDArray[np.int64],
    new: NDArray[np.bool_],
    proceed: Callable[[], None],
) -> NDArray[np.bool_]:
    """Which of the `new` blocks [2bx,2by,2bz] are occupied, the first one at grid coordinates `lower`.

    `proceed` is called between the passes, and may raise.
    """
    near = _near(canonical, grid.field, stack, lower, np.array(new.shape), 2)
    near &= new
    proceed()
    candidates = np.argwhere(near).astype(np.int32)
    if len(candidates):
        near[tuple(candidates.T)] = _refined(candidates, grid, stack, lower)
    return near


def _near(
    canonical: Occupancy,
    field: VoxelField,
    stack: DeviceStack,
    lower: NDArray[np.int64],
    count: NDArray[np.int64],
    spacing: int,
) -> NDArray[np.bool_]:
    """Cubes of `spacing` cells [count] with an occupied corner, or a corner beside one."""
    near = _corners(canonical, field, stack, lower, count + 1, spacing)
    return cubes(ndimage.maximum_filter(near, size=3, mode="nearest"))


def _corners(
    canonical: Occupancy,
    field: VoxelField,
    stack: DeviceStack,
    lower: NDArray[np.int64],
    count: NDArray[np.int64],
    spacing: int,
) -> NDArray[np.bool_]:
    """Occupied lattice points [count], `spacing` cells apart, the first at grid coordinates `lower`."""
    out = np.zeros(int(np.prod(count)), np.uint8)
    _occupied_corners(
        out,
        deal_of(len(out)),
        canonical.codes.reshape(-1),
        ints(canonical.codes.shape),
        ints(canonical.origin),
        ints(lower),
        ints(count),
        spacing,
        *transform_of(field),
        stack.params,
        stack.lattice,
        stack.n_edits,
        field.contracted,
        stack.has_flows,
    )
    return out.reshape(tuple(count)).astype(bool)


def _refined(
    candidates: NDArray[np.int32], grid: DeviceGrid, stack: DeviceStack, lower: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Which of the candidate blocks [C,3], counted from grid coordinates `lower`, are occupied."""
    out = np.zeros(len(candidates), np.uint8)
    _occupied_blocks(
        out,
        deal_of(len(out)),
        np.ascontiguousarray(candidates).reshape(-1),
        ints(lower),
        grid.index,
        grid.density,
        ints(grid.field.resolution),
        *transform_of(grid.field),
        stack.params,
        stack.lattice,
        stack.n_edits,
        grid.field.contracted,
        stack.has_flows,
    )
    return out.astype(bool)


@qd.kernel(fastcache=True)
def _occupied_corners(
    out: U8,
    deal: Deal,
    codes: I32,
    bricks: ivec3,
    bricks_origin: ivec3,
    lower: ivec3,
    count: ivec3,
    spacing: qd.i32,
    origin: vec3,
    scale: vec3,
    half: vec3,
    params: Params,
    lattice: Nodes,
    n_edits: qd.i32,
    contracted: qd.template(),
    flows: qd.template(),
):
    for turn in range(turns(deal)):
        n = dealt(turn, deal)
        if n < count.x * count.y * count.z:
            i = n // (count.y * count.z)
            j = (n // count.z) % count.y
            k = n % count.z
            g = qd.cast(lower + spacing * ivec3(i, j, k), qd.f32)
            image, reach, empty = probe(g, origin, scale, half, params, lattice, n_edits, contracted, flows)
            found = 0
            if empty == 0:
                r = qd.min(reach * (0.5 * qd.cast(spacing, qd.f32)) + 0.5, MOST_CELLS)
                found = is_blocked(image, r, codes, bricks, bricks_origin)
            out[n] = qd.cast(found, qd.u8)


@qd.kernel(fastcache=True)
def _occupied_blocks(
    out: U8,
    deal: Deal,
    candidates: I32,
    lower: ivec3,
    index: I32,
    density: F32,
    resolution: ivec3,
    origin: vec3,
    scale: vec3,
    half: vec3,
    params: Params,
    lattice: Nodes,
    n_edits: qd.i32,
    contracted: qd.template(),
    flows: qd.template(),
):
    for turn in range(turns(deal)):
        n = dealt(turn, deal)
        if n < out.shape[0]:
            block = ivec3(candidates[3 * n], candidates[3 * n + 1], candidates[3 * n + 2])
            found = 0
            k = 0
            while k < 27 and found == 0:
                g = qd.cast(lower + 2 * block + ivec3(k % 3, (k // 3) % 3, k // 9), qd.f32)
                image, reach, empty = probe(
                    g, origin, scale, half, params, lattice, n_edits, contracted, flows
                )
                if empty == 0:
                    r = qd.min(0.5 * reach, MOST_CELLS) + 1e-3
                    found = is_dense(image, r, index, density, resolution)
                k += 1
            out[n] = qd.cast(found, qd.u8)


@qd.func
def probe(
    g: vec3,
    origin: vec3,
    scale: vec3,
    half: vec3,
    params: qd.template(),
    lattice: qd.template(),
    n_edits: qd.i32,
    contracted: qd.template(),
    flows: qd.template(),
):
    """(image, reach, empty) of grid coordinates g: image in grid coordinates, reach = row sums of |J|."""
    p = to_world(g, origin, scale, half, contracted)
    c = g / half - 2.0
    reach = vec3(0.0, 0.0, 0.0)
    image = g
    empty = 0
    for a in range(3):
        # One cell along grid axis a, as a world-space displacement.
        e = vec3(0.0, 0.0, 0.0)
        if a == 0:
            e.x = 1.0
        elif a == 1:
            e.y = 1.0
        else:
            e.z = 1.0
        d = e / scale
        if qd.static(contracted):
            d = (uncontract_point(c + 0.01 * e / half) - uncontract_point(c - 0.01 * e / half)) * 50.0 / scale
        length = qd.max(d.norm(), 1e-20)
        q, v, emptied = map_sample(p, d / length, params, lattice, n_edits, flows)
        empty = emptied
        along = v * length * scale
        if qd.static(contracted):
            along = contract_velocity((q - origin) * scale, along) * half
        image = to_grid(q, origin, scale, half, contracted)
        reach += qd.abs(along)
    return image, reach, empty
