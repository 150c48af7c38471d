"""The kernels that make new densities and colours of a batch's records: Laplacian, diagonal Gauss-Newton."""

from cagefield.compute.quadrants import qd
from cagefield.rendering.voxels.kernels.grid import F32, I32, ivec3
from cagefield.training.voxels.kernels.accumulators import HEAD


@qd.kernel(fastcache=True)
def laplacian(
    density: F32,
    sh: F32,
    index: I32,
    vertex_at: I32,
    cell: F32,
    accumulator: F32,
    slots: qd.i32,
    resolution: ivec3,
    density_weight: qd.f32,
    colour_weight: qd.f32,
    K: qd.template(),
):
    """Adds the gradient and curvature of weight/2 * sum over stored neighbours (x - x_n)^2 to touched slots.

    Touched: the first accumulator has a colour curvature. Neighbours are the 6 along the axes. The density's
    weight is times the squared voxel size, so that it acts on optical depth per voxel.
    """
    qd.loop_config(block_dim=256)
    for slot in range(1, slots):
        stride = qd.static(HEAD + 3 * K)
        to = slot * stride
        if accumulator[to + 2] > 0.0:
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
            accumulator[to] = accumulator[to] + scaled * (count * density[slot] - d)
            accumulator[to + 1] = accumulator[to + 1] + scaled * count
            accumulator[to + 2] = accumulator[to + 2] + colour_weight * count
            for j in qd.static(range(3 * K)):
                a = to + HEAD + j
                accumulator[a] = accumulator[a] + colour_weight * (count * sh[slot * (3 * K) + j] - s[j])


@qd.kernel(fastcache=True)
def gauss_newton(
    density: F32,
    sh: F32,
    state: F32,
    weight: F32,
    cell: F32,
    accumulator: F32,
    record: qd.i32,
    workers: qd.i32,
    slots: qd.i32,
    decay: qd.f32,
    density_rate: qd.f32,
    colour_rate: qd.f32,
    largest_step: qd.f32,
    damping: qd.f32,
    plain: qd.f32,
    K: qd.template(),
):
    """One diagonal Gauss-Newton step of every slot the batch touched; empties the accumulators.

    state: [slots, 2] running sums of density and colour curvature, decayed on each touch.
    weight: [slots] the largest weight seen since the last pruning. cell: [slots] world-space voxel size h.
    The density moves by at most largest_step / h; `damping` is added to the colour curvature, and times h^2
    to the density curvature. Coefficients c that make a colour depend on the view get the gradient of
    plain/2 * c^2 for each unit of colour curvature: where photos from many sides say what they are it does
    little, where they do not it keeps them small.
    """
    qd.loop_config(block_dim=256)
    for slot in range(1, slots):
        stride = qd.static(HEAD + 3 * K)
        h_density = 0.0
        h_colour = 0.0
        for worker in range(workers):
            at = worker * record + slot * stride
            h_density += accumulator[at + 1]
            h_colour += accumulator[at + 2]
        if h_colour > 0.0:
            s0 = state[2 * slot] * decay + h_density
            s1 = state[2 * slot + 1] * decay + h_colour
            state[2 * slot] = s0
            state[2 * slot + 1] = s1
            g_density = 0.0
            w = weight[slot]
            for worker in range(workers):
                at = worker * record + slot * stride
                g_density += accumulator[at]
                w = qd.max(w, accumulator[at + 3])
                for a in qd.static(range(HEAD)):
                    accumulator[at + a] = 0.0
            weight[slot] = w
            change = density_rate * g_density / (s0 + damping * cell[slot] * cell[slot])
            limit = largest_step / cell[slot]
            density[slot] = density[slot] - qd.max(qd.min(change, limit), -limit)
            rate = colour_rate / (s1 + damping)
            for j in qd.static(range(3 * K)):
                g = 0.0
                for worker in range(workers):
                    at = worker * record + slot * stride + HEAD + j
                    g += accumulator[at]
                    accumulator[at] = 0.0
                c = sh[slot * (3 * K) + j]
                if qd.static(j >= 3):
                    g += plain * h_colour * c
                sh[slot * (3 * K) + j] = c - rate * g
