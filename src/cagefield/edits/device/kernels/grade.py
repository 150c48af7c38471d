"""Grade of one sample by an edit stack, inside Quadrants kernels, in float32.

The float64 reference is `EditMap.to_canonical` with `Edit.grade_weights`; see `cagefield.edits.grade`.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.quadrants import qd
from cagefield.edits.device.kernels.edit_maps import EditArgs, map_edit
from cagefield.edits.device.kernels.hexahedron import in_box, locate, read3, times
from cagefield.edits.device.packing import (
    CHANGED_BOX,
    CONTINUOUS,
    EDGE,
    FIRST,
    GRADE_DENSITY,
    GRADE_INNER,
    GRADE_MATRIX,
    GRADE_OUTER,
    GRADED,
    RECORDS,
)

vec3 = qd.math.vec3
mat3 = qd.types.matrix(3, 3, qd.f32)


@qd.func
def grade_sample(p: vec3, edits: EditArgs, flows: qd.template()):
    """(matrix [3,3] of rgb, factor of density) of a deformed sample."""
    q = p
    place = 0
    colors = mat3(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    density = 1.0
    for n in range(edits.count):
        e = edits.count - 1 - n
        if place == 0 and in_box(q, edits.params, e, CHANGED_BOX):
            weight = 0.0
            if edits.params[e, GRADED] > 0.5 and edits.params[e, CONTINUOUS] < 0.5:
                if edits.params[e, FIRST] < 0.5:
                    _xi, error = locate(q, edits.params, e, RECORDS)
                    if error <= EDGE:
                        weight = 1.0
            q, _v, place = map_edit(q, vec3(0.0, 0.0, 1.0), edits.params, edits.lattice, e, flows)
            if edits.params[e, GRADED] > 0.5:
                if edits.params[e, CONTINUOUS] > 0.5:
                    weight = falloff_weight(q, edits.params, e)
                if weight > 0.0:
                    step = mat3(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
                    for a, b in qd.static(qd.ndrange(3, 3)):
                        step[a, b] += weight * (edits.params[e, GRADE_MATRIX + 3 * a + b] - step[a, b])
                    colors = colors @ step
                    density *= 1.0 + weight * (edits.params[e, GRADE_DENSITY] - 1.0)
    return colors, density


@qd.func
def falloff_weight(q: vec3, params: qd.template(), e: qd.i32):
    """w in [0, 1] of a canonical point, as `GradeFalloff.weights`."""
    xi = qd.abs(times(params, e, GRADE_INNER, q - read3(params, e, GRADE_INNER + 9)))
    z = qd.abs(times(params, e, GRADE_OUTER, q - read3(params, e, GRADE_OUTER + 9)))
    w = 1.0
    if xi.max() > 1.0:
        w = 0.0
        if z.max() < 1.0:
            outside = 0.0
            inverse = 0.0
            for a in qd.static(range(3)):
                e_a = qd.max(xi[a] - 1.0, 0.0) / read3(params, e, GRADE_INNER + 3 * a).norm()
                d_a = 0.5 * qd.max(1.0 - z[a] * z[a], 1e-6) / read3(params, e, GRADE_OUTER + 3 * a).norm()
                outside += e_a * e_a * e_a * e_a
                inverse += 1.0 / (d_a * d_a * d_a * d_a)
            d_i = qd.sqrt(qd.sqrt(outside))
            d_o = 1.0 / qd.sqrt(qd.sqrt(inverse))
            g = d_o / (d_i + d_o)
            w = g * g * (3.0 - 2.0 * g)
    return w
