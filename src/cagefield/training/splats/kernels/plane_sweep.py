"""Inverse depths of photos by plane sweeping over many depths (Numba).

Notation: w is the inverse depth 1/z of a reference pixel with direction (x, y, 1) in its camera's axes. A
neighbor sees it at q = A (x, y, 1) + w b, with A and b the relative rotation and translation. The score of w
is the zero-mean normalized cross-correlation of windows of (2 WINDOW_RADIUS_PIXELS + 1)^2 pixels, averaged
over the two best neighbors, so that occlusion in other neighbors does not count.

Source: Collins, "A space-sweep approach to true multi-image matching" (1996); Gallup et al. (2007).
"""

from __future__ import annotations

import numpy as np

from cagefield.compute.numba_cache import FAST, njit
from cagefield.compute.parallel_kernels import parallel_njit
from cagefield.rendering.splats.kernels.projection import distort

WINDOW_RADIUS_PIXELS = 2
"""Pixels on each side of a window's center."""

NOISE_VARIANCE = np.float32((3.0 / 255.0) ** 2)
"""Variance of windows without texture."""


@njit(**FAST)
def box_sums(image, rows, out):
    """Sums over windows of (2 WINDOW_RADIUS_PIXELS + 1)^2 pixels, clipped at borders; `rows` is scratch."""
    height, width = image.shape
    for y in range(height):
        for x in range(width):
            total = np.float32(0.0)
            for k in range(max(0, x - WINDOW_RADIUS_PIXELS), min(width, x + WINDOW_RADIUS_PIXELS + 1)):
                total += image[y, k]
            rows[y, x] = total
    for y in range(height):
        for x in range(width):
            out[y, x] = np.float32(0.0)
        for k in range(max(0, y - WINDOW_RADIUS_PIXELS), min(height, y + WINDOW_RADIUS_PIXELS + 1)):
            for x in range(width):
                out[y, x] += rows[k, x]


@njit(**FAST)
def warp(image, directions, A, b, w, focal, center, model, coefficients, out, inside):
    """Warp the neighbor's image to the reference's pixels at inverse depth w; `inside` is 0 outside."""
    height, width = out.shape
    rows, columns = image.shape
    for y in range(height):
        for x in range(width):
            dx, dy = directions[y, x, 0], directions[y, x, 1]
            qx = A[0, 0] * dx + A[0, 1] * dy + A[0, 2] + w * b[0]
            qy = A[1, 0] * dx + A[1, 1] * dy + A[1, 2] + w * b[1]
            qz = A[2, 0] * dx + A[2, 1] * dy + A[2, 2] + w * b[2]
            out[y, x] = np.float32(0.0)
            inside[y, x] = np.float32(0.0)
            if qz > 0.05:
                u, v, _, _, _, _ = distort(qx / qz, qy / qz, model, coefficients)
                px = focal[0] * u + center[0] - 0.5
                py = focal[1] * v + center[1] - 0.5
                if px >= 0.0 and py >= 0.0 and px < columns - 1 and py < rows - 1:
                    i, j = int(px), int(py)
                    fx, fy = np.float32(px - i), np.float32(py - j)
                    top = image[j, i] + fx * (image[j, i + 1] - image[j, i])
                    low = image[j + 1, i] + fx * (image[j + 1, i + 1] - image[j + 1, i])
                    out[y, x] = top + fy * (low - top)
                    inside[y, x] = np.float32(1.0)


@parallel_njit(lambda images, *_: len(images), **FAST)
def sweep(
    begin,
    end,
    images,
    directions,
    rotations,
    origins,
    focals,
    centers,
    models,
    coefficients,
    neighbors,
    inverse,
    out,
):
    """Write out [V,H,W,3]: fractional index of the best inverse depth, its score, the best score elsewhere.

    images [V,H,W] float32; directions [V,H,W,2]; rotations [V,3,3] world to camera; origins [V,3]; neighbors
    [V,K]; inverse [V,D] inverse depths of each reference view, evenly spaced and increasing.
    """
    height, width = images.shape[1:]
    count = inverse.shape[1]
    K = neighbors.shape[1]
    for r in range(begin, end):
        reference = images[r]
        rows = np.empty((height, width), np.float32)
        warped = np.empty((height, width), np.float32)
        inside = np.empty((height, width), np.float32)
        product = np.empty((height, width), np.float32)
        n0 = np.empty((height, width), np.float32)
        s_r = np.empty((height, width), np.float32)
        s_rr = np.empty((height, width), np.float32)
        s_n = np.empty((height, width), np.float32)
        s_nn = np.empty((height, width), np.float32)
        s_rn = np.empty((height, width), np.float32)
        volume = np.empty((count, height, width), np.float32)
        for y in range(height):
            for x in range(width):
                product[y, x] = np.float32(1.0)
        box_sums(product, rows, n0)
        box_sums(reference, rows, s_r)
        for y in range(height):
            for x in range(width):
                product[y, x] = reference[y, x] * reference[y, x]
        box_sums(product, rows, s_rr)
        A = np.empty((3, 3))
        b = np.empty(3)
        best2 = np.empty((2, height, width), np.float32)
        for d in range(count):
            best2[:] = np.float32(-1.0)
            for k in range(K):
                n = neighbors[r, k]
                if n < 0:
                    continue
                for i in range(3):
                    b[i] = 0.0
                    for j in range(3):
                        A[i, j] = 0.0
                        b[i] += rotations[n, i, j] * (origins[r, j] - origins[n, j])
                        for m in range(3):
                            A[i, j] += rotations[n, i, m] * rotations[r, j, m]
                warp(
                    images[n], directions[r], A, b, inverse[r, d], focals[n], centers[n], models[n],
                    coefficients[n], warped, inside,
                )  # fmt: skip
                box_sums(warped, rows, s_n)
                for y in range(height):
                    for x in range(width):
                        product[y, x] = warped[y, x] * warped[y, x]
                box_sums(product, rows, s_nn)
                for y in range(height):
                    for x in range(width):
                        product[y, x] = warped[y, x] * reference[y, x]
                box_sums(product, rows, s_rn)
                for y in range(height):
                    for x in range(width):
                        c = np.float32(1.0) / n0[y, x]
                        vr = c * (s_rr[y, x] - c * s_r[y, x] * s_r[y, x]) + NOISE_VARIANCE
                        vn = c * (s_nn[y, x] - c * s_n[y, x] * s_n[y, x]) + NOISE_VARIANCE
                        cov = c * (s_rn[y, x] - c * s_r[y, x] * s_n[y, x])
                        score = cov / np.sqrt(vr * vn) if inside[y, x] > 0.0 else np.float32(-1.0)
                        if score > best2[0, y, x]:
                            best2[1, y, x] = best2[0, y, x]
                            best2[0, y, x] = score
                        elif score > best2[1, y, x]:
                            best2[1, y, x] = score
            for y in range(height):
                for x in range(width):
                    volume[d, y, x] = np.float32(0.5) * (best2[0, y, x] + best2[1, y, x])
        for y in range(height):
            for x in range(width):
                at = 0
                for d in range(1, count):
                    if volume[d, y, x] > volume[at, y, x]:
                        at = d
                top = volume[at, y, x]
                second = np.float32(-1.0)
                for d in range(count):
                    if abs(d - at) > 3 and volume[d, y, x] > second:
                        second = volume[d, y, x]
                position = np.float32(at)
                if 0 < at < count - 1:
                    before, after = volume[at - 1, y, x], volume[at + 1, y, x]
                    bend = before - np.float32(2.0) * top + after
                    if bend < -1e-6:
                        position += np.float32(0.5) * (before - after) / bend
                out[r, y, x, 0] = position
                out[r, y, x, 1] = top
                out[r, y, x, 2] = second
