"""Kernels that update densities and colors from a batch's records: sum over workers, Laplacian, diagonal
Gauss-Newton step."""

from dataclasses import dataclass

from cagefield.compute.quadrants import qd
from cagefield.rendering.voxels.kernels.grid import F32, I32, U8, ivec3
from cagefield.training.voxels.kernels.accumulators import HEADER_FLOATS


@dataclass(frozen=True, eq=False)
class StepArgs:
    """Rule of a diagonal Gauss-Newton step.

    `decay` of the running curvatures per batch. The density moves by at most max_step / h, h the world-space
    voxel size; `damping` is added to the color curvature, and times h^2 to the density curvature.
    View-dependent coefficients c get the gradient of view_dependence_reg/2 * c^2 per unit of color curvature:
    small against the evidence of photos from many sides, and a damping without it.
    """

    decay: qd.f32
    density_rate: qd.f32
    color_rate: qd.f32
    max_step: qd.f32
    damping: qd.f32
    view_dependence_reg: qd.f32


@dataclass(frozen=True, eq=False)
class RecordArgs:
    """Accumulator of `slots` records, and its flags, one for 2^group_bits slots: see `accumulators`."""

    accumulator: F32
    met: U8
    slots: qd.i32
    group_bits: qd.i32


@qd.kernel(fastcache=True)
def reduce_workers(
    accumulator: F32,
    met: U8,
    record: qd.i32,
    workers: qd.i32,
    slots: qd.i32,
    group_bits: qd.i32,
    K: qd.template(),
):
    """Add the accumulators of the other workers, and their flags, to the first one's, and empty them."""
    groups = ((slots - 1) >> group_bits) + 1
    qd.loop_config(block_dim=256)
    for part in range(groups):
        stride = qd.static(HEADER_FLOATS + 3 * K)
        for worker in range(1, workers):
            if met[worker * groups + part] > 0:
                met[worker * groups + part] = qd.u8(0)
                met[part] = qd.u8(1)
                for slot in range(qd.max(part << group_bits, 1), qd.min((part + 1) << group_bits, slots)):
                    to = slot * stride
                    at = worker * record + to
                    # A ray that meets a slot adds to its color curvature.
                    if accumulator[at + 2] > 0.0:
                        accumulator[to + 3] = qd.max(accumulator[to + 3], accumulator[at + 3])
                        accumulator[at + 3] = 0.0
                        for a in qd.static(range(stride)):
                            if qd.static(a != 3):
                                accumulator[to + a] = accumulator[to + a] + accumulator[at + a]
                                accumulator[at + a] = 0.0


@qd.kernel(fastcache=True)
def laplacian(
    density: F32,
    sh: F32,
    index: I32,
    vertex_at: I32,
    cell: F32,
    records: RecordArgs,
    resolution: ivec3,
    density_weight: qd.f32,
    color_weight: qd.f32,
    K: qd.template(),
):
    """Add gradient and curvature of weight/2 * sum over stored neighbors (x - x_n)^2 to the batch's slots.

    Slots of the batch have a color curvature in the reduced accumulator. Neighbors are the 6 along the axes.
    The density's weight is multiplied by the squared voxel size: it acts on optical depth per voxel.
    """
    qd.loop_config(block_dim=256)
    for part in range(((records.slots - 1) >> records.group_bits) + 1):
        if records.met[part] > 0:
            begin = qd.max(part << records.group_bits, 1)
            for slot in range(begin, qd.min((part + 1) << records.group_bits, records.slots)):
                stride = qd.static(HEADER_FLOATS + 3 * K)
                to = slot * stride
                if records.accumulator[to + 2] > 0.0:
                    at = vertex_at[slot]
                    nyz = resolution.y * resolution.z
                    x = at // nyz
                    rest = at - x * nyz
                    y = rest // resolution.z
                    z = rest - y * resolution.z
                    count = 0.0
                    s = qd.Vector.zero(qd.f32, 3 * K)
                    d = 0.0
                    for n in qd.static(range(6)):
                        other = 0
                        if qd.static(n == 0):
                            if x > 0:
                                other = index[at - nyz]
                        if qd.static(n == 1):
                            if x < resolution.x - 1:
                                other = index[at + nyz]
                        if qd.static(n == 2):
                            if y > 0:
                                other = index[at - resolution.z]
                        if qd.static(n == 3):
                            if y < resolution.y - 1:
                                other = index[at + resolution.z]
                        if qd.static(n == 4):
                            if z > 0:
                                other = index[at - 1]
                        if qd.static(n == 5):
                            if z < resolution.z - 1:
                                other = index[at + 1]
                        if other > 0:
                            count += 1.0
                            d += density[other]
                            for j in qd.static(range(3 * K)):
                                s[j] += sh[other * (3 * K) + j]
                    scaled = density_weight * cell[slot] * cell[slot]
                    records.accumulator[to] = records.accumulator[to] + scaled * (count * density[slot] - d)
                    records.accumulator[to + 1] = records.accumulator[to + 1] + scaled * count
                    records.accumulator[to + 2] = records.accumulator[to + 2] + color_weight * count
                    for j in qd.static(range(3 * K)):
                        a = to + HEADER_FLOATS + j
                        records.accumulator[a] = records.accumulator[a] + color_weight * (
                            count * sh[slot * (3 * K) + j] - s[j]
                        )


@qd.kernel(fastcache=True)
def gauss_newton(
    density: F32,
    sh: F32,
    state: F32,
    weight: F32,
    cell: F32,
    records: RecordArgs,
    step: StepArgs,
    K: qd.template(),
):
    """Take one diagonal Gauss-Newton step of every slot in the batch, and empty the reduced accumulator.

    state: [slots, 2] running sums of density and color curvature, decayed per batch with the slot.
    weight: [slots] maximum weight since the last pruning. cell: [slots] world-space voxel size h.
    """
    qd.loop_config(block_dim=256)
    for part in range(((records.slots - 1) >> records.group_bits) + 1):
        if records.met[part] > 0:
            records.met[part] = qd.u8(0)
            begin = qd.max(part << records.group_bits, 1)
            for slot in range(begin, qd.min((part + 1) << records.group_bits, records.slots)):
                stride = qd.static(HEADER_FLOATS + 3 * K)
                at = slot * stride
                h_color = records.accumulator[at + 2]
                if h_color > 0.0:
                    s0 = state[2 * slot] * step.decay + records.accumulator[at + 1]
                    s1 = state[2 * slot + 1] * step.decay + h_color
                    state[2 * slot] = s0
                    state[2 * slot + 1] = s1
                    weight[slot] = qd.max(weight[slot], records.accumulator[at + 3])
                    change = (
                        step.density_rate
                        * records.accumulator[at]
                        / (s0 + step.damping * cell[slot] * cell[slot])
                    )
                    limit = step.max_step / cell[slot]
                    density[slot] = density[slot] - qd.max(qd.min(change, limit), -limit)
                    rate = step.color_rate / (s1 + step.damping)
                    for j in qd.static(range(3 * K)):
                        g = records.accumulator[at + HEADER_FLOATS + j]
                        c = sh[slot * (3 * K) + j]
                        if qd.static(j >= 3):
                            g += step.view_dependence_reg * h_color * c
                        sh[slot * (3 * K) + j] = c - rate * g
                    for a in qd.static(range(stride)):
                        records.accumulator[at + a] = 0.0
