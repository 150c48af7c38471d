"""Kernel that marches a batch of photo rays forward and backward and accumulates gradients and curvatures.

Notation, per ray and channel: samples i with density s_i, step h_i, alpha_i = 1 - exp(-s_i h_i),
transmittance T_i, weight w_i = T_i alpha_i, color c_i; C = sum_i w_i c_i + T_end * background;
residual r = gain * C - photo; remaining color S_i = C - sum_{j<=i} w_j c_j. Then

    dC/dc_i = w_i          dC/ds_i = h_i (T_{i+1} c_i - S_i)

The loss of a ray is r^2 / 2 summed over channels, plus `distortion` times the distortion of mip-NeRF 360
(equation 15), which pulls the weights of a ray together; its distance along the ray is t / (t + reach).

A voxel's curvature in a bounded grid is that of one Gauss-Newton step for all voxels at once: with J_k the
slope of C with respect to voxel k, (sum_k J_k x_k)^2 <= sum_k D_k x_k^2 for D_k = |J_k| sum_j |J_j|, and D_k
is summed over the rays. J_k^2 alone is too small where samples share a ray's error, most in the fog at the
start of a training: each of them would correct the whole error. A contracted grid uses J_k^2: with D_k its
fog clears too slowly (3 dB less on a capture).

The forward march computes C and notes the few samples with weight in the worker's scratch; the backward pass
over these samples computes gradients from S_i. (Two marches without notes take 1.5 times as long on a CPU.)
b_v are trilinear weights.
"""

from dataclasses import dataclass

from cagefield.compute.block_cyclic import Schedule, scheduled_item, turn_count
from cagefield.compute.quadrants import qd
from cagefield.rendering.voxels.kernels.grid import (
    F32,
    U8,
    GridArgs,
    contract,
    contract_velocity,
    corner_slots,
    corner_weights,
    gather_density,
    gather_rgb,
    sh_basis,
    vec3,
)
from cagefield.rendering.voxels.kernels.ray_grid import OccupancyArgs, look_ahead, safe_inverse, slab
from cagefield.training.voxels.kernels.accumulators import HEADER_FLOATS, add, add_max
from cagefield.training.voxels.kernels.ray_batches import PatchArgs, PhotoArgs
from cagefield.training.voxels.kernels.sample_lists import SampleListArgs, note_sample

SAMPLE_FLOATS = 8
"""Floats of a noted sample: t, h, w, T after it, color before the clamp, and distortion slope u."""

MAX_SAMPLES = 512
"""Maximum number of noted samples per ray."""

MIN_SAMPLE_WEIGHT = 1e-4
"""Minimum weight of a sample with a color."""


@qd.func
def hash01(a: qd.u32, b: qd.u32):
    """A pseudo-random number in [0, 1) of two counters (PCG output hash)."""
    s = a * qd.u32(747796405) + b * qd.u32(2891336453) + qd.u32(277803737)
    s = ((s >> ((s >> qd.u32(28)) + qd.u32(4))) ^ s) * qd.u32(277803737)
    s = (s >> qd.u32(22)) ^ s
    return qd.cast(s >> qd.u32(8), qd.f32) * (1.0 / 16777216.0)


@qd.func
def spread_slope(
    s: qd.f32, ds: qd.f32, w: qd.f32, before_w: qd.f32, before_ws: qd.f32, total_w: qd.f32, total_ws: qd.f32
):
    """u = dL/dw of the distortion L = sum_ij w_i w_j |s_i - s_j| + sum_i w_i^2 ds_i / 3."""
    after_w = total_w - before_w - w
    after_ws = total_ws - before_ws - w * s
    return 2.0 * (s * before_w - before_ws + after_ws - s * after_w) + (2.0 / 3.0) * w * ds


@dataclass(frozen=True, eq=False)
class WorkerArgs:
    """Accumulators of `record` floats per worker, their flags, and scratch for the workers' samples.

    Each worker has `groups` flags, one for 2^group_bits slots; see `kernels.accumulators`.
    """

    accumulator: F32
    met: U8
    record: qd.i32
    groups: qd.i32
    group_bits: qd.i32
    scratch: F32
    workers: qd.i32


@dataclass(frozen=True, eq=False)
class LossArgs:
    """Outputs per ray: losses (squared error), penalties (distortion term), gain_sums [rays,6].

    The gain sums are C photo and C C per channel, for the exposure fit.
    """

    losses: F32
    penalties: F32
    gain_sums: F32


@dataclass(frozen=True, eq=False)
class BatchArgs:
    """Options of a batch's march: step and near distance in units of t, and random seed and background."""

    step: qd.f32
    near: qd.f32
    distortion: qd.f32
    reach: qd.f32
    seed: qd.u32
    random_background: qd.i32
    background: vec3


@qd.kernel(fastcache=True)
def march_batch(
    deal: Schedule,
    patches: PatchArgs,
    photos: PhotoArgs,
    grid: GridArgs,
    bricks: OccupancyArgs,
    work: WorkerArgs,
    loss: LossArgs,
    batch: BatchArgs,
    lists: SampleListArgs,
    K: qd.template(),
    contracted: qd.template(),
    gpu: qd.template(),
):
    """Add the gradients and curvatures of a batch of patches to the accumulators, and write `loss`.

    On a GPU samples go to the lists, as many as these have room for.
    """
    rays = patches.size * patches.size
    total = patches.count * rays
    # A CPU worker takes consecutive patches; neighboring GPU threads take neighboring rays.
    per = (patches.count + work.workers - 1) // work.workers * rays
    if qd.static(gpu):
        per = (total + work.workers - 1) // work.workers
    for turn in range(turn_count(deal)):
        worker = scheduled_item(turn, deal)
        base = 0
        first_flag = 0
        if qd.static(not gpu):
            base = worker * work.record
            first_flag = worker * work.groups
        for n in range(per):
            ray = worker * per + n
            if qd.static(gpu):
                ray = n * work.workers + worker
            if worker < work.workers and ray < total:
                patch = ray // rays
                r = ray % rays
                view = patches.patches[3 * patch]
                column = patches.patches[3 * patch + 1] + r % patches.size
                row = patches.patches[3 * patch + 2] + r // patches.size
                first = photos.views[4 * view]
                width = photos.views[4 * view + 1]
                pixel = row * width + column
                loss.losses[ray] = 0.0
                loss.penalties[ray] = 0.0
                for a in qd.static(range(6)):
                    loss.gain_sums[6 * ray + a] = 0.0
                drawn = 0
                if row < photos.views[4 * view + 3] and column < width:
                    if photos.valid[(first + pixel) * photos.masked] > 0:
                        drawn = 1
                if drawn == 1:
                    m = 12 * view
                    at = 3 * (photos.views[4 * view + 2] + pixel)
                    l = vec3(photos.directions[at], photos.directions[at + 1], photos.directions[at + 2])
                    d = vec3(
                        photos.poses[m] * l.x + photos.poses[m + 1] * l.y + photos.poses[m + 2] * l.z,
                        photos.poses[m + 4] * l.x + photos.poses[m + 5] * l.y + photos.poses[m + 6] * l.z,
                        photos.poses[m + 8] * l.x + photos.poses[m + 9] * l.y + photos.poses[m + 10] * l.z,
                    )
                    o = vec3(photos.poses[m + 3], photos.poses[m + 7], photos.poses[m + 11])
                    gain = vec3(
                        photos.gains[3 * view], photos.gains[3 * view + 1], photos.gains[3 * view + 2]
                    )
                    key = qd.cast(ray, qd.u32)
                    bg = batch.background
                    if batch.random_background == 1:
                        for a in qd.static(range(3)):
                            bg[a] = hash01(key, batch.seed * qd.u32(4) + qd.u32(a + 1))
                    px = 4 * (first + pixel)
                    opacity = qd.cast(photos.pixels[px + 3], qd.f32) / 255.0
                    photo = vec3(0.0, 0.0, 0.0)
                    for a in qd.static(range(3)):
                        photo[a] = (
                            qd.cast(photos.pixels[px + a], qd.f32) / 255.0 * opacity + (1.0 - opacity) * bg[a]
                        )
                    basis = sh_basis(d, K)

                    # Ray in grid coordinates (bounded) or normalized coordinates (contracted).
                    go = (o - grid.lower) * grid.scale
                    gd = d * grid.scale
                    inverse = safe_inverse(gd)
                    t_end = 1e30
                    t_start = batch.near
                    if qd.static(not contracted):
                        hit = slab(go, inverse, vec3(0.0, 0.0, 0.0), qd.cast(grid.resolution - 1, qd.f32))
                        t_start = qd.max(hit.x, batch.near)
                        t_end = hit.y
                    jitter = hash01(key, batch.seed * qd.u32(4))
                    if qd.static(not contracted):
                        t_start += jitter * batch.step
                    else:
                        v0 = contract_velocity(go + t_start * gd, gd)
                        t_start += jitter * batch.step / qd.abs(v0 * grid.half).max()

                    C = vec3(0.0, 0.0, 0.0)
                    T = 1.0
                    t = t_start
                    samples = 0
                    total_w = 0.0
                    total_ws = 0.0
                    while t < t_end and T > 1e-3:
                        g, h, empty, leap, last = look_ahead(
                            bricks, go + t * gd, gd, inverse, grid.half, batch.step, contracted
                        )
                        if qd.static(contracted):
                            if last == 1:
                                t_end = t
                        if empty == 1:
                            t += leap
                        else:
                            cell = qd.max(qd.min(qd.cast(qd.floor(g), qd.i32), grid.resolution - 2), 0)
                            slots = corner_slots(grid.index, cell, grid.resolution.y, grid.resolution.z)
                            b = corner_weights(g - qd.cast(cell, qd.f32))
                            raw = gather_density(grid.density, slots, b)
                            if raw > 0.0:
                                keep = qd.exp(-raw * h)
                                w = T * (1.0 - keep)
                                T *= keep
                                if w > MIN_SAMPLE_WEIGHT:
                                    color = gather_rgb(grid.sh, slots, b, basis, K)
                                    C += w * qd.max(qd.min(color, 1.0), 0.0)
                                    if samples < MAX_SAMPLES:
                                        s = t / (t + batch.reach)
                                        total_w += w
                                        total_ws += w * s
                                        at = SAMPLE_FLOATS * (worker * MAX_SAMPLES + samples)
                                        work.scratch[at] = t
                                        work.scratch[at + 1] = h
                                        work.scratch[at + 2] = w
                                        work.scratch[at + 3] = T
                                        for a in qd.static(range(3)):
                                            work.scratch[at + 4 + a] = color[a]
                                        samples += 1
                            t += h
                    C += T * bg
                    residual = gain * C - photo
                    loss.losses[ray] = residual.dot(residual)
                    for a in qd.static(range(3)):
                        loss.gain_sums[6 * ray + a] = C[a] * photo[a]
                        loss.gain_sums[6 * ray + 3 + a] = C[a] * C[a]

                    total_wu = 0.0
                    if batch.distortion > 0.0:
                        before_w = 0.0
                        before_ws = 0.0
                        for sample in range(samples):
                            at = SAMPLE_FLOATS * (worker * MAX_SAMPLES + sample)
                            s = work.scratch[at] / (work.scratch[at] + batch.reach)
                            ds = (
                                work.scratch[at + 1]
                                * batch.reach
                                / ((work.scratch[at] + batch.reach) * (work.scratch[at] + batch.reach))
                            )
                            w = work.scratch[at + 2]
                            u = spread_slope(s, ds, w, before_w, before_ws, total_w, total_ws)
                            before_w += w
                            before_ws += w * s
                            total_wu += w * u
                            work.scratch[at + 7] = u
                        loss.penalties[ray] = 0.5 * batch.distortion * total_wu

                    slopes = vec3(0.0, 0.0, 0.0)  # sum of |dC/ds_i|
                    remaining = C
                    if qd.static(not contracted):
                        for sample in range(samples):
                            at = SAMPLE_FLOATS * (worker * MAX_SAMPLES + sample)
                            for a in qd.static(range(3)):
                                c = qd.max(qd.min(work.scratch[at + 4 + a], 1.0), 0.0)
                                remaining[a] -= work.scratch[at + 2] * c
                                slopes[a] += work.scratch[at + 1] * qd.abs(
                                    work.scratch[at + 3] * c - remaining[a]
                                )
                        slopes *= gain

                    noted = 0
                    if qd.static(gpu):
                        noted = qd.atomic_add(lists.count[0], samples)
                    remaining = C
                    for sample in range(samples):
                        at = SAMPLE_FLOATS * (worker * MAX_SAMPLES + sample)
                        q = go + work.scratch[at] * gd
                        h = work.scratch[at + 1]
                        w = work.scratch[at + 2]
                        color = vec3(
                            work.scratch[at + 4],
                            work.scratch[at + 5],
                            work.scratch[at + 6],
                        )
                        g = q
                        if qd.static(contracted):
                            g = (contract(q) + 2.0) * grid.half
                        cell = qd.max(qd.min(qd.cast(qd.floor(g), qd.i32), grid.resolution - 2), 0)
                        slots = corner_slots(grid.index, cell, grid.resolution.y, grid.resolution.z)
                        b = corner_weights(g - qd.cast(cell, qd.f32))
                        c = qd.max(qd.min(color, 1.0), 0.0)
                        remaining -= w * c
                        slope = h * gain * (work.scratch[at + 3] * c - remaining)
                        curvature = slope.dot(slope)
                        color_curvature = w * w
                        if qd.static(not contracted):
                            curvature = qd.abs(slope).dot(slopes)
                            color_curvature = w * total_w
                        gradient = slope.dot(residual)
                        if batch.distortion > 0.0:
                            total_wu -= w * work.scratch[at + 7]
                            gradient += (
                                batch.distortion
                                * h
                                * (work.scratch[at + 3] * work.scratch[at + 7] - total_wu)
                            )
                        pull = residual * gain * w
                        for a in qd.static(range(3)):
                            if color[a] < 0.0 and pull[a] > 0.0:
                                pull[a] = 0.0
                            if color[a] > 1.0 and pull[a] < 0.0:
                                pull[a] = 0.0
                        listed = 0
                        if qd.static(gpu):
                            if noted + sample < lists.room:
                                listed = 1
                                note_sample(
                                    lists,
                                    noted + sample,
                                    (cell.x * grid.resolution.y + cell.y) * grid.resolution.z + cell.z,
                                    g - qd.cast(cell, qd.f32),
                                    qd.Vector([gradient, curvature, color_curvature, w]),
                                    pull,
                                    d,
                                )
                        if listed == 0:
                            for k in qd.static(range(8)):
                                if slots[k] > 0:
                                    work.met[first_flag + (slots[k] >> work.group_bits)] = qd.u8(1)
                                    to = base + slots[k] * (HEADER_FLOATS + 3 * K)
                                    add(work.accumulator, to, b[k] * gradient, gpu)
                                    add(work.accumulator, to + 1, b[k] * curvature, gpu)
                                    add(work.accumulator, to + 2, b[k] * color_curvature, gpu)
                                    add_max(work.accumulator, to + 3, b[k] * w, gpu)
                                    for j in qd.static(range(K)):
                                        y = b[k] * basis[j]
                                        for a in qd.static(range(3)):
                                            c_to = to + HEADER_FLOATS + 3 * j + a
                                            add(work.accumulator, c_to, y * pull[a], gpu)
