"""Occupied blocks under maps that do not jump, from the images of a lattice's points.

Each point is mapped once; how far its surroundings reach in canonical space is read off its neighbors'
images q: along axis a as far as to the farther neighbor's, halved, and summed over the axes,

    r = sum_a max(|q_(+a) - q|, |q - q_(-a)|) / 2.

Three passes, each where the one before found something: points a brick apart, points a block
apart (both against occupied blocks, half a cell added), and the cells of a block against the densities
themselves. The images of the cells' corners are interpolated between the block's corners, and r is then half
a cell's reach plus a quarter of the images' second difference, twice the error of interpolation. A coarse
look is the first pass alone, with points two bricks apart where there are more than COARSE_BRICKS.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.block_cyclic import block_cyclic_schedule
from cagefield.compute.devices import ints
from cagefield.edits.device_stack import DeviceStack
from cagefield.rendering.voxels.device_grid import DeviceGrid, occupancy_args
from cagefield.rendering.voxels.kernels.occupancy_continuous import dense_blocks, occupied_points
from cagefield.rendering.voxels.kernels.occupancy_queries import MOST_CELLS
from cagefield.rendering.voxels.mapped_lattice import images_of
from cagefield.rendering.voxels.occupancy import BRICK, Occupancy, cubes
from cagefield.typing import Mask

COARSE_BRICKS = 1 << 17
"""Bricks up to which a coarse pass maps the corners of each: in milliseconds, which rays through empty space
would take several times over."""


def near_bricks(
    canonical: Occupancy,
    grid: DeviceGrid,
    stack: DeviceStack,
    lower: NDArray[np.int64],
    count: NDArray[np.int64],
    starts: NDArray[np.float32] | None = None,
    *,
    coarse: bool = False,
) -> Mask:
    """The bricks [count] with an occupied corner, the first one's at grid coordinates `lower`.

    `coarse` takes eight bricks as one where there are many (COARSE_BRICKS). `starts`, where given, are where
    the corners are mapped from; see `coarse_corners`.
    """
    apart = _coarse_spacing(count) if coarse else 1
    points = _points(count, apart)
    images = images_of(grid, stack, lower, np.ones(points, bool), apart * BRICK, starts)
    near = cubes(_occupied(images, canonical, points, apart * MOST_CELLS))
    if apart == 1:
        return near
    return near.repeat(2, 0).repeat(2, 1).repeat(2, 2)[: count[0], : count[1], : count[2]]


def coarse_corners(
    grid: DeviceGrid, stack: DeviceStack, lower: NDArray[np.int64], count: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Images [N,3], grid coordinates, under a stack, of the corners that a coarse pass maps."""
    apart = _coarse_spacing(count)
    return images_of(grid, stack, lower, np.ones(_points(count, apart), bool), apart * BRICK)


def _coarse_spacing(count: NDArray[np.int64]) -> int:
    """Bricks between the points of a coarse pass over `count` [3] bricks."""
    return 1 if count.prod() <= COARSE_BRICKS else 2


def _points(count: NDArray[np.int64], apart: int) -> tuple[int, ...]:
    return tuple((-(-count // apart) + 1).tolist())


def occupied_blocks(
    canonical: Occupancy,
    grid: DeviceGrid,
    stack: DeviceStack,
    lower: NDArray[np.int64],
    bricks: Mask,
    new: Mask,
    proceed: Callable[[], None],
) -> Mask:
    """Which of the `new` blocks [2bx,2by,2bz] are occupied, of the bricks that `near_bricks` found.

    `proceed` is called between the passes, and may raise.
    """
    near = bricks.repeat(2, 0).repeat(2, 1).repeat(2, 2)
    points = tuple(n + 1 for n in near.shape)
    wanted = np.zeros(points, bool)
    for corner in range(8):
        i, j, k = corner >> 2 & 1, corner >> 1 & 1, corner & 1
        wanted[i : i + near.shape[0], j : j + near.shape[1], k : k + near.shape[2]] |= near
    proceed()
    images = images_of(grid, stack, lower, wanted, 2)
    proceed()
    near &= new & cubes(_occupied(images, canonical, points))
    candidates = np.argwhere(near).astype(np.int32)
    if len(candidates):
        proceed()
        near[tuple(candidates.T)] = _refined(candidates, images, points, grid)
    return near


def _occupied(
    images: NDArray[np.float32], canonical: Occupancy, count: tuple[int, ...], most: float = MOST_CELLS
) -> Mask:
    """Which points [count] have an occupied block within reach, at most `most` cells."""
    out = np.empty(len(images), np.uint8)
    occupied_points(
        out,
        block_cyclic_schedule(len(out)),
        images,
        occupancy_args(canonical),
        ints(count),
        most,
    )
    return out.reshape(count).view(bool)


def _refined(
    candidates: NDArray[np.int32], images: NDArray[np.float32], count: tuple[int, ...], grid: DeviceGrid
) -> Mask:
    """Which of the candidate blocks [C,3] hold density, by the images of points [count]."""
    out = np.empty(len(candidates), np.uint8)
    dense_blocks(
        out,
        block_cyclic_schedule(len(out)),
        candidates.reshape(-1),
        images,
        ints(count),
        grid.args,
    )
    return out.view(bool)
