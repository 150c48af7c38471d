"""The kernels of `cagefield.edits.device_stack`."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.block_cyclic import Schedule, scheduled_item, turn_count
from cagefield.compute.quadrants import qd
from cagefield.edits.device.kernels.edit_maps import EditArgs, Params, map_sample
from cagefield.edits.device.kernels.grade import grade_sample
from cagefield.edits.device.kernels.hexahedron import read3


@qd.kernel(fastcache=True)
def map_samples(
    samples: Params,
    deal: Schedule,
    out: Params,
    edits: EditArgs,
    flows: qd.template(),
):
    for turn in range(turn_count(deal)):
        i = scheduled_item(turn, deal)
        if i < samples.shape[0]:
            d = read3(samples, i, 3)
            q, v, place = map_sample(read3(samples, i, 0), d, edits, flows)
            stretch = 1.0
            if (v - d).norm() > 0.0:
                stretch = v.norm()
            for a in qd.static(range(3)):
                out[i, a] = q[a]
                out[i, 3 + a] = v[a] / qd.max(stretch, 1e-20)
            out[i, 6] = stretch
            out[i, 7] = qd.cast(place, qd.f32)


@qd.kernel(fastcache=True)
def grade_samples(
    points: Params,
    deal: Schedule,
    out: Params,
    edits: EditArgs,
    flows: qd.template(),
):
    """Writes the color matrix (9 numbers) and the density factor of points [N,3] into out [N,10]."""
    for turn in range(turn_count(deal)):
        i = scheduled_item(turn, deal)
        if i < points.shape[0]:
            colors, density = grade_sample(read3(points, i, 0), edits, flows)
            for a, b in qd.static(qd.ndrange(3, 3)):
                out[i, 3 * a + b] = colors[a, b]
            out[i, 9] = density
