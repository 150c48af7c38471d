"""Numba kernels: the proof of a lattice shell's correction, patch by patch of the cage's faces.

Notation: see `correction_proof` and `correction_bounds`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from benchmarks.correction_bounds import determinant, flow_bound, largest_singular, norm
from cagefield.warps.kernels.lattice_flow import _inverse, lattice_point

SPARE = 1e-6
"""Least distance of a proven matrix from a singular one; rounding, which is not counted, is below 1e-9."""


@njit(error_model="numpy")
def fade_range(low, high, heights, near, far, gradient, grad_radius, rho, drho):
    """Writes rho [2] (middle, half-width) and its gradient drho [2,3] over a box; False where it is all out.

    low, high [3]: the box in z; near, far: bounds of d_i; gradient, grad_radius [3]: of dd_i/dz.
    """
    q_lo, q_hi, z_lo, z_hi = drho[2], drho[3], drho[4], drho[5]
    total_lo, total_hi = 0.0, 0.0
    for i in range(3):
        first, last = max(low[i], -1.0), min(high[i], 1.0)
        if first > last:
            return False
        z_lo[i], z_hi[i] = first, last
        most = 1.0 if first * last <= 0.0 else 1.0 - min(first * first, last * last)
        least = 1.0 - max(first * first, last * last)
        q_lo[i] = (0.5 * heights[i] * max(most, 1e-30)) ** -4.0
        q_hi[i] = (0.5 * heights[i] * max(least, 1e-30)) ** -4.0
        total_lo += q_lo[i]
        total_hi += q_hi[i]
    do_lo, do_hi = total_hi**-0.25, total_lo**-0.25
    g_lo, g_hi = do_lo / (far + do_lo), do_hi / max(near + do_hi, 1e-300)
    r_lo, r_hi = g_lo * g_lo * (3.0 - 2.0 * g_lo), g_hi * g_hi * (3.0 - 2.0 * g_hi)
    rho[0], rho[1] = 0.5 * (r_hi + r_lo), 0.5 * (r_hi - r_lo)
    # 6 g (1 - g) / (d_i + d_o) of the two gradients' mean: s (1 - g) dd_o - s g dd_i
    f_lo, f_hi = min(g_lo * (1.0 - g_lo), g_hi * (1.0 - g_hi)), max(g_lo * (1.0 - g_lo), g_hi * (1.0 - g_hi))
    if g_lo <= 0.5 <= g_hi:
        f_hi = 0.25
    s_lo, s_hi = 6.0 * f_lo / (far + do_hi), 6.0 * f_hi / (near + do_lo)
    o_lo, o_hi, i_lo, i_hi = s_lo * (1.0 - g_hi), s_hi * (1.0 - g_lo), s_lo * g_lo, s_hi * g_hi
    for i in range(3):
        others_lo, others_hi = total_lo - q_lo[i], total_hi - q_hi[i]
        p_lo = (q_lo[i] / (q_lo[i] + others_hi)) ** 1.25
        p_hi = (q_hi[i] / (q_hi[i] + others_lo)) ** 1.25
        # dd_o/dz_i = -p heights_i z_i
        a_lo = min(p_lo * z_lo[i], p_hi * z_lo[i]) * heights[i]
        a_hi = max(p_lo * z_hi[i], p_hi * z_hi[i]) * heights[i]
        x_lo, x_hi = min(-a_hi * o_lo, -a_hi * o_hi), max(-a_lo * o_lo, -a_lo * o_hi)
        y_lo, y_hi = gradient[i] - grad_radius[i], gradient[i] + grad_radius[i]
        w_lo, w_hi = min(y_lo * i_lo, y_lo * i_hi), max(y_hi * i_lo, y_hi * i_hi)
        lo, hi = x_lo - w_hi, x_hi - w_lo
        drho[0, i], drho[1, i] = 0.5 * (lo + hi), 0.5 * (hi - lo)
    return True


@njit(error_model="numpy")
def _bends(P, linear, weights, a, b, c, bends):
    """Writes bounds of |x_bb|, |x_bc|, |x_cc| in one cell of the face across axis a of padded points P.

    Second derivatives of a spline are means of its second differences. weights [3,9]: see `_spline_weights`.
    """
    first, last = (1, 3) if linear else (0, 4)
    nb, nc = P.shape[2 - b] - 3, P.shape[2 - c] - 3
    net = np.zeros((4, 4, 3))
    at = np.empty(3, np.int64)
    for i in range(first, last):
        at[a] = int(weights[a, 8]) + i
        for j in range(first, last):
            at[b] = int(weights[b, 8]) + j
            for k in range(first, last):
                at[c] = int(weights[c, 8]) + k
                for n in range(3):
                    net[j, k, n] += weights[a, i] * P[at[2], at[1], at[0], n]
    bb, bc, cc = 0.0, 0.0, 0.0
    for j in range(first, last):
        for k in range(first, last):
            if j + 1 < last and k + 1 < last:
                total = 0.0
                for n in range(3):
                    d = net[j + 1, k + 1, n] - net[j + 1, k, n] - net[j, k + 1, n] + net[j, k, n]
                    total += d * d
                bc = max(bc, total)
            if j + 2 < last:
                total = 0.0
                for n in range(3):
                    d = net[j + 2, k, n] - 2.0 * net[j + 1, k, n] + net[j, k, n]
                    total += d * d
                bb = max(bb, total)
            if k + 2 < last:
                total = 0.0
                for n in range(3):
                    d = net[j, k + 2, n] - 2.0 * net[j, k + 1, n] + net[j, k, n]
                    total += d * d
                cc = max(cc, total)
    bends[0], bends[1], bends[2] = np.sqrt(bb) * nb * nb, np.sqrt(bc) * nb * nc, np.sqrt(cc) * nc * nc


@njit(error_model="numpy")
def _is_regular(D, r, r_radius, D_spread, W, rho, drho, M):
    """Whether 1 + rho D W + r drho^T stays regular: D [3,2] +- D_spread, W [2,3], r [3] +- r_radius [3]."""
    most_W = 0.0
    for i in range(3):
        for j in range(3):
            M[i, j] = D[i, 0] * W[0, j] + D[i, 1] * W[1, j]
    for j in range(2):
        most_W += W[j, 0] * W[j, 0] + W[j, 1] * W[j, 1] + W[j, 2] * W[j, 2]
    error = rho[1] * norm(M, 3, 3) + (rho[0] + rho[1]) * D_spread * np.sqrt(most_W)
    size, tilt, grad, away = 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        size += r[i] * r[i]
        away += r_radius[i] * r_radius[i]
        tilt += drho[1, i] * drho[1, i]
        grad += (abs(drho[0, i]) + drho[1, i]) ** 2
        for j in range(3):
            M[i, j] = rho[0] * M[i, j] + r[i] * drho[0, j]
        M[i, i] += 1.0
    error += np.sqrt(size * tilt) + np.sqrt(away * grad)
    if determinant(M) <= 0.0:
        return False
    return np.sqrt(max(largest_singular(M)[1], 0.0)) > error + SPARE


@njit(error_model="numpy")
def _beyond(count, place, frames, D, r, r_radius, D_spread, W2, boxes, work):
    """Whether the correction is proven regular in all of the outer cage beyond a patch.

    count: axes beyond the cage, 1 (face), 2 (edge) or 3 (corner); place: axes [3], those first, sides [3], -1
    or 1, center and extent [3], the patch's box in z; frames: F, its inverse, A and heights of `prove`; boxes
    [n,6]: room for boxes (s, beta, gamma) of the cones.
    """
    axes, sides, center, extent = place
    F, W, A, heights = frames
    o, gradient, grad_radius, low, high, rho = work[0], work[1], work[2], work[3], work[4], work[5]
    drho, M = work[6:12], work[12:15]
    patch = extent[0] + extent[1] + extent[2]
    for main in range(count):
        top = 0
        reach = 0.0
        for i in range(3):
            reach += F[i, axes[main]] * F[i, axes[main]]
        reach = 3.5 / np.sqrt(reach)  # longer than the outer cage is wide
        boxes[0, 0], boxes[0, 1], boxes[0, 2], boxes[0, 3] = 0.0, reach, 0.0, 1.0
        boxes[0, 4], boxes[0, 5] = 0.0, 1.0
        while top >= 0:
            s0, s1, b0, b1, c0, c1 = boxes[top]
            top -= 1
            if count < 2:
                b0, b1 = 0.0, 0.0
            if count < 3:
                c0, c1 = 0.0, 0.0
            aa = axes[main]
            ab, ac = axes[(main + 1) % count], axes[(main + 2) % count]
            spread_b, spread_c, length = 0.0, 0.0, 0.0
            for i in range(3):
                o[i] = sides[aa] * A[i, aa]
                if count > 1:
                    o[i] += 0.5 * (b0 + b1) * sides[ab] * A[i, ab]
                    spread_b += A[i, ab] * A[i, ab]
                if count > 2:
                    o[i] += 0.5 * (c0 + c1) * sides[ac] * A[i, ac]
                    spread_c += A[i, ac] * A[i, ac]
                length += o[i] * o[i]
                low[i], high[i] = center[i] - extent[i], center[i] + extent[i]
                x = sides[aa] * F[i, aa]
                low[i] += min(s0 * x, s1 * x)
                high[i] += max(s0 * x, s1 * x)
                if count > 1:
                    x = sides[ab] * F[i, ab]
                    low[i] += min(s0 * b0 * x, s1 * b1 * x)
                    high[i] += max(s0 * b0 * x, s1 * b1 * x)
                if count > 2:
                    x = sides[ac] * F[i, ac]
                    low[i] += min(s0 * c0 * x, s1 * c1 * x)
                    high[i] += max(s0 * c0 * x, s1 * c1 * x)
            length = np.sqrt(length)
            away = 0.5 * ((b1 - b0) * np.sqrt(spread_b) + (c1 - c0) * np.sqrt(spread_c))
            x = away / length
            chord = x / np.sqrt(0.5 * (1.0 + np.sqrt(max(1.0 - x * x, 0.0)))) if x < 1.0 else 2.0
            for i in range(3):
                gradient[i], grad_radius[i] = 0.0, 0.0
            for n in range(count):
                a = axes[n]
                along, size = 0.0, 0.0
                for i in range(3):
                    along += o[i] * A[i, a] / length
                    size += A[i, a] * A[i, a]
                for i in range(3):
                    gradient[i] += along * W[a, i]
                    grad_radius[i] += chord * np.sqrt(size) * abs(W[a, i])
            near, far = s0 * max(length - away, 0.0), s1 * (length + away)
            if not fade_range(low, high, heights, near, far, gradient, grad_radius, rho, drho):
                continue
            if _is_regular(D, r, r_radius, D_spread, W2, rho, drho, M):
                continue
            # Halve the direction or the distance; a box much shorter than its patch is hopeless.
            deep = 0.0
            for i in range(3):
                deep += abs(F[i, aa])
            deep *= s1 - s0
            if top + 2 >= len(boxes) or deep < 0.12 * patch + 1e-3:
                return False
            wide_b, wide_c = (b1 - b0) * s1, (c1 - c0) * s1
            top += 1
            boxes[top] = s0, s1, b0, b1, c0, c1
            boxes[top + 1] = s0, s1, b0, b1, c0, c1
            if max(b1 - b0, c1 - c0) * 1.0 > 0.26 or max(wide_b, wide_c) > s1 - s0:
                if b1 - b0 >= c1 - c0:
                    boxes[top, 3] = boxes[top + 1, 2] = 0.5 * (b0 + b1)
                else:
                    boxes[top, 5] = boxes[top + 1, 4] = 0.5 * (c0 + c1)
            else:
                boxes[top, 1] = boxes[top + 1, 0] = 0.5 * (s0 + s1)
            top += 1
    return True


@njit(error_model="numpy")
def prove(P, linear, grids, steps, z0, F, A, heights, patches, least, most, left):
    """(evaluations, patches left open): all are proven where none is left.

    P: padded control points in z; z0 [3], F [3,3]: z = z0 + F u of the canonical cage; A [3,3]: dx/du;
    patches [n,7]: axis, side (0 or 1), kind (0 face, 1 edge, 2 corner), and the range of u along the two
    other axes; an open patch is halved until it is shorter than `least`, with `most` evaluations at most;
    left [m,7]: room for the patches that are left, of which more are counted, not written.
    """
    W = np.empty((3, 3))
    _inverse(F, W)
    work, boxes, weights = np.zeros((60, 3)), np.empty((64, 6)), np.empty((3, 9))
    stack = np.empty((len(patches) + 64, 7))
    stack[: len(patches)] = patches
    top, done, open_ = len(patches) - 1, 0, 0
    x, u, center, extent, r, r_radius = work[0], work[1], work[2], work[3], work[4], work[5]
    bends, sides = work[6], work[7]
    J, K, W2 = work[8:11], work[11:14], np.zeros((2, 3))
    axes = np.empty(3, np.int64)
    while top >= 0:
        a, kind = int(stack[top, 0]), int(stack[top, 2])
        side, b0, b1, c0, c1 = stack[top, 1], stack[top, 3], stack[top, 4], stack[top, 5], stack[top, 6]
        top -= 1
        if done >= most:
            if open_ < len(left):
                left[open_] = stack[top + 1]
            open_ += 1
            continue
        done += 1
        b, c = (a + 1) % 3, (a + 2) % 3
        axes[0], axes[1], axes[2] = a, b, c
        u[a], u[b], u[c] = side, 0.5 * (b0 + b1), 0.5 * (c0 + c1)
        for n in range(3):
            sides[n] = 1.0 if u[n] > 0.5 else -1.0
        lattice_point(P, linear, u, x, J, weights)
        _bends(P, linear, weights, a, b, c, bends)
        size_b, size_c = 0.0, 0.0
        for i in range(3):
            size_b += F[i, b] * F[i, b]
            size_c += F[i, c] * F[i, c]
        size_b, size_c = np.sqrt(size_b), np.sqrt(size_c)
        hb, hc = 0.5 * (b1 - b0), 0.5 * (c1 - c0)
        spread_b = (bends[0] * hb + bends[1] * hc) / size_b
        spread_c = (bends[1] * hb + bends[2] * hc) / size_c
        free_b, free_c = 1.0 if kind == 0 else 0.0, 1.0 if kind < 2 else 0.0
        for i in range(3):
            K[i, 0], K[i, 1] = free_b * J[i, b] / size_b, free_c * J[i, c] / size_c
            W2[0, i], W2[1, i] = free_b * size_b * W[b, i], free_c * size_c * W[c, i]
            center[i] = z0[i] + F[i, 0] * u[0] + F[i, 1] * u[1] + F[i, 2] * u[2]
            extent[i] = abs(F[i, b]) * hb + abs(F[i, c]) * hc
        spread = np.sqrt(free_b * spread_b * spread_b + free_c * spread_c * spread_c)
        lb, lc = hb * size_b, hc * size_c
        spread, found = flow_bound(grids, steps, x, K, spread, lb, lc, work[14:44])
        if found:
            for i in range(3):
                r[i] = x[i] - center[i]
                K[i, 0] -= free_b * F[i, b] / size_b
                K[i, 1] -= free_c * F[i, c] / size_c
                r_radius[i] = abs(K[i, 0]) * lb + abs(K[i, 1]) * lc + spread * np.sqrt(lb * lb + lc * lc)
            place, frames = (axes, sides, center, extent), (F, W, A, heights)
            found = _beyond(kind + 1, place, frames, K, r, r_radius, spread, W2, boxes, work[44:60])
        if found:
            continue
        if kind == 2 or top + 3 >= len(stack) or max(lb, lc) < least:
            if open_ < len(left):
                row = left[open_]
                row[0], row[1], row[2], row[3], row[4], row[5], row[6] = a, side, kind, b0, b1, c0, c1
            open_ += 1
            continue
        top += 1
        for n in range(2):
            row = stack[top + n]
            row[0], row[1], row[2], row[3], row[4], row[5], row[6] = a, side, kind, b0, b1, c0, c1
        if lb >= lc:
            stack[top, 4] = stack[top + 1, 3] = 0.5 * (b0 + b1)
        else:
            stack[top, 6] = stack[top + 1, 5] = 0.5 * (c0 + c1)
        top += 1
    return done, open_
