"""The flow shell for one sample, inside Quadrants kernels, in float32, from a table of the cage's motion.

Everything is done in Z, the affine coordinates of the outer cage; `flow_table` has the layout of the table.
The
oracle, and the mathematics, are in `flow_shell`.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.quadrants import qd
from cagefield.warps.flow_table import HEADER, MOMENT
from cagefield.warps.kernels.flow_velocity import rows_times, velocity

vec3 = qd.math.vec3


@qd.func
def flow_sample(p: vec3, d: vec3, lattice: qd.template(), base: qd.i32):
    """(canonical point, J d) of a deformed point p in the shell; J is that of the discrete scheme."""
    return flow(p, d, lattice, base, True)


@qd.func
def flow_point(p: vec3, lattice: qd.template(), base: qd.i32):
    """The canonical point of a deformed point p."""
    q, _v = flow(p, vec3(0.0, 0.0, 0.0), lattice, base, False)
    return q


@qd.func
def flow(p: vec3, d: vec3, lattice: qd.template(), base: qd.i32, tangent: qd.template()):
    """(canonical point, J d); d is ignored, and returned, where there is no tangent."""
    Z = rows_times(lattice, base, p - lattice[base + 3])
    D = rows_times(lattice, base, d)
    steps = qd.cast(lattice[base + 8].x, qd.i32)
    z = qd.max(qd.min(Z, 1.0), -1.0)
    xi = rows_times(lattice, base + HEADER, Z) + lattice[base + HEADER + 3]
    # The stages are a loop, not four copies: compilers take minutes for those.
    for n in range(steps):
        at = base + HEADER + 2 * MOMENT * n
        h = lattice[at + 9].x
        sum_Z = vec3(0.0, 0.0, 0.0)
        sum_D = vec3(0.0, 0.0, 0.0)
        k = vec3(0.0, 0.0, 0.0)
        m = vec3(0.0, 0.0, 0.0)
        share = 0.0
        for stage in range(4):
            middle = stage == 1 or stage == 2
            if stage == 1:
                share = 0.5 * h
            elif stage == 3:
                share = h
            k, m, z, xi = velocity(
                Z + share * k, D + share * m, z, xi, lattice, base, at + ((stage + 1) // 2) * MOMENT, tangent
            )
            weight = 2.0 if middle else 1.0
            sum_Z += weight * k
            if qd.static(tangent):
                sum_D += weight * m
        Z += (h / 6.0) * sum_Z
        if qd.static(tangent):
            D += (h / 6.0) * sum_D
    q = p
    v = d
    if steps > 0:
        q = lattice[base + 3] + rows_times(lattice, base + 4, Z)
        if qd.static(tangent):
            v = rows_times(lattice, base + 4, D)
    return q, v
