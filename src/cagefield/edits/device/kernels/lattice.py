"""The lookup in an edit's lattice for one sample, inside Quadrants kernels, in float32.

All edits' lattices lie one after the other in an array of nodes; an edit's row says where its own begins. The
float64 reference is `lattice.Lattice`.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.quadrants import qd
from cagefield.edits.device.kernels.hexahedron import read3, times
from cagefield.edits.device.packing import OFFSET, TO_NODES

vec3 = qd.math.vec3


@qd.func
def interpolate(
    p: vec3, d: vec3, params: qd.template(), lattice: qd.template(), e: qd.i32, resolution: qd.i32
):
    """(canonical point, J d) from the lattice of edit e; J is the derivative of the interpolation."""
    s = times(params, e, TO_NODES + 3, d)
    u, along = displacement(to_nodes(p, params, e), s, lattice, first_node(params, e), resolution)
    return p + u, d + along


@qd.func
def displacement(at: vec3, s: vec3, lattice: qd.template(), first: qd.i32, resolution: qd.i32):
    """(displacement, derivative along s) in the lattice that begins at node `first`; at, s in node units."""
    top = qd.cast(resolution - 1, qd.f32)
    g = qd.max(qd.min(at, top), 0.0)
    cell = qd.min(qd.cast(g, qd.i32), resolution - 2)
    f = g - qd.cast(cell, qd.f32)
    n = first + (cell.z * resolution + cell.y) * resolution + cell.x
    plane = resolution * resolution
    v000 = lattice[n]
    v010 = lattice[n + resolution]
    v001 = lattice[n + plane]
    v011 = lattice[n + plane + resolution]
    x00 = lattice[n + 1] - v000
    x10 = lattice[n + resolution + 1] - v010
    x01 = lattice[n + plane + 1] - v001
    x11 = lattice[n + plane + resolution + 1] - v011
    w00 = v000 + f.x * x00
    w10 = v010 + f.x * x10
    w01 = v001 + f.x * x01
    w11 = v011 + f.x * x11
    y0 = w10 - w00
    y1 = w11 - w01
    z0 = w00 + f.y * y0
    z1 = w01 + f.y * y1
    x0 = x00 + f.y * (x10 - x00)
    x1 = x01 + f.y * (x11 - x01)
    u = z0 + f.z * (z1 - z0)
    along = s.x * (x0 + f.z * (x1 - x0)) + s.y * (y0 + f.z * (y1 - y0)) + s.z * (z1 - z0)
    return u, along


@qd.func
def to_nodes(p: vec3, params: qd.template(), e: qd.i32):
    """p in units of the lattice's nodes."""
    return times(params, e, TO_NODES + 3, p - read3(params, e, TO_NODES))


@qd.func
def first_node(params: qd.template(), e: qd.i32):
    """The place of edit e's first lattice node, or of its flow's table."""
    return qd.cast(params[e, OFFSET], qd.i32) * 65536 + qd.cast(params[e, OFFSET + 1], qd.i32)
