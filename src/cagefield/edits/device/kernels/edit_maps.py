"""The maps of an edit stack for one sample, inside Quadrants kernels, in float32.

Edits are rows of `params` (see `packing`); their lattices and flow tables lie one after the other in
`lattice`.
The float64 reference of everything here is `Edit.warp` and `EditStack.to_canonical`.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from dataclasses import dataclass

from cagefield.compute.quadrants import qd
from cagefield.edits.device.kernels.hexahedron import image, in_box, locate, read3, times
from cagefield.edits.device.kernels.lattice import first_node, interpolate, to_nodes
from cagefield.edits.device.packing import (
    CENTER,
    CHANGED_BOX,
    CONTINUOUS,
    EDGE,
    FIRST,
    LAST,
    MATRIX,
    NODE_BOX,
    PART_PLACE,
    RECORD,
    RECORDS,
    RESOLUTION,
    SIMPLE,
    STILL,
    UNDER_PLACE,
)
from cagefield.warps.kernels.flow_shell import flow_sample

vec3 = qd.math.vec3
Params = qd.types.ndarray(dtype=qd.f32, ndim=2)
Nodes = qd.types.ndarray(dtype=vec3, ndim=1)


@dataclass(frozen=True, eq=False)
class EditArgs:
    """An edit stack as kernels take it: the params [E,WIDTH] and lattice [M,3] of `DeviceStack`, and E."""

    params: Params
    lattice: Nodes
    count: qd.i32


@qd.func
def map_sample(p: vec3, d: vec3, edits: EditArgs, flows: qd.template()):
    """(canonical point, J d, place) of a deformed sample and a direction d.

    The place is 0 where the field is read there, that of a layer (`fields.voxel_layers`) where this is, and
    -1
    where an edit left nothing; such a sample is returned where it was when that was found.
    """
    q = p
    v = d
    place = 0
    for n in range(edits.count):
        e = edits.count - 1 - n
        if place == 0 and in_box(q, edits.params, e, CHANGED_BOX):
            q, v, place = map_edit(q, v, edits.params, edits.lattice, e, flows)
    return q, v, place


@qd.func
def map_edit(
    p: vec3, d: vec3, params: qd.template(), lattice: qd.template(), e: qd.i32, flows: qd.template()
):
    """(canonical point, J d, place) of a sample through edit e alone; flows: `DeviceStack.has_flows`."""
    first = qd.cast(params[e, FIRST], qd.i32)
    last = qd.cast(params[e, LAST], qd.i32)
    resolution = qd.cast(params[e, RESOLUTION], qd.i32)
    continuous = params[e, CONTINUOUS] > 0.5
    place = 0
    use_lattice = 0
    use_flow = 0
    hit = -1
    best = 1e30
    at = vec3(0.0, 0.0, 0.0)
    if params[e, STILL] > 0.5:
        hit = -1
    elif params[e, SIMPLE] > 0.5:
        y = times(params, e, RECORDS + MATRIX, p - read3(params, e, RECORDS + CENTER))
        if first == 0 and qd.abs(y).max() <= 1.0 + EDGE:
            hit = 0
            at = qd.max(qd.min(y, 1.0), -1.0)
        elif in_box(to_nodes(p, params, e), params, e, NODE_BOX):
            use_lattice = 1
    else:
        guess = 2
        for n in range(first, last):
            # The sides of the shell are gone through from the one that p most likely lies in.
            h = n
            if n == 2:
                guess = likely_side(p, params, e)
                h = guess
            elif n > 2 and n <= guess:
                h = n - 1
            xi, error = locate(p, params, e, RECORDS + h * RECORD)
            if n >= 2:
                if error < best:
                    best = error
                    hit = h
                    at = xi
                if error <= EDGE:
                    break
            elif n == 0:
                if error <= EDGE:
                    hit = 0
                    at = xi
                    break
            else:
                inside = error <= EDGE
                if not continuous:
                    if inside:
                        place = qd.cast(params[e, UNDER_PLACE], qd.i32)
                elif not inside:
                    break
                elif resolution > 0:
                    use_lattice = 1
                    break
                elif resolution < 0:
                    use_flow = 1
                    break
    q = p
    v = d
    if use_lattice == 1:
        q, v = interpolate(p, d, params, lattice, e, resolution)
    elif hit >= 0:
        q, v = image(at, d, params, e, RECORDS + hit * RECORD)
        if hit == 0:
            place = qd.cast(params[e, PART_PLACE], qd.i32)
    if qd.static(flows):
        if use_flow == 1:
            q, v = flow_sample(p, d, lattice, first_node(params, e))
    return q, v, place


@qd.func
def likely_side(p: vec3, params: qd.template(), e: qd.i32):
    """The record of the shell's side that p would lie in if the cages were concentric boxes."""
    y = times(params, e, RECORDS + MATRIX, p - read3(params, e, RECORDS + CENTER))
    size = qd.abs(y)
    side = 0
    value = y.x
    if size.y > size.x and size.y >= size.z:
        side = 2
        value = y.y
    elif size.z > size.x:
        side = 4
        value = y.z
    if value < 0.0:
        side += 1
    return 2 + side
