"""The kernels of `cagefield.warps.flow_shell_nodes`."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.block_cyclic import Schedule, scheduled_item, turn_count
from cagefield.compute.quadrants import qd
from cagefield.warps.flow_table import HEADER, MOMENT
from cagefield.warps.kernels.flow_shell import flow_point
from cagefield.warps.kernels.flow_velocity_simd import bend, inverse, newton, newton_twice, times, weight_at

NODES_PER_BATCH = 64
lanes = qd.types.vector(NODES_PER_BATCH, qd.f32)
vec3 = qd.math.vec3
mat3 = qd.types.matrix(3, 3, qd.f32)
Nodes = qd.types.ndarray(dtype=vec3, ndim=1)
Numbers = qd.types.ndarray(dtype=qd.i32, ndim=1)

START_LATTICE_NEWTON_STEPS = 5
"""Newton's steps for the outer cage's coordinates at the start of a way."""

LOST = 1e30
"""Written to nodes whose coordinates were not followed."""

MAX_MOVING_COORDINATE = 1.0 - 3e-6
"""Nodes farther out than this, in coordinates of the outer cage, stay: those on its faces, after rounding.

`kernels.flow_velocity_simd.NEAR` would let them drift.
"""

FOLLOWED = 0.05
"""Largest residual of the inner cage's coordinates, in units of xi, after the first of two steps."""


@qd.kernel(fastcache=True)
def march_lost(
    nodes: Nodes, lost: Numbers, deal: Schedule, table: Nodes, origin: vec3, frame: mat3, resolution: qd.i32
):
    for turn in range(turn_count(deal)):
        item = scheduled_item(turn, deal)
        if item < lost.shape[0]:
            n = lost[item]
            p = place(n, origin, frame, resolution)
            nodes[n] = flow_point(p, table, 0) - p


@qd.kernel(fastcache=True)
def march(
    nodes: Nodes,
    deal: Schedule,
    table: Nodes,
    origin: vec3,
    frame: mat3,
    resolution: qd.i32,
    bent_outer: qd.template(),
    bent_inner: qd.template(),
):
    count = nodes.shape[0]
    for turn in range(turn_count(deal)):
        block = scheduled_item(turn, deal)
        if block * NODES_PER_BATCH < count:
            # z, its rate k and the weighted sum of rates s; xi; the largest residual of xi; 1 where z is at
            # rest.
            zx = lanes(0.0)
            zy = lanes(0.0)
            zz = lanes(0.0)
            kx = lanes(0.0)
            ky = lanes(0.0)
            kz = lanes(0.0)
            sx = lanes(0.0)
            sy = lanes(0.0)
            sz = lanes(0.0)
            bx = lanes(0.0)
            by = lanes(0.0)
            bz = lanes(0.0)
            lost = lanes(0.0)
            still = lanes(0.0)
            for lane in range(NODES_PER_BATCH):
                p = (
                    place(qd.min(block * NODES_PER_BATCH + lane, count - 1), origin, frame, resolution)
                    - table[3]
                )
                Zx, Zy, Zz = times(table, 0, p.x, p.y, p.z)
                x = Zx
                y = Zy
                z = Zz
                if qd.static(bent_outer):
                    x = qd.max(qd.min(Zx, 1.0), -1.0)
                    y = qd.max(qd.min(Zy, 1.0), -1.0)
                    z = qd.max(qd.min(Zz, 1.0), -1.0)
                    for _ in qd.static(range(START_LATTICE_NEWTON_STEPS)):
                        x, y, z, lost[lane] = newton(x, y, z, Zx, Zy, Zz, table, 10)
                zx[lane] = x
                zy[lane] = y
                zz[lane] = z
                if qd.max(qd.abs(x), qd.abs(y), qd.abs(z)) > MAX_MOVING_COORDINATE:
                    still[lane] = 1.0
                if qd.static(bent_inner):
                    ix, iy, iz = times(table, HEADER, Zx, Zy, Zz)
                    ix += table[HEADER + 3].x
                    iy += table[HEADER + 3].y
                    iz += table[HEADER + 3].z
                    x = ix
                    y = iy
                    z = iz
                    for _ in qd.static(range(START_LATTICE_NEWTON_STEPS)):
                        x, y, z, _r = newton(x, y, z, ix, iy, iz, table, HEADER + 10)
                    bx[lane] = x
                    by[lane] = y
                    bz[lane] = z
            steps = qd.cast(table[8].x, qd.i32)
            for n in range(steps):
                start = HEADER + 2 * MOMENT * n
                h = table[start + 9].x
                share = 0.0
                for stage in range(4):
                    if stage == 1:
                        share = 0.5 * h
                    elif stage == 3:
                        share = h
                    kept = 0.0 if stage == 0 else 1.0
                    weight = 2.0 if (stage == 1 or stage == 2) else 1.0
                    moment = start + ((stage + 1) // 2) * MOMENT
                    for lane in range(NODES_PER_BATCH):
                        x = zx[lane] + share * kx[lane]
                        y = zy[lane] + share * ky[lane]
                        z = zz[lane] + share * kz[lane]
                        Zx = x
                        Zy = y
                        Zz = z
                        if qd.static(bent_outer):
                            tx, ty, tz = bend(x, y, z, table, 10)
                            Zx += tx
                            Zy += ty
                            Zz += tz
                        ix, iy, iz = times(table, moment, Zx, Zy, Zz)
                        ix += table[moment + 3].x
                        iy += table[moment + 3].y
                        iz += table[moment + 3].z
                        vx, vy, vz = times(table, moment + 4, Zx, Zy, Zz)
                        vx += table[moment + 7].x
                        vy += table[moment + 7].y
                        vz += table[moment + 7].z
                        if qd.static(bent_inner):
                            ix, iy, iz, residual = newton_twice(
                                bx[lane], by[lane], bz[lane], ix, iy, iz, table, moment + 10
                            )
                            bx[lane] = ix
                            by[lane] = iy
                            bz[lane] = iz
                            lost[lane] = qd.max(lost[lane], residual)
                            cx = qd.max(qd.min(ix, 1.0), -1.0)
                            cy = qd.max(qd.min(iy, 1.0), -1.0)
                            cz = qd.max(qd.min(iz, 1.0), -1.0)
                            tx, ty, tz = bend(cx, cy, cz, table, 20)
                            tx, ty, tz = times(table, moment + 20, tx, ty, tz)
                            vx += tx
                            vy += ty
                            vz += tz
                        w = weight_at(x, y, z, ix, iy, iz, table, moment)
                        vx *= w
                        vy *= w
                        vz *= w
                        if qd.static(bent_outer):
                            ux, uy, uz, wx, wy, wz, tx, ty, tz = inverse(x, y, z, table, 10, False)
                            x = ux * vx + uy * vy + uz * vz
                            y = wx * vx + wy * vy + wz * vz
                            z = tx * vx + ty * vy + tz * vz
                            vx = x
                            vy = y
                            vz = z
                        kx[lane] = vx
                        ky[lane] = vy
                        kz[lane] = vz
                        sx[lane] = kept * sx[lane] + weight * vx
                        sy[lane] = kept * sy[lane] + weight * vy
                        sz[lane] = kept * sz[lane] + weight * vz
                for lane in range(NODES_PER_BATCH):
                    zx[lane] += (h / 6.0) * sx[lane]
                    zy[lane] += (h / 6.0) * sy[lane]
                    zz[lane] += (h / 6.0) * sz[lane]
            for lane in range(NODES_PER_BATCH):
                n = block * NODES_PER_BATCH + lane
                if n < count:
                    p = place(n, origin, frame, resolution) - table[3]
                    x = zx[lane]
                    y = zy[lane]
                    z = zz[lane]
                    moved = vec3(0.0, 0.0, 0.0)
                    if still[lane] == 0.0 and qd.max(qd.abs(x), qd.abs(y), qd.abs(z)) < 1.0:
                        Zx, Zy, Zz = times(table, 0, p.x, p.y, p.z)
                        if qd.static(bent_outer):
                            tx, ty, tz = bend(x, y, z, table, 10)
                            x += tx
                            y += ty
                            z += tz
                        qx, qy, qz = times(table, 4, x - Zx, y - Zy, z - Zz)
                        moved = vec3(qx, qy, qz)
                        if lost[lane] > FOLLOWED:
                            moved = vec3(LOST, LOST, LOST)
                    nodes[n] = moved


@qd.func
def place(n: qd.i32, origin: vec3, frame: mat3, resolution: qd.i32):
    """The place of a node in the world."""
    at = vec3(n % resolution, (n // resolution) % resolution, n // (resolution * resolution))
    return origin + frame @ (at / qd.cast(resolution - 1, qd.f32))
