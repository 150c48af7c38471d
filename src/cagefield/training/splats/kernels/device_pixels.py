"""Residuals of an image's pixels, and their gradients and curvatures by splats, on Quadrants' devices.

One thread has one pixel. Notation and sums as in `rendering.splats.kernels.blending`. Each pixel adds to the
sums of a splat by atomics, so that the last digits of the sums depend on the order of threads.

The oracle is finite differences of `cagefield.rendering.splats.reference_rasterizer`.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.quadrants import qd
from cagefield.rendering.splats.kernels.blending import SUMS
from cagefield.rendering.splats.kernels.projection import ALPHA_MAX, ALPHA_MIN, AREA, PACKED, TILE_PX
from cagefield.rendering.voxels.kernels.grid import F32, I32, vec3
from cagefield.training.splats.kernels.device_args import PhotoArgs, photo_value

MIN_PIXEL_TRANSMITTANCE = 1e-4
"""Transmittance below which a pixel is left; the CPU leaves a tile once all of its pixels are below 1e-3."""

TILE_SUMS = 7
"""Sums of a tile: squared error, image x photo (3), image^2 (3); see `gauss_newton_splats.residuals`."""

ivec2 = qd.types.vector(2, qd.i32)
vec4 = qd.types.vector(4, qd.f32)
vec20 = qd.types.vector(SUMS, qd.f32)


@qd.kernel(fastcache=True)
def residuals(out: F32, photo: PhotoArgs, color: F32, slopes: F32, sums: F32, tiles: qd.i32):
    """As `gauss_newton_splats.residuals`; `sums` [tiles,TILE_SUMS] are added to."""
    across = (photo.width + TILE_PX - 1) // TILE_PX
    qd.loop_config(block_dim=AREA)
    for n in range(tiles * AREA):
        t = n // AREA
        i = n % AREA
        x = (t % across) * TILE_PX + i % TILE_PX
        y = (t // across) * TILE_PX + i // TILE_PX
        inside = x < photo.width and y < photo.height
        through = out[4 * t * AREA + i]
        weight = photo.weights[n]
        error = 0.0
        for channel in qd.static(range(3)):
            c = out[(4 * t + 1 + channel) * AREA + i] + through * photo.background[channel]
            at = (3 * t + channel) * AREA + i
            color[at] = c
            slopes[at] = 0.0
            if inside:
                value = photo_value(photo, t, channel, i)
                d = photo.gain[channel] * c - value
                slopes[at] = photo.gain[channel] * d
                error += weight * d * d
                qd.atomic_add(sums[TILE_SUMS * t + 1 + channel], weight * c * value)
                qd.atomic_add(sums[TILE_SUMS * t + 4 + channel], weight * c * c)
        if inside:
            qd.atomic_add(sums[TILE_SUMS * t], error)


@qd.func
def splat_at(packed: qd.template(), row: qd.i32, x: qd.f32, y: qd.f32):
    """Splat at a pixel: (e_x, e_y) = Q d, alpha before its limits, alpha or 0 below ALPHA_MIN."""
    dx = x - packed[row]
    dy = y - packed[row + 1]
    ex = packed[row + 2] * (dx + packed[row + 3] * dy)
    f = packed[row + 4] * dy
    ey = packed[row + 3] * ex + f
    full = packed[row + 5] * qd.exp(-0.5 * ((dx + packed[row + 3] * dy) * ex + dy * f))
    alpha = qd.min(full, ALPHA_MAX)
    if alpha < ALPHA_MIN:
        alpha = 0.0
    return vec4(ex, ey, full, alpha)


@qd.kernel(fastcache=True)
def gradients(
    packed: F32,
    ids: I32,
    starts: I32,
    tiles: qd.i32,
    size: ivec2,
    color: F32,
    slopes: F32,
    weights: F32,
    empty: F32,
    empty_size: ivec2,
    penalty: qd.f32,
    sums: F32,
):
    """Add each splat's pixels to its sums [N,SUMS]; arguments as those of `blending.gradients`.

    `size` is (width, height) of the image, `empty_size` that of `empty` [2,h,w].
    """
    across = (size.x + TILE_PX - 1) // TILE_PX
    qd.loop_config(block_dim=AREA)
    for n in range(tiles * AREA):
        t = n // AREA
        i = n % AREA
        column = (t % across) * TILE_PX + i % TILE_PX
        line = (t // across) * TILE_PX + i // TILE_PX
        weight = weights[n]
        if column < size.x and line < size.y and weight > 0.0:
            x = qd.cast(column, qd.f32)
            y = qd.cast(line, qd.f32)
            at = 3 * t * AREA + i
            image = vec3(color[at], color[at + AREA], color[at + 2 * AREA])
            slope = weight * vec3(slopes[at], slopes[at + AREA], slopes[at + 2 * AREA])
            cell = qd.min(line * empty_size.y // size.y, empty_size.y - 1) * empty_size.x
            cell += qd.min(column * empty_size.x // size.x, empty_size.x - 1)
            free_distance = empty[cell]
            cost = penalty * empty[empty_size.x * empty_size.y + cell]
            influence = 0.0
            T = 1.0
            rest = image
            e = starts[t]
            end = starts[t + 1]
            while e < end and T >= MIN_PIXEL_TRANSMITTANCE:
                row = PACKED * ids[e]
                alpha = splat_at(packed, row, x, y)[3]
                if alpha > 0.0:
                    own = alpha * T * vec3(packed[row + 6], packed[row + 7], packed[row + 8])
                    rest -= own
                    T -= alpha * T
                    influence += (own - alpha / (1.0 - alpha) * rest).norm()
                e += 1
            T = 1.0
            rest = image
            e = starts[t]
            while e < end and T >= MIN_PIXEL_TRANSMITTANCE:
                splat = ids[e]
                row = PACKED * splat
                here = splat_at(packed, row, x, y)
                alpha = here[3]
                if alpha > 0.0:
                    w = alpha * T
                    own = w * vec3(packed[row + 6], packed[row + 7], packed[row + 8])
                    rest -= own
                    T -= w
                    J = own - alpha / (1.0 - alpha) * rest
                    if here[2] > ALPHA_MAX:
                        J = vec3(0.0, 0.0, 0.0)
                    ex = here[0]
                    ey = here[1]
                    v = J.dot(slope)
                    h = J.norm() * influence
                    distance = (
                        packed[row + 10]
                        + packed[row + 11] * (x - packed[row])
                        + packed[row + 12] * (y - packed[row + 1])
                    )
                    fade = v
                    if distance < free_distance:
                        fade += cost * alpha
                    xx = ex * ex
                    xy = ex * ey
                    yy = ey * ey
                    values = vec20(
                        fade,
                        v * ex,
                        v * ey,
                        v * xx,
                        v * xy,
                        v * yy,
                        w * slope[0],
                        w * slope[1],
                        w * slope[2],
                        w,
                        h,
                        h * xx,
                        h * xy,
                        h * yy,
                        h * xx * xx,
                        h * xx * xy,
                        h * xx * yy,
                        h * xy * yy,
                        h * yy * yy,
                        w * slope.dot(slope),
                    )
                    for j in qd.static(range(SUMS)):
                        qd.atomic_add(sums[SUMS * splat + j], values[j])
                e += 1
