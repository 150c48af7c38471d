"""Damped Gauss-Newton steps of splats by per-splat blocks, and image residuals (Numba).

The curvature of a pixel is |J_k| sum_j |J_j| in place of |J_k|^2, with J_k the derivative of its color by
splat k's
log alpha: it majorizes the sum over overlapping splats (separable surrogates). A splat has 3 x 3 blocks for
its mean and for its log scales, and diagonal curvatures for its rotation and its logit; the curvature of its
color is the sum of its weights, because the weights of a pixel sum to at most 1. Gradients and curvatures are
running means over the views of the splat. Steps are clamped: overlapping splats break the block-diagonal
model for long steps.

Source: derived here; per-splat blocks as in 3DGS^2 (Lan et al., 2025), damping as in Levenberg-Marquardt;
separable surrogates as in De Pierro, "A modified expectation maximization algorithm for penalized likelihood
estimation in emission tomography" (1995).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.numba_cache import FAST, njit
from cagefield.compute.parallel_kernels import parallel_njit
from cagefield.rendering.splats.kernels.projection import AREA, MAX_TERMS, TILE_PX, harmonics_at
from cagefield.typing import Array, Float32

MOMENTUM_FLOATS, RUNNING_FLOATS = 13, 17
"""Floats of a splat's running gradient, and of its running curvature (the last is the sum of weights)."""

CURRENT_CURVATURE_SHARE = 0.5
"""Share of the current photo's curvature added to the running curvature.

Without it, the steps of a photo taken from close by are too long for that photo."""


class AverageArgs(NamedTuple):
    """Running means over the views of each splat.

    Gradient [N,MOMENTUM_FLOATS], curvature [N,RUNNING_FLOATS], number of steps taken [N].
    """

    momentum: Float32
    running: Float32
    ticks: NDArray[np.int32]


class StepArgs(NamedTuple):
    """Rule of a Gauss-Newton step.

    Attributes:
        memory: [2] decay of the running gradient and of the running curvature.
        rates: [5] of mean, log scales, rotation, logit, color.
        damping: [2] relative to the block, and absolute.
        caps: [2] largest change of log scales and rotations; of the mean, in largest sigmas.
        terms: number of harmonics in use.
        scale_range: [2] least and largest sigma, world units.
        pull: added to the logit's gradient.
    """

    memory: Array
    rates: Array
    damping: Array
    caps: Array
    terms: int
    scale_range: Array
    pull: float


@parallel_njit(lambda out, *_: len(out), **FAST)
def residuals(begin, end, out, target, width, height, gain, background, weights, color, slopes, sums):
    """Write the composited image, dL/d(image) of L = |gain image - photo|^2 / 2, and sums per tile.

    out [tiles, >=4, AREA] is T and color; target [tiles, 3 or 4, AREA] uint8 with straight alpha. sums
    [tiles, 7]: squared error; gain-free image x photo and image^2, by channel; all weighted by `weights`
    [tiles,AREA]. The slopes are unweighted.
    """
    across = (width + TILE_PX - 1) // TILE_PX
    alpha = target.shape[1] == 4
    for t in range(begin, end):
        x0, y0 = (t % across) * TILE_PX, (t // across) * TILE_PX
        for j in range(7):
            sums[t, j] = 0.0
        for ch in range(3):
            error = np.float32(0.0)
            product = np.float32(0.0)
            square = np.float32(0.0)
            for i in range(AREA):
                inside = x0 + i % TILE_PX < width and y0 + i // TILE_PX < height
                c = out[t, 1 + ch, i] + out[t, 0, i] * background[ch]
                photo = np.float32(target[t, ch, i]) * np.float32(1 / 255)
                if alpha:
                    share = np.float32(target[t, 3, i]) * np.float32(1 / 255)
                    photo = photo * share + background[ch] * (np.float32(1) - share)
                d = gain[ch] * c - photo if inside else np.float32(0.0)
                color[t, ch, i] = c
                slopes[t, ch, i] = gain[ch] * d
                error += weights[t, i] * d * d
                if inside:
                    product += weights[t, i] * c * photo
                    square += weights[t, i] * c * c
            sums[t, 0] += error
            sums[t, 1 + ch] = product
            sums[t, 4 + ch] = square


@njit(inline="always", **FAST)
def turn(quaternions, i, wx, wy, wz):
    """Rotate a quaternion in place: q <- q exp(w / 2) to second order, normalized."""
    w, a, b, c = quaternions[i, 0], quaternions[i, 1], quaternions[i, 2], quaternions[i, 3]
    x, y, z = 0.5 * wx, 0.5 * wy, 0.5 * wz
    n0 = w - a * x - b * y - c * z
    n1 = a + w * x + b * z - c * y
    n2 = b + w * y + c * x - a * z
    n3 = c + w * z + a * y - b * x
    r = 1.0 / np.sqrt(n0 * n0 + n1 * n1 + n2 * n2 + n3 * n3)
    quaternions[i, 0], quaternions[i, 1], quaternions[i, 2], quaternions[i, 3] = (
        n0 * r,
        n1 * r,
        n2 * r,
        n3 * r,
    )


@njit(inline="always", **FAST)
def solve3(H, at, damp, g0, g1, g2):
    """Solution (H + damp I)^-1 g for the symmetric block at H[at:at+6]."""
    a = H[at] + damp
    b = H[at + 1]
    c = H[at + 2]
    d = H[at + 3] + damp
    e = H[at + 4]
    f = H[at + 5] + damp
    A = d * f - e * e
    B = c * e - b * f
    C = b * e - c * d
    r = 1.0 / max(a * A + b * B + c * C, 1e-300)
    return (
        (A * g0 + B * g1 + C * g2) * r,
        (B * g0 + (a * f - c * c) * g1 + (b * c - a * e) * g2) * r,
        (C * g0 + (b * c - a * e) * g1 + (a * d - b * b) * g2) * r,
    )


@njit(inline="always", **FAST)
def clamp_size(value, cap):
    """Value clamped to [-cap, cap]."""
    return min(cap, max(-cap, value))


@parallel_njit(lambda order, *_: order.size, **FAST)
def gauss_newton(begin, end, order, gradients, curvatures, parameters, origin, averages, step):
    """Take one step of the splats in `order`, seen from `origin` [3].

    `parameters` are `splat_backward.ParameterArgs`, `averages` `AverageArgs`, `step` `StepArgs`.
    """
    means, log_scales, quaternions, logits, sh = parameters
    momentum, running, ticks = averages
    memory, rates, damping, caps, terms, scale_range, pull = step
    H = np.empty(17)
    basis = np.empty(MAX_TERMS)
    for q in range(begin, end):
        i = order[q]
        ticks[i] += 1
        t = 1.0 / ticks[i]
        new1 = max(1.0 - memory[0], t)
        new2 = max(1.0 - memory[1], t)
        g = momentum[i]
        memory_H = running[i]
        for j in range(16):
            memory_H[j] += new2 * (curvatures[i, j] - memory_H[j])
            H[j] = memory_H[j] + CURRENT_CURVATURE_SHARE * curvatures[i, j]
        memory_H[16] += new2 * (gradients[i, 14] - memory_H[16])
        H[16] = memory_H[16] + CURRENT_CURVATURE_SHARE * gradients[i, 14]
        for j in range(13):
            g[j] += new1 * (gradients[i, j] - g[j])
        rel, tiny, cap = damping[0], damping[1], caps[0]
        damp = rel * (H[0] + H[3] + H[5]) / 3.0 + 1e-30
        x, y, z = solve3(H, 0, damp, g[0], g[1], g[2])
        x, y, z = -rates[0] * x, -rates[0] * y, -rates[0] * z
        big = np.exp(max(log_scales[i, 0], max(log_scales[i, 1], log_scales[i, 2])))
        f = min(1.0, caps[1] * big / (np.sqrt(x * x + y * y + z * z) + 1e-30))
        means[i, 0] += f * x
        means[i, 1] += f * y
        means[i, 2] += f * z
        damp = rel * (H[6] + H[9] + H[11]) / 3.0 + tiny
        x, y, z = solve3(H, 6, damp, g[3], g[4], g[5])
        low, high = np.log(scale_range[0]), np.log(scale_range[1])
        log_scales[i, 0] = min(high, max(low, log_scales[i, 0] + clamp_size(-rates[1] * x, cap)))
        log_scales[i, 1] = min(high, max(low, log_scales[i, 1] + clamp_size(-rates[1] * y, cap)))
        log_scales[i, 2] = min(high, max(low, log_scales[i, 2] + clamp_size(-rates[1] * z, cap)))
        damp = rel * (H[12] + H[13] + H[14]) / 3.0 + tiny
        turn(
            quaternions,
            i,
            clamp_size(-rates[2] * g[6] / (H[12] + damp), cap),
            clamp_size(-rates[2] * g[7] / (H[13] + damp), cap),
            clamp_size(-rates[2] * g[8] / (H[14] + damp), cap),
        )
        change = -rates[3] * (g[9] + pull) / (H[15] * (1.0 + rel) + tiny)
        logits[i] = clamp_size(logits[i] + clamp_size(change, 4.0 * cap), 7.0)
        dx = np.float64(means[i, 0]) - origin[0]
        dy = np.float64(means[i, 1]) - origin[1]
        dz = np.float64(means[i, 2]) - origin[2]
        r = 1.0 / np.sqrt(dx * dx + dy * dy + dz * dz)
        harmonics_at(dx * r, dy * r, dz * r, terms, basis)
        norm = 0.0
        for j in range(terms):
            norm += basis[j] * basis[j]
        for ch in range(3):
            change = -rates[4] * gradients[i, 10 + ch] / (norm * (H[16] + 1e-2))
            for j in range(terms):
                sh[i, j, ch] += change * basis[j]
