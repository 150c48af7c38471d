"""Residuals of an image's pixels, and their gradients and curvatures by splats, on Quadrants' devices.

One thread has one pixel. Notation and sums as in `rendering.splats.kernels.blending`. Pixels, or subgroups of
pixels, add to the sums of a splat by atomics, so that the last digits of the sums depend on the order of
threads.

The oracle is finite differences of `cagefield.rendering.splats.reference_rasterizer`.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.quadrants import qd
from cagefield.rendering.splats.kernels.blending import SUMS
from cagefield.rendering.splats.kernels.projection import ALPHA_MAX, ALPHA_MIN, AREA, PACKED, TILE_PX
from cagefield.rendering.voxels.kernels.grid import F32, vec3
from cagefield.training.splats.kernels.device_args import PairArgs, PhotoArgs, photo_value

MIN_PIXEL_TRANSMITTANCE = 1e-4
"""Transmittance below which a pixel is left; the CPU leaves a tile once all of its pixels are below 1e-3."""

TILE_SUMS = 7
"""Sums of a tile: squared error, image x photo (3), image^2 (3); see `gauss_newton_splats.residuals`."""

subgroup = qd.simt.subgroup
ivec2 = qd.types.vector(2, qd.i32)
vec4 = qd.types.vector(4, qd.f32)
vec7 = qd.types.vector(TILE_SUMS, qd.f32)
vec20 = qd.types.vector(SUMS, qd.f32)


@qd.func
def add_sums(
    sums: qd.template(), first: qd.i32, values: qd.template(), any_value: qd.i32, grouped: qd.template()
):
    """Add a pixel's values to sums[first:]; `any_value` is 0 where they are all 0.

    With `grouped`, the values of a subgroup, which must have one `first`, are summed before.
    """
    if qd.static(grouped):
        if subgroup.any_true(any_value) == 1:
            lane = subgroup.invocation_id()
            for j in qd.static(range(values.n)):
                total = subgroup.reduce_all_add(values[j])
                if lane == j % qd.static(subgroup.group_size()):
                    qd.atomic_add(sums[first + j], total)
    elif any_value == 1:
        for j in qd.static(range(values.n)):
            qd.atomic_add(sums[first + j], values[j])


@qd.kernel(fastcache=True)
def residuals(
    out: F32, photo: PhotoArgs, color: F32, slopes: F32, sums: F32, tiles: qd.i32, grouped: qd.template()
):
    """As `gauss_newton_splats.residuals`; writes sums [tiles,TILE_SUMS]. `grouped`: see `add_sums`."""
    across = (photo.width + TILE_PX - 1) // TILE_PX
    for n in range(TILE_SUMS * tiles):
        sums[n] = 0.0
    qd.loop_config(block_dim=AREA)
    for n in range(tiles * AREA):
        t = n // AREA
        i = n % AREA
        x = (t % across) * TILE_PX + i % TILE_PX
        y = (t // across) * TILE_PX + i // TILE_PX
        inside = 0
        if x < photo.width and y < photo.height:
            inside = 1
        through = out[4 * t * AREA + i]
        weight = photo.weights[n]
        values = vec7(0.0)
        for channel in qd.static(range(3)):
            c = out[(4 * t + 1 + channel) * AREA + i] + through * photo.background[channel]
            at = (3 * t + channel) * AREA + i
            color[at] = c
            slopes[at] = 0.0
            if inside == 1:
                value = photo_value(photo, t, channel, i)
                d = photo.gain[channel] * c - value
                slopes[at] = photo.gain[channel] * d
                values[0] += weight * d * d
                values[1 + channel] = weight * c * value
                values[4 + channel] = weight * c * c
        add_sums(sums, TILE_SUMS * t, values, inside, grouped)


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
    pairs: PairArgs,
    size: ivec2,
    color: F32,
    slopes: F32,
    weights: F32,
    empty: F32,
    empty_size: ivec2,
    penalty: qd.f32,
    sums: F32,
    count: qd.i32,
    grouped: qd.template(),
):
    """Write the sums [`count`,SUMS] over each splat's pixels; arguments as those of `blending.gradients`.

    `size` is (width, height) of the image, `empty_size` that of `empty` [2,h,w]. `grouped`: see `add_sums`.
    """
    across = (size.x + TILE_PX - 1) // TILE_PX
    for n in range(SUMS * count):
        sums[n] = 0.0
    qd.loop_config(block_dim=AREA)
    for n in range(pairs.tiles * AREA):
        t = n // AREA
        i = n % AREA
        column = (t % across) * TILE_PX + i % TILE_PX
        line = (t // across) * TILE_PX + i // TILE_PX
        weight = weights[n]
        x = qd.cast(column, qd.f32)
        y = qd.cast(line, qd.f32)
        at = 3 * t * AREA + i
        image = vec3(color[at], color[at + AREA], color[at + 2 * AREA])
        slope = weight * vec3(slopes[at], slopes[at + AREA], slopes[at + 2 * AREA])
        cell = qd.min(line * empty_size.y // size.y, empty_size.y - 1) * empty_size.x
        cell += qd.min(column * empty_size.x // size.x, empty_size.x - 1)
        free_distance = empty[cell]
        cost = penalty * empty[empty_size.x * empty_size.y + cell]
        # A pixel without weight is left before its first splat.
        before = 0.0
        if column < size.x and line < size.y and weight > 0.0:
            before = 1.0
        end = pairs.starts[t + 1]
        influence = 0.0
        T = before
        rest = image
        e = pairs.starts[t]
        while e < end and T >= MIN_PIXEL_TRANSMITTANCE:
            row = PACKED * pairs.ids[e]
            alpha = splat_at(pairs.packed, row, x, y)[3]
            if alpha > 0.0:
                own = alpha * T * vec3(pairs.packed[row + 6], pairs.packed[row + 7], pairs.packed[row + 8])
                rest -= own
                T -= alpha * T
                influence += (own - alpha / (1.0 - alpha) * rest).norm()
            e += 1
        T = before
        rest = image
        e = pairs.starts[t]
        going = 1
        while e < end and going == 1:
            splat = pairs.ids[e]
            row = PACKED * splat
            alpha = 0.0
            values = vec20(0.0)
            if T >= MIN_PIXEL_TRANSMITTANCE:
                here = splat_at(pairs.packed, row, x, y)
                alpha = here[3]
                if alpha > 0.0:
                    w = alpha * T
                    own = w * vec3(pairs.packed[row + 6], pairs.packed[row + 7], pairs.packed[row + 8])
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
                        pairs.packed[row + 10]
                        + pairs.packed[row + 11] * (x - pairs.packed[row])
                        + pairs.packed[row + 12] * (y - pairs.packed[row + 1])
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
            going = qd.cast(T >= MIN_PIXEL_TRANSMITTANCE, qd.i32)
            if qd.static(grouped):
                going = subgroup.any_true(going)
            add_sums(sums, SUMS * splat, values, qd.cast(alpha > 0.0, qd.i32), grouped)
            e += 1
