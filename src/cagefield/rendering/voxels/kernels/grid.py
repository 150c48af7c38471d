"""The kernels of `cagefield.rendering.voxels.device_grid`."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from dataclasses import dataclass

from cagefield.compute.quadrants import qd
from cagefield.fields import sh as harmonics

F32 = qd.types.ndarray(dtype=qd.f32, ndim=1)
I32 = qd.types.ndarray(dtype=qd.i32, ndim=1)
U8 = qd.types.ndarray(dtype=qd.u8, ndim=1)
vec3 = qd.types.vector(3, qd.f32)
ivec3 = qd.types.vector(3, qd.i32)
vec8 = qd.types.vector(8, qd.f32)
ivec8 = qd.types.vector(8, qd.i32)


@dataclass(frozen=True, eq=False)
class GridArgs:
    """A grid as kernels take it: index, density and sh of `DeviceGrid`, its resolution and its transform.

    A world position p has the grid coordinates (p - lower) * scale or, where it is contracted,
    (contract((p - lower) * scale) + 2) * half; half = (resolution - 1) / 4.
    """

    index: I32
    density: F32
    sh: F32
    resolution: ivec3
    lower: vec3
    scale: vec3
    half: vec3


SH_C0, SH_C1, SH_C2, SH_C3, SH_C4 = harmonics.C0, harmonics.C1, harmonics.C2, harmonics.C3, harmonics.C4


@qd.func
def sh_basis(d: vec3, K: qd.template()):
    """The K real spherical harmonics of the unit direction d, degree 0 to 4 (as
    `cagefield.fields.sh.sh_basis`)."""
    b = qd.Vector.zero(qd.f32, K)
    b[0] = SH_C0
    if qd.static(K > 1):
        b[1] = -SH_C1 * d.y
        b[2] = SH_C1 * d.z
        b[3] = -SH_C1 * d.x
    if qd.static(K > 4):
        b[4] = SH_C2[0] * d.x * d.y
        b[5] = SH_C2[1] * d.y * d.z
        b[6] = SH_C2[2] * (2.0 * d.z * d.z - d.x * d.x - d.y * d.y)
        b[7] = SH_C2[3] * d.x * d.z
        b[8] = SH_C2[4] * (d.x * d.x - d.y * d.y)
    if qd.static(K > 9):
        b[9] = SH_C3[0] * d.y * (3.0 * d.x * d.x - d.y * d.y)
        b[10] = SH_C3[1] * d.x * d.y * d.z
        b[11] = SH_C3[2] * d.y * (4.0 * d.z * d.z - d.x * d.x - d.y * d.y)
        b[12] = SH_C3[3] * d.z * (2.0 * d.z * d.z - 3.0 * d.x * d.x - 3.0 * d.y * d.y)
        b[13] = SH_C3[4] * d.x * (4.0 * d.z * d.z - d.x * d.x - d.y * d.y)
        b[14] = SH_C3[5] * d.z * (d.x * d.x - d.y * d.y)
        b[15] = SH_C3[6] * d.x * (d.x * d.x - 3.0 * d.y * d.y)
    if qd.static(K > 16):
        x2 = d.x * d.x
        y2 = d.y * d.y
        z2 = d.z * d.z
        s = x2 + y2
        b[16] = SH_C4[0] * d.x * d.y * (x2 - y2)
        b[17] = SH_C4[1] * d.y * d.z * (3.0 * x2 - y2)
        b[18] = SH_C4[2] * d.x * d.y * (6.0 * z2 - s)
        b[19] = SH_C4[3] * d.y * d.z * (4.0 * z2 - 3.0 * s)
        b[20] = SH_C4[4] * (8.0 * z2 * z2 - 24.0 * z2 * s + 3.0 * s * s)
        b[21] = SH_C4[5] * d.x * d.z * (4.0 * z2 - 3.0 * s)
        b[22] = SH_C4[6] * (x2 - y2) * (6.0 * z2 - s)
        b[23] = SH_C4[7] * d.x * d.z * (x2 - 3.0 * y2)
        b[24] = SH_C4[8] * (x2 * (x2 - 3.0 * y2) - y2 * (3.0 * x2 - y2))
    return b


@qd.func
def corner_weights(f: vec3):
    """The 8 trilinear weights of the fractions f; corner k = 4x + 2y + z, z fastest as in memory."""
    e = 1.0 - f
    a = e.x * e.y
    b = e.x * f.y
    c = f.x * e.y
    d = f.x * f.y
    return vec8(a * e.z, a * f.z, b * e.z, b * f.z, c * e.z, c * f.z, d * e.z, d * f.z)


@qd.func
def corner_slots(index: qd.template(), base: ivec3, ny: qd.i32, nz: qd.i32):
    """The slots of a cell's 8 corners, in the order of `corner_weights`."""
    i = (base.x * ny + base.y) * nz + base.z
    j = i + ny * nz
    return ivec8(index[i], index[i + 1], index[i + nz], index[i + nz + 1],
                 index[j], index[j + 1], index[j + nz], index[j + nz + 1])  # fmt: skip


@qd.func
def gather_density(density: qd.template(), slots: ivec8, w: vec8):
    """Interpolated density, before the clamp at 0."""
    raw = 0.0
    for c in qd.static(range(8)):
        raw += w[c] * density[slots[c]]
    return raw


@qd.func
def gather_rgb(sh: qd.template(), slots: ivec8, w: vec8, basis: qd.template(), K: qd.template()):
    """Interpolated color, 0.5 added, before the clamp to [0, 1]."""
    rgb = vec3(0.5, 0.5, 0.5)
    for c in qd.static(range(8)):
        if slots[c] > 0:
            at = slots[c] * (3 * K)
            s = vec3(0.0, 0.0, 0.0)
            for k in qd.static(range(K)):
                s += basis[k] * vec3(sh[at + 3 * k], sh[at + 3 * k + 1], sh[at + 3 * k + 2])
            rgb += w[c] * s
    return rgb


@qd.func
def to_grid(p: vec3, grid: GridArgs, contracted: qd.template()):
    """Grid coordinates of a world position."""
    g = (p - grid.lower) * grid.scale
    if qd.static(contracted):
        g = (contract(g) + 2.0) * grid.half
    return g


@qd.func
def to_world(g: vec3, grid: GridArgs, contracted: qd.template()):
    """The position at grid coordinates: the inverse of `to_grid`, up to that of `contract`."""
    p = g / grid.scale + grid.lower
    if qd.static(contracted):
        p = uncontract(g / grid.half - 2.0) / grid.scale + grid.lower
    return p


@qd.func
def contract(q: vec3):
    """Contracted position of a normalized one (`cagefield.fields.contraction.contract`)."""
    m = qd.max(qd.abs(q).max(), 1.0)
    return ((2.0 - 1.0 / m) / m) * q


@qd.func
def uncontract(c: vec3):
    """The inverse of `contract`, up to 1e-4 from the surface at infinity (`contraction.uncontract`)."""
    m = qd.min(qd.abs(c).max(), 2.0 - 1e-4)
    scale = 1.0
    if m > 1.0:
        scale = m / qd.abs(c).max() / (m * (2.0 - m))
    return c * scale


@qd.func
def contract_velocity(q: vec3, d: vec3):
    """d/dt of contract(q + t d) at t = 0."""
    v = d
    a = qd.abs(q)
    m = a.max()
    if m > 1.0:
        dm = d.x * qd.math.sign(q.x)
        if a.y >= m:
            dm = d.y * qd.math.sign(q.y)
        if a.z >= m:
            dm = d.z * qd.math.sign(q.z)
        v = ((2.0 - 1.0 / m) / m) * d + ((-2.0 + 2.0 / m) / (m * m)) * dm * q
    return v
