"""Where an edit stack's map takes the points of a regular lattice in deformed space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.block_cyclic import block_cyclic_schedule
from cagefield.compute.devices import ints
from cagefield.edits.device_stack import DeviceStack
from cagefield.rendering.voxels.device_grid import DeviceGrid
from cagefield.rendering.voxels.kernels.mapped_lattice import map_points


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
    map_points(
        images,
        block_cyclic_schedule(len(images)),
        np.zeros((1, 3), np.float32) if starts is None else starts,
        int(starts is not None),
        np.ascontiguousarray(wanted, np.uint8).reshape(-1),
        ints(lower),
        ints(wanted.shape),
        spacing,
        grid.args,
        stack.args,
        grid.field.contracted,
        stack.has_flows,
    )
    return images
