"""Splats onto a picture: projected means, covariances, colors, and the tiles that each one touches (Numba).

Notation: a splat's mean is p in camera axes (x right, y down, z forward), C its covariance in the world, W
the world-to-camera rotation. The lens maps n = (x/z, y/z) to d(n), and the pixel is (fx d_x + cx, fy d_y +
cy).
J = diag(f) D(n) [1/z, 0, -x/z^2; 0, 1/z, -y/z^2], D = dd/dn, is the derivative of the pixel by p, taken
where n
is at most a little outside the picture. The projected covariance is M C M^T + BLUR I with M = J W (local
affine
approximation). An antialiased splat's opacity is multiplied by sqrt(det(M C M^T) / det(M C M^T + BLUR I)).

The oracle is `cagefield.rendering.splats.reference_rasterizer.project`.

Source: Zwicker et al., "EWA splatting" (2002), equations 24 to 34; Kerbl et al., "3D Gaussian Splatting for
Real-Time Radiance Field Rendering" (2023), equation 5; Yu et al., "Mip-Splatting" (2024), equation 9.
"""

from __future__ import annotations

import numpy as np

from cagefield.compute.numba_cache import FAST, njit
from cagefield.compute.parallel_kernels import parallel_njit
from cagefield.fields import sh as harmonics

TILE_PX = 16
AREA = TILE_PX * TILE_PX
BLUR = 0.3
"""Variance, in pixels^2, of the filter that every splat gets."""
ALPHA_MIN = 1.0 / 255.0
"""Smaller alphas are 0."""
ALPHA_MAX = 0.99
"""Larger alphas are this."""
LEAST_COMPENSATION = 0.005
"""An antialiased splat keeps at least this share of its opacity."""

PINHOLE, OPENCV, FISHEYE = 0, 1, 2

PACKED = 16
"""Floats a packed splat has, one cache line: 0-1 mean (pixel centers at whole numbers), 2-4 conic A, k, D
(the quadratic form is A (x + k y)^2 + D y^2: no difference of large numbers far from the mean), 5 opacity,
6-8 color, 9 half-height of the region above ALPHA_MIN, 10 distance along the ray at the mean, 11-12 its
slope
per pixel, 13-15 normal."""

SLOPE_BLUR = 0.02
"""Variance, in pixels^2, with which the slope of the distance is found: BLUR would level slanted splats."""

DEEPEST = 1.588625448
"""Li2(ALPHA_MAX): the optical depth, over 2 pi times its area, of the most opaque splat there is."""

MAX_WORLD_VARIANCE = 1e30
"""Splats of larger variances, in world units^2, are not drawn."""

C0, C1 = harmonics.C0, harmonics.C1
C20, C21, C22, C23, C24 = harmonics.C2
C30, C31, C32, C33, C34, C35, C36 = harmonics.C3
C40, C41, C42, C43, C44, C45, C46, C47, C48 = harmonics.C4
MAX_TERMS = harmonics.MAX_TERMS


@njit(**FAST)
def distort(x, y, model, k):
    """The lens's image (xd, yd) of n = (x, y), and D = d(xd, yd)/d(x, y) by rows; see
    `cagefield.cameras.lenses`."""
    if model == OPENCV:
        s = x * x + y * y
        g = 1.0 + s * (k[0] + s * (k[1] + s * (k[4] + s * k[5])))
        dg = k[0] + s * (2.0 * k[1] + s * (3.0 * k[4] + s * 4.0 * k[5]))
        cross = 2.0 * x * y * dg + 2.0 * k[2] * x + 2.0 * k[3] * y
        return (
            g * x + 2.0 * k[2] * x * y + k[3] * (s + 2.0 * x * x),
            g * y + k[2] * (s + 2.0 * y * y) + 2.0 * k[3] * x * y,
            g + 2.0 * x * x * dg + 2.0 * k[2] * y + 6.0 * k[3] * x,
            cross,
            cross,
            g + 2.0 * y * y * dg + 6.0 * k[2] * y + 2.0 * k[3] * x,
        )
    if model == FISHEYE:
        s = x * x + y * y
        if s < 1e-8:
            return x, y, 1.0, 0.0, 0.0, 1.0
        r = np.sqrt(s)
        t = np.arctan(r)
        u = t * t
        curve = t * (1.0 + u * (k[0] + u * (k[1] + u * (k[2] + u * k[3]))))
        slope = 1.0 + u * (3.0 * k[0] + u * (5.0 * k[1] + u * (7.0 * k[2] + u * 9.0 * k[3])))
        scale = curve / r
        bend = (slope / (1.0 + s) - scale) / s
        return x * scale, y * scale, scale + x * x * bend, x * y * bend, x * y * bend, scale + y * y * bend
    return x, y, 1.0, 0.0, 0.0, 1.0


@njit(inline="always", **FAST)
def clamped(value, low, high):
    """The value, at least `low` and at most `high`."""
    return min(high, max(low, value))


@njit(inline="always", **FAST)
def jacobian(x, y, z, W, fx, fy, limits, model, k, M):
    """Writes M = J W [2,3] at camera point (x, y, z), n within `limits` (x low, x high, y low, y high)."""
    nx = clamped(x / z, limits[0], limits[1])
    ny = clamped(y / z, limits[2], limits[3])
    _, _, d00, d01, d10, d11 = distort(nx, ny, model, k)
    for j in range(3):
        px = (W[0, j] - nx * W[2, j]) / z
        py = (W[1, j] - ny * W[2, j]) / z
        M[0, j] = fx * (d00 * px + d01 * py)
        M[1, j] = fy * (d10 * px + d11 * py)


@njit(**FAST)
def harmonics_at(x, y, z, terms, basis):
    """Writes the first `terms` real spherical harmonics of the unit direction; see `cagefield.fields.sh`."""
    basis[0] = C0
    if terms > 1:
        basis[1] = -C1 * y
        basis[2] = C1 * z
        basis[3] = -C1 * x
    if terms > 4:
        basis[4] = C20 * x * y
        basis[5] = C21 * y * z
        basis[6] = C22 * (2.0 * z * z - x * x - y * y)
        basis[7] = C23 * x * z
        basis[8] = C24 * (x * x - y * y)
    if terms > 9:
        basis[9] = C30 * y * (3.0 * x * x - y * y)
        basis[10] = C31 * x * y * z
        basis[11] = C32 * y * (4.0 * z * z - x * x - y * y)
        basis[12] = C33 * z * (2.0 * z * z - 3.0 * x * x - 3.0 * y * y)
        basis[13] = C34 * x * (4.0 * z * z - x * x - y * y)
        basis[14] = C35 * z * (x * x - y * y)
        basis[15] = C36 * x * (x * x - 3.0 * y * y)
    if terms > 16:
        s = x * x + y * y
        t = z * z
        basis[16] = C40 * x * y * (x * x - y * y)
        basis[17] = C41 * y * z * (3.0 * x * x - y * y)
        basis[18] = C42 * x * y * (6.0 * t - s)
        basis[19] = C43 * y * z * (4.0 * t - 3.0 * s)
        basis[20] = C44 * (8.0 * t * t - 24.0 * t * s + 3.0 * s * s)
        basis[21] = C45 * x * z * (4.0 * t - 3.0 * s)
        basis[22] = C46 * (x * x - y * y) * (6.0 * t - s)
        basis[23] = C47 * x * z * (x * x - 3.0 * y * y)
        basis[24] = C48 * (x * x * (x * x - 3.0 * y * y) - y * y * (3.0 * x * x - y * y))


@parallel_njit(lambda splats, normals, masses, depths, rows, *_: rows.size, **FAST)
def project(begin, end, splats, normals, masses, depths, rows, camera, antialiased, projected):
    """Write the `ProjectedSplats` of `rows` of the `SplatArgs` as seen by the `CameraArgs`.

    `normals` [N,3] has no rows where none are wanted. Splats that are not shown get an empty box of tiles.

    `masses` [N,2] are those of representatives of many splats (`splat_lod.merge`), or no rows: their
    optical depth on the screen is that of the splats they stand for, each blurred on its own, and their
    opacity the one whose Li2 is that depth over their own projected area. `depths` is the table of
    o (Li2) in equal steps of Li2 from 0 to Li2(ALPHA_MAX).
    """
    means, covariances, opacities, sh, rotations = splats
    W, origin, focal, center, size, limits, model, coefficients, radius_limit, near = camera
    packed, keys, tiles = projected
    across = (size[0] + TILE_PX - 1) // TILE_PX
    down = (size[1] + TILE_PX - 1) // TILE_PX
    fx, fy = focal[0], focal[1]
    turned = rotations.shape[0] > 0
    with_normals = normals.shape[0] > 0
    merged = masses.shape[0] > 0
    terms = sh.shape[1]
    M = np.empty((2, 3))
    basis = np.empty(MAX_TERMS)
    for q in range(begin, end):
        i = rows[q]
        tiles[i, 0] = 0
        tiles[i, 1] = 0
        dx = np.float64(means[i, 0]) - origin[0]
        dy = np.float64(means[i, 1]) - origin[1]
        dz = np.float64(means[i, 2]) - origin[2]
        z = W[2, 0] * dx + W[2, 1] * dy + W[2, 2] * dz
        keys[i] = z
        if z < near or opacities[i] <= ALPHA_MIN:
            continue
        x = W[0, 0] * dx + W[0, 1] * dy + W[0, 2] * dz
        y = W[1, 0] * dx + W[1, 1] * dy + W[1, 2] * dz
        if x * x + y * y > radius_limit * radius_limit * z * z:
            continue
        jacobian(x, y, z, W, fx, fy, limits, model, coefficients, M)
        C = covariances[i]
        if not C[0] + C[3] + C[5] < MAX_WORLD_VARIANCE:
            continue
        v00 = M[0, 0] * C[0] + M[0, 1] * C[1] + M[0, 2] * C[2]
        v01 = M[0, 0] * C[1] + M[0, 1] * C[3] + M[0, 2] * C[4]
        v02 = M[0, 0] * C[2] + M[0, 1] * C[4] + M[0, 2] * C[5]
        v10 = M[1, 0] * C[0] + M[1, 1] * C[1] + M[1, 2] * C[2]
        v11 = M[1, 0] * C[1] + M[1, 1] * C[3] + M[1, 2] * C[4]
        v12 = M[1, 0] * C[2] + M[1, 1] * C[4] + M[1, 2] * C[5]
        a = v00 * M[0, 0] + v01 * M[0, 1] + v02 * M[0, 2]
        b = v00 * M[1, 0] + v01 * M[1, 1] + v02 * M[1, 2]
        c = v10 * M[1, 0] + v11 * M[1, 1] + v12 * M[1, 2]
        # Rounded covariances may be indefinite.
        sharp = max(0.0, a * c - b * b)
        det = sharp + BLUR * (a + c + BLUR)
        slope_det = sharp + SLOPE_BLUR * (a + c + SLOPE_BLUR)
        o = np.float64(opacities[i])
        if merged:
            mass = masses[i, 0] * np.sqrt(sharp) + (0.0 if antialiased else BLUR * masses[i, 1])
            place = min(1.0, mass / np.sqrt(det) / DEEPEST) * (depths.size - 1)
            step = min(int(place), depths.size - 2)
            o = depths[step] + (place - step) * (depths[step + 1] - depths[step])
        elif antialiased:
            o *= max(LEAST_COMPENSATION, np.sqrt(sharp / det))
        reach = 2.0 * np.log(o / ALPHA_MIN)
        if not reach > 0.0:
            continue
        a_slope, c_slope = a + SLOPE_BLUR, c + SLOPE_BLUR
        a += BLUR
        c += BLUR
        xd, yd, _, _, _, _ = distort(x / z, y / z, model, coefficients)
        u = fx * xd + center[0]
        v = fy * yd + center[1]
        rx = np.sqrt(reach * a)
        ry = np.sqrt(reach * c)
        if not (u + rx > 0.0 and v + ry > 0.0 and u - rx < size[0] and v - ry < size[1]):
            continue
        tiles[i, 0] = int(max(0.0, (u - rx) / TILE_PX))
        tiles[i, 1] = int(min(across - 1.0, (u + rx) / TILE_PX)) + 1
        tiles[i, 2] = int(max(0.0, (v - ry) / TILE_PX))
        tiles[i, 3] = int(min(down - 1.0, (v + ry) / TILE_PX)) + 1
        row = packed[i]
        row[0] = u - 0.5
        row[1] = v - 0.5
        row[2] = c / det
        row[3] = -b / c
        row[4] = 1.0 / c
        row[5] = o
        row[9] = ry
        distance = np.sqrt(dx * dx + dy * dy + dz * dz)
        ex, ey, ez = dx / distance, dy / distance, dz / distance
        row[10] = distance
        along_u = ex * v00 + ey * v01 + ez * v02
        along_v = ex * v10 + ey * v11 + ez * v12
        row[11] = (along_u * c_slope - along_v * b) / slope_det
        row[12] = (along_v * a_slope - along_u * b) / slope_det
        if with_normals:
            facing = normals[i, 0] * ex + normals[i, 1] * ey + normals[i, 2] * ez
            sign = -1.0 if facing > 0.0 else 1.0
            for j in range(3):
                row[13 + j] = sign * normals[i, j]
        if turned:
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
