"""The flow shell's velocity in plain numbers and without branches, for loops that compilers vectorize.

Vectors are three numbers (x, y, z); z are the coordinates of the outer cage, xi those of the inner one. The
tables are those of `flow_table`; the same mathematics for one sample, in vectors, is in
`kernels.flow_velocity`. The oracle of both is `warps.flow_velocity`.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.quadrants import qd

MIN_FACE_SHARE = 2e-5
"""Distances to the outer cage's faces, as shares of its half-width, are taken to be no less than this.

Its eighth power, at the outer cage's edges, is still a normal float32.
"""


@qd.func
def weight_at(
    x: qd.f32, y: qd.f32, z: qd.f32, ix: qd.f32, iy: qd.f32, iz: qd.f32, table: qd.template(), moment: qd.i32
):
    """w at coordinates z of the outer and xi of the inner cage: 1 / (1 + d_i / d_o) in one division."""
    H = table[7]
    height = table[moment + 8]
    dx = qd.max(H.x * (1.0 - x * x), MIN_FACE_SHARE)
    dy = qd.max(H.y * (1.0 - y * y), MIN_FACE_SHARE)
    dz = qd.max(H.z * (1.0 - z * z), MIN_FACE_SHARE)
    ex = height.x * qd.max(qd.abs(ix) - 1.0, 0.0)
    ey = height.y * qd.max(qd.abs(iy) - 1.0, 0.0)
    ez = height.z * qd.max(qd.abs(iz) - 1.0, 0.0)
    product = dx * dy * dz
    dx *= dx
    dy *= dy
    dz *= dz
    ex *= ex
    ey *= ey
    ez *= ez
    a = dx * dy
    b = dx * dz
    c = dy * dz
    # Two roots, not one of the product, which float32 has no room for.
    q = qd.sqrt(qd.sqrt(ex * ex + ey * ey + ez * ez) * qd.sqrt(a * a + b * b + c * c))
    g = qd.max((product / (product + q) - 1.0) * table[8].z + 1.0, 0.0)
    end = table[9].x
    middle = table[9].z
    u = qd.max(2.0 * g - 1.0, 0.0)
    u8 = u * u
    u8 *= u8
    u8 *= u8
    return g * (end + middle * g * (3.0 - 2.0 * g)) + (1.0 - end - middle) * u8 * u


@qd.func
def newton(
    x: qd.f32,
    y: qd.f32,
    z: qd.f32,
    ax: qd.f32,
    ay: qd.f32,
    az: qd.f32,
    table: qd.template(),
    K: qd.i32,
):
    """(xi after a step from xi = (x, y, z) towards y(xi) = a, the residual before it)."""
    rx, ry, rz = residual(x, y, z, ax, ay, az, table, K)
    ux, uy, uz, vx, vy, vz, wx, wy, wz = inverse(x, y, z, table, K, True)
    return (
        x - (rx * ux + ry * uy + rz * uz),
        y - (rx * vx + ry * vy + rz * vz),
        z - (rx * wx + ry * wy + rz * wz),
        qd.max(qd.abs(rx), qd.abs(ry), qd.abs(rz)),
    )


@qd.func
def newton_twice(
    x: qd.f32,
    y: qd.f32,
    z: qd.f32,
    ax: qd.f32,
    ay: qd.f32,
    az: qd.f32,
    table: qd.template(),
    K: qd.i32,
):
    """(xi after two steps from (x, y, z) towards y(xi) = a, with one slope, the residual between them)."""
    rx, ry, rz = residual(x, y, z, ax, ay, az, table, K)
    ux, uy, uz, vx, vy, vz, wx, wy, wz = inverse(x, y, z, table, K, True)
    x1 = x - (rx * ux + ry * uy + rz * uz)
    y1 = y - (rx * vx + ry * vy + rz * vz)
    z1 = z - (rx * wx + ry * wy + rz * wz)
    sx, sy, sz = residual(x1, y1, z1, ax, ay, az, table, K)
    return (
        x1 - (sx * ux + sy * uy + sz * uz),
        y1 - (sx * vx + sy * vy + sz * vz),
        z1 - (sx * wx + sy * wy + sz * wz),
        qd.max(qd.abs(sx), qd.abs(sy), qd.abs(sz)),
    )


@qd.func
def residual(
    x: qd.f32,
    y: qd.f32,
    z: qd.f32,
    ax: qd.f32,
    ay: qd.f32,
    az: qd.f32,
    table: qd.template(),
    K: qd.i32,
):
    """y(xi) - a at xi = (x, y, z)."""
    cx = qd.max(qd.min(x, 1.0), -1.0)
    cy = qd.max(qd.min(y, 1.0), -1.0)
    cz = qd.max(qd.min(z, 1.0), -1.0)
    tx, ty, tz = bend(cx, cy, cz, table, K)
    xy, xz, yx, yz, zx, zy = tilts(x, y, z, table, K)
    return (
        x + tx + (y - cy) * yx + (z - cz) * zx - ax,
        y + ty + (x - cx) * xy + (z - cz) * zy - ay,
        z + tz + (x - cx) * xz + (y - cy) * yz - az,
    )


@qd.func
def inverse(
    x: qd.f32,
    y: qd.f32,
    z: qd.f32,
    table: qd.template(),
    K: qd.i32,
    around: qd.template(),
):
    """The rows of (dy/dxi)^-1 at xi = (x, y, z); without tilts where nothing is around the cage."""
    a = table[K]
    b = table[K + 1]
    c = table[K + 2]
    g = table[K + 3]
    cx = qd.max(qd.min(x, 1.0), -1.0)
    cy = qd.max(qd.min(y, 1.0), -1.0)
    cz = qd.max(qd.min(z, 1.0), -1.0)
    in_x = qd.select(qd.abs(x) <= 1.0, 1.0, 0.0)
    in_y = qd.select(qd.abs(y) <= 1.0, 1.0, 0.0)
    in_z = qd.select(qd.abs(z) <= 1.0, 1.0, 0.0)
    yz = cy * cz
    xz = cx * cz
    xy = cx * cy
    ux = 1.0 + in_x * (cy * a.x + cz * b.x + yz * g.x)
    uy = in_x * (cy * a.y + cz * b.y + yz * g.y)
    uz = in_x * (cy * a.z + cz * b.z + yz * g.z)
    vx = in_y * (cx * a.x + cz * c.x + xz * g.x)
    vy = 1.0 + in_y * (cx * a.y + cz * c.y + xz * g.y)
    vz = in_y * (cx * a.z + cz * c.z + xz * g.z)
    wx = in_z * (cx * b.x + cy * c.x + xy * g.x)
    wy = in_z * (cx * b.y + cy * c.y + xy * g.y)
    wz = 1.0 + in_z * (cx * b.z + cy * c.z + xy * g.z)
    if qd.static(around):
        dxy, dxz, dyx, dyz, dzx, dzy = tilts(x, y, z, table, K)
        uy += (1.0 - in_x) * dxy
        uz += (1.0 - in_x) * dxz
        vx += (1.0 - in_y) * dyx
        vz += (1.0 - in_y) * dyz
        wx += (1.0 - in_z) * dzx
        wy += (1.0 - in_z) * dzy
    # v x w, w x u and u x v.
    px = vy * wz - vz * wy
    py = vz * wx - vx * wz
    pz = vx * wy - vy * wx
    scale = 1.0 / qd.max(ux * px + uy * py + uz * pz, 1e-3)
    return (
        px * scale,
        py * scale,
        pz * scale,
        (wy * uz - wz * uy) * scale,
        (wz * ux - wx * uz) * scale,
        (wx * uy - wy * ux) * scale,
        (uy * vz - uz * vy) * scale,
        (uz * vx - ux * vz) * scale,
        (ux * vy - uy * vx) * scale,
    )


@qd.func
def tilts(x: qd.f32, y: qd.f32, z: qd.f32, table: qd.template(), K: qd.i32):
    """The tilts on the sides where xi = (x, y, z) is: (xy, xz, yx, yz, zx, zy), across their axes."""
    ax = table[K + 4]
    bx = table[K + 5]
    ay = table[K + 6]
    by = table[K + 7]
    az = table[K + 8]
    bz = table[K + 9]
    return (
        qd.select(x > 0.0, bx.y, ax.y),
        qd.select(x > 0.0, bx.z, ax.z),
        qd.select(y > 0.0, by.x, ay.x),
        qd.select(y > 0.0, by.z, ay.z),
        qd.select(z > 0.0, bz.x, az.x),
        qd.select(z > 0.0, bz.y, az.y),
    )


@qd.func
def bend(x: qd.f32, y: qd.f32, z: qd.f32, table: qd.template(), K: qd.i32):
    """B(xi), in three parts, of the bend at a row of the table."""
    a = table[K]
    b = table[K + 1]
    c = table[K + 2]
    g = table[K + 3]
    xy = x * y
    xz = x * z
    yz = y * z
    xyz = xy * z
    return (
        xy * a.x + xz * b.x + yz * c.x + xyz * g.x,
        xy * a.y + xz * b.y + yz * c.y + xyz * g.y,
        xy * a.z + xz * b.z + yz * c.z + xyz * g.z,
    )


@qd.func
def times(table: qd.template(), at: qd.i32, x: qd.f32, y: qd.f32, z: qd.f32):
    """The matrix whose rows are three entries of the table, times (x, y, z)."""
    a = table[at]
    b = table[at + 1]
    c = table[at + 2]
    return (
        a.x * x + a.y * y + a.z * z,
        b.x * x + b.y * y + b.z * z,
        c.x * x + c.y * y + c.z * z,
    )
