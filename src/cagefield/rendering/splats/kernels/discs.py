"""Discs of 2DGS onto a picture, each met by the pixels' rays, blended in tiles (Numba).

Notation: a disc has its mean p in camera axes (x right, y down, z forward) and tangents a, b, each as long as
its standard deviation. The ray of n = (x/z, y/z), r = (n, 1), meets the disc's plane at p + u a + v b with
(u, v, 1) along (b x p, p x a, a x b) . r. With dn the way from the mean's n and g = (a x b) . p / z,

    u = (b x p) . dn / (g + (a x b) . dn),    v = (p x a) . dn / (g + (a x b) . dn),

so u^2 + v^2 is a quadratic form of the pixel's offset d = (x, y) over a square,

    u^2 + v^2 = (A (x + k y)^2 + D y^2) / (1 + e x + f y)^2,    the depth there is z / (1 + e x + f y),

exact for a pinhole; another lens is taken to be affine around each mean. Alpha is o exp(-q / 2), q the lesser
of u^2 + v^2 and d^2 / (2 FILTER); depths nearer than the least one count as nothing.

The oracle is `cagefield.rendering.splats.reference_discs`.

Source: Huang et al., "2D Gaussian Splatting" (2024), equations 7 to 11.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from cagefield.compute.numba_cache import FAST, njit
from cagefield.compute.parallel_kernels import parallel_njit
from cagefield.rendering.splats.kernels.blending import (
    AREA,
    HALF,
    LEAST,
    MOST,
    ONE,
    ROW1,
    ROW2,
    ROW3,
    ROW4,
    ROWS,
    T_MIN,
    ZERO,
    F,
    X,
    Y,
    coordinates,
    falloff,
    rows_of,
)
from cagefield.rendering.splats.kernels.projection import (
    ALPHA_MIN,
    MAX_TERMS,
    TILE_PX,
    clamped,
    distort,
    harmonics_at,
)
from cagefield.rendering.splats.kernels.tile_binning import FILTER

EDGE_ON = 1e-5
"""Least |g| there is, against |a x b|: a disc seen exactly from its edge has no picture but its dot."""

LEAST_DENOMINATOR = F(1e-6)


@njit(inline="always", **FAST)
def interval(a, b, p, az, bz, pz, reach):
    """(middle, half) of x / z over the disc u^2 + v^2 <= reach; it lies in front of the camera."""
    zz = reach * (az * az + bz * bz) - pz * pz
    xz = reach * (a * az + b * bz) - p * pz
    xx = reach * (a * a + b * b) - p * p
    return xz / zz, np.sqrt(max(0.0, xz * xz - xx * zz)) / -zz


@parallel_njit(lambda discs, *_: len(discs.means), **FAST)
def project(begin, end, discs, normals, camera, projected):
    """Write the `ProjectedSplats` of the `DiscArgs` as seen by the `CameraArgs`.

    packed [N,16]: 0-1 mean (pixel centers at whole numbers), 2-4 A, k, D, 5 opacity, 6-8 color, 9
    half-height of the region above ALPHA_MIN, 10 depth z, 11-12 e, f, 13-15 normal. `normals` [N,3] has no
    rows where none are wanted. Discs that are not shown get an empty box of tiles.
    """
    means, tangents, opacities, sh, rotations = discs
    W, origin, focal, center, size, limits, model, coefficients, radius_limit, near = camera
    packed, keys, tiles = projected
    across = (size[0] + TILE_PX - 1) // TILE_PX
    down = (size[1] + TILE_PX - 1) // TILE_PX
    terms = sh.shape[1]
    basis = np.empty(MAX_TERMS)
    for i in range(begin, end):
        tiles[i, 0] = 0
        tiles[i, 1] = 0
        dx = np.float64(means[i, 0]) - origin[0]
        dy = np.float64(means[i, 1]) - origin[1]
        dz = np.float64(means[i, 2]) - origin[2]
        z = W[2, 0] * dx + W[2, 1] * dy + W[2, 2] * dz
        keys[i] = z
        o = np.float64(opacities[i])
        if z < near or o <= ALPHA_MIN:
            continue
        x = W[0, 0] * dx + W[0, 1] * dy + W[0, 2] * dz
        y = W[1, 0] * dx + W[1, 1] * dy + W[1, 2] * dz
        if x * x + y * y > radius_limit * radius_limit * z * z:
            continue
        q = tangents[i]
        ax = W[0, 0] * q[0] + W[0, 1] * q[1] + W[0, 2] * q[2]
        ay = W[1, 0] * q[0] + W[1, 1] * q[1] + W[1, 2] * q[2]
        az = W[2, 0] * q[0] + W[2, 1] * q[1] + W[2, 2] * q[2]
        bx = W[0, 0] * q[3] + W[0, 1] * q[4] + W[0, 2] * q[5]
        by = W[1, 0] * q[3] + W[1, 1] * q[4] + W[1, 2] * q[5]
        bz = W[2, 0] * q[3] + W[2, 1] * q[4] + W[2, 2] * q[5]
        nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        area = np.sqrt(nx * nx + ny * ny + nz * nz)
        if not (area > 0.0 and area < 1e30):
            continue
        g = (nx * x + ny * y + nz * z) / z
        if abs(g) < EDGE_ON * area:
            g = EDGE_ON * area if g >= 0.0 else -EDGE_ON * area
        # By n: u and v over g, and the denominator's slope.
        un, um = (by * z - bz * y) / g, (bz * x - bx * z) / g
        vn, vm = (y * az - z * ay) / g, (z * ax - x * az) / g
        en, em = nx / g, ny / g
        _, _, d00, d01, d10, d11 = distort(
            clamped(x / z, limits[0], limits[1]), clamped(y / z, limits[2], limits[3]), model, coefficients
        )
        j00, j01, j10, j11 = focal[0] * d00, focal[0] * d01, focal[1] * d10, focal[1] * d11
        det = j00 * j11 - j01 * j10
        i00, i01, i10, i11 = j11 / det, -j01 / det, -j10 / det, j00 / det
        ux, uy = un * i00 + um * i10, un * i01 + um * i11
        vx, vy = vn * i00 + vm * i10, vn * i01 + vm * i11
        A = max(ux * ux + vx * vx, 1e-20)
        turn = ux * vy - uy * vx
        xd, yd, _, _, _, _ = distort(x / z, y / z, model, coefficients)
        u = focal[0] * xd + center[0]
        v = focal[1] * yd + center[1]
        reach = 2.0 * np.log(o / ALPHA_MIN)
        dot = np.sqrt(2.0 * FILTER * reach)
        left, right, top, bottom = u - dot, u + dot, v - dot, v + dot
        if z - np.sqrt(reach * (az * az + bz * bz)) < 1e-3 * z:
            # It reaches the camera's plane: it may be anywhere.
            left, right, top, bottom = -1.0, size[0] + 1.0, -1.0, size[1] + 1.0
        else:
            cx, hx = interval(ax, bx, x, az, bz, z, reach)
            cy, hy = interval(ay, by, y, az, bz, z, reach)
            cx -= x / z
            cy -= y / z
            mx, my = u + j00 * cx + j01 * cy, v + j10 * cx + j11 * cy
            rx, ry = abs(j00) * hx + abs(j01) * hy, abs(j10) * hx + abs(j11) * hy
            left, right = min(left, mx - rx), max(right, mx + rx)
            top, bottom = min(top, my - ry), max(bottom, my + ry)
        if not (right > 0.0 and bottom > 0.0 and left < size[0] and top < size[1]):
            continue
        tiles[i, 0] = int(max(0.0, left / TILE_PX))
        tiles[i, 1] = int(min(across - 1.0, right / TILE_PX)) + 1
        tiles[i, 2] = int(max(0.0, top / TILE_PX))
        tiles[i, 3] = int(min(down - 1.0, bottom / TILE_PX)) + 1
        row = packed[i]
        row[0] = u - 0.5
        row[1] = v - 0.5
        row[2] = A
        row[3] = (ux * uy + vx * vy) / A
        row[4] = turn * turn / A
        row[5] = o
        row[9] = max(v - top, bottom - v) + 1e-3
        row[10] = z
        row[11] = en * i00 + em * i10
        row[12] = en * i01 + em * i11
        distance = np.sqrt(dx * dx + dy * dy + dz * dz)
        ex, ey, ez = dx / distance, dy / distance, dz / distance
        if normals.shape[0] > 0:
            facing = normals[i, 0] * ex + normals[i, 1] * ey + normals[i, 2] * ez
            sign = -1.0 if facing > 0.0 else 1.0
            for j in range(3):
                row[13 + j] = sign * normals[i, j]
        if rotations.shape[0] > 0:
            R = rotations[i]
            tx = R[0, 0] * ex + R[1, 0] * ey + R[2, 0] * ez
            ty = R[0, 1] * ex + R[1, 1] * ey + R[2, 1] * ez
            tz = R[0, 2] * ex + R[1, 2] * ey + R[2, 2] * ez
            ex, ey, ez = tx, ty, tz
        harmonics_at(ex, ey, ez, terms, basis)
        for ch in range(3):
            color = 0.5
            for j in range(terms):
                color += basis[j] * sh[i, j, ch]
            row[6 + ch] = max(0.0, color)


@njit(inline="always", **FAST)
def alpha_at(p, dx, dy, near):
    """(alpha, depth) of a packed disc at a pixel's offset from its mean."""
    l = dx + p[3] * dy
    below = ONE + p[11] * dx + p[12] * dy
    size = max(abs(below), LEAST_DENOMINATOR)
    over = ONE / (size if below >= ZERO else -size)
    inside = (p[2] * l * l + p[4] * dy * dy) * over * over
    dot = F(0.5 / FILTER) * (dx * dx + dy * dy)
    z = p[10] * (over if inside <= dot else ONE)
    a = min(p[5] * falloff(min(inside, dot)), MOST)
    return (a if a >= LEAST and z >= near else ZERO), z


@njit(**FAST)
def blend_tile(state, packed, ids, begin, end, x0, y0, near):
    """Rows of the state: 0 T, 1-3 color, 4 depth z times weight. Returns where the tile was left."""
    for i in range(AREA):
        state[i] = ONE
    for i in range(AREA, 5 * AREA):
        state[i] = ZERO
    for e in range(begin, end):
        p = packed[ids[e]]
        mx, my = p[0] - F(x0), p[1] - F(y0)
        r, g, b = p[6], p[7], p[8]
        low, high = rows_of(p, y0)
        for i in range(low, high):
            a, z = alpha_at(p, state[X + i] - mx, state[Y + i] - my, near)
            w = a * state[i]
            state[ROW1 + i] += w * r
            state[ROW2 + i] += w * g
            state[ROW3 + i] += w * b
            state[ROW4 + i] += w * z
            state[i] -= w
        if (e - begin) & 7 == 7:
            most = ZERO
            for i in range(AREA):
                most = max(most, state[i])
            if most < T_MIN:
                return e + 1
    return end


@njit(**FAST)
def blend_normals_tile(state, packed, ids, begin, end, x0, y0, near):
    """Rows of the state: 0 T, 1-3 normals times weight."""
    for i in range(AREA):
        state[i] = ONE
    for i in range(AREA, 4 * AREA):
        state[i] = ZERO
    for e in range(begin, end):
        p = packed[ids[e]]
        mx, my = p[0] - F(x0), p[1] - F(y0)
        r, g, b = p[13], p[14], p[15]
        low, high = rows_of(p, y0)
        for i in range(low, high):
            a, _ = alpha_at(p, state[X + i] - mx, state[Y + i] - my, near)
            w = a * state[i]
            state[ROW1 + i] += w * r
            state[ROW2 + i] += w * g
            state[ROW3 + i] += w * b
            state[i] -= w


@parallel_njit(lambda packed, ids, starts, *_: starts.size - 1, **FAST)
def blend(begin, end, packed, ids, starts, across, near, channels, out):
    """Blends all tiles into out [tiles, channels, AREA]: T, color (3), depth z (of 5), normals (of 8)."""
    state = np.empty(ROWS * AREA, nb.float32)
    for t in range(begin, end):
        coordinates(state)
        x0, y0 = (t % across) * TILE_PX, (t // across) * TILE_PX
        stop = blend_tile(state, packed, ids, starts[t], starts[t + 1], x0, y0, near)
        for ch in range(min(channels, 5)):
            for i in range(AREA):
                out[t, ch, i] = state[ch * AREA + i]
        if channels > 5:
            blend_normals_tile(state, packed, ids, starts[t], stop, x0, y0, near)
            for ch in range(3):
                for i in range(AREA):
                    out[t, 5 + ch, i] = state[(ch + 1) * AREA + i]


@parallel_njit(lambda *args: len(args[-1]), **FAST)
def opacity_before(begin, end, packed, ids, starts, across, near, pixels, depths, out):
    """Opacity [K] that rays through pixels [K,2] (x, y, centers at .5) have gathered before depths z [K]."""
    for n in range(begin, end):
        x, y = pixels[n, 0] - HALF, pixels[n, 1] - HALF
        t = int(pixels[n, 1]) // TILE_PX * across + int(pixels[n, 0]) // TILE_PX
        through = ONE
        for e in range(starts[t], starts[t + 1]):
            p = packed[ids[e]]
            a, z = alpha_at(p, x - p[0], y - p[1], near)
            if z < depths[n]:
                through *= ONE - a
        out[n] = ONE - through
