"""Splat projection and blending on Quadrants' devices, for GPUs; see `projection` and `blending`.

Notation and layouts (packed splats, tiles) as there. One thread has one splat, or one pixel. Everything is
float32: splats as thin as a pixel and much longer than a picture come out some percent wider or narrower.

The oracle is `cagefield.rendering.splats.reference_rasterizer`.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.quadrants import qd
from cagefield.rendering.splats.kernels.device_sort import SortArgs, scan_blocks, sort_digits
from cagefield.rendering.splats.kernels.device_splat_args import (
    CameraArgs,
    ProjectionArgs,
    SplatArgs,
    ivec2,
    vec2,
    vec6,
)
from cagefield.rendering.splats.kernels.projection import (
    ALPHA_MAX,
    ALPHA_MIN,
    AREA,
    BLUR,
    FISHEYE,
    LEAST_COMPENSATION,
    OPENCV,
    PACKED,
    SLOPE_BLUR,
    TILE_PX,
)
from cagefield.rendering.voxels.kernels.grid import F32, I32, sh_basis, vec3

MAX_VARIANCE_PX2 = 1e15
"""Splats of larger variances, in pixels^2, are not drawn: their determinant would overflow."""

HIDDEN_KEY = 0x7FFFFFFF
"""Sorting key of a splat that is not drawn: it comes after all others."""


@qd.func
def distort(x: qd.f32, y: qd.f32, k: vec6, model: qd.template()):
    """The lens's image of n = (x, y), and its derivative by rows: (x', y', D00, D01, D10, D11)."""
    out = vec6(x, y, 1.0, 0.0, 0.0, 1.0)
    s = x * x + y * y
    if qd.static(model == OPENCV):
        g = 1.0 + s * (k[0] + s * (k[1] + s * (k[4] + s * k[5])))
        dg = k[0] + s * (2.0 * k[1] + s * (3.0 * k[4] + s * 4.0 * k[5]))
        cross = 2.0 * x * y * dg + 2.0 * k[2] * x + 2.0 * k[3] * y
        out = vec6(
            g * x + 2.0 * k[2] * x * y + k[3] * (s + 2.0 * x * x),
            g * y + k[2] * (s + 2.0 * y * y) + 2.0 * k[3] * x * y,
            g + 2.0 * x * x * dg + 2.0 * k[2] * y + 6.0 * k[3] * x,
            cross,
            cross,
            g + 2.0 * y * y * dg + 6.0 * k[2] * y + 2.0 * k[3] * x,
        )
    if qd.static(model == FISHEYE):
        if s > 1e-6:
            r = qd.sqrt(s)
            t = qd.atan2(r, 1.0)
            u = t * t
            scale = t * (1.0 + u * (k[0] + u * (k[1] + u * (k[2] + u * k[3])))) / r
            slope = 1.0 + u * (3.0 * k[0] + u * (5.0 * k[1] + u * (7.0 * k[2] + u * 9.0 * k[3])))
            bend = (slope / (1.0 + s) - scale) / s
            cross = x * y * bend
            out = vec6(x * scale, y * scale, scale + x * x * bend, cross, cross, scale + y * y * bend)
    return out


@qd.kernel(fastcache=True)
def project(
    splats: SplatArgs, camera: CameraArgs, out: ProjectionArgs, K: qd.template(), model: qd.template()
):
    """As `projection.project`, of all splats; K harmonics."""
    across = (camera.size.x + TILE_PX - 1) // TILE_PX
    down = (camera.size.y + TILE_PX - 1) // TILE_PX
    qd.loop_config(block_dim=128)
    for i in range(splats.count):
        offset = (
            vec3(splats.means[3 * i], splats.means[3 * i + 1], splats.means[3 * i + 2])
            - camera.origin
            - camera.origin_rest
        )
        p = camera.W @ offset
        z = p.z
        out.keys[i] = z
        for j in range(4):
            out.tiles[4 * i + j] = 0
        if z >= camera.near and splats.opacities[i] > ALPHA_MIN:
            n = vec2(p.x / z, p.y / z)
            if n.x * n.x + n.y * n.y <= camera.radius_limit * camera.radius_limit:
                nx = qd.min(camera.limits[1], qd.max(camera.limits[0], n.x))
                ny = qd.min(camera.limits[3], qd.max(camera.limits[2], n.y))
                lens = distort(nx, ny, camera.coefficients, model)
                px = (
                    vec3(camera.W[0, 0], camera.W[0, 1], camera.W[0, 2])
                    - nx * vec3(camera.W[2, 0], camera.W[2, 1], camera.W[2, 2])
                ) / z
                py = (
                    vec3(camera.W[1, 0], camera.W[1, 1], camera.W[1, 2])
                    - ny * vec3(camera.W[2, 0], camera.W[2, 1], camera.W[2, 2])
                ) / z
                M0 = camera.focal.x * (lens[2] * px + lens[3] * py)
                M1 = camera.focal.y * (lens[4] * px + lens[5] * py)
                at = 6 * i
                C = qd.Matrix(
                    [
                        [splats.covariances[at], splats.covariances[at + 1], splats.covariances[at + 2]],
                        [splats.covariances[at + 1], splats.covariances[at + 3], splats.covariances[at + 4]],
                        [splats.covariances[at + 2], splats.covariances[at + 4], splats.covariances[at + 5]],
                    ]
                )
                v0 = C @ M0
                v1 = C @ M1
                a = v0.dot(M0)
                b = v0.dot(M1)
                c = v1.dot(M1)
                if a + c < MAX_VARIANCE_PX2:
                    # Rounded covariances may be indefinite.
                    sharp = qd.max(0.0, a * c - b * b)
                    det = sharp + BLUR * (a + c + BLUR)
                    o = splats.opacities[i]
                    if splats.antialiased == 1:
                        o *= qd.max(LEAST_COMPENSATION, qd.sqrt(sharp / det))
                    reach = 2.0 * qd.log(o / ALPHA_MIN)
                    seen = distort(n.x, n.y, camera.coefficients, model)
                    u = camera.focal.x * seen[0] + camera.center.x
                    v = camera.focal.y * seen[1] + camera.center.y
                    rx = qd.sqrt(qd.max(reach, 0.0) * (a + BLUR))
                    ry = qd.sqrt(qd.max(reach, 0.0) * (c + BLUR))
                    inside = (
                        u + rx > 0.0 and v + ry > 0.0 and u - rx < camera.size.x and v - ry < camera.size.y
                    )
                    if reach > 0.0 and inside:
                        out.tiles[4 * i] = qd.cast(qd.max(0.0, (u - rx) / TILE_PX), qd.i32)
                        out.tiles[4 * i + 1] = qd.cast(qd.min(across - 1.0, (u + rx) / TILE_PX), qd.i32) + 1
                        out.tiles[4 * i + 2] = qd.cast(qd.max(0.0, (v - ry) / TILE_PX), qd.i32)
                        out.tiles[4 * i + 3] = qd.cast(qd.min(down - 1.0, (v + ry) / TILE_PX), qd.i32) + 1
                        row = PACKED * i
                        out.packed[row] = u - 0.5
                        out.packed[row + 1] = v - 0.5
                        out.packed[row + 2] = (c + BLUR) / det
                        out.packed[row + 3] = -b / (c + BLUR)
                        out.packed[row + 4] = 1.0 / (c + BLUR)
                        out.packed[row + 5] = o
                        out.packed[row + 9] = ry
                        distance = offset.norm()
                        e = offset / distance
                        out.packed[row + 10] = distance
                        along0 = e.dot(v0)
                        along1 = e.dot(v1)
                        slope_det = sharp + SLOPE_BLUR * (a + c + SLOPE_BLUR)
                        out.packed[row + 11] = (along0 * (c + SLOPE_BLUR) - along1 * b) / slope_det
                        out.packed[row + 12] = (along1 * (a + SLOPE_BLUR) - along0 * b) / slope_det
                        if splats.with_normals == 1:
                            normal = vec3(
                                splats.normals[3 * i], splats.normals[3 * i + 1], splats.normals[3 * i + 2]
                            )
                            sign = 1.0
                            if normal.dot(e) > 0.0:
                                sign = -1.0
                            for j in qd.static(range(3)):
                                out.packed[row + 13 + j] = sign * normal[j]
                        if splats.turned == 1:
                            first = 9 * i
                            back = vec3(0.0, 0.0, 0.0)
                            for j in qd.static(range(3)):
                                for m in qd.static(range(3)):
                                    back[j] += splats.rotations[first + 3 * m + j] * e[m]
                            e = back
                        basis = sh_basis(e, K)
                        for channel in qd.static(range(3)):
                            color = 0.5
                            for j in qd.static(range(K)):
                                color += basis[j] * splats.sh[(i * K + j) * 3 + channel]
                            out.packed[row + 6 + channel] = qd.max(0.0, color)


@qd.func
def overlaps(packed: qd.template(), i: qd.i32, column: qd.i32, line: qd.i32):
    """1 where alpha exceeds ALPHA_MIN at some point of a tile; see `tile_binning.overlaps`."""
    row = PACKED * i
    x0 = column * TILE_PX - packed[row]
    y0 = line * TILE_PX - packed[row + 1]
    x1 = x0 + (TILE_PX - 1)
    y1 = y0 + (TILE_PX - 1)
    A = packed[row + 2]
    k = packed[row + 3]
    D = packed[row + 4]
    found = 1
    if not (x0 <= 0.0 and x1 >= 0.0 and y0 <= 0.0 and y1 >= 0.0):
        least = 1e30
        for side in qd.static(range(2)):
            y = y0
            x = x0
            if qd.static(side == 1):
                y = y1
                x = x1
            across = qd.min(x1, qd.max(x0, -k * y)) + k * y
            least = qd.min(least, A * across * across + D * y * y)
            y = qd.min(y1, qd.max(y0, -A * k * x / (A * k * k + D)))
            across = x + k * y
            least = qd.min(least, A * across * across + D * y * y)
        if least >= 2.0 * qd.log(packed[row + 5] / ALPHA_MIN):
            found = 0
    return found


@qd.kernel(fastcache=True)
def order_splats(
    depths: F32,
    tiles: I32,
    packed: F32,
    keys: I32,
    order: I32,
    firsts: I32,
    scratch: SortArgs,
    number: qd.i32,
    passes: qd.template(),
):
    """Write the splats' `order` by depth, hidden ones last, and where the pairs of each begin.

    `firsts` [number+1] are the counts of tiles before each splat of `order`; `passes` is that of HIDDEN_KEY
    and even.
    """
    qd.loop_config(block_dim=128)
    for i in range(number):
        keys[i] = HIDDEN_KEY
        if tiles[4 * i + 1] > tiles[4 * i]:
            keys[i] = qd.bit_cast(depths[i], qd.i32)
        order[i] = i
    sort_digits(keys, order, scratch, number, passes)
    qd.loop_config(block_dim=128)
    for q in range(number + 1):
        n = 0
        if q < number:
            i = order[q]
            for line in range(tiles[4 * i + 2], tiles[4 * i + 3]):
                for column in range(tiles[4 * i], tiles[4 * i + 1]):
                    n += overlaps(packed, i, column, line)
        firsts[q] = n
    scan_blocks(firsts, scratch.sums, scratch.tops, number + 1)


@qd.func
def write_starts(touched: qd.template(), starts: qd.template(), pairs: qd.i32, tiles: qd.i32):
    """Write starts [tiles+1] of the tiles in the sorted `touched` [pairs]."""
    qd.loop_config(block_dim=128)
    for e in range(pairs + 1):
        before = -1
        here = tiles
        if e > 0:
            before = touched[e - 1]
        if e < pairs:
            here = touched[e]
        for t in range(before + 1, here + 1):
            starts[t] = e


@qd.kernel(fastcache=True)
def list_pairs(
    order: I32,
    firsts: I32,
    tiles: I32,
    packed: F32,
    size: ivec2,
    touched: I32,
    ids: I32,
    starts: I32,
    scratch: SortArgs,
    number: qd.i32,
    pairs: qd.i32,
    passes: qd.template(),
):
    """Write the pairs (tile, splat) by tile, and by depth within; `size` is that of the picture in tiles.

    `starts` [tiles+1] are where the tiles begin in `ids`, or in the scratch memory where `passes` is odd.
    """
    qd.loop_config(block_dim=128)
    for q in range(number):
        i = order[q]
        n = firsts[q]
        for line in range(tiles[4 * i + 2], tiles[4 * i + 3]):
            for column in range(tiles[4 * i], tiles[4 * i + 1]):
                if overlaps(packed, i, column, line) == 1:
                    touched[n] = line * size.x + column
                    ids[n] = i
                    n += 1
    sort_digits(touched, ids, scratch, pairs, passes)
    if qd.static(passes % 2 == 1):
        write_starts(scratch.other_keys, starts, pairs, size.x * size.y)
    else:
        write_starts(touched, starts, pairs, size.x * size.y)


@qd.kernel(fastcache=True)
def blend(
    packed: F32,
    ids: I32,
    starts: I32,
    count: qd.i32,
    across: qd.i32,
    out: F32,
    t_min: qd.f32,
    channels: qd.template(),
):
    """Blends all tiles into out [tiles, channels, AREA]; see `blending.blend`.

    A pixel is left once it lets less than `t_min` through.
    """
    qd.loop_config(block_dim=AREA)
    for n in range(count * AREA):
        t = n // AREA
        pixel = n % AREA
        x = qd.cast((t % across) * TILE_PX + pixel % TILE_PX, qd.f32)
        y = qd.cast((t // across) * TILE_PX + pixel // TILE_PX, qd.f32)
        T = 1.0
        rgb = vec3(0.0, 0.0, 0.0)
        normal = vec3(0.0, 0.0, 0.0)
        depth = 0.0
        e = starts[t]
        end = starts[t + 1]
        while e < end and t_min <= T:
            row = PACKED * ids[e]
            dx = x - packed[row]
            dy = y - packed[row + 1]
            l = dx + packed[row + 3] * dy
            q = packed[row + 2] * l * l + packed[row + 4] * dy * dy
            a = qd.min(packed[row + 5] * qd.exp(-0.5 * q), ALPHA_MAX)
            if a >= ALPHA_MIN:
                w = a * T
                T -= w
                rgb += w * vec3(packed[row + 6], packed[row + 7], packed[row + 8])
                if qd.static(channels > 4):
                    depth += w * (packed[row + 10] + packed[row + 11] * dx + packed[row + 12] * dy)
                if qd.static(channels > 5):
                    normal += w * vec3(packed[row + 13], packed[row + 14], packed[row + 15])
            e += 1
        at = t * channels * AREA + pixel
        out[at] = T
        for j in qd.static(range(3)):
            out[at + (1 + j) * AREA] = rgb[j]
        if qd.static(channels > 4):
            out[at + 4 * AREA] = depth
        if qd.static(channels > 5):
            for j in qd.static(range(3)):
                out[at + (5 + j) * AREA] = normal[j]


@qd.kernel(fastcache=True)
def opacity_before(
    packed: F32,
    ids: I32,
    starts: I32,
    across: qd.i32,
    pixels: F32,
    distances: F32,
    out: F32,
    number: qd.i32,
):
    """Opacity gathered before distances along the rays of pixels; see `blending.opacity_before`."""
    for n in range(number):
        x = pixels[2 * n] - 0.5
        y = pixels[2 * n + 1] - 0.5
        column = qd.cast(pixels[2 * n], qd.i32) // TILE_PX
        t = qd.cast(pixels[2 * n + 1], qd.i32) // TILE_PX * across + column
        T = 1.0
        for e in range(starts[t], starts[t + 1]):
            row = PACKED * ids[e]
            dx = x - packed[row]
            dy = y - packed[row + 1]
            if packed[row + 10] + packed[row + 11] * dx + packed[row + 12] * dy < distances[n]:
                l = dx + packed[row + 3] * dy
                q = packed[row + 2] * l * l + packed[row + 4] * dy * dy
                a = packed[row + 5] * qd.exp(-0.5 * q)
                if a >= ALPHA_MIN:
                    T *= 1.0 - qd.min(a, ALPHA_MAX)
        out[n] = 1.0 - T
