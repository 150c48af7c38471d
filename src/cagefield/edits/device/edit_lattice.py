"""The lattice of a continuous map, sampled by a Quadrants kernel in float32."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cagefield.compute import devices
from cagefield.compute.block_cyclic import block_cyclic_schedule
from cagefield.compute.devices import floats
from cagefield.edits.device.kernels.edit_lattice import sample_lattice
from cagefield.edits.device.packing import pack_warp
from cagefield.errors import EditError
from cagefield.files import memory
from cagefield.warps import FreeFormFlow, LatticeShell, MeshShell, flow_shell_nodes
from cagefield.warps.continuous import ContinuousWarp
from cagefield.warps.flow_shell import FlowShell
from cagefield.warps.lattice import Lattice
from cagefield.warps.trilinear_shell import TrilinearShell

NODE_BYTES = 32
"""Bytes of a node: 12 as sampled, 12 in the stack, and the padding of the kernels' copies."""

_UNCHECKED_NODES_PER_AXIS = 64

LATTICE_STRAIN = 1.0
"""Strain of a step (see `FlowShell`) for a lattice of up to 32^3 nodes; finer ones take (R / 32)^-1/2 of it.

Chosen by measurement over the edits of `benchmarks/flow_shell_nodes.py`: error that the integration adds to
the interpolation's own, worst of the edits, in the mean and in the largest error:

    strain    1.0          0.7          0.5          0.35
    32^3      1% and 4%    0% and 1%    0% and 0%    0% and 0%
    64^3      4% and 9%    2% and 3%    0% and 1%    0% and 0%
    128^3     29% and 33%  4% and 9%    4% and 2%    0% and 0%
"""

FREE_FORM_STRAIN = 0.5
"""Strain of a step (see `warps.free_form`) of a flow whose inner cage is no hexahedron."""


def sample_nodes(warp: ContinuousWarp, resolution: int) -> NDArray[np.float32]:
    """The nodes [R^3,3] of a continuous map's lattice, displacements in world units, x fastest.

    Raises `DeviceError` where no device starts, and `EditError` where the lattice and the arrays made of it
    would take most of the free memory.
    """
    _check_memory(resolution)
    devices.start()
    if isinstance(warp.shell, FlowShell):
        strain = LATTICE_STRAIN * min(1.0, (32.0 / resolution) ** 0.5)
        return flow_shell_nodes.sample(warp.shell.with_strain(strain), resolution)
    if isinstance(warp.shell, LatticeShell | MeshShell):
        return warp.shell.sample(resolution)
    if isinstance(warp.shell, FreeFormFlow):
        return warp.shell.with_strain(FREE_FORM_STRAIN).sample(resolution, warp.inner)
    nodes = np.empty((resolution**3, 3), dtype=np.float32)
    if not isinstance(warp.shell, TrilinearShell):  # no kernel: from the reference
        lattice = Lattice.sample(lambda p: warp.to_canonical(p).points, warp.outer, resolution)
        nodes[:] = lattice.displacement.reshape(-1, 3)
        return nodes
    origin, frame = warp.outer.frame
    place = (floats(origin), floats(frame), resolution)
    params = pack_warp(warp, warp.outer.aabb[None])[None]
    sample_lattice(
        nodes, block_cyclic_schedule(len(nodes)), params, np.zeros((1, 3), dtype=np.float32), *place
    )
    return nodes


def _check_memory(resolution: int) -> None:
    needed, free = NODE_BYTES * resolution**3, memory.free_memory()
    if resolution > _UNCHECKED_NODES_PER_AXIS and free is not None and needed > free // 2:
        raise EditError(
            f"a lattice of {resolution} nodes per axis takes {needed / 1e9:.1f} GB, of the "
            f"{free / 1e9:.1f} GB that are free at most half is taken; give it a lower resolution"
        )
