"""Kernel functions that walk a ray through the brick grid of `cagefield.rendering.voxels.occupancy`."""

from dataclasses import dataclass

from cagefield.compute.quadrants import qd
from cagefield.rendering.voxels.kernels.grid import I32, contract, contract_velocity, ivec3, vec3

vec2 = qd.types.vector(2, qd.f32)


@dataclass(frozen=True, eq=False)
class OccupancyArgs:
    """A grid of bricks as kernels take it: codes and origin of `Occupancy`, and its shape."""

    codes: I32
    origin: ivec3
    dims: ivec3


@qd.func
def slab(origin: vec3, inverse: vec3, lower: vec3, upper: vec3):
    """(t_in, t_out) of a ray with a box; empty when t_in >= t_out. `inverse` is 1 / direction."""
    a = (lower - origin) * inverse
    b = (upper - origin) * inverse
    return vec2(qd.min(a, b).max(), qd.max(a, b).min())


@qd.func
def safe_inverse(d: vec3):
    """1 / d with zero components replaced by a tiny one of positive sign."""
    r = vec3(0.0, 0.0, 0.0)
    for a in qd.static(range(3)):
        x = d[a]
        if qd.abs(x) < 1e-12:
            x = 1e-12
        r[a] = 1.0 / x
    return r


@qd.func
def empty_run(bricks: OccupancyArgs, g: vec3, inverse: vec3):
    """The ray parameter to the exit of the empty block around grid coordinates g; -1 where it is occupied."""
    cell = qd.cast(qd.floor(g), qd.i32) - bricks.origin
    b = qd.max(qd.min(cell >> 2, bricks.dims - 1), 0)
    code = bricks.codes[(b.x * bricks.dims.y + b.y) * bricks.dims.z + b.z]
    run = -1.0
    lower = ivec3(0, 0, 0)
    size = 0
    if code >= 256:
        d = code >> 8
        lower = (b - (d - 1)) * 4
        size = (2 * d - 1) * 4
    else:
        s = (cell >> 1) & 1
        if (code >> (s.x * 4 + s.y * 2 + s.z)) & 1 == 0:
            lower = (cell >> 1) << 1
            size = 2
    if size > 0:
        lo = qd.cast(lower + bricks.origin, qd.f32)
        a = (lo - g) * inverse
        c = (lo + qd.cast(size, qd.f32) - g) * inverse
        run = qd.max(qd.max(a, c).min(), 0.0)
    return run


@qd.func
def is_occupied(bricks: OccupancyArgs, g: vec3):
    """True where the sub-block around grid coordinates g is occupied; the brick grid begins at 0."""
    cell = qd.cast(g, qd.i32)
    b = qd.min(cell >> 2, bricks.dims - 1)
    code = bricks.codes[(b.x * bricks.dims.y + b.y) * bricks.dims.z + b.z]
    s = (cell >> 1) & 1
    return code < 256 and (code >> (s.x * 4 + s.y * 2 + s.z)) & 1 == 1


@qd.func
def look_ahead(
    bricks: OccupancyArgs,
    q: vec3,
    gd: vec3,
    inverse: vec3,
    half: vec3,
    step: qd.f32,
    contracted: qd.template(),
):
    """(g, h, empty, leap, last) at a point q of a ray with velocity gd and its inverse.

    q and gd are in grid coordinates or, when contracted, normalized ones; half = (resolution - 1) / 4.
    g: grid coordinates of q. h: ray parameter of one step. empty: 1 where the block around q is. leap: the
    ray parameter to go on by then, whole steps if bounded. last: 1 from half a voxel before infinity on,
    where a contracted march ends.

    A contracted ray is bent outside the inner box: it goes half of the straight run there, and no farther
    than a quarter of the way to the center. Inside, the next sample is amid the first step after the run: at
    its end all the samples that follow would lie on faces of cells, where the gradient jumps.
    """
    g = q
    h = step
    leap = 0.0
    empty = 0
    last = 0
    if qd.static(contracted):
        v = contract_velocity(q, gd) * half
        g = (contract(q) + 2.0) * half
        h = step / qd.abs(v).max()
        share = 1.0
        limit = 1e30
        m = qd.abs(q).max()
        if m > 1.0:
            share = 0.5
            limit = 0.25 * m / qd.abs(gd).max()
        if m > 2.0 * half.x:
            last = 1
        run = empty_run(bricks, g, safe_inverse(v))
        if run >= 0.0:
            empty = 1
            if m <= 1.0:
                run += 0.5 * h
            leap = qd.max(qd.min(run * share, limit), h)
    else:
        run = empty_run(bricks, g, inverse)
        if run >= 0.0:
            empty = 1
            leap = (qd.floor(run / step) + 1.0) * step
    return g, h, empty, leap, last
