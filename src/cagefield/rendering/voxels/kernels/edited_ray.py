"""Edits along a ray: stretches in which its samples are mapped alike.

Stretches end where the ray enters or leaves an edit's box, V, its outer cage or its region. Edits are tried
from the last to the first. A discrete edit changes nothing outside of V and of its region, and the one before
it is tried; in the region its layer is read. In V, where that is a parallelepiped, the ray is straight also
in canonical space; in the shell of a lattice it is straight in node units. Both lines are found once: a
sample costs a multiplication in V, and a few samples of a shell share three lattice lookups (`ray_stretch`).
They need all that it moves to be read at one place (`ALONE` in `cagefield.edits.device.packing`); elsewhere
each sample is mapped through the stack by itself.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.quadrants import qd
from cagefield.edits.device.kernels.edit_maps import EditArgs
from cagefield.edits.device.kernels.hexahedron import image, read3, times
from cagefield.edits.device.kernels.lattice import first_node, to_nodes
from cagefield.edits.device.packing import (
    AFFINE,
    ALONE,
    BASE_PLACE,
    CENTER,
    CHANGED_BOX,
    CONTINUOUS,
    EDGE,
    FIRST,
    IS_CUT,
    LAST,
    MATRIX,
    NODE_BOX,
    PART_PLACE,
    RECORD,
    RECORDS,
    RESOLUTION,
    SIMPLE,
    STILL,
    TO_NODES,
    UNDER_PLACE,
)
from cagefield.rendering.voxels.kernels.grid import vec3
from cagefield.rendering.voxels.kernels.ray_grid import safe_inverse, slab

IN_PLACE, LINE, LATTICE, MIXED = range(4)
"""Stretches whose samples stay where they are; lie on a line in canonical space; lie in one lattice; are
mapped one by one."""

EditedRay = qd.types.struct(
    kind=qd.i32,
    until=qd.f32,
    place=qd.i32,
    is_continuous=qd.i32,
    resolution=qd.i32,
    first=qd.i32,
    start=vec3,
    velocity=vec3,
)
"""A stretch of a ray o + t d in deformed space.

kind: `IN_PLACE` to `MIXED`; until: the ray parameter at which it ends; place: that at which its samples are
read (`fields.voxel_layers`), unless they are mapped one by one; is_continuous: 1 where discrete edits move
none of its samples; resolution, first: the lattice; start + t velocity: the line in canonical space, or in
node units of the lattice.
"""


@qd.func
def edited_ray(t: qd.f32, origin: vec3, d: vec3, edits: EditArgs):
    """The `EditedRay` from t on of a ray with unit direction d."""
    ray = EditedRay(kind=IN_PLACE, until=1e30, is_continuous=1)
    inverse = safe_inverse(d)
    is_found = 0
    for n in range(edits.count):
        e = edits.count - 1 - n
        if is_found == 0 and edits.params[e, STILL] < 0.5:
            box = slab(
                origin, inverse, read3(edits.params, e, CHANGED_BOX), read3(edits.params, e, CHANGED_BOX + 3)
            )
            if box.x <= box.y and t <= box.y:
                if t < box.x:
                    ray.until = qd.min(ray.until, box.x)
                else:
                    ray.until = qd.min(ray.until, box.y)
                    is_found = enter(ray, t, origin, d, edits, e)
    return ray


@qd.func
def enter(ray: qd.template(), t: qd.f32, origin: vec3, d: vec3, edits: EditArgs, e: qd.i32):
    """1 where edit e, in whose box the ray is at t, maps its samples: the stretch becomes its own; else 0."""
    is_found = 0
    is_simple = edits.params[e, SIMPLE] > 0.5
    is_alone = edits.params[e, ALONE] > 0.5
    base = qd.cast(edits.params[e, BASE_PLACE], qd.i32)
    if is_simple or is_straight(edits.params, e):
        if edits.params[e, FIRST] < 0.5:
            inner, at = through(origin, d, edits.params, e, RECORDS)
            if t >= inner.x and t <= inner.y:
                is_found = 1
                ray.until = qd.min(ray.until, inner.y)
                ray.place = qd.cast(edits.params[e, PART_PLACE], qd.i32)
                if ray.place == 0:
                    ray.place = base
                if is_alone or edits.params[e, PART_PLACE] != 0.0:
                    ray.kind = LINE
                    ray.start, ray.velocity = image(at, d, edits.params, e, RECORDS)
                else:
                    ray.kind = MIXED
            elif t < inner.x and inner.x <= inner.y:
                ray.until = qd.min(ray.until, inner.x)
        if is_found == 0 and edits.params[e, LAST] > 1.5:
            start = origin
            velocity = d
            outer = qd.math.vec2(0.0, 0.0)
            if is_simple:
                start = to_nodes(origin, edits.params, e)
                velocity = times(edits.params, e, TO_NODES + 3, d)
                outer = slab(
                    start,
                    safe_inverse(velocity),
                    read3(edits.params, e, NODE_BOX),
                    read3(edits.params, e, NODE_BOX + 3),
                )
            else:
                outer, _at = through(origin, d, edits.params, e, RECORDS + RECORD)
            if t >= outer.x and t <= outer.y:
                is_found = 1
                ray.until = qd.min(ray.until, outer.y)
                if not is_simple:
                    ray.place = qd.cast(edits.params[e, UNDER_PLACE], qd.i32)
                elif is_alone:
                    ray.kind = LATTICE
                    ray.place = base
                    ray.resolution = qd.cast(edits.params[e, RESOLUTION], qd.i32)
                    ray.first = first_node(edits.params, e)
                    ray.start = start
                    ray.velocity = velocity
                else:
                    ray.kind = MIXED
            elif t < outer.x and outer.x <= outer.y:
                ray.until = qd.min(ray.until, outer.x)
    else:
        is_found = 1
        ray.kind = MIXED
    if ray.kind == MIXED and edits.params[e, IS_CUT] > 0.5:
        ray.is_continuous = 0
    return is_found


@qd.func
def is_straight(params: qd.template(), e: qd.i32):
    """True for a discrete edit whose V and region, where it has them, are parallelepipeds, V^c too."""
    return (
        params[e, CONTINUOUS] < 0.5
        and (params[e, FIRST] > 0.5 or params[e, RECORDS + AFFINE] > 0.5)
        and (params[e, LAST] < 1.5 or params[e, RECORDS + RECORD + AFFINE] > 0.5)
    )


@qd.func
def through(origin: vec3, d: vec3, params: qd.template(), e: qd.i32, at: qd.i32):
    """([t_in, t_out] in a record's parallelepiped, xi of the ray's origin)."""
    xi = times(params, e, at + MATRIX, origin - read3(params, e, at + CENTER))
    velocity = times(params, e, at + MATRIX, d)
    one = vec3(1.0 + EDGE, 1.0 + EDGE, 1.0 + EDGE)
    return slab(xi, safe_inverse(velocity), -one, one), xi
