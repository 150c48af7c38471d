"""Gradients and curvatures of each splat's parameters, from sums over an image's pixels (Numba).

Notation as in `rendering.splats.kernels.projection` and `blending`. A splat's parameters are its mean, log
scales, a rotation `turn` about its own axes (R <- R exp([turn]x)), the logit of its opacity, and its color
before the clamp at 0. k_j = M R_j is the screen vector of its unit axis j. With G = dL/dS, S the projected
covariance:

    log scale j:   dS = 2 s_j^2 k_j k_j^T
    turn about j:  dS = (s_m^2 - s_n^2) (k_m k_n^T + k_n k_m^T)

and (m, n) the other two axes. G = sum v e e^T / 2; an antialiased splat's opacity adds v K / 2,
K = (M C M^T)^-1 - S^-1, to it. Curvatures are Gauss-Newton's, sum over pixels and channels of
(dC/dparameter)^2.

The oracle is finite differences of `cagefield.rendering.splats.reference_rasterizer`.

Source: derived here; the classic gradients are in Kerbl et al. (2023), appendix A, and Ye and Kanazawa,
"Mathematical supplement for the gsplat library" (2023); block curvatures as in 3DGS^2 (Lan et al., 2025).
"""

from __future__ import annotations

from typing import NamedTuple

import numba as nb
import numpy as np
from numpy.typing import NDArray

from cagefield.compute.numba_cache import FAST, njit
from cagefield.compute.parallel_kernels import parallel_njit
from cagefield.rendering.splats.kernels.projection import (
    BLUR,
    LEAST_COMPENSATION,
    MAX_TERMS,
    clamped,
    distort,
    harmonics_at,
)
from cagefield.typing import Float32

GRADIENT_FLOATS = 16
"""0-2 mean, 3-5 log scales, 6-8 turn, 9 logit, 10-12 color, 13 |dL/d(projected mean)|, 14 sum of weights,
15 sum of weight |dL/dC|^2."""
CURVATURE_FLOATS = 16
"""0-5 mean (xx xy xz yy yz zz), 6-11 log scales (same order), 12-14 turn, 15 logit."""

LENS_STEP = 1e-4
"""Finite-difference step of the lens's second derivative, in normalized coordinates n."""


class ParameterArgs(NamedTuple):
    """Parameters of N splats, as `SplatState`."""

    means: Float32
    log_scales: Float32
    quaternions: Float32
    logits: Float32
    sh: Float32


class PairArgs(NamedTuple):
    """Pairs (tile, splat) of an image, as `Projection`, and the sums [pairs,SUMS] of their pixels."""

    order: NDArray[np.int64]
    firsts: NDArray[np.int64]
    slots: NDArray[np.int32]
    sums: Float32


@njit(**FAST)
def quartic(s, ax, ay, bx, by, cx, cy, dx, dy):
    """Sum of h (a.e)(b.e)(c.e)(d.e) from the moments s[14] to s[18]."""
    p0, p1, p2 = ax * bx, ax * by + ay * bx, ay * by
    q0, q1, q2 = cx * dx, cx * dy + cy * dx, cy * dy
    return (
        p0 * q0 * s[14]
        + (p0 * q1 + p1 * q0) * s[15]
        + (p0 * q2 + p1 * q1 + p2 * q0) * s[16]
        + (p1 * q2 + p2 * q1) * s[17]
        + p2 * q2 * s[18]
    )


@njit(**FAST)
def bilinear(a, b, c, x0, y0, x1, y1):
    """Bilinear form (x0, y0) (a b; b c) (x1, y1)^T."""
    return a * x0 * x1 + b * (x0 * y1 + y0 * x1) + c * y0 * y1


@parallel_njit(lambda pairs, *_: pairs.order.size, **FAST)
def backpropagate(
    begin, end, pairs, packed, parameters, opacities, camera, antialiased, directional, gradients, curvatures
):
    """Write gradients [N,GRADIENT_FLOATS] and curvatures [N,CURVATURE_FLOATS] of the splats in `pairs`.

    `pairs` are `PairArgs`, `parameters` `ParameterArgs`, `camera` the `CameraArgs` of the image whose splats
    are `packed` with `opacities` [N]. The color's gradient is before its clamp at 0. `directional` adds the
    mean's gradient through the viewing direction of the color, where the clamp is inactive.
    """
    order, firsts, slots, sums = pairs
    means, log_scales, quaternions, _, sh = parameters
    W, origin, focal, _, _, limits, model, coefficients, _, _ = camera
    fx, fy = focal[0], focal[1]
    terms = sh.shape[1]
    s = np.empty(20)
    M = np.empty((2, 3))
    R = np.empty((3, 3))
    k = np.empty((2, 3))
    s2 = np.empty(3)
    C = np.empty((3, 3))
    P = np.empty((2, 3))
    kappa = np.empty(3)
    spread = np.empty(3)
    for q in range(begin, end):
        i = order[q]
        s[:] = 0.0
        for e in range(firsts[q], firsts[q + 1]):
            for j in range(20):
                s[j] += sums[slots[e], j]
        G = gradients[i]
        H = curvatures[i]
        dx = np.float64(means[i, 0]) - origin[0]
        dy = np.float64(means[i, 1]) - origin[1]
        dz = np.float64(means[i, 2]) - origin[2]
        x = W[0, 0] * dx + W[0, 1] * dy + W[0, 2] * dz
        y = W[1, 0] * dx + W[1, 1] * dy + W[1, 2] * dz
        z = W[2, 0] * dx + W[2, 1] * dy + W[2, 2] * dz
        iz = 1.0 / z
        nx = clamped(x * iz, limits[0], limits[1])
        ny = clamped(y * iz, limits[2], limits[3])
        _, _, d00, d01, d10, d11 = distort(nx, ny, model, coefficients)
        for j in range(3):
            px = (W[0, j] - nx * W[2, j]) * iz
            py = (W[1, j] - ny * W[2, j]) * iz
            M[0, j] = fx * (d00 * px + d01 * py)
            M[1, j] = fy * (d10 * px + d11 * py)
        w, a, b, c = quaternions[i, 0], quaternions[i, 1], quaternions[i, 2], quaternions[i, 3]
        R[0, 0] = 1.0 - 2.0 * (b * b + c * c)
        R[0, 1] = 2.0 * (a * b - w * c)
        R[0, 2] = 2.0 * (a * c + w * b)
        R[1, 0] = 2.0 * (a * b + w * c)
        R[1, 1] = 1.0 - 2.0 * (a * a + c * c)
        R[1, 2] = 2.0 * (b * c - w * a)
        R[2, 0] = 2.0 * (a * c - w * b)
        R[2, 1] = 2.0 * (b * c + w * a)
        R[2, 2] = 1.0 - 2.0 * (a * a + b * b)
        for j in range(3):
            s2[j] = np.exp(2.0 * log_scales[i, j])
            for m in range(2):
                k[m, j] = M[m, 0] * R[0, j] + M[m, 1] * R[1, j] + M[m, 2] * R[2, j]
        # Antialiasing term K, where the compensation is above its minimum.
        K0 = K1 = K2 = 0.0
        if antialiased:
            f0 = s2[0] * k[0, 0] * k[0, 0] + s2[1] * k[0, 1] * k[0, 1] + s2[2] * k[0, 2] * k[0, 2]
            f1 = s2[0] * k[0, 0] * k[1, 0] + s2[1] * k[0, 1] * k[1, 1] + s2[2] * k[0, 2] * k[1, 2]
            f2 = s2[0] * k[1, 0] * k[1, 0] + s2[1] * k[1, 1] * k[1, 1] + s2[2] * k[1, 2] * k[1, 2]
            sharp = f0 * f2 - f1 * f1
            det = (f0 + BLUR) * (f2 + BLUR) - f1 * f1
            if sharp > LEAST_COMPENSATION * LEAST_COMPENSATION * det:
                K0 = f2 / sharp - (f2 + BLUR) / det
                K1 = -f1 / sharp + f1 / det
                K2 = f0 / sharp - (f0 + BLUR) / det
        g00 = 0.5 * (s[3] + s[0] * K0)
        g01 = 0.5 * (s[4] + s[0] * K1)
        g11 = 0.5 * (s[5] + s[0] * K2)
        o = opacities[i]
        for j in range(3):
            m = (j + 1) % 3
            n = (j + 2) % 3
            G[3 + j] = 2.0 * s2[j] * bilinear(g00, g01, g11, k[0, j], k[1, j], k[0, j], k[1, j])
            G[6 + j] = 2.0 * (s2[m] - s2[n]) * bilinear(g00, g01, g11, k[0, m], k[1, m], k[0, n], k[1, n])
        G[9] = s[0] * (1.0 - o)
        G[10], G[11], G[12] = s[6], s[7], s[8]
        G[13] = np.sqrt(s[1] * s[1] + s[2] * s[2])
        G[14] = s[9]
        G[15] = s[19]
        # The mean, through M: D2 = dL/dM = 2 G M C.
        C[:] = 0.0
        for m in range(3):
            for n in range(3):
                for j in range(3):
                    C[m, n] += R[m, j] * s2[j] * R[n, j]
        j00 = j01 = j02 = j10 = j11 = j12 = 0.0
        for n in range(3):
            v0 = M[0, 0] * C[0, n] + M[0, 1] * C[1, n] + M[0, 2] * C[2, n]
            v1 = M[1, 0] * C[0, n] + M[1, 1] * C[1, n] + M[1, 2] * C[2, n]
            D0 = 2.0 * fx * (g00 * v0 + g01 * v1)
            D1 = 2.0 * fy * (g01 * v0 + g11 * v1)
            j00 += D0 * W[0, n]
            j01 += D0 * W[1, n]
            j02 += D0 * W[2, n]
            j10 += D1 * W[0, n]
            j11 += D1 * W[1, n]
            j12 += D1 * W[2, n]
        # J / diag(f) = D [iz, 0, -nx iz; 0, iz, -ny iz]: through D, and through the matrix on its right.
        p00 = d00 * j00 + d10 * j10
        p02 = d00 * j02 + d10 * j12
        p11, p12 = d01 * j01 + d11 * j11, d01 * j02 + d11 * j12
        gz = -iz * iz * (p00 + p11 - nx * p02 - ny * p12)
        gx = -iz * p02
        gy = -iz * p12
        if model != 0:
            e00 = iz * (j00 - nx * j02)
            e01 = iz * (j01 - ny * j02)
            e10 = iz * (j10 - nx * j12)
            e11 = iz * (j11 - ny * j12)
            _, _, a00, a01, a10, a11 = distort(nx + LENS_STEP, ny, model, coefficients)
            _, _, b00, b01, b10, b11 = distort(nx - LENS_STEP, ny, model, coefficients)
            gx += ((a00 - b00) * e00 + (a01 - b01) * e01 + (a10 - b10) * e10 + (a11 - b11) * e11) / (
                2.0 * LENS_STEP
            )
            _, _, a00, a01, a10, a11 = distort(nx, ny + LENS_STEP, model, coefficients)
            _, _, b00, b01, b10, b11 = distort(nx, ny - LENS_STEP, model, coefficients)
            gy += ((a00 - b00) * e00 + (a01 - b01) * e01 + (a10 - b10) * e10 + (a11 - b11) * e11) / (
                2.0 * LENS_STEP
            )
        free_x = limits[0] < x * iz < limits[1]
        free_y = limits[2] < y * iz < limits[3]
        cx = cy = 0.0
        cz = gz
        if free_x:
            cx += gx * iz
            cz -= gx * x * iz * iz
        if free_y:
            cy += gy * iz
            cz -= gy * y * iz * iz
        # The mean, through its projection, where n is not clamped.
        if not (free_x and free_y):
            _, _, d00, d01, d10, d11 = distort(x * iz, y * iz, model, coefficients)
        for j in range(3):
            px = (W[0, j] - x * iz * W[2, j]) * iz
            py = (W[1, j] - y * iz * W[2, j]) * iz
            P[0, j] = fx * (d00 * px + d01 * py)
            P[1, j] = fy * (d10 * px + d11 * py)
            G[j] = cx * W[0, j] + cy * W[1, j] + cz * W[2, j] + s[1] * P[0, j] + s[2] * P[1, j]
        if directional and terms > 1:
            add_direction(i, dx, dy, dz, s, packed, sh, terms, G)
        at = 0
        for m in range(3):
            for n in range(m, 3):
                H[at] = bilinear(s[11], s[12], s[13], P[0, m], P[1, m], P[0, n], P[1, n])
                at += 1
        for j in range(3):
            kappa[j] = s2[j] * bilinear(K0, K1, K2, k[0, j], k[1, j], k[0, j], k[1, j])
            spread[j] = s2[j] * bilinear(s[11], s[12], s[13], k[0, j], k[1, j], k[0, j], k[1, j])
        for m in range(3):
            for n in range(m, 3):
                H[at] = (
                    s2[m]
                    * s2[n]
                    * quartic(s, k[0, m], k[1, m], k[0, m], k[1, m], k[0, n], k[1, n], k[0, n], k[1, n])
                    + kappa[m] * spread[n]
                    + kappa[n] * spread[m]
                    + kappa[m] * kappa[n] * s[10]
                )
                at += 1
        for j in range(3):
            m = (j + 1) % 3
            n = (j + 2) % 3
            f = s2[m] - s2[n]
            kap = bilinear(K0, K1, K2, k[0, m], k[1, m], k[0, n], k[1, n])
            H[12 + j] = (
                f
                * f
                * (
                    quartic(s, k[0, m], k[1, m], k[0, n], k[1, n], k[0, m], k[1, m], k[0, n], k[1, n])
                    + 2.0 * kap * bilinear(s[11], s[12], s[13], k[0, m], k[1, m], k[0, n], k[1, n])
                    + kap * kap * s[10]
                )
            )
        H[15] = s[10] * (1.0 - o) * (1.0 - o)


@njit(**FAST)
def add_direction(i, dx, dy, dz, s, packed, sh, terms, G):
    """Add the mean's gradient through the viewing direction of its color, by central differences."""
    r = 1.0 / np.sqrt(dx * dx + dy * dy + dz * dz)
    ex, ey, ez = dx * r, dy * r, dz * r
    ahead = np.empty(MAX_TERMS)
    behind = np.empty(MAX_TERMS)
    slope = np.empty(3)
    h = 1e-3
    for axis in range(3):
        ux = h if axis == 0 else 0.0
        uy = h if axis == 1 else 0.0
        uz = h if axis == 2 else 0.0
        harmonics_at(ex + ux, ey + uy, ez + uz, terms, ahead)
        harmonics_at(ex - ux, ey - uy, ez - uz, terms, behind)
        total = 0.0
        for ch in range(3):
            if packed[i, 6 + ch] > 0.0:
                part = 0.0
                for j in range(terms):
                    part += (ahead[j] - behind[j]) * sh[i, j, ch]
                total += part * s[6 + ch]
        slope[axis] = total / (2.0 * h)
    along = slope[0] * ex + slope[1] * ey + slope[2] * ez
    G[0] += r * (slope[0] - along * ex)
    G[1] += r * (slope[1] - along * ey)
    G[2] += r * (slope[2] - along * ez)


@parallel_njit(lambda log_scales, *_: len(log_scales), **FAST)
def build_covariances(begin, end, log_scales, quaternions, logits, covariances, opacities):
    """Write covariances [N,6] and opacities [N] of the parameters."""
    R = np.empty((3, 3), nb.float32)
    for i in range(begin, end):
        w, a, b, c = quaternions[i, 0], quaternions[i, 1], quaternions[i, 2], quaternions[i, 3]
        R[0, 0] = 1.0 - 2.0 * (b * b + c * c)
        R[0, 1] = 2.0 * (a * b - w * c)
        R[0, 2] = 2.0 * (a * c + w * b)
        R[1, 0] = 2.0 * (a * b + w * c)
        R[1, 1] = 1.0 - 2.0 * (a * a + c * c)
        R[1, 2] = 2.0 * (b * c - w * a)
        R[2, 0] = 2.0 * (a * c - w * b)
        R[2, 1] = 2.0 * (b * c + w * a)
        R[2, 2] = 1.0 - 2.0 * (a * a + b * b)
        at = 0
        for m in range(3):
            for n in range(m, 3):
                total = 0.0
                for j in range(3):
                    total += R[m, j] * R[n, j] * np.exp(2.0 * log_scales[i, j])
                covariances[i, at] = total
                at += 1
        opacities[i] = 1.0 / (1.0 + np.exp(-logits[i]))
