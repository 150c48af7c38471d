"""Gradient of structural similarity (SSIM) by an image's pixels on Quadrants' devices; see `ssim`.

One thread has one channel of one pixel. Planes are [channel, plane, height, width].
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.quadrants import qd
from cagefield.rendering.splats.kernels.projection import AREA, TILE_PX
from cagefield.rendering.voxels.kernels.grid import F32, vec3
from cagefield.training.splats.kernels import ssim
from cagefield.training.splats.kernels.device_args import PhotoArgs, photo_value
from cagefield.training.splats.kernels.ssim import MOMENT_PLANES, WINDOW_PIXELS

HALF = WINDOW_PIXELS // 2
WEIGHTS = tuple(float(weight) for weight in ssim.WINDOW_WEIGHTS)
C1, C2 = float(ssim.C1), float(ssim.C2)

vec5 = qd.types.vector(MOMENT_PLANES, qd.f32)


@qd.func
def moment_slopes(m: vec5):
    """Derivatives of SSIM by the means of image, image^2 and image x photo, from a window's means."""
    a1 = 2.0 * m[0] * m[1] + C1
    a2 = 2.0 * (m[4] - m[0] * m[1]) + C2
    b1 = m[0] * m[0] + m[1] * m[1] + C1
    b2 = m[2] - m[0] * m[0] + m[3] - m[1] * m[1] + C2
    per = 1.0 / (b1 * b2)
    similarity = a1 * a2 * per
    by_square = -similarity / b2
    by_product = 2.0 * a1 * per
    return vec3(
        2.0 * m[1] * a2 * per - 2.0 * m[0] * (similarity / b1 + by_square) - m[1] * by_product,
        by_square,
        by_product,
    )


@qd.kernel(fastcache=True)
def add_ssim_gradient(
    color: F32, photo: PhotoArgs, weight: qd.f32, moments: F32, by_moment: F32, pixels: F32, slopes: F32
):
    """As `ssim.add_ssim_gradient`; moments [3,MOMENT_PLANES,H,W], by_moment [3,3,H,W], pixels [3,2,H,W]."""
    width = photo.width
    height = photo.height
    size = width * height
    across = (width + TILE_PX - 1) // TILE_PX
    for n in range(3 * size):
        channel = n // size
        at = n % size
        x = at % width
        y = at // width
        tile = (y // TILE_PX) * across + x // TILE_PX
        pixel = (y % TILE_PX) * TILE_PX + x % TILE_PX
        shown = photo.gain[channel] * color[(3 * tile + channel) * AREA + pixel]
        pixels[2 * channel * size + at] = shown
        if photo.weights[tile * AREA + pixel] > 0.0:
            shown = photo_value(photo, tile, channel, pixel)
        pixels[(2 * channel + 1) * size + at] = shown
    for n in range(3 * size):
        channel = n // size
        at = n % size
        x = at % width
        if x >= HALF and x < width - HALF:
            mean = vec5(0.0)
            for k in qd.static(range(WINDOW_PIXELS)):
                a = pixels[2 * channel * size + at + k - HALF]
                b = pixels[(2 * channel + 1) * size + at + k - HALF]
                mean += WEIGHTS[k] * vec5(a, b, a * a, b * b, a * b)
            for j in qd.static(range(MOMENT_PLANES)):
                moments[(MOMENT_PLANES * channel + j) * size + at] = mean[j]
    for n in range(3 * size):
        channel = n // size
        at = n % size
        x = at % width
        y = at // width
        by = vec3(0.0)
        if x >= HALF and x < width - HALF and y >= HALF and y < height - HALF:
            mean = vec5(0.0)
            for k in qd.static(range(WINDOW_PIXELS)):
                for j in qd.static(range(MOMENT_PLANES)):
                    plane = (MOMENT_PLANES * channel + j) * size
                    mean[j] += WEIGHTS[k] * moments[plane + at + (k - HALF) * width]
            by = moment_slopes(mean)
        for j in qd.static(range(3)):
            by_moment[(3 * channel + j) * size + at] = by[j]
    # The moments are used up; three of their planes take the horizontal sums.
    for n in range(3 * size):
        channel = n // size
        at = n % size
        x = at % width
        total = vec3(0.0)
        for k in qd.static(range(WINDOW_PIXELS)):
            if x + k >= HALF and x + k < width + HALF:
                for j in qd.static(range(3)):
                    total[j] += WEIGHTS[k] * by_moment[(3 * channel + j) * size + at + k - HALF]
        for j in qd.static(range(3)):
            moments[(MOMENT_PLANES * channel + j) * size + at] = total[j]
    for n in range(3 * size):
        channel = n // size
        at = n % size
        x = at % width
        y = at // width
        total = vec3(0.0)
        for k in qd.static(range(WINDOW_PIXELS)):
            if y + k >= HALF and y + k < height + HALF:
                for j in qd.static(range(3)):
                    plane = (MOMENT_PLANES * channel + j) * size
                    total[j] += WEIGHTS[k] * moments[plane + at + (k - HALF) * width]
        tile = (y // TILE_PX) * across + x // TILE_PX
        pixel = (y % TILE_PX) * TILE_PX + x % TILE_PX
        a = pixels[2 * channel * size + at]
        b = pixels[(2 * channel + 1) * size + at]
        to = (3 * tile + channel) * AREA + pixel
        slopes[to] = slopes[to] - 0.5 * weight * photo.gain[channel] * (
            total[0] + 2.0 * a * total[1] + b * total[2]
        )
