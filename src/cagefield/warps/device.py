"""The maps of an edit stack for one sample, inside Quadrants kernels, in float32.

An edit is one row of `params`. Its regions are hexahedra, each a record of `RECORD` numbers: an affine flag;
W [3,3] and c [3] with y = W (p - c); the box of the hexahedron in y; the bend K [4,3] of
y = xi + K0 xi eta + K1 xi zeta + K2 eta zeta + K3 xi eta zeta, xi in [-1,1]^3; and the monomial coefficients
C [8,3] of its image in canonical space (see `cagefield.hexahedron`). Records: 0 is V with its image V^c,
1 is V^o for a continuous edit and V^c for a discrete one, 2 to 7 are the sides of the trilinear shell.

The float64 reference of everything here is `Edit.warp` and `EditStack.to_canonical`.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol, TypeAlias
from weakref import WeakKeyDictionary

import numpy as np
import quadrants as qd
from numpy.typing import NDArray

from cagefield import devices, hexahedron
from cagefield.devices import floats
from cagefield.errors import EditError
from cagefield.hexahedron import Array
from cagefield.loops import Deal, deal_of, dealt, turns
from cagefield.warps import flow_device, flow_lattice
from cagefield.warps.continuous import ContinuousWarp
from cagefield.warps.discrete import DiscreteWarp
from cagefield.warps.flow_device import flow_sample, solve_columns
from cagefield.warps.flow_shell import FlowShell
from cagefield.warps.joined import Joined
from cagefield.warps.lattice import Lattice
from cagefield.warps.maps import Warp
from cagefield.warps.trilinear_shell import TrilinearShell

vec3 = qd.math.vec3
mat3 = qd.types.matrix(3, 3, qd.f32)
Params = qd.types.ndarray(dtype=qd.f32, ndim=2)
Nodes = qd.types.ndarray(dtype=vec3, ndim=1)

# Columns of `params`.
BOX = 0  # min, max of the deformed-space box outside which the edit changes nothing
FIRST, LAST = 6, 7  # records that are tried, in order: first <= record < last
CONTINUOUS = 8  # 1, or 0 for a discrete edit
RESOLUTION = 9  # lattice nodes per axis; 0 evaluates the shell exactly, -1 (`FLOW`) a flow shell by its table
FLOW = -1.0
OFFSET = 10  # first lattice node, or table's entry, as 65536 * [10] + [11]: a float32 counts to 2^24 only
TO_NODES = 12  # origin [3] and matrix [3,3] of the lattice, node units
NODE_BOX = 24  # min, max of the outer cage in node units, where it is a parallelepiped
SIMPLE = 30  # 1 where phi is affine, V and V^o are parallelepipeds, and the shell is a lattice
ALONE = 31  # 1 where no earlier edit reaches into the edit's box
RECORDS = 32
AFFINE, MATRIX, CENTRE, LOW, HIGH, BEND, IMAGE, RECORD = 0, 1, 10, 13, 16, 19, 31, 55
WIDTH = RECORDS + 8 * RECORD

EDGE = 1e-6
"""A sample counts as inside a hexahedron when its xi is within this of [-1,1]^3: rounding in float32."""

LATTICE_STRAIN = 1.0
"""Strain of a step (see `FlowShell`) for a lattice of up to 32^3 nodes; finer ones take (R / 32)^-1/2 of it.

Chosen by measurement over the edits of `benchmarks/flow_lattice.py`: what the integration adds to the
interpolation's own error, worst of the edits, in the mean and in the largest error:

    strain    1.0          0.7          0.5          0.35
    32^3      1% and 4%    0% and 1%    0% and 0%    0% and 0%
    64^3      4% and 9%    2% and 3%    0% and 1%    0% and 0%
    128^3     29% and 33%  4% and 9%    4% and 2%    0% and 0%
"""

BOX_SLACK = 1e-5
"""Boxes are this share of their size larger than the edit, so that no float32 sample inside it is missed."""


class PackedEdit(Protocol):
    """What of an edit is packed."""

    @property
    def exact_warp(self) -> Warp: ...

    @property
    def lattice(self) -> int | None: ...

    @property
    def boxes(self) -> Array: ...


class PackedStack(Protocol):
    """What of an edit stack is packed."""

    @property
    def active(self) -> Sequence[PackedEdit]: ...


@dataclass(frozen=True)
class DeviceStack:
    """An edit stack packed for kernels.

    params [max(E,1), WIDTH] float32; lattice [M,3] float32, all edits' nodes one after the other (x fastest),
    displacements in world units, and the tables of exact flow shells (see `flow_device`); n_edits E; boxes
    [B,2,3] float32 (min, max), one or two for each edit, outside all of which a sample is canonical as it is.
    """

    params: NDArray[np.float32]
    lattice: NDArray[np.float32]
    n_edits: int
    boxes: NDArray[np.float32]

    @classmethod
    def from_stack(cls, stack: PackedStack) -> "DeviceStack":
        """The stack's enabled edits that change something. Raises `EditError` where one cannot be evaluated.

        Lattices are sampled here, by the kernel, and kept for as long as their edit lives.
        """
        edits = stack.active
        params = np.zeros((max(len(edits), 1), WIDTH), dtype=np.float32)
        lattices: list[NDArray[np.float32]] = []
        offset = 0
        for number, edit in enumerate(edits):
            row = params[number]
            row[:] = _kept(_rows, edit, partial(_packed, edit))
            warp = edit.exact_warp
            if row[RESOLUTION] > 0.0:
                nodes = _lattice(edit, row)
            elif isinstance(warp, ContinuousWarp) and isinstance(warp.shell, FlowShell):
                nodes = _kept(_tables, edit, partial(flow_device.table, warp.shell))
            else:
                continue
            row[OFFSET], row[OFFSET + 1] = divmod(offset, 65536)
            offset += len(nodes)
            lattices.append(nodes)
        nodes = np.zeros((1, 3), dtype=np.float32)
        if lattices:
            nodes = lattices[0] if len(lattices) == 1 else _joined.join(lattices)
        for number in range(len(edits)):
            params[number, ALONE] = not _meets(params[:number], params[number])
        boxes = widened(np.concatenate([np.zeros((0, 2, 3))] + [edit.boxes for edit in edits]))
        packed = cls(params, nodes, len(edits), boxes.astype(np.float32))
        for array in (packed.params, packed.lattice, packed.boxes):
            array.setflags(write=False)
        return packed

    @property
    def has_flows(self) -> bool:
        """True where a flow shell is evaluated exactly: kernels without one leave its code out."""
        return bool((self.params[:, RESOLUTION] == FLOW).any())

    def to_canonical(
        self, points: NDArray[np.float32], viewdirs: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_]]:
        """(points [N,3], viewdirs [N,3], stretch [N], emptied [N]) of samples, by `map_sample`."""
        devices.start()
        n = len(points)
        out = np.empty((n, 8), dtype=np.float32)
        samples = np.ascontiguousarray(np.concatenate([points, viewdirs], axis=1), dtype=np.float32)
        if n:
            _map_samples(
                samples, deal_of(len(samples)), out, self.params, self.lattice, self.n_edits, self.has_flows
            )
        return out[:, :3], out[:, 3:6], out[:, 6], out[:, 7] > 0.5


@qd.func
def map_sample(
    p: vec3,
    d: vec3,
    params: qd.template(),
    lattice: qd.template(),
    n_edits: qd.i32,
    flows: qd.template(),
):
    """(canonical point, J d, emptied 0 or 1) of a deformed sample and a direction d.

    An emptied sample is returned where it was when it was found empty.
    """
    q = p
    v = d
    emptied = 0
    for n in range(n_edits):
        e = n_edits - 1 - n
        if emptied == 0 and in_box(q, params, e, BOX):
            q, v, emptied = map_edit(q, v, params, lattice, e, flows)
    return q, v, emptied


@qd.func
def map_edit(
    p: vec3, d: vec3, params: qd.template(), lattice: qd.template(), e: qd.i32, flows: qd.template()
):
    """(canonical point, J d, emptied) of a sample through edit e alone; flows: `DeviceStack.has_flows`."""
    first = qd.cast(params[e, FIRST], qd.i32)
    last = qd.cast(params[e, LAST], qd.i32)
    resolution = qd.cast(params[e, RESOLUTION], qd.i32)
    continuous = params[e, CONTINUOUS] > 0.5
    emptied = 0
    use_lattice = 0
    use_flow = 0
    hit = -1
    best = 1e30
    at = vec3(0.0, 0.0, 0.0)
    if params[e, SIMPLE] > 0.5:
        y = times(params, e, RECORDS + MATRIX, p - read3(params, e, RECORDS + CENTRE))
        if qd.abs(y).max() <= 1.0 + EDGE:
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
                    emptied = qd.cast(inside, qd.i32)
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
    if qd.static(flows):  # noqa: SIM102  one is decided when the kernel is compiled
        if use_flow == 1:
            q, v = flow_sample(p, d, lattice, first_node(params, e))
    return q, v, emptied


@qd.func
def likely_side(p: vec3, params: qd.template(), e: qd.i32):
    """The record of the shell's side that p would lie in if the cages were concentric boxes."""
    y = times(params, e, RECORDS + MATRIX, p - read3(params, e, RECORDS + CENTRE))
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


@qd.func
def to_nodes(p: vec3, params: qd.template(), e: qd.i32):
    """p in units of the lattice's nodes."""
    return times(params, e, TO_NODES + 3, p - read3(params, e, TO_NODES))


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
    """Three neighbouring columns as a vector."""
    return vec3(params[e, at], params[e, at + 1], params[e, at + 2])


@qd.func
def times(params: qd.template(), e: qd.i32, at: qd.i32, v: vec3):
    """The matrix [3,3] stored row by row at a column, times v."""
    return vec3(
        params[e, at] * v.x + params[e, at + 1] * v.y + params[e, at + 2] * v.z,
        params[e, at + 3] * v.x + params[e, at + 4] * v.y + params[e, at + 5] * v.z,
        params[e, at + 6] * v.x + params[e, at + 7] * v.y + params[e, at + 8] * v.z,
    )


@qd.func
def locate(p: vec3, params: qd.template(), e: qd.i32, at: qd.i32):
    """(xi, error): p's coordinates in a hexahedron, clamped to [-1,1]^3, and how far off that is.

    The error is the distance to the cube plus the residual of Newton's method, both in units of xi; 0 for a
    point inside.
    """
    y = times(params, e, at + MATRIX, p - read3(params, e, at + CENTRE))
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
def interpolate(
    p: vec3, d: vec3, params: qd.template(), lattice: qd.template(), e: qd.i32, resolution: qd.i32
):
    """(canonical point, J d) from the lattice of edit e; J is the derivative of the interpolation."""
    s = times(params, e, TO_NODES + 3, d)
    u, along = displacement(to_nodes(p, params, e), s, lattice, first_node(params, e), resolution)
    return p + u, d + along


@qd.func
def first_node(params: qd.template(), e: qd.i32):
    """The place of edit e's first lattice node, or of its flow's table."""
    return qd.cast(params[e, OFFSET], qd.i32) * 65536 + qd.cast(params[e, OFFSET + 1], qd.i32)


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


@qd.kernel(fastcache=True)
def _map_samples(
    samples: Params,
    deal: Deal,
    out: Params,
    params: Params,
    lattice: Nodes,
    n_edits: qd.i32,
    flows: qd.template(),
):
    for turn in range(turns(deal)):
        i = dealt(turn, deal)
        if i < samples.shape[0]:
            d = read3(samples, i, 3)
            q, v, emptied = map_sample(read3(samples, i, 0), d, params, lattice, n_edits, flows)
            stretch = 1.0
            if (v - d).norm() > 0.0:
                stretch = v.norm()
            for a in qd.static(range(3)):
                out[i, a] = q[a]
                out[i, 3 + a] = v[a] / qd.max(stretch, 1e-20)
            out[i, 6] = stretch
            out[i, 7] = qd.cast(emptied, qd.f32)


@qd.kernel(fastcache=True)
def _sample_lattice(
    nodes: Nodes, deal: Deal, params: Params, none: Nodes, origin: vec3, frame: mat3, resolution: qd.i32
):
    for turn in range(turns(deal)):
        n = dealt(turn, deal)
        if n < nodes.shape[0]:
            i = n % resolution
            j = (n // resolution) % resolution
            k = n // (resolution * resolution)
            p = origin + frame @ (vec3(i, j, k) / qd.cast(resolution - 1, qd.f32))
            q, _v, _emptied = map_edit(p, vec3(1.0, 0.0, 0.0), params, none, 0, False)
            nodes[n] = q - p


_Kept: TypeAlias = "WeakKeyDictionary[Any, NDArray[np.float32]]"
_lattices: _Kept = WeakKeyDictionary()
_tables: _Kept = WeakKeyDictionary()
_rows: _Kept = WeakKeyDictionary()
_joined = Joined()


def _kept(kept: _Kept, edit: PackedEdit, make: Callable[[], NDArray[np.float32]]) -> NDArray[np.float32]:
    """What `make` returns, made once in the edit's life."""
    known = kept.get(edit)
    if known is None:
        known = make()
        known.setflags(write=False)
        kept[edit] = known
    return known


def _lattice(edit: PackedEdit, row: NDArray[np.float32]) -> NDArray[np.float32]:
    """The nodes [R^3,3] of a continuous edit's lattice, from its packed row.

    The row is not looked at for a flow shell.
    """
    return _kept(_lattices, edit, lambda: _sampled(edit, row))


def lattice_of(edit: PackedEdit) -> Lattice:
    """The lattice of a continuous edit as the renderer has it, for the float64 reference.

    Raises `DeviceError` where no device starts, `EditError` for edits without a lattice.
    """
    warp = edit.exact_warp
    if not isinstance(warp, ContinuousWarp) or edit.lattice is None:
        raise EditError("only a continuous edit with a lattice has one")
    nodes = _lattice(edit, _kept(_rows, edit, partial(_packed, edit)))
    origin, frame = warp.outer.frame
    R = edit.lattice
    return Lattice(origin, frame, nodes.reshape(R, R, R, 3).astype(np.float64))


def _sampled(edit: PackedEdit, row: NDArray[np.float32]) -> NDArray[np.float32]:
    warp, resolution = edit.exact_warp, edit.lattice
    if not isinstance(warp, ContinuousWarp) or resolution is None:
        raise EditError("only a continuous edit has a lattice")
    devices.start()
    if isinstance(warp.shell, FlowShell):
        strain = LATTICE_STRAIN * min(1.0, (32.0 / resolution) ** 0.5)
        return flow_lattice.sample(warp.shell.with_strain(strain), resolution)
    origin, frame = warp.outer.frame
    nodes = np.empty((resolution**3, 3), dtype=np.float32)
    place = (floats(origin), floats(frame), resolution)
    params = row[None].copy()
    params[0, [RESOLUTION, SIMPLE]] = 0.0
    if not isinstance(warp.shell, TrilinearShell):  # no kernel: from the reference
        lattice = Lattice.sample(lambda p: warp.to_canonical(p).points, warp.outer, resolution)
        nodes[:] = lattice.displacement.reshape(-1, 3)
    else:
        _sample_lattice(nodes, deal_of(len(nodes)), params, np.zeros((1, 3), dtype=np.float32), *place)
    return nodes


def _packed(edit: PackedEdit) -> NDArray[np.float32]:
    """The row of an edit, but for what depends on the others in its stack."""
    row = np.zeros(WIDTH, dtype=np.float32)
    _pack(row, edit)
    warp = edit.exact_warp
    if edit.lattice is not None and isinstance(warp, ContinuousWarp):
        row[RESOLUTION] = edit.lattice
        row[NODE_BOX : NODE_BOX + 3] = -EDGE * edit.lattice
        row[NODE_BOX + 3 : NODE_BOX + 6] = edit.lattice - 1 + EDGE * edit.lattice
        row[SIMPLE] = row[RECORDS + AFFINE] == 1.0 and warp.outer.is_affine
    elif isinstance(warp, ContinuousWarp) and isinstance(warp.shell, FlowShell):
        row[RESOLUTION] = FLOW
    return row


def _pack(row: NDArray[np.float32], edit: PackedEdit) -> None:
    """Write an edit into its row of `params`, with its shell exact."""
    boxes = edit.boxes
    row[BOX : BOX + 6] = widened(np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])[None]).ravel()
    warp = edit.exact_warp
    if isinstance(warp, DiscreteWarp):
        row[FIRST], row[LAST] = int(warp.inner is None), 1 if warp.keep_source else 2
        if warp.inner is not None:
            _record(row, 0, warp.inner.deformed.corners, warp.inner.canonical.corners)
        _record(row, 1, warp.source.corners)
        return
    if not isinstance(warp, ContinuousWarp):
        raise EditError(f"a {type(warp).__name__} has no kernel")
    row[FIRST], row[LAST], row[CONTINUOUS] = 0, 2, 1
    _record(row, 0, warp.inner.deformed.corners, warp.inner.canonical.corners)
    _record(row, 1, warp.outer.corners)
    if isinstance(warp.shell, TrilinearShell):
        row[LAST] = 8
        for n in range(6):
            _record(row, 2 + n, warp.shell.deformed_hexahedra[n], warp.shell.canonical_hexahedra[n])
    elif not isinstance(warp.shell, FlowShell) and edit.lattice is None:
        raise EditError(f"a {type(warp.shell).__name__} has no kernel; set a lattice")
    origin, frame = warp.outer.frame
    row[TO_NODES : TO_NODES + 3] = origin
    if edit.lattice is not None:
        row[TO_NODES + 3 : TO_NODES + 12] = ((edit.lattice - 1) * np.linalg.inv(frame)).ravel()


def _record(row: NDArray[np.float32], number: int, corners: Array, onto: Array | None = None) -> None:
    """Write the record of a hexahedron [8,3] and, if it has one, of its image [8,3]."""
    C = hexahedron.coefficients(corners)
    D = C if onto is None else hexahedron.coefficients(onto)
    W = hexahedron.centre_inverse(C)
    bend = C[[3, 5, 6, 7]] @ W.T
    y = (corners - C[0]) @ W.T
    # Affine only where the image is, too: an affine record skips the image's bend.
    size = np.abs(D[[1, 2, 4]]).max()
    affine = np.abs(bend).max() < 1e-7 and np.abs(D[[3, 5, 6, 7]]).max() < 1e-7 * size
    slack = 1e-5 * (y.max(axis=0) - y.min(axis=0))
    at = RECORDS + number * RECORD
    row[at : at + RECORD] = np.concatenate(
        [[affine], W.ravel(), C[0], y.min(axis=0) - slack, y.max(axis=0) + slack, bend.ravel(), D.ravel()]
    )


def _meets(others: NDArray[np.float32], row: NDArray[np.float32]) -> bool:
    """True where the box of one of the other rows meets that of `row`."""
    low, high = row[BOX : BOX + 3], row[BOX + 3 : BOX + 6]
    meets = (others[:, BOX : BOX + 3] <= high) & (others[:, BOX + 3 : BOX + 6] >= low)
    return bool(meets.all(axis=1).any())


def widened(boxes: Array) -> Array:
    """Boxes [B,2,3] made larger by what float32 samples may be off."""
    rounding = 1e-6 * np.abs(boxes).max(axis=(1, 2), initial=0.0)
    slack = BOX_SLACK * (boxes[:, 1] - boxes[:, 0]) + rounding[:, None]
    return np.stack([boxes[:, 0] - slack, boxes[:, 1] + slack], axis=1)
