"""The lattice of a flow shell between parallelepipeds, sampled by a Quadrants kernel in float32.

The march of `flow_device`, written for `LANES` nodes at a time and without branches, so that compilers can
use vector instructions: a vector here holds one number of each of the nodes. The table is
that of `flow_device`.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

import numpy as np
import quadrants as qd
from numpy.typing import NDArray

from cagefield import devices
from cagefield.warps.flow_device import HEADER, MOMENT, table
from cagefield.warps.flow_shell import FlowShell

LANES = 8
lanes = qd.types.vector(LANES, qd.f32)
vec3 = qd.math.vec3
mat3 = qd.types.matrix(3, 3, qd.f32)
Nodes = qd.types.ndarray(dtype=vec3, ndim=1)


def sample(shell: FlowShell, resolution: int) -> NDArray[np.float32]:
    """Displacements to canonical space [R^3,3], x fastest, of the nodes of an outer cage; see `Lattice`.

    Both cages must be parallelepipeds. Nodes inside the inner cage go along with it, up to the error of the
    integration; those on the outer cage's faces stay where they are.
    """
    devices.start()
    origin, frame = shell.outer.frame
    nodes = np.empty((resolution**3, 3), dtype=np.float32)
    _march(nodes, table(shell), vec3(*origin.tolist()), mat3(frame.tolist()), resolution)
    return nodes


@qd.kernel
def _march(nodes: Nodes, table: Nodes, origin: vec3, frame: mat3, resolution: qd.i32):
    count = nodes.shape[0]
    for block in range((count + LANES - 1) // LANES):
        px = lanes(0.0)
        py = lanes(0.0)
        pz = lanes(0.0)
        for lane in qd.static(range(LANES)):
            n = qd.min(block * LANES + lane, count - 1)
            at = vec3(n % resolution, (n // resolution) % resolution, n // (resolution * resolution))
            p = origin - table[3] + frame @ (at / qd.cast(resolution - 1, qd.f32))
            px[lane] = p.x
            py[lane] = p.y
            pz[lane] = p.z
        x, y, z = times(table, 0, px, py, pz)
        x0 = x
        y0 = y
        z0 = z
        steps = qd.cast(table[8].x, qd.i32)
        for n in range(steps):
            start = HEADER + 2 * MOMENT * n
            h = table[start + 9].x
            kx = lanes(0.0)
            ky = lanes(0.0)
            kz = lanes(0.0)
            sx = lanes(0.0)
            sy = lanes(0.0)
            sz = lanes(0.0)
            share = 0.0
            for stage in range(4):
                if stage == 1:
                    share = 0.5 * h
                elif stage == 3:
                    share = h
                moment = start + ((stage + 1) // 2) * MOMENT
                kx, ky, kz = velocity(x + share * kx, y + share * ky, z + share * kz, table, moment)
                weight = 2.0 if (stage == 1 or stage == 2) else 1.0
                sx += weight * kx
                sy += weight * ky
                sz += weight * kz
            x += (h / 6.0) * sx
            y += (h / 6.0) * sy
            z += (h / 6.0) * sz
        qx, qy, qz = times(table, 4, x - x0, y - y0, z - z0)
        for lane in qd.static(range(LANES)):
            n = block * LANES + lane
            if n < count:
                nodes[n] = vec3(qx[lane], qy[lane], qz[lane])


@qd.func
def velocity(x: lanes, y: lanes, z: lanes, table: qd.template(), moment: qd.i32):
    """dZ/dt at Z, in three parts."""
    bx, by, bz = times(table, moment, x, y, z)
    bx += table[moment + 3].x
    by += table[moment + 3].y
    bz += table[moment + 3].z
    vx, vy, vz = times(table, moment + 4, x, y, z)
    vx += table[moment + 7].x
    vy += table[moment + 7].y
    vz += table[moment + 7].z
    H = table[7]
    height = table[moment + 8]
    dx = 1.0 / qd.max(H.x * (1.0 - x * x), 1e-6)
    dy = 1.0 / qd.max(H.y * (1.0 - y * y), 1e-6)
    dz = 1.0 / qd.max(H.z * (1.0 - z * z), 1e-6)
    ex = height.x * qd.max(qd.abs(bx) - 1.0, 0.0)
    ey = height.y * qd.max(qd.abs(by) - 1.0, 0.0)
    ez = height.z * qd.max(qd.abs(bz) - 1.0, 0.0)
    dx *= dx
    dy *= dy
    dz *= dz
    ex *= ex
    ey *= ey
    ez *= ez
    q = qd.sqrt(qd.sqrt((dx * dx + dy * dy + dz * dz) * (ex * ex + ey * ey + ez * ez)))
    g = qd.max((1.0 / (1.0 + q) - 1.0) * table[8].z + 1.0, 0.0)
    linear = table[9].x
    w = g * (linear + (1.0 - linear) * g * (3.0 - 2.0 * g))
    return w * vx, w * vy, w * vz


@qd.func
def times(table: qd.template(), at: qd.i32, x: lanes, y: lanes, z: lanes):
    """The matrix whose rows are three entries of the table, times (x, y, z)."""
    a = table[at]
    b = table[at + 1]
    c = table[at + 2]
    return (
        a.x * x + a.y * y + a.z * z,
        b.x * x + b.y * y + b.z * z,
        c.x * x + c.y * y + c.z * z,
    )
