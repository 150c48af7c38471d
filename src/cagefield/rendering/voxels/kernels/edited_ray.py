"""One edit along a stretch of a ray: where the edit is affine and shown by a lattice, so is the ray in it.

A ray is walked in stretches, along each of which the same edits' boxes hold it. In a stretch of one edit
only, whose cages are parallelepipeds and whose shell is a lattice (`SIMPLE` in
`cagefield.edits.device.packing`), it runs straight through the inner region also in canonical space, and
straight through the lattice. Both lines and where they begin and end are found once; a sample on them costs a
multiplication in the inner region and one lattice lookup in the shell. Of a discrete edit, V and the region
are such stretches of the ray.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.quadrants import qd
from cagefield.edits.device.kernels.edit_maps import EditArgs, map_sample
from cagefield.edits.device.kernels.hexahedron import image, read3, times
from cagefield.edits.device.kernels.lattice import displacement, first_node, to_nodes
from cagefield.edits.device.packing import (
    AFFINE,
    ALONE,
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
    TO_NODES,
    UNDER_PLACE,
)
from cagefield.rendering.voxels.kernels.grid import vec3
from cagefield.rendering.voxels.kernels.ray_grid import safe_inverse, slab, vec2

STAYED, BENT, STRAIGHT = 0, 1, 2
"""How a sample was moved: not at all, along a direction of its own, along the one that its ray has in V^c."""

EditedRay = qd.types.struct(
    edit=qd.i32,
    until=qd.f32,
    is_continuous=qd.i32,
    resolution=qd.i32,
    first=qd.i32,
    part=qd.i32,
    under=qd.i32,
    inner=vec2,
    outer=vec2,
    canonical=vec3,
    velocity=vec3,
    node=vec3,
    node_velocity=vec3,
)
"""A stretch of a ray o + t d in deformed space, in the one simple edit whose box holds it.

edit: its number, MANY where samples must be mapped one by one, NONE where no edit's box holds the stretch;
until: the ray parameter at which it ends; is_continuous: 1 where discrete edits
move none of its samples;
resolution, first: the edit's lattice, of 0 nodes for a discrete edit; part, under: the places
(`fields.voxel_layers`) at which samples of V and of a discrete edit's region are read; inner, outer: [t_in,
t_out] in the inner region and in the outer cage, or the region; canonical + t velocity: the inner region's
samples in canonical space; node + t node_velocity: the ray in node units of the lattice.
"""

NONE, MANY = -2, -1


@qd.func
def edited_ray(t: qd.f32, origin: vec3, d: vec3, edits: EditArgs):
    """The `EditedRay` from t on of a ray with unit direction d."""
    ray = EditedRay(edit=NONE, until=1e30, is_continuous=1, inner=vec2(1e30, -1e30), outer=vec2(1e30, -1e30))
    inverse = safe_inverse(d)
    met = 0
    e = 0
    for n in range(edits.count):
        box = slab(
            origin, inverse, read3(edits.params, n, CHANGED_BOX), read3(edits.params, n, CHANGED_BOX + 3)
        )
        if box.x <= box.y and t <= box.y:
            if t >= box.x:
                met += 1
                e = n
                ray.until = qd.min(ray.until, box.y)
                if edits.params[n, IS_CUT] > 0.5:
                    ray.is_continuous = 0
            else:
                ray.until = qd.min(ray.until, box.x)
    if met > 0:
        ray.edit = MANY
        if met == 1 and edits.params[e, ALONE] > 0.5:
            # Earlier edits do not reach where this one takes samples, later ones do not hold them.
            if edits.params[e, SIMPLE] > 0.5:
                ray.edit = e
                ray.resolution = qd.cast(edits.params[e, RESOLUTION], qd.i32)
                ray.first = first_node(edits.params, e)
                ray.node = to_nodes(origin, edits.params, e)
                ray.node_velocity = times(edits.params, e, TO_NODES + 3, d)
                ray.outer = slab(
                    ray.node,
                    safe_inverse(ray.node_velocity),
                    read3(edits.params, e, NODE_BOX),
                    read3(edits.params, e, NODE_BOX + 3),
                )
            elif is_straight(edits.params, e):
                ray.edit = e
                ray.part = qd.cast(edits.params[e, PART_PLACE], qd.i32)
                ray.under = qd.cast(edits.params[e, UNDER_PLACE], qd.i32)
                if edits.params[e, LAST] > 1.5:
                    ray.outer, _at = through(origin, d, edits.params, e, RECORDS + RECORD)
        if ray.edit >= 0 and edits.params[e, FIRST] < 0.5:
            ray.inner, at = through(origin, d, edits.params, e, RECORDS)
            q, v = image(at, d, edits.params, e, RECORDS)
            ray.canonical = q
            ray.velocity = v
    return ray


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


@qd.func
def map_along(
    ray: qd.template(),
    t: qd.f32,
    p: vec3,
    d: vec3,
    edits: EditArgs,
    flows: qd.template(),
):
    """As `map_sample` for p = o + t d on the ray, and how p was moved (`STAYED`, `BENT`, `STRAIGHT`)."""
    q = p
    v = d
    place = 0
    moved = STAYED
    if ray.edit >= 0:
        if t >= ray.inner.x and t <= ray.inner.y:
            q = ray.canonical + t * ray.velocity
            v = ray.velocity
            place = ray.part
            moved = STRAIGHT
        elif t >= ray.outer.x and t <= ray.outer.y:
            if ray.resolution > 0:
                u, along = displacement(
                    ray.node + t * ray.node_velocity,
                    ray.node_velocity,
                    edits.lattice,
                    ray.first,
                    ray.resolution,
                )
                q = p + u
                v = d + along
                moved = BENT
            else:
                place = ray.under
    elif ray.edit == MANY:
        q, v, place = map_sample(p, d, edits, flows)
        if qd.abs(q - p).max() > 0.0:
            moved = BENT
    return q, v, place, moved
