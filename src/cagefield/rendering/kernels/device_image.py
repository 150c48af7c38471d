"""Pixels of images from the sums that renderers leave on Quadrants' devices."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from dataclasses import dataclass

from cagefield.compute.quadrants import qd

F32 = qd.types.ndarray(dtype=qd.f32, ndim=1)
U8 = qd.types.ndarray(dtype=qd.u8, ndim=1)
vec3 = qd.types.vector(3, qd.f32)
vec5 = qd.types.vector(5, qd.f32)

MIN_OPACITY = 1e-6
"""Opacity from which a pixel has a depth."""


@dataclass(frozen=True, eq=False)
class SumArgs:
    """Sums of each pixel: premultiplied color, opacity or transmittance, distance times weight.

    Without tiles (`tile_px` 0) in rows [H,W,`channels`]: r, g, b, opacity, distance, more that is not read;
    else in tiles [tiles,`channels`,tile_px^2]: transmittance, r, g, b, distance, more.
    """

    values: F32
    width: qd.i32
    height: qd.i32
    channels: qd.i32
    tile_px: qd.i32


@qd.func
def pixel_sums(sums: SumArgs, n: qd.i32):
    """Sums (r, g, b, opacity in [0,1], distance) of pixel n, counted by rows."""
    out = vec5(0.0)
    if sums.tile_px == 0:
        at = sums.channels * n
        for j in qd.static(range(5)):
            out[j] = sums.values[at + j]
    else:
        x = n % sums.width
        y = n // sums.width
        across = (sums.width + sums.tile_px - 1) // sums.tile_px
        area = sums.tile_px * sums.tile_px
        tile = (y // sums.tile_px) * across + x // sums.tile_px
        at = tile * sums.channels * area + (y % sums.tile_px) * sums.tile_px + x % sums.tile_px
        out[3] = 1.0 - sums.values[at]
        for j in qd.static(range(3)):
            out[j] = sums.values[at + (1 + j) * area]
        out[4] = sums.values[at + 4 * area]
    out[3] = qd.min(1.0, qd.max(0.0, out[3]))
    return out


@qd.func
def shown(s: vec5, background: vec3, has_background: qd.i32):
    """Color over the background, or straight color without one."""
    color = vec3(s[0], s[1], s[2])
    if has_background == 1:
        color += (1.0 - s[3]) * background
    elif s[3] > 0.0:
        color /= s[3]
    return color


@qd.kernel(fastcache=True)
def write_rgb8(sums: SumArgs, background: vec3, has_background: qd.i32, out: U8):
    """Write the 8-bit color [H,W,3]."""
    for n in range(sums.width * sums.height):
        color = shown(pixel_sums(sums, n), background, has_background)
        for j in qd.static(range(3)):
            out[3 * n + j] = qd.cast(qd.min(1.0, qd.max(0.0, color[j])) * 255.0 + 0.5, qd.u8)


@qd.kernel(fastcache=True)
def write_rgb(sums: SumArgs, background: vec3, has_background: qd.i32, out: F32):
    """Write the color [H,W,3]."""
    for n in range(sums.width * sums.height):
        color = shown(pixel_sums(sums, n), background, has_background)
        for j in qd.static(range(3)):
            out[3 * n + j] = color[j]


@qd.kernel(fastcache=True)
def write_planes(sums: SumArgs, out: F32):
    """Write opacity and mean distance [2,H,W]; 1e30 where nothing is seen."""
    size = sums.width * sums.height
    for n in range(size):
        s = pixel_sums(sums, n)
        out[n] = s[3]
        out[size + n] = 1e30
        if s[3] > MIN_OPACITY:
            out[size + n] = s[4] / s[3]
