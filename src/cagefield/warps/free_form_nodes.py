"""Arguments of the kernels of node lattices, `kernels.lattice_nodes`: a flow, and the places of its nodes."""

from __future__ import annotations

import numpy as np

from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Float32

NO_VELOCITY = np.float32(1e-9)
"""|dz/ds| that counts as 0: below the rounding of z, and rounding itself where a cage moves along one axis.

The squares of its differences would be subnormal float32, with which processors are ten times slower."""


def flow_arguments(
    velocities: Float32, steps: Array, outer: Cage, frame: Array, iterations: int, resolution: int
) -> tuple[object, ...]:
    """(grid, nodes, steps, iterations, places, frame) of a flow in an outer cage with parallel faces.

    velocities [K,G,G,G,3] and steps [K] of the flow; frame [7,3]: center, dz/dx, dx/dz of the outer cage;
    `iterations` of a step.

    Half as many nodes along each axis and cubic interpolation between them: 2.2 times the error, measured.
    """
    padded = np.zeros((*velocities.shape[:-1], 4), dtype=np.float32)
    padded[..., :3] = np.where(np.abs(velocities) > NO_VELOCITY, velocities, np.float32(0.0))
    nodes = np.uintp(velocities.shape[1])
    place = node_places(outer, resolution)
    places = np.concatenate([place[:1] - frame[0], place[1:]]) @ frame[1:4].T
    return padded.reshape(-1), nodes, steps, iterations, places, frame[4:].astype(np.float32)


def node_places(outer: Cage, resolution: int) -> Array:
    """[4,3]: x of the first node of a `Lattice` over an outer cage, dx by a node along each axis."""
    origin, edges = outer.frame
    return np.concatenate([origin[None], edges.T / (resolution - 1)])
