"""Occupied blocks under maps that jump, as those of discrete edits do, from the maps' Jacobians.

A probe at a lattice point p maps it to canonical space and looks for an occupied cell within

    r = |J|_inf * spacing / 2

of the image (L-infinity norm), which covers the images of all points nearer to p than to another lattice
point, to first order. The first pass probes block corners (spacing 2 cells, half a cell added) against
occupied blocks, and takes the neighbors' corners too; the second probes the 27 cell corners of each block
that passed (spacing 1) against the densities themselves. Where the map is the identity at a corner, only
vertices of the block itself are looked at: no others are read in it. A coarse pass is the first one alone, by
bricks.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.compute.block_cyclic import block_cyclic_schedule
from cagefield.compute.devices import ints
from cagefield.edits.device_stack import DeviceStack
from cagefield.rendering.voxels.device_grid import DeviceGrid, occupancy_args
from cagefield.rendering.voxels.kernels.occupancy_discontinuous import dense_blocks, occupied_corners
from cagefield.rendering.voxels.occupancy import BRICK, Occupancy, cubes


def near_bricks(
    canonical: Occupancy,
    grid: DeviceGrid,
    stack: DeviceStack,
    lower: NDArray[np.int64],
    count: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """The bricks [count] with an occupied corner or one beside it, the first at grid coordinates `lower`."""
    return _near(canonical, grid, stack, lower, count, BRICK)


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
    near = _near(canonical, grid, stack, lower, np.array(new.shape), 2)
    near &= new
    proceed()
    candidates = np.argwhere(near).astype(np.int32)
    if len(candidates):
        near[tuple(candidates.T)] = _refined(candidates, grid, stack, lower)
    return near


def _near(
    canonical: Occupancy,
    grid: DeviceGrid,
    stack: DeviceStack,
    lower: NDArray[np.int64],
    count: NDArray[np.int64],
    spacing: int,
) -> NDArray[np.bool_]:
    """Cubes of `spacing` cells [count] with an occupied corner, or a corner beside one."""
    near = _corners(canonical, grid, stack, lower, count + 1, spacing)
    return cubes(ndimage.maximum_filter(near, size=3, mode="nearest"))


def _corners(
    canonical: Occupancy,
    grid: DeviceGrid,
    stack: DeviceStack,
    lower: NDArray[np.int64],
    count: NDArray[np.int64],
    spacing: int,
) -> NDArray[np.bool_]:
    """Occupied lattice points [count], `spacing` cells apart, the first at grid coordinates `lower`."""
    out = np.zeros(int(np.prod(count)), np.uint8)
    occupied_corners(
        out,
        block_cyclic_schedule(len(out)),
        occupancy_args(canonical),
        ints(lower),
        ints(count),
        spacing,
        grid.args,
        stack.args,
        grid.field.contracted,
        stack.has_flows,
    )
    return out.reshape(tuple(count)).astype(bool)


def _refined(
    candidates: NDArray[np.int32], grid: DeviceGrid, stack: DeviceStack, lower: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Which of the candidate blocks [C,3], counted from grid coordinates `lower`, are occupied."""
    out = np.zeros(len(candidates), np.uint8)
    dense_blocks(
        out,
        block_cyclic_schedule(len(out)),
        np.ascontiguousarray(candidates).reshape(-1),
        ints(lower),
        grid.args,
        stack.args,
        grid.field.contracted,
        stack.has_flows,
    )
    return out.astype(bool)
