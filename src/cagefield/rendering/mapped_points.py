"""Where an edit stack's map takes the points of a regular lattice in deformed space."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

import numpy as np
import quadrants as qd
from numpy.typing import NDArray

from cagefield.devices import ints
from cagefield.loops import Deal, deal_of, dealt, turns
from cagefield.rendering.grid import U8, DeviceGrid, ivec3, to_grid, to_world, transform_of, vec3
from cagefield.warps.device_stack import DeviceStack
from cagefield.warps.kernels.edit_maps import Nodes, Params, map_sample

UNKNOWN = 1e30
"""Image of a point that was not mapped."""


def images_of(
    grid: DeviceGrid,
    stack: DeviceStack,
    lower: NDArray[np.int64],
    wanted: NDArray[np.bool_],
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
        grid.field.contracted,
        stack.has_flows,
    )
    return images


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
    contracted: qd.template(),
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
            p = to_world(g, origin, scale, half, contracted)
            q, _v, _empty = map_sample(p, vec3(1.0, 0.0, 0.0), params, lattice, n_edits, flows)
            image = g
            if qd.abs(q - p).max() > 0.0:
                image = to_grid(q, origin, scale, half, contracted)
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
