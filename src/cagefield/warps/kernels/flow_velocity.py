"""The velocity of the flow shell for one sample, inside Quadrants kernels, in float32.

In Z, the affine coordinates of the outer cage, from a table of the cage's motion (`flow_table`).
`flow_velocity_simd` has the
same functions on plain numbers, for loops that compilers vectorize. The oracle of both, and the
mathematics, are in `warps.flow_velocity`.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.quadrants import qd

vec3 = qd.math.vec3

STARTS = 9
"""Places from which Newton's method is tried again where it is stuck."""


@qd.func
def velocity(
    Z: vec3,
    D: vec3,
    z_guess: vec3,
    xi_guess: vec3,
    lattice: qd.template(),
    base: qd.i32,
    moment: qd.i32,
    tangent: qd.template(),
):
    """(dZ/dt, its change along D, z, xi) at Z; the guesses are z and xi of the last call."""
    v = rows_times(lattice, moment + 4, Z) + lattice[moment + 7]
    z = Z
    dz = D
    xi = rows_times(lattice, moment, Z) + lattice[moment + 3]
    dxi = vec3(0.0, 0.0, 0.0)
    dv = vec3(0.0, 0.0, 0.0)
    if qd.static(tangent):
        dxi = rows_times(lattice, moment, D)
        dv = rows_times(lattice, moment + 4, D)
    # One loop for both cages, not two copies: compilers take long for what it calls.
    for cage in range(2):
        outer = cage == 0
        K = base + 10 if outer else moment + 10
        straight = lattice[base + 9].y if outer else lattice[base + 8].y
        if straight < 0.5:
            y = z if outer else xi
            x = straighten(y, z_guess if outer else xi_guess, lattice, K, tangent)
            dx = dz if outer else dxi
            if qd.static(tangent):
                dx = straighten_slope(x, dx, lattice, K)
            if outer:
                z = x
                dz = dx
            else:
                xi = x
                dxi = dx
                held = qd.max(qd.min(xi, 1.0), -1.0)
                v += rows_times(lattice, moment + 20, bend(held, lattice, base + 20))
                if qd.static(tangent):
                    dv += rows_times(
                        lattice, moment + 20, bend_along(held, inside(xi, dxi), lattice, base + 20)
                    )
    # Outside the outer cage everything is at rest, also after a stage's rounding.
    far = lattice[base + 7] * (1.0 - z * z)
    g = 0.0
    out = vec3(0.0, 0.0, 0.0)
    dout = vec3(0.0, 0.0, 0.0)
    if far.min() > 1e-6:
        height = lattice[moment + 8]
        e = height * qd.max(qd.abs(xi) - 1.0, 0.0)
        inverse = 1.0 / far
        ee = e * e
        ff = inverse * inverse
        E = ee.dot(ee)
        F = ff.dot(ff)
        q = qd.sqrt(qd.sqrt(E * F))
        r = 1.0 / (1.0 + q)
        per_width = lattice[base + 8].z
        g = qd.max((r - 1.0) * per_width + 1.0, 0.0)
        end = lattice[base + 9].x
        middle = lattice[base + 9].z
        u = qd.max(2.0 * g - 1.0, 0.0)
        u8 = u * u
        u8 *= u8
        u8 *= u8
        w = g * (end + middle * g * (3.0 - 2.0 * g)) + (1.0 - end - middle) * u8 * u
        out = w * v
        if qd.static(tangent):
            dw = 0.0
            if q > 1e-6 and g > 0.0:
                sign = vec3(1.0, 1.0, 1.0)
                for a in qd.static(range(3)):
                    if xi[a] < 0.0:
                        sign[a] = -1.0
                dE = (ee * e * height * sign).dot(dxi)
                dF = 2.0 * (ff * ff * inverse * lattice[base + 7] * z).dot(dz)
                dw = -r * r * per_width * q * (dE / E + dF / F)
                dw *= end + 6.0 * middle * g * (1.0 - g) + 18.0 * (1.0 - end - middle) * u8
            dout = w * dv + dw * v
    return out, dout, z, xi


@qd.func
def straighten(y: vec3, start: vec3, lattice: qd.template(), K: qd.i32, precise: qd.template()):
    """xi with y(xi) = y for the form at a row of the table, to rounding or (not precise) to 1e-5.

    Newton's method, its steps halved where they fail; a point stuck at a kink is tried again from another
    start.
    """
    xi = start
    enough = qd.static(3e-7 if precise else 1e-5) * (1.0 + qd.abs(y).max())
    size = 1e30
    best = start
    step = vec3(0.0, 0.0, 0.0)
    share = 1.0
    tried = 0
    for _ in range(24 * (1 + STARTS)):
        held = qd.max(qd.min(xi, 1.0), -1.0)
        residual = xi + bend(held, lattice, K) + tilt(xi - held, lattice, K + 4) - y
        new = qd.abs(residual).max()
        if new < size:
            best = xi
            size = new
            if new <= enough:
                break
            step = straighten_slope(xi, residual, lattice, K)
            share = 1.0
        else:
            share *= 0.5
            if share < 0.01:
                if size < 1e-3 * (1.0 + qd.abs(y).max()) or tried == STARTS:
                    break
                # The center, then the corners of a cube twice as large.
                best = vec3(0.0, 0.0, 0.0)
                if tried > 0:
                    n = tried - 1
                    best = 4.0 * vec3(n % 2, (n // 2) % 2, n // 4) - 2.0
                step = vec3(0.0, 0.0, 0.0)
                size = 1e30
                tried += 1
        xi = best - share * step
    return best


@qd.func
def straighten_slope(xi: vec3, d: vec3, lattice: qd.template(), K: qd.i32):
    """(dy/dxi)^-1 d."""
    x = qd.max(qd.min(xi, 1.0), -1.0)
    a = lattice[K]
    b = lattice[K + 1]
    c = lattice[K + 2]
    g = lattice[K + 3]
    u = vec3(1.0, 0.0, 0.0)
    v = vec3(0.0, 1.0, 0.0)
    w = vec3(0.0, 0.0, 1.0)
    if qd.abs(xi.x) <= 1.0:
        u += x.y * a + x.z * b + x.y * x.z * g
    else:
        u += lattice[K + 5 if xi.x > 0.0 else K + 4]
    if qd.abs(xi.y) <= 1.0:
        v += x.x * a + x.z * c + x.x * x.z * g
    else:
        v += lattice[K + 7 if xi.y > 0.0 else K + 6]
    if qd.abs(xi.z) <= 1.0:
        w += x.x * b + x.y * c + x.x * x.y * g
    else:
        w += lattice[K + 9 if xi.z > 0.0 else K + 8]
    return solve_columns(u, v, w, d)


@qd.func
def solve_columns(u: vec3, v: vec3, w: vec3, r: vec3):
    """x with [u v w] x = r, by Cramer's rule; a determinant under 1e-6 is moved off zero."""
    vw = v.cross(w)
    det = u.dot(vw)
    if qd.abs(det) < 1e-6:
        det = 1e-6 if det >= 0.0 else -1e-6
    return vec3(r.dot(vw), r.dot(w.cross(u)), r.dot(u.cross(v))) / det


@qd.func
def bend(xi: vec3, lattice: qd.template(), K: qd.i32):
    """B(xi) of the bend at a row of the table."""
    return (
        xi.x * xi.y * lattice[K]
        + xi.x * xi.z * lattice[K + 1]
        + xi.y * xi.z * lattice[K + 2]
        + xi.x * xi.y * xi.z * lattice[K + 3]
    )


@qd.func
def tilt(beyond: vec3, lattice: qd.template(), at: qd.i32):
    """The tilts at a row of the table, times xi - clamp(xi)."""
    out = vec3(0.0, 0.0, 0.0)
    for a in qd.static(range(3)):
        out += beyond[a] * lattice[at + 2 * a + 1 if beyond[a] > 0.0 else at + 2 * a]
    return out


@qd.func
def bend_along(xi: vec3, d: vec3, lattice: qd.template(), K: qd.i32):
    """dB/dxi d of the bend at a row of the table."""
    return (
        (d.x * xi.y + xi.x * d.y) * lattice[K]
        + (d.x * xi.z + xi.x * d.z) * lattice[K + 1]
        + (d.y * xi.z + xi.y * d.z) * lattice[K + 2]
        + (d.x * xi.y * xi.z + xi.x * d.y * xi.z + xi.x * xi.y * d.z) * lattice[K + 3]
    )


@qd.func
def inside(xi: vec3, d: vec3):
    """The change of clamp(xi) along d."""
    out = d
    for a in qd.static(range(3)):
        if qd.abs(xi[a]) > 1.0:
            out[a] = 0.0
    return out


@qd.func
def rows_times(lattice: qd.template(), at: qd.i32, v: vec3):
    """The matrix whose rows are three entries of the table, times v."""
    return vec3(lattice[at].dot(v), lattice[at + 1].dot(v), lattice[at + 2].dot(v))
