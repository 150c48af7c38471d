"""Sorted splats blended in tiles of 16 x 16 pixels, and the gradients of it by hand (Numba).

Notation: at a pixel, splat k (near to far) has alpha a_k = o exp(-d^T Q d / 2), d the pixel minus the
projected mean, d^T Q d = A (x + k y)^2 + D y^2. With T_k the product of (1 - a_j) over the nearer ones and
w_k = a_k T_k, the pixel's color is sum_k w_k c_k + T b, b the background.

One flat loop over the pixels of the rows that a splat reaches vectorizes: state lies in one buffer at
constant offsets, exp is a polynomial, and there are selections in place of branches. A tile is left once all
its pixels let less than T_MIN through. Gradients go front to back too: the color behind splat k is the
pixel's
color less the accumulated one. Each (tile, splat) pair writes its own sums; no two write to one place.

The oracle is `cagefield.rendering.splats.reference_rasterizer.blend`.

Source: Kerbl et al. (2023), equations 2 and 3; Zwicker et al. (2002).
"""

from __future__ import annotations

import numba as nb
import numpy as np

from cagefield.compute.numba_cache import FAST, njit
from cagefield.compute.parallel_kernels import parallel_njit
from cagefield.rendering.splats.kernels.projection import ALPHA_MAX, ALPHA_MIN, AREA, TILE_PX

F, U = np.float32, np.uint64
LEAST, MOST = F(ALPHA_MIN), F(ALPHA_MAX)
ZERO, ONE, HALF, MINUS_16TH = F(0), F(1), F(0.5), F(-1 / 16)
T_MIN = F(1e-3)
Q_MAX = F(16)
"""Larger values of the quadratic form are this: alpha is then below ALPHA_MIN whatever the opacity."""
E1, E2, E3, E4, E5 = F(0.99997018), F(0.49960978), F(0.16494888), F(0.03824679), F(0.00505834)
"""Of the polynomial 1 + E1 x + ... that has the least largest relative error to exp(x) on [-1, 0]: 8e-7."""
ROW1, ROW2, ROW3, ROW4, ROW5, ROW6, ROW7, ROW8, ROW9, ROW10, ROW11 = (U(AREA * k) for k in range(1, 12))
ROWS = 12
X, Y = ROW8, ROW9
"""Where the pixels' own coordinates lie in a tile's state."""

SUMS = 20
"""Floats a pair's sums have. With v = alpha dL/dalpha, e = Q d, g = dL/dC, h_k = |J_k| sum_j |J_j|, J = alpha
dC/dalpha:
0 v, 1-2 v e, 3-5 v e e^T, 6-8 w g, 9 w, 10 h, 11-13 h e e^T, 14-18 h e e e e (xxxx xxxy xxyy xyyy yyyy),
19 w |g|^2. Where a splat lies in space that is known to be empty, 0 is greater by alpha times a
cost: such a splat fades, it does not move to where nobody looks."""


@njit(inline="always", **FAST)
def falloff(q):
    """exp(-q/2) for q in [0, Q_MAX], to 1e-5 of it: a polynomial of -q/16, squared three times."""
    x = min(q, Q_MAX) * MINUS_16TH
    y = ONE + x * (E1 + x * (E2 + x * (E3 + x * (E4 + x * E5))))
    y = y * y
    y = y * y
    return y * y


@njit(inline="always", **FAST)
def rows_of(p, y0):
    """The pixels of a tile, first and end, in the rows that a packed splat reaches."""
    low = int(np.ceil(p[1] - p[9])) - y0
    high = int(np.floor(p[1] + p[9])) + 1 - y0
    return U(max(0, low) * TILE_PX), U(max(0, min(TILE_PX, high)) * TILE_PX)


@njit(inline="always", **FAST)
def coordinates(state):
    """Writes the pixels' coordinates into a tile's state."""
    for i in range(AREA):
        state[X + U(i)] = F(i % TILE_PX)
        state[Y + U(i)] = F(i // TILE_PX)


@njit(**FAST)
def blend_tile(state, packed, ids, begin, end, x0, y0, with_depth):
    """Rows of the state: 0 T, 1-3 color, 4 depth times weight. Returns where the tile was left."""
    for i in range(AREA):
        state[i] = ONE
    for i in range(AREA, 5 * AREA):
        state[i] = ZERO
    for e in range(begin, end):
        p = packed[ids[e]]
        mx, my = p[0] - F(x0), p[1] - F(y0)
        A, k, D, o, r, g, b = p[2], p[3], p[4], p[5], p[6], p[7], p[8]
        low, high = rows_of(p, y0)
        if with_depth:
            t, tx, ty = p[10], p[11], p[12]
            for i in range(low, high):
                dx = state[X + i] - mx
                dy = state[Y + i] - my
                l = dx + k * dy
                q = A * l * l + D * dy * dy
                a = min(o * falloff(q), MOST)
                a = a if a >= LEAST else ZERO
                w = a * state[i]
                state[ROW1 + i] += w * r
                state[ROW2 + i] += w * g
                state[ROW3 + i] += w * b
                state[ROW4 + i] += w * (t + tx * dx + ty * dy)
                state[i] -= w
        else:
            for i in range(low, high):
                dx = state[X + i] - mx
                dy = state[Y + i] - my
                l = dx + k * dy
                q = A * l * l + D * dy * dy
                a = min(o * falloff(q), MOST)
                a = a if a >= LEAST else ZERO
                w = a * state[i]
                state[ROW1 + i] += w * r
                state[ROW2 + i] += w * g
                state[ROW3 + i] += w * b
                state[i] -= w
        if (e - begin) & 7 == 7:
            most = ZERO
            for i in range(AREA):
                most = max(most, state[i])
            if most < T_MIN:
                return e + 1
    return end


@njit(**FAST)
def blend_normals_tile(state, packed, ids, begin, end, x0, y0):
    """Rows of the state: 0 T, 1-3 normals times weight."""
    for i in range(AREA):
        state[i] = ONE
    for i in range(AREA, 4 * AREA):
        state[i] = ZERO
    for e in range(begin, end):
        p = packed[ids[e]]
        mx, my = p[0] - F(x0), p[1] - F(y0)
        A, k, D, o, r, g, b = p[2], p[3], p[4], p[5], p[13], p[14], p[15]
        low, high = rows_of(p, y0)
        for i in range(low, high):
            dx = state[X + i] - mx
            dy = state[Y + i] - my
            l = dx + k * dy
            q = A * l * l + D * dy * dy
            a = min(o * falloff(q), MOST)
            a = a if a >= LEAST else ZERO
            w = a * state[i]
            state[ROW1 + i] += w * r
            state[ROW2 + i] += w * g
            state[ROW3 + i] += w * b
            state[i] -= w


@parallel_njit(lambda packed, ids, starts, *_: starts.size - 1, **FAST)
def blend(begin, end, packed, ids, starts, across, channels, stops, out):
    """Blends all tiles into out [tiles, channels, AREA]: T, color (3), depth (of 5), normals (of 8)."""
    state = np.empty(ROWS * AREA, nb.float32)
    for t in range(begin, end):
        coordinates(state)
        x0, y0 = (t % across) * TILE_PX, (t // across) * TILE_PX
        stop = blend_tile(state, packed, ids, starts[t], starts[t + 1], x0, y0, channels > 4)
        stops[t] = stop
        for ch in range(min(channels, 5)):
            for i in range(AREA):
                out[t, ch, i] = state[ch * AREA + i]
        if channels > 5:
            blend_normals_tile(state, packed, ids, starts[t], stop, x0, y0)
            for ch in range(3):
                for i in range(AREA):
                    out[t, 5 + ch, i] = state[(ch + 1) * AREA + i]


@njit(**FAST)
def influence_tile(state, packed, ids, begin, end, x0, y0):
    """Adds up |alpha dC/dalpha| of a tile's splats in row 7; uses up rows 0 (T) and 4-6 (color to come)."""
    for e in range(begin, end):
        p = packed[ids[e]]
        mx, my = p[0] - F(x0), p[1] - F(y0)
        A, k, D, o, r, g, b = p[2], p[3], p[4], p[5], p[6], p[7], p[8]
        low, high = rows_of(p, y0)
        for i in range(low, high):
            dx = state[X + i] - mx
            dy = state[Y + i] - my
            l = dx + k * dy
            a = min(o * falloff(A * l * l + D * dy * dy), MOST)
            a = a if a >= LEAST else ZERO
            w = a * state[i]
            rr = state[ROW4 + i] - w * r
            rg = state[ROW5 + i] - w * g
            rb = state[ROW6 + i] - w * b
            state[ROW4 + i] = rr
            state[ROW5 + i] = rg
            state[ROW6 + i] = rb
            state[i] -= w
            q = a / (ONE - a)
            jr = w * r - q * rr
            jg = w * g - q * rg
            jb = w * b - q * rb
            state[ROW7 + i] += np.sqrt(jr * jr + jg * jg + jb * jb)


@njit(**FAST)
def gradient_tile(state, packed, ids, begin, end, x0, y0, sums):
    """Sums of a tile's pairs.

    Rows of the state: 0 T, 1-3 dL/dC, 4-6 color to come, background too, 7 influence, 10 distance that is
    empty, 11 cost of an alpha there.
    """
    for e in range(begin, end):
        p = packed[ids[e]]
        mx, my = p[0] - F(x0), p[1] - F(y0)
        A, k, D, o, r, g, b = p[2], p[3], p[4], p[5], p[6], p[7], p[8]
        t, tx, ty = p[10], p[11], p[12]
        low, high = rows_of(p, y0)
        s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = s8 = s9 = s19 = ZERO
        h0 = h1 = h2 = h3 = h4 = h5 = h6 = h7 = h8 = ZERO
        for i in range(low, high):
            dx = state[X + i] - mx
            dy = state[Y + i] - my
            l = dx + k * dy
            ex = A * l
            f = D * dy
            ey = k * ex + f
            full = o * falloff(l * ex + dy * f)
            a = min(full, MOST)
            a = a if a >= LEAST else ZERO
            T = state[i]
            w = a * T
            gr, gg, gb = state[ROW1 + i], state[ROW2 + i], state[ROW3 + i]
            rr = state[ROW4 + i] - w * r
            rg = state[ROW5 + i] - w * g
            rb = state[ROW6 + i] - w * b
            state[ROW4 + i] = rr
            state[ROW5 + i] = rg
            state[ROW6 + i] = rb
            state[i] = T - w
            q = a / (ONE - a)
            free = ONE if full <= MOST else ZERO
            jr = free * (w * r - q * rr)
            jg = free * (w * g - q * rg)
            jb = free * (w * b - q * rb)
            v = jr * gr + jg * gg + jb * gb
            h = np.sqrt(jr * jr + jg * jg + jb * jb) * state[ROW7 + i]
            vx = v * ex
            vy = v * ey
            s0 += v + state[ROW11 + i] * (a if t + tx * dx + ty * dy < state[ROW10 + i] else ZERO)
            s1 += vx
            s2 += vy
            s3 += vx * ex
            s4 += vx * ey
            s5 += vy * ey
            s6 += w * gr
            s7 += w * gg
            s8 += w * gb
            s9 += w
            s19 += w * (gr * gr + gg * gg + gb * gb)
            xx, xy, yy = ex * ex, ex * ey, ey * ey
            hx, hy = h * xx, h * yy
            h0 += h
            h1 += hx
            h2 += h * xy
            h3 += hy
            h4 += hx * xx
            h5 += hx * xy
            h6 += hx * yy
            h7 += hy * xy
            h8 += hy * yy
        m = sums[e]
        m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8], m[9] = s0, s1, s2, s3, s4, s5, s6, s7, s8, s9
        m[10], m[11], m[12], m[13], m[14], m[15], m[16], m[17], m[18] = h0, h1, h2, h3, h4, h5, h6, h7, h8
        m[19] = s19


@parallel_njit(lambda packed, ids, starts, *_: starts.size - 1, **FAST)
def gradients(
    begin, end, packed, ids, starts, stops, width, height, color, slopes, weights, empty, veil, sums
):
    """The sums of all pairs [pairs, SUMS]: color [tiles,3,AREA] is the picture, slopes dL/d(picture).

    `weights` [tiles,AREA] scale the slopes; pixels of weight 0 count for nothing, nor does their curvature.
    `empty` [2,h,w], of the picture's shape but maybe smaller, are distances along its rays up to which there
    is nothing, and how sure that is; each alpha of a splat before them costs that times `veil`.
    """
    across = (width + TILE_PX - 1) // TILE_PX
    state = np.empty(ROWS * AREA, nb.float32)
    for t in range(begin, end):
        coordinates(state)
        x0, y0 = (t % across) * TILE_PX, (t // across) * TILE_PX
        for i in range(AREA):
            # Pixels outside the picture let nothing through, so that nothing there counts.
            weight = weights[t, i]
            inside = (
                ONE if x0 + i % TILE_PX < width and y0 + i // TILE_PX < height and weight > ZERO else ZERO
            )
            state[i] = inside
            state[7 * AREA + i] = ZERO
            row = min((y0 + i // TILE_PX) * empty.shape[1] // height, empty.shape[1] - 1)
            column = min((x0 + i % TILE_PX) * empty.shape[2] // width, empty.shape[2] - 1)
            state[10 * AREA + i] = inside * empty[0, row, column]
            state[11 * AREA + i] = veil * empty[1, row, column]
            for ch in range(3):
                state[(1 + ch) * AREA + i] = inside * weight * slopes[t, ch, i]
                state[(4 + ch) * AREA + i] = inside * color[t, ch, i]
        influence_tile(state, packed, ids, starts[t], stops[t], x0, y0)
        for i in range(AREA):
            kept = x0 + i % TILE_PX < width and y0 + i // TILE_PX < height and weights[t, i] > ZERO
            inside = ONE if kept else ZERO
            state[i] = inside
            for ch in range(3):
                state[(4 + ch) * AREA + i] = inside * color[t, ch, i]
        gradient_tile(state, packed, ids, starts[t], stops[t], x0, y0, sums)
        for e in range(stops[t], starts[t + 1]):
            for j in range(SUMS):
                sums[e, j] = ZERO


@parallel_njit(lambda *args: len(args[-1]), **FAST)
def opacity_before(begin, end, packed, ids, starts, across, pixels, distances, out):
    """Opacity [K] that rays through pixels [K,2] (x, y, centers at .5) have gathered before distances [K]."""
    for n in range(begin, end):
        x, y = pixels[n, 0] - HALF, pixels[n, 1] - HALF
        t = int(pixels[n, 1]) // TILE_PX * across + int(pixels[n, 0]) // TILE_PX
        through = ONE
        for e in range(starts[t], starts[t + 1]):
            p = packed[ids[e]]
            dx, dy = x - p[0], y - p[1]
            if p[10] + p[11] * dx + p[12] * dy < distances[n]:
                l = dx + p[3] * dy
                a = p[5] * np.exp(-HALF * (p[2] * l * l + p[4] * dy * dy))
                if a >= LEAST:
                    through *= ONE - min(a, MOST)
        out[n] = ONE - through
