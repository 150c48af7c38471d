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
from cagefield.rendering.grid import (
    F32,
    I32,
    U8,
    DeviceGrid,
    contract_point,
    ivec3,
    transform_of,
    uncontract_point,
    vec3,
)
from cagefield.rendering.occupancy import BRICK, Occupancy
from cagefield.warps.device import DeviceStack, Nodes, Params, map_sample

MOST_CELLS = 12.0
"""Largest r, in cells; twice that in a coarse look. A map that squeezes more looks that far only."""

UNKNOWN = 1e30
"""Image of a point that was not mapped."""

Mask = NDArray[np.bool_]
Proceed = Callable[[], None]


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
        images = _images(grid, stack, lower, np.ones(points, bool), BRICK, starts)
        return cubes(_occupied(images, canonical, points))
    points = _coarse_points(count)
    images = _images(grid, stack, lower, np.ones(points, bool), 2 * BRICK, starts)
    near = cubes(_occupied(images, canonical, points, 2.0 * MOST_CELLS))
    return near.repeat(2, 0).repeat(2, 1).repeat(2, 2)[: count[0], : count[1], : count[2]]


def coarse_corners(
    grid: DeviceGrid, stack: DeviceStack, lower: NDArray[np.int64], count: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Images [N,3], grid coordinates, under a stack, of the corners that a coarse look at bricks maps."""
    return _images(grid, stack, lower, np.ones(_coarse_points(count), bool), 2 * BRICK)


def _coarse_points(count: NDArray[np.int64]) -> tuple[int, ...]:
    return tuple((-(-count // 2) + 1).tolist())


def occupied_blocks(
    canonical: Occupancy,
    grid: DeviceGrid,
    stack: DeviceStack,
    lower: NDArray[np.int64],
    bricks: Mask,
    new: Mask,
    proceed: Proceed,
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
    images = _images(grid, stack, lower, wanted, 2)
    proceed()
    near &= new & cubes(_occupied(images, canonical, points))
    candidates = np.argwhere(near).astype(np.int32)
    if len(candidates):
        proceed()
        near[tuple(candidates.T)] = _refined(candidates, images, points, grid)
    return near


def _images(
    grid: DeviceGrid,
    stack: DeviceStack,
    lower: NDArray[np.int64],
    wanted: Mask,
    spacing: int,
    starts: NDArray[np.float32] | None = None,
) -> NDArray[np.float32]:
    """Images [N,3], grid coordinates, of the wanted lattice points, `spacing` cells apart; others UNKNOWN.

    `starts` [N,3], grid coordinates, take the points' place where they are given.
    """
    images = np.empty((wanted.size, 3), np.float32)
    _map_points(
        images,
        deal_of(len(images)),
        np.zeros((1, 3), np.float32) if starts is None else starts,
        int(starts is not None),
        np.ascontiguousarray(wanted, np.uint8).reshape(-1),
        ints(lower),
        ints(wanted.shape),
        spacing,
        *transform_of(grid.field),
        stack.params,
        stack.lattice,
        stack.n_edits,
        int(grid.field.contracted),
        stack.has_flows,
    )
    return images


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


def cubes(points: Mask) -> Mask:
    """Cubes with one of eight points [count + 1]."""
    near = points[:-1] | points[1:]
    near = near[:, :-1] | near[:, 1:]
    return np.asarray(near[:, :, :-1] | near[:, :, 1:])


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
def _map_points(
    images: Nodes,
    deal: Deal,
    starts: Nodes,
    started: qd.i32,
    wanted: U8,
    lower: ivec3,
    count: ivec3,
    spacing: qd.i32,
    origin: vec3,
    scale: vec3,
    half: vec3,
    params: Params,
    lattice: Nodes,
    n_edits: qd.i32,
    contracted: qd.i32,
    flows: qd.template(),
):
    for turn in range(turns(deal)):
        n = dealt(turn, deal)
        image = vec3(UNKNOWN, UNKNOWN, UNKNOWN)
        if n < images.shape[0] and wanted[n] > 0:
            at = lower + spacing * ivec3(n // (count.y * count.z), (n // count.z) % count.y, n % count.z)
            g = qd.cast(at, qd.f32)
            if started == 1:
                g = starts[n]
            p = g / scale + origin
            if contracted == 1:
                p = uncontract_point(g / half - 2.0) / scale + origin
            q, _v, _empty = map_sample(p, vec3(1.0, 0.0, 0.0), params, lattice, n_edits, flows)
            image = g
            if qd.abs(q - p).max() > 0.0:
                image = (q - origin) * scale
                if contracted == 1:
                    image = (contract_point(image) + 2.0) * half
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


@qd.func
def is_blocked(image: vec3, r: vec3, codes: qd.template(), bricks: ivec3, origin: ivec3):
    """1 where an occupied block lies within r of an image, grid coordinates, else 0."""
    first = qd.max(qd.cast(qd.floor((image - r) * 0.5), qd.i32) - (origin >> 1), 0)
    last = qd.min(qd.cast(qd.floor((image + r) * 0.5), qd.i32) - (origin >> 1), 2 * bricks - 1)
    found = 0
    x = first.x >> 1
    while x <= last.x >> 1 and found == 0:
        in_x = between(x, first.x, last.x, 0xF0)
        for y in range(first.y >> 1, (last.y >> 1) + 1):
            in_xy = in_x & between(y, first.y, last.y, 0xCC)
            for z in range(first.z >> 1, (last.z >> 1) + 1):
                code = codes[(x * bricks.y + y) * bricks.z + z]
                found |= code & in_xy & between(z, first.z, last.z, 0xAA)
        x += 1
    return qd.min(found, 1)


@qd.func
def between(brick: qd.i32, first: qd.i32, last: qd.i32, upper: qd.i32):
    """Bits of a brick's sub-blocks from the block `first` to `last` along an axis.

    `upper` are the bits of its second sub-blocks.
    """
    bits = 0xFF
    if first > 2 * brick:
        bits = upper
    if last <= 2 * brick:
        bits = bits & ~upper
    return bits


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


@qd.func
def is_dense(image: vec3, r: vec3, index: qd.template(), density: qd.template(), resolution: ivec3):
    """1 where a cell within r of an image, grid coordinates, holds density, else 0."""
    first = qd.max(qd.cast(qd.floor(image - r), qd.i32), 0)
    last = qd.min(qd.cast(qd.floor(image + r), qd.i32) + 1, resolution - 1)
    found = 0
    x = first.x
    while x <= last.x and found == 0:
        for y in range(first.y, last.y + 1):
            for z in range(first.z, last.z + 1):
                if density[index[(x * resolution.y + y) * resolution.z + z]] > 0.0:
                    found = 1
        x += 1
    return found


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
