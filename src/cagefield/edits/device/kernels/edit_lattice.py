"""The kernels of `cagefield.edits.device.edit_lattice`."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.block_cyclic import Schedule, scheduled_item, turn_count
from cagefield.compute.quadrants import qd
from cagefield.edits.device.kernels.edit_maps import Nodes, Params, map_edit

vec3 = qd.math.vec3
mat3 = qd.types.matrix(3, 3, qd.f32)


@qd.kernel(fastcache=True)
def sample_lattice(
    nodes: Nodes, deal: Schedule, params: Params, none: Nodes, origin: vec3, frame: mat3, resolution: qd.i32
):
    for turn in range(turn_count(deal)):
        n = scheduled_item(turn, deal)
        if n < nodes.shape[0]:
            i = n % resolution
            j = (n // resolution) % resolution
            k = n // (resolution * resolution)
            p = origin + frame @ (vec3(i, j, k) / qd.cast(resolution - 1, qd.f32))
            q, _v, _place = map_edit(p, vec3(1.0, 0.0, 0.0), params, none, 0, False)
            nodes[n] = q - p
