"""The kernels of `cagefield.rendering.nerf.torch_edit_map`."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.block_cyclic import Schedule, scheduled_item, turn_count
from cagefield.compute.quadrants import qd
from cagefield.edits.device.kernels.edit_maps import EditArgs, Params, map_sample
from cagefield.edits.device.kernels.hexahedron import read3


@qd.kernel(fastcache=True)
def map_tensors(
    samples: Params,
    deal: Schedule,
    out: Params,
    edits: EditArgs,
    flows: qd.template(),
    preserve_opacity: qd.template(),
):
    for turn in range(turn_count(deal)):
        i = scheduled_item(turn, deal)
        if i < samples.shape[0]:
            d = read3(samples, i, 3)
            q, v, place = map_sample(read3(samples, i, 0), d, edits, flows)
            length = qd.max(v.norm(), 1e-20)
            unchanged = (v - d).norm() == 0.0
            for a in qd.static(range(3)):
                out[i, a] = q[a]
                out[i, 3 + a] = d[a] if unchanged else v[a] / length
            gain = 1.0
            if place < 0:
                gain = 0.0
            if qd.static(preserve_opacity):
                if not unchanged:
                    gain *= length / qd.max(d.norm(), 1e-20)
            out[i, 6] = gain
            out[i, 7] = qd.cast(place, qd.f32)
