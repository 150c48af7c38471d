"""Occupied blocks under maps that do not jump, from the images of a lattice's points.

Each point is mapped once; how far its surroundings reach in canonical space is read off its neighbours'
images q: along axis a as far as to the farther neighbour's, halved, and summed over the axes,

    r = sum_a max(|q_(+a) - q|, |q - q_(-a)|) / 2.

Three passes, each looked at where the one before found something: points a brick apart, points a block
apart (both against occupied blocks, half a cell added), and the cells of a block against the densities
themselves. The images of the cells' corners are interpolated between the block's corners, and r is then half
a cell's reach plus a quarter of the images' second difference, twice the error of interpolation. A coarse
look is the first pass alone, with points two bricks apart.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from collections.abc import Callable

import numpy as np
import quadrants as qd
from numpy.typing import NDArray

from cagefield.devices import ints
from cagefield.loops import Deal, deal_of, dealt, turns
from cagefield.rendering.grid import F32, I32, U8, DeviceGrid, ivec3, vec3
from cagefield.rendering.kernels.occupancy_queries import MOST_CELLS, is_blocked, is_dense
from cagefield.rendering.mapped_points import UNKNOWN, differences, images_of
from cagefield.rendering.occupancy import BRICK, Occupancy, cubes
from cagefield.warps.device_stack import DeviceStack
from cagefield.warps.kernels.edit_maps import Nodes

Mask = NDArray[np.bool_]


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

    `coarse` takes eight bricks as one. `starts`, where given, are where the corners are mapped from; see
    `coarse_corners`.
    """
    if not coarse:
        points = tuple((count + 1).tolist())
        images = images_of(grid, stack, lower, np.ones(points, bool), BRICK, starts)
        return cubes(_occupied(images, canonical, points))
    points = _coarse_points(count)
    images = images_of(grid, stack, lower, np.ones(points, bool), 2 * BRICK, starts)
    near = cubes(_occupied(images, canonical, points, 2.0 * MOST_CELLS))
    return near.repeat(2, 0).repeat(2, 1).repeat(2, 2)[: count[0], : count[1], : count[2]]


def coarse_corners(
    grid: DeviceGrid, stack: DeviceStack, lower: NDArray[np.int64], count: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Images [N,3], grid coordinates, under a stack, of the corners that a coarse look at bricks maps."""
    return images_of(grid, stack, lower, np.ones(_coarse_points(count), bool), 2 * BRICK)


def _coarse_points(count: NDArray[np.int64]) -> tuple[int, ...]:
    return tuple((-(-count // 2) + 1).tolist())


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
    _occupied_points(
        out,
        deal_of(len(out)),
        images,
        canonical.codes.reshape(-1),
        ints(canonical.codes.shape),
        ints(canonical.origin),
        ints(count),
        most,
    )
    return out.reshape(count).view(bool)


def _refined(
    candidates: NDArray[np.int32], images: NDArray[np.float32], count: tuple[int, ...], grid: DeviceGrid
) -> Mask:
    """Which of the candidate blocks [C,3] hold density, by the images of points [count]."""
    out = np.empty(len(candidates), np.uint8)
    _dense_blocks(
        out,
        deal_of(len(out)),
        candidates.reshape(-1),
        images,
        ints(count),
        grid.index,
        grid.density,
        ints(grid.field.resolution),
    )
    return out.view(bool)


@qd.kernel(fastcache=True)
def _occupied_points(
    out: U8,
    deal: Deal,
    images: Nodes,
    codes: I32,
    bricks: ivec3,
    origin: ivec3,
    count: ivec3,
    most: qd.f32,
):
    for turn in range(turns(deal)):
        n = dealt(turn, deal)
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
                b = (qd.cast(qd.floor(image), qd.i32) - origin) >> 2
                if b.min() >= 0 and (bricks - b).min() > 0:
                    # Every brick nearer than this code says is empty.
                    code = codes[(b.x * bricks.y + b.y) * bricks.z + b.z]
                    if r.max() < qd.cast(4 * ((code >> 8) - 1), qd.f32):
                        empty = 1
                if empty == 0:
                    found = is_blocked(image, r, codes, bricks, origin)
            out[n] = qd.cast(found, qd.u8)


@qd.kernel(fastcache=True)
def _dense_blocks(
    out: U8,
    deal: Deal,
    candidates: I32,
    images: Nodes,
    count: ivec3,
    index: I32,
    density: F32,
    resolution: ivec3,
):
    for turn in range(turns(deal)):
        c = dealt(turn, deal)
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
                found = is_dense(image, r, index, density, resolution)
                at += 1
            out[c] = qd.cast(found, qd.u8)
