"""The map of one hexahedron for one sample, inside Quadrants kernels, in float32, from its record in a row.

Records, xi, the bend and the image are defined in `packing`. The float64 reference is
`inner_map.HexahedronMap`.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.quadrants import qd
from cagefield.edits.device.packing import AFFINE, BEND, CENTER, IMAGE, LOW, MATRIX
from cagefield.warps.kernels.flow_velocity import solve_columns

vec3 = qd.math.vec3


@qd.func
def locate(p: vec3, params: qd.template(), e: qd.i32, at: qd.i32):
    """(xi, error): p's coordinates in a hexahedron, clamped to [-1,1]^3, and how far off that is.

    The error is the distance to the cube plus the residual of Newton's method, both in units of xi; 0 for a
    point inside.
    """
    y = times(params, e, at + MATRIX, p - read3(params, e, at + CENTER))
    xi = y
    error = 0.0
    if params[e, at + AFFINE] < 0.5:
        if in_box(y, params, e, at + LOW):
            a = read3(params, e, at + BEND)
            b = read3(params, e, at + BEND + 3)
            c = read3(params, e, at + BEND + 6)
            g = read3(params, e, at + BEND + 9)
            xi = qd.max(qd.min(y, 1.0), -1.0)
            for _ in range(16):
                r = xi + xi.x * xi.y * a + xi.x * xi.z * b + xi.y * xi.z * c + xi.x * xi.y * xi.z * g - y
                step = bend_solve(a, b, c, g, xi, r)
                new = qd.max(qd.min(xi - step, 1.4), -1.4)
                moved = qd.abs(new - xi).max()
                xi = new
                # Quadratic convergence: the step after one of 1e-4 is at rounding level.
                if moved < 1e-4:
                    break
            r = xi + xi.x * xi.y * a + xi.x * xi.z * b + xi.y * xi.z * c + xi.x * xi.y * xi.z * g - y
            error = qd.abs(r).max()
            if error < 2e-6:
                error = 0.0
        else:
            error = 10.0
    error += qd.max(qd.abs(xi).max() - 1.0, 0.0)
    return qd.max(qd.min(xi, 1.0), -1.0), error


@qd.func
def bend_solve(a: vec3, b: vec3, c: vec3, g: vec3, xi: vec3, r: vec3):
    """(dy/dxi)^-1 r for the bend a xi eta + b xi zeta + c eta zeta + g xi eta zeta."""
    u = vec3(1.0, 0.0, 0.0) + xi.y * a + xi.z * b + xi.y * xi.z * g
    v = vec3(0.0, 1.0, 0.0) + xi.x * a + xi.z * c + xi.x * xi.z * g
    w = vec3(0.0, 0.0, 1.0) + xi.x * b + xi.y * c + xi.x * xi.y * g
    return solve_columns(u, v, w, r)


@qd.func
def image(xi: vec3, d: vec3, params: qd.template(), e: qd.i32, at: qd.i32):
    """(canonical point, J d) at coordinates xi of a hexahedron."""
    c = at + IMAGE
    along = times(params, e, at + MATRIX, d)
    c1 = read3(params, e, c + 3)
    c2 = read3(params, e, c + 6)
    c4 = read3(params, e, c + 12)
    q = read3(params, e, c) + xi.x * c1 + xi.y * c2 + xi.z * c4
    if params[e, at + AFFINE] < 0.5:
        along = bend_solve(
            read3(params, e, at + BEND),
            read3(params, e, at + BEND + 3),
            read3(params, e, at + BEND + 6),
            read3(params, e, at + BEND + 9),
            xi,
            along,
        )
        c3 = read3(params, e, c + 9)
        c5 = read3(params, e, c + 15)
        c6 = read3(params, e, c + 18)
        c7 = read3(params, e, c + 21)
        q += xi.x * xi.y * c3 + xi.x * xi.z * c5 + xi.y * xi.z * c6 + xi.x * xi.y * xi.z * c7
        c1 += xi.y * c3 + xi.z * c5 + xi.y * xi.z * c7
        c2 += xi.x * c3 + xi.z * c6 + xi.x * xi.z * c7
        c4 += xi.x * c5 + xi.y * c6 + xi.x * xi.y * c7
    return q, along.x * c1 + along.y * c2 + along.z * c4


@qd.func
def in_box(p: vec3, params: qd.template(), e: qd.i32, at: qd.i32):
    """True where p lies in the box (min, max) stored at a column."""
    return (
        p.x >= params[e, at]
        and p.y >= params[e, at + 1]
        and p.z >= params[e, at + 2]
        and p.x <= params[e, at + 3]
        and p.y <= params[e, at + 4]
        and p.z <= params[e, at + 5]
    )


@qd.func
def read3(params: qd.template(), e: qd.i32, at: qd.i32):
    """Three neighboring columns as a vector."""
    return vec3(params[e, at], params[e, at + 1], params[e, at + 2])


@qd.func
def times(params: qd.template(), e: qd.i32, at: qd.i32, v: vec3):
    """The matrix [3,3] stored row by row at a column, times v."""
    return vec3(
        params[e, at] * v.x + params[e, at + 1] * v.y + params[e, at + 2] * v.z,
        params[e, at + 3] * v.x + params[e, at + 4] * v.y + params[e, at + 5] * v.z,
        params[e, at + 6] * v.x + params[e, at + 7] * v.y + params[e, at + 8] * v.z,
    )
