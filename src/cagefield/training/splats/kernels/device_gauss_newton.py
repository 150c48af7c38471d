"""Damped Gauss-Newton steps of splats on Quadrants' devices; see `gauss_newton_splats`.

One thread has one splat. Blocks are divided by their traces before they are solved, for float32.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.quadrants import qd
from cagefield.rendering.splats.kernels.device_splat_args import CameraArgs
from cagefield.rendering.voxels.kernels.grid import F32, I32, sh_basis, vec3
from cagefield.training.splats.kernels.device_args import AverageArgs, ParameterArgs, StepArgs
from cagefield.training.splats.kernels.gauss_newton_splats import (
    CURRENT_CURVATURE_SHARE,
    MOMENTUM_FLOATS,
    RUNNING_FLOATS,
)
from cagefield.training.splats.kernels.splat_backward import CURVATURE_FLOATS, GRADIENT_FLOATS

MIN_TRACE = 1e-20
"""Smallest trace of a block; smaller ones are 0."""

vec6 = qd.types.vector(6, qd.f32)
CurvatureRow = qd.types.vector(RUNNING_FLOATS, qd.f32)


@qd.func
def solve3(H: vec6, relative: qd.f32, absolute: qd.f32, g: vec3):
    """Solution (H + d I)^-1 g of a block, d = relative mean(diag H) + absolute."""
    trace = H[0] + H[3] + H[5] + absolute + MIN_TRACE
    unit = H / trace
    damping = (relative * (H[0] + H[3] + H[5]) / 3.0 + absolute + MIN_TRACE) / trace
    a = unit[0] + damping
    b = unit[1]
    c = unit[2]
    d = unit[3] + damping
    e = unit[4]
    f = unit[5] + damping
    A = d * f - e * e
    B = c * e - b * f
    C = b * e - c * d
    r = 1.0 / (qd.max(a * A + b * B + c * C, 1e-12) * trace)
    return r * vec3(
        A * g[0] + B * g[1] + C * g[2],
        B * g[0] + (a * f - c * c) * g[1] + (b * c - a * e) * g[2],
        C * g[0] + (b * c - a * e) * g[1] + (a * d - b * b) * g[2],
    )


@qd.func
def clamp(value: qd.f32, cap: qd.f32):
    """Value clamped to [-cap, cap]."""
    return qd.min(cap, qd.max(-cap, value))


@qd.func
def turn(quaternions: qd.template(), i: qd.i32, angle: vec3):
    """Rotate a quaternion in place: q <- q exp(angle / 2) to second order, normalized."""
    w = quaternions[4 * i]
    v = vec3(quaternions[4 * i + 1], quaternions[4 * i + 2], quaternions[4 * i + 3])
    half = 0.5 * angle
    new_w = w - v.dot(half)
    new_v = v + w * half + v.cross(half)
    r = 1.0 / qd.sqrt(new_w * new_w + new_v.dot(new_v))
    quaternions[4 * i] = new_w * r
    for j in qd.static(range(3)):
        quaternions[4 * i + 1 + j] = new_v[j] * r


@qd.kernel(fastcache=True)
def gauss_newton(
    boxes: I32,
    gradients: F32,
    curvatures: F32,
    parameters: ParameterArgs,
    camera: CameraArgs,
    averages: AverageArgs,
    step: StepArgs,
    count: qd.i32,
    K: qd.template(),
):
    """Take one step of the splats with tiles in `boxes` [N,4], K harmonics each; add to errors and hits.

    Frozen splats, of ticks below 0, stay.
    """
    qd.loop_config(block_dim=128)
    for i in range(count):
        if boxes[4 * i + 1] > boxes[4 * i] and averages.ticks[i] >= 0:
            first = GRADIENT_FLOATS * i
            ticks = averages.ticks[i] + 1
            averages.ticks[i] = ticks
            averages.hits[i] = averages.hits[i] + 1
            averages.error[i] = averages.error[i] + gradients[first + 15]
            fresh = 1.0 / qd.cast(ticks, qd.f32)
            new_gradient = qd.max(1.0 - step.memory[0], fresh)
            new_curvature = qd.max(1.0 - step.memory[1], fresh)
            H = CurvatureRow(0.0)
            for j in qd.static(range(RUNNING_FLOATS)):
                here = gradients[first + 14]
                if qd.static(j < CURVATURE_FLOATS):
                    here = curvatures[CURVATURE_FLOATS * i + j]
                at = RUNNING_FLOATS * i + j
                mean = averages.running[at] + new_curvature * (here - averages.running[at])
                averages.running[at] = mean
                H[j] = mean + CURRENT_CURVATURE_SHARE * here
            g = qd.Vector.zero(qd.f32, MOMENTUM_FLOATS)
            for j in qd.static(range(MOMENTUM_FLOATS)):
                at = MOMENTUM_FLOATS * i + j
                mean = averages.momentum[at]
                g[j] = mean + new_gradient * (gradients[first + j] - mean)
                averages.momentum[at] = g[j]
            log_scale = vec3(
                parameters.log_scales[3 * i],
                parameters.log_scales[3 * i + 1],
                parameters.log_scales[3 * i + 2],
            )
            relative = step.damping[0]
            absolute = step.damping[1]
            cap = step.caps[0]

            shift = -step.rates[0] * solve3(
                vec6(H[0], H[1], H[2], H[3], H[4], H[5]), relative, 0.0, vec3(g[0], g[1], g[2])
            )
            limit = step.caps[1] * qd.exp(qd.max(log_scale[0], qd.max(log_scale[1], log_scale[2])))
            shift *= qd.min(1.0, limit / (shift.norm() + 1e-30))
            mean = (
                vec3(parameters.means[3 * i], parameters.means[3 * i + 1], parameters.means[3 * i + 2])
                + shift
            )
            growth = -step.rates[1] * solve3(
                vec6(H[6], H[7], H[8], H[9], H[10], H[11]), relative, absolute, vec3(g[3], g[4], g[5])
            )
            for j in qd.static(range(3)):
                parameters.means[3 * i + j] = mean[j]
                parameters.log_scales[3 * i + j] = qd.min(
                    step.log_range[1], qd.max(step.log_range[0], log_scale[j] + clamp(growth[j], cap))
                )
            damping = relative * (H[12] + H[13] + H[14]) / 3.0 + absolute
            angle = vec3(0.0)
            for j in qd.static(range(3)):
                angle[j] = clamp(-step.rates[2] * g[6 + j] / (H[12 + j] + damping), cap)
            turn(parameters.quaternions, i, angle)
            change = -step.rates[3] * (g[9] + step.pull) / (H[15] * (1.0 + relative) + absolute)
            parameters.logits[i] = clamp(parameters.logits[i] + clamp(change, 4.0 * cap), 7.0)

            direction = (mean - camera.origin - camera.origin_rest).normalized()
            basis = sh_basis(direction, K)
            norm = 0.0
            for j in qd.static(range(K)):
                if j < step.terms:
                    norm += basis[j] * basis[j]
            for channel in qd.static(range(3)):
                color = -step.rates[4] * gradients[first + 10 + channel] / (norm * (H[16] + 1e-2))
                for j in qd.static(range(K)):
                    if j < step.terms:
                        at = 3 * (i * K + j) + channel
                        parameters.sh[at] = parameters.sh[at] + color * basis[j]
