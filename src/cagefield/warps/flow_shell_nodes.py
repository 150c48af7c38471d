"""The lattice of a flow shell, sampled by a Quadrants kernel in float32.

The march of `kernels.flow_shell`, written for `NODES_PER_BATCH` nodes at a time: the innermost loops run
over them,
have no branches, and keep each number of all of them in one array, so that compilers use vector instructions.
The table is that of `flow_table`. Two things differ from the march of single samples, by less than the error
of its steps: it continues in the outer cage's coordinates z, so that only the start of a way is straightened
there, and the inner cage's xi are followed by two of Newton's steps a stage, with one slope, not to rounding.
Nodes that these do not suffice for are marked, and marched again one by one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cagefield.compute import devices
from cagefield.compute.block_cyclic import block_cyclic_schedule
from cagefield.compute.devices import floats
from cagefield.warps.flow_shell import FlowShell
from cagefield.warps.flow_table import table
from cagefield.warps.kernels.flow_shell_nodes import (
    LOST,
    NODES_PER_BATCH,
    march,
    march_lost,
)


def sample(shell: FlowShell, resolution: int) -> NDArray[np.float32]:
    """Displacements to canonical space [R^3,3], x fastest, of the nodes of an outer cage; see `Lattice`.

    Nodes inside the inner cage go along with it, up to the error of the integration; those on the outer
    cage's faces and outside them stay where they are.
    """
    devices.start()
    origin, frame = shell.outer.frame
    nodes = np.empty((resolution**3, 3), dtype=np.float32)
    place = (table(shell), floats(origin), floats(frame), resolution)
    if devices.is_gpu():  # which has a lane for every node
        nodes[:] = LOST
    else:
        blocks = block_cyclic_schedule(-(-len(nodes) // NODES_PER_BATCH), 1)
        march(nodes, blocks, *place, not shell.motion.confines.is_affine, not shell.motion.is_affine)
    lost = np.flatnonzero(nodes[:, 0] == np.float32(LOST)).astype(np.int32)
    if len(lost):
        march_lost(nodes, lost, block_cyclic_schedule(len(lost), 1), *place)
    return nodes
