"""Splats and the Jacobians of a map: which of them it reaches, and their covariances after it (Numba).

Notation: J is d(deformed)/d(canonical) at a splat's mean, J = R S its polar decomposition, A = diag(s) along
the splat's axes, so that its covariance is Q A^2 Q^T, Q the rotation of its quaternion. The map's affine part
takes it to (J Q A)(J Q A)^T.

The oracle is `cagefield.rendering.splats.reference_raster_splats`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cagefield.compute.numba_cache import njit
from cagefield.compute.parallel_kernels import parallel_njit

PLAIN: dict[str, Any] = {"error_model": "numpy", "cache": True}
"""Options of every kernel: rounding matters to covariances of flat splats, so no `fastmath`."""

ROUNDING = 2e-7
"""Increment of the variances, as a share of the largest one: above the float32 rounding error of the
smallest,
so that the covariance of a flat splat stays positive."""


@parallel_njit(lambda points, *_: len(points), **PLAIN)
def in_boxes(begin, end, points, boxes, inside):
    """Writes which points [N,3] lie in one of the boxes [B,2,3]."""
    for n in range(begin, end):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        found = False
        for b in range(len(boxes)):
            found |= (
                boxes[b, 0, 0] <= x <= boxes[b, 1, 0]
                and boxes[b, 0, 1] <= y <= boxes[b, 1, 1]
                and boxes[b, 0, 2] <= z <= boxes[b, 1, 2]
            )
        inside[n] = found


@njit(inline="always", **PLAIN)
def reaches(x, y, z, log_scales, n, stretch, low, high, reach, least):
    """Whether splat n at (x, y, z) is wider than `least`, and nearer to a box than `reach` of its width."""
    width = stretch * np.exp(float(max(log_scales[n, 0], log_scales[n, 1], log_scales[n, 2])))
    r = reach * width
    found = low[0] - r <= x <= high[0] + r
    found &= low[1] - r <= y <= high[1] + r
    found &= low[2] - r <= z <= high[2] + r
    return found and width > least


@parallel_njit(lambda points, *_: len(points), **PLAIN)
def within_reach(begin, end, points, numbers, log_scales, low, high, reach, least, stretch, found):
    """Writes which points [M,3] an edit in a box may bend or cut: splats `numbers` [M], stretched [M]."""
    for m in range(begin, end):
        x, y, z = points[m, 0], points[m, 1], points[m, 2]
        found[m] = reaches(x, y, z, log_scales, numbers[m], stretch[m], low, high, reach, least)


@parallel_njit(lambda means, *_: len(means), **PLAIN)
def within_reach_at_rest(begin, end, means, left, log_scales, low, high, reach, least, stretch, found):
    """Mark splats [N] within reach at their canonical positions, except those that have left them."""
    for n in range(begin, end):
        x, y, z = float(means[n, 0]), float(means[n, 1]), float(means[n, 2])
        found[n] = not left[n] and reaches(x, y, z, log_scales, n, stretch, low, high, reach, least)


@parallel_njit(lambda points, *_: len(points), **PLAIN)
def changes(begin, end, points, ends, jacobian, moves):
    """Writes which points [M,3] end elsewhere, or have a Jacobian [M,3,3] that is not 1."""
    for m in range(begin, end):
        same = True
        for a in range(3):
            same &= points[m, a] == ends[m, a]
            for b in range(3):
                same &= jacobian[m, a, b] == (1.0 if a == b else 0.0)
        moves[m] = not same


@parallel_njit(lambda values, rows, out: len(rows), **PLAIN)
def gather(begin, end, values, rows, out):
    """Writes the rows of values [N,K] into out [M,K]."""
    for m in range(begin, end):
        n = rows[m]
        for k in range(values.shape[1]):
            out[m, k] = values[n, k]


@parallel_njit(lambda values, rows, out: len(rows), **PLAIN)
def scatter(begin, end, values, rows, out):
    """Writes values [M,K] into the rows of out [N,K]; no row occurs twice."""
    for m in range(begin, end):
        n = rows[m]
        for k in range(values.shape[1]):
            out[n, k] = values[m, k]


@njit(**PLAIN)
def polar_rotation(J, R):
    """Writes R of J = R S, by Newton's method X <- (g X + X^-T / g) / 2 from J; 1 for a singular J.

    Source: Higham, "Computing the polar decomposition, with applications" (1986), equations 3.5 to 3.8.
    """
    for i in range(3):
        for j in range(3):
            R[i, j] = J[i, j]
    for _ in range(24):
        a, b, c = R[0, 0], R[0, 1], R[0, 2]
        d, e, f = R[1, 0], R[1, 1], R[1, 2]
        g, h, k = R[2, 0], R[2, 1], R[2, 2]
        c00, c01, c02 = e * k - f * h, f * g - d * k, d * h - e * g
        c10, c11, c12 = c * h - b * k, a * k - c * g, b * g - a * h
        c20, c21, c22 = b * f - c * e, c * d - a * f, a * e - b * d
        det = a * c00 + b * c01 + c * c02
        size = a * a + b * b + c * c + d * d + e * e + f * f + g * g + h * h + k * k
        if abs(det) <= 1e-30 * size * np.sqrt(size):
            for i in range(3):
                for j in range(3):
                    R[i, j] = 1.0 if i == j else 0.0
            return
        cofactors = c00 * c00 + c01 * c01 + c02 * c02 + c10 * c10 + c11 * c11 + c12 * c12
        cofactors += c20 * c20 + c21 * c21 + c22 * c22
        scale = np.sqrt(np.sqrt(cofactors / (det * det * size)))
        p, q = 0.5 * scale, 0.5 / (scale * det)
        change = 0.0
        for i in range(3):
            for j in range(3):
                if i == 0:
                    inverse = c00 if j == 0 else (c01 if j == 1 else c02)
                elif i == 1:
                    inverse = c10 if j == 0 else (c11 if j == 1 else c12)
                else:
                    inverse = c20 if j == 0 else (c21 if j == 1 else c22)
                value = p * R[i, j] + q * inverse
                change = max(change, abs(value - R[i, j]))
                R[i, j] = value
        # The convergence is quadratic: the next step would change less than the rounding of float64.
        if change < 1e-8:
            return


@parallel_njit(lambda source, *_: len(source), **PLAIN)
def deform(begin, end, source, jacobian, quaternions, log_scales, covariances, rotations, growth):
    """Write the deformation by J [M,3,3] of the splats with indices `source` [M].

    covariances [M,6] float32 (xx, xy, xz, yy, yz, zz); rotations [M,3,3] float32, R; growth [M],
    |det J|^(1/3).
    """
    Q, A = np.empty((3, 3)), np.empty((3, 3))
    for m in range(begin, end):
        n = source[m]
        J = jacobian[m]
        w, x, y, z = (
            float(quaternions[n, 0]),
            float(quaternions[n, 1]),
            float(quaternions[n, 2]),
            float(quaternions[n, 3]),
        )
        Q[0, 0], Q[0, 1], Q[0, 2] = (
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - w * z),
            2.0 * (x * z + w * y),
        )
        Q[1, 0], Q[1, 1], Q[1, 2] = (
            2.0 * (x * y + w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - w * x),
        )
        Q[2, 0], Q[2, 1], Q[2, 2] = (
            2.0 * (x * z - w * y),
            2.0 * (y * z + w * x),
            1.0 - 2.0 * (x * x + y * y),
        )
        for j in range(3):
            s = np.exp(float(log_scales[n, j]))
            for i in range(3):
                A[i, j] = s * (J[i, 0] * Q[0, j] + J[i, 1] * Q[1, j] + J[i, 2] * Q[2, j])
        xx = A[0, 0] ** 2 + A[0, 1] ** 2 + A[0, 2] ** 2
        yy = A[1, 0] ** 2 + A[1, 1] ** 2 + A[1, 2] ** 2
        zz = A[2, 0] ** 2 + A[2, 1] ** 2 + A[2, 2] ** 2
        slack = ROUNDING * max(xx, yy, zz)
        covariances[m, 0] = xx + slack
        covariances[m, 1] = A[0, 0] * A[1, 0] + A[0, 1] * A[1, 1] + A[0, 2] * A[1, 2]
        covariances[m, 2] = A[0, 0] * A[2, 0] + A[0, 1] * A[2, 1] + A[0, 2] * A[2, 2]
        covariances[m, 3] = yy + slack
        covariances[m, 4] = A[1, 0] * A[2, 0] + A[1, 1] * A[2, 1] + A[1, 2] * A[2, 2]
        covariances[m, 5] = zz + slack
        det = (
            J[0, 0] * (J[1, 1] * J[2, 2] - J[1, 2] * J[2, 1])
            - J[0, 1] * (J[1, 0] * J[2, 2] - J[1, 2] * J[2, 0])
            + J[0, 2] * (J[1, 0] * J[2, 1] - J[1, 1] * J[2, 0])
        )
        growth[m] = abs(det) ** (1.0 / 3.0)
        polar_rotation(J, Q)
        for i in range(3):
            for j in range(3):
                rotations[m, i, j] = Q[i, j]


@parallel_njit(lambda jacobian, before: len(jacobian), **PLAIN)
def times(begin, end, jacobian, before):
    """Writes J J_0 into J [M,3,3], for J_0 [M,3,3] of the maps before."""
    for m in range(begin, end):
        for i in range(3):
            a, b, c = jacobian[m, i, 0], jacobian[m, i, 1], jacobian[m, i, 2]
            for j in range(3):
                jacobian[m, i, j] = a * before[m, 0, j] + b * before[m, 1, j] + c * before[m, 2, j]
