"""Numba kernel of a mesh cage: blends of its vertices' motion by mean value coordinates, and its distance.

Triangles near a point add the weights of `geometry.mean_value`, in the vector form of Floater, Kos and
Reimers, "Mean value coordinates in 3D" (2005): a triangle seen in the unit vectors u_1, u_2, u_3 adds
w_i / r_i with

    m = 1/2 sum_i theta_i n_i,    w_i = m . (u_(i+1) x u_(i-1)) / (u_1 . (u_2 x u_3)),

n_i the unit normal of u_(i+1) x u_(i-1), theta_i the angle between these two. Both are the integral of f / r
over the unit sphere, f linear on the triangle; of triangles further than `FAR` of their radii it is taken at
the centroid c: A n . (c - x) / |c - x|^4, with A n the area times the outward normal, to about 4 %.

`MESH_LANES` points go through together: the innermost loops run over them.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import chebyshev

from cagefield.compute.numba_cache import FAST, njit
from cagefield.compute.parallel_kernels import parallel_njit

U = np.uintp

MESH_LANES = 32

FAR = 4.0
"""Distance of a triangle's centroid, in radii of the triangle, from which one value stands for it."""

_LEAST_DET = 1e-10
"""Least |u_1 . (u_2 x u_3)|: below it the point is in the plane of the triangle."""


def _arc_cosine_terms(degree: int = 14) -> tuple[float, ...]:
    """Coefficients, highest first, of P on [0,1] with arccos c = sqrt(1 - c) P(c), to 1e-11."""
    nodes = 0.5 + 0.5 * np.cos(np.pi * (np.arange(200) + 0.5) / 200)
    fit = chebyshev.Chebyshev.fit(nodes, np.arccos(nodes) / np.sqrt(1.0 - nodes), degree, domain=[0, 1])
    return tuple(float(term) for term in fit.convert(kind=np.polynomial.Polynomial).coef[::-1])


_T = _arc_cosine_terms()


@njit(inline="always", **FAST)
def _arc(c, square):
    """theta / (2 sin theta) of two unit vectors with cosine c and squared sine `square`."""
    size = min(abs(c), 1.0)
    p = _T[0]
    p = p * size + _T[1]
    p = p * size + _T[2]
    p = p * size + _T[3]
    p = p * size + _T[4]
    p = p * size + _T[5]
    p = p * size + _T[6]
    p = p * size + _T[7]
    p = p * size + _T[8]
    p = p * size + _T[9]
    p = p * size + _T[10]
    p = p * size + _T[11]
    p = p * size + _T[12]
    p = p * size + _T[13]
    p = p * size + _T[14]
    behind = 1.0 if c < 0.0 else 0.0
    return (0.5 - behind) * p / np.sqrt(1.0 + size) + 0.5 * np.pi * behind / np.sqrt(max(square, 1e-24))


@njit(**FAST)
def _near_weights(x, count, v, motion, part):
    """Writes part [4,L] at points x [3,L], the first `count`: the weight of a triangle with vertices v [3,3],
    and its weighted motion, from that of its vertices, motion [3,3]."""
    a0, a1, a2 = v[0, 0], v[0, 1], v[0, 2]
    b0, b1, b2 = v[1, 0], v[1, 1], v[1, 2]
    c0, c1, c2 = v[2, 0], v[2, 1], v[2, 2]
    i0, i1, i2 = motion[0, 0], motion[0, 1], motion[0, 2]
    j0, j1, j2 = motion[1, 0], motion[1, 1], motion[1, 2]
    k0, k1, k2 = motion[2, 0], motion[2, 1], motion[2, 2]
    for l in range(U(count)):
        x0, x1, x2 = x[0, l], x[1, l], x[2, l]
        d0, d1, d2 = a0 - x0, a1 - x1, a2 - x2
        e0, e1, e2 = b0 - x0, b1 - x1, b2 - x2
        f0, f1, f2 = c0 - x0, c1 - x1, c2 - x2
        ra = 1.0 / np.sqrt(d0 * d0 + d1 * d1 + d2 * d2 + 1e-300)
        rb = 1.0 / np.sqrt(e0 * e0 + e1 * e1 + e2 * e2 + 1e-300)
        rc = 1.0 / np.sqrt(f0 * f0 + f1 * f1 + f2 * f2 + 1e-300)
        d0, d1, d2 = ra * d0, ra * d1, ra * d2
        e0, e1, e2 = rb * e0, rb * e1, rb * e2
        f0, f1, f2 = rc * f0, rc * f1, rc * f2
        p0, p1, p2 = e1 * f2 - e2 * f1, e2 * f0 - e0 * f2, e0 * f1 - e1 * f0
        q0, q1, q2 = f1 * d2 - f2 * d1, f2 * d0 - f0 * d2, f0 * d1 - f1 * d0
        s0, s1, s2 = d1 * e2 - d2 * e1, d2 * e0 - d0 * e2, d0 * e1 - d1 * e0
        tp = _arc(e0 * f0 + e1 * f1 + e2 * f2, p0 * p0 + p1 * p1 + p2 * p2)
        tq = _arc(f0 * d0 + f1 * d1 + f2 * d2, q0 * q0 + q1 * q1 + q2 * q2)
        ts = _arc(d0 * e0 + d1 * e1 + d2 * e2, s0 * s0 + s1 * s1 + s2 * s2)
        m0 = tp * p0 + tq * q0 + ts * s0
        m1 = tp * p1 + tq * q1 + ts * s1
        m2 = tp * p2 + tq * q2 + ts * s2
        det = d0 * p0 + d1 * p1 + d2 * p2
        scale = 1.0 / (det if abs(det) > _LEAST_DET else 1e300)
        wi = scale * ra * (m0 * p0 + m1 * p1 + m2 * p2)
        wj = scale * rb * (m0 * q0 + m1 * q1 + m2 * q2)
        wk = scale * rc * (m0 * s0 + m1 * s1 + m2 * s2)
        part[0, l] = wi + wj + wk
        part[1, l] = wi * i0 + wj * j0 + wk * k0
        part[2, l] = wi * i1 + wj * j1 + wk * k1
        part[3, l] = wi * i2 + wj * j2 + wk * k2


@njit(**FAST)
def _segment(p0, p1, p2, g0, g1, g2):
    """Squared distance of p [3] from the segment from 0 to g [3]."""
    t = (p0 * g0 + p1 * g1 + p2 * g2) / (g0 * g0 + g1 * g1 + g2 * g2)
    t = min(max(t, 0.0), 1.0)
    d0, d1, d2 = p0 - t * g0, p1 - t * g1, p2 - t * g2
    return d0 * d0 + d1 * d1 + d2 * d2


@njit(**FAST)
def _triangle_distance(x0, x1, x2, v):
    """Squared distance of a point from the triangle v [3,3]."""
    g0, g1, g2 = v[1, 0] - v[0, 0], v[1, 1] - v[0, 1], v[1, 2] - v[0, 2]
    h0, h1, h2 = v[2, 0] - v[0, 0], v[2, 1] - v[0, 1], v[2, 2] - v[0, 2]
    p0, p1, p2 = x0 - v[0, 0], x1 - v[0, 1], x2 - v[0, 2]
    gg, gh, hh = g0 * g0 + g1 * g1 + g2 * g2, g0 * h0 + g1 * h1 + g2 * h2, h0 * h0 + h1 * h1 + h2 * h2
    pg, ph = p0 * g0 + p1 * g1 + p2 * g2, p0 * h0 + p1 * h1 + p2 * h2
    det = gg * hh - gh * gh
    s, t = (hh * pg - gh * ph) / det, (gg * ph - gh * pg) / det
    if min(s, min(t, 1.0 - s - t)) >= 0.0:
        d0, d1, d2 = p0 - s * g0 - t * h0, p1 - s * g1 - t * h1, p2 - s * g2 - t * h2
        return d0 * d0 + d1 * d1 + d2 * d2
    first = min(_segment(p0, p1, p2, g0, g1, g2), _segment(p0, p1, p2, h0, h1, h2))
    return min(first, _segment(p0 - g0, p1 - g1, p2 - g2, h0 - g0, h1 - g1, h2 - g2))


@njit(**FAST)
def _far(y, table, squares, sums):
    """Adds far triangles to sums [8,L] at y [3,L] float32: weights and weighted motion, signed, then their
    sizes; writes squares [F,L], the squared distances from the centroids."""
    zero = np.float32(0.0)
    for f in range(U(len(table))):
        c0, c1, c2 = table[f, 0], table[f, 1], table[f, 2]
        n0, n1, n2 = table[f, 3], table[f, 4], table[f, 5]
        m0, m1, m2 = table[f, 6], table[f, 7], table[f, 8]
        near = table[f, 9]
        for l in range(U(MESH_LANES)):
            d0, d1, d2 = c0 - y[0, l], c1 - y[1, l], c2 - y[2, l]
            q = d0 * d0 + d1 * d1 + d2 * d2
            squares[f, l] = q
            k = (n0 * d0 + n1 * d1 + n2 * d2) / (q * q) if q > near else zero
            sums[0, l] += k
            sums[1, l] += k * m0
            sums[2, l] += k * m1
            sums[3, l] += k * m2
            k = abs(k)
            sums[4, l] += k
            sums[5, l] += k * m0
            sums[6, l] += k * m1
            sums[7, l] += k * m2


@njit(**FAST)
def _block(x, y, corners, motion, table, squares, sums, totals, away, part, some, lanes):
    """Sums over all triangles, totals [8,L], and squared distances, away [L], of points x and y [3,L]."""
    for n in range(8):
        for l in range(MESH_LANES):
            sums[n, l] = np.float32(0.0)
    _far(y, table, squares, sums)
    reach = np.empty(MESH_LANES, np.float32)  # distance of the nearest centroid
    for l in range(U(MESH_LANES)):
        reach[l], away[l] = np.float32(1e30), 1e300
    for f in range(U(len(table))):
        for l in range(U(MESH_LANES)):
            reach[l] = min(reach[l], squares[f, l])
    for l in range(U(MESH_LANES)):
        reach[l] = np.sqrt(reach[l])
    for n in range(8):
        for l in range(MESH_LANES):
            totals[n, l] = sums[n, l]
    for f in range(U(len(table))):
        near, radius = table[f, 9], table[f, 10]
        hits = np.float32(0.0)
        for l in range(U(MESH_LANES)):
            e = reach[l] + min(radius, radius * radius / reach[l])
            hits += np.float32(1.0) if squares[f, l] <= max(near, e * e) else np.float32(0.0)
        if hits == np.float32(0.0):
            continue
        count = 0
        for l in range(U(MESH_LANES)):
            # The centroid of a triangle at a distance d over its inside is at most d + radius^2 / 2 d away.
            e = reach[l] + min(radius, radius * radius / reach[l])
            if squares[f, l] <= e * e:
                away[l] = min(away[l], _triangle_distance(x[0, l], x[1, l], x[2, l], corners[f]))
            if squares[f, l] <= near:
                lanes[count] = l
                some[0, count], some[1, count], some[2, count] = x[0, l], x[1, l], x[2, l]
                count += 1
        if count == 0:
            continue
        _near_weights(some, count, corners[f], motion[f], part)
        for m in range(count):
            l, size = lanes[m], 1.0 if part[0, m] >= 0.0 else -1.0
            for n in range(4):
                totals[n, l] += part[n, m]
                totals[n + 4, l] += size * part[n, m]


@parallel_njit(lambda places, *_: (len(places) + MESH_LANES - 1) // MESH_LANES, **FAST)
def blend_motion(begin, end, places, center, corners, motion, table, out):
    """Writes out [N,4]: the motion blended at places [N,3], and their distance from the mesh, 0 inside.

    corners [F,3,3] of the triangles, their motion [F,3,3]; table [F,11] float32: centroids less center [3],
    areas times outward normals, motion of the centroids, (`FAR` radius)^2, radius: the largest distance of a
    corner from the centroid.

    Inside, the blend is that of the mean value coordinates; outside, of the sizes of their triangles' parts,
    all positive: a mean of the vertices' motion that does not grow with the distance. Both are the motion of
    the surface on it. The sum of the weights is positive inside, negative outside.
    """
    x, y = np.empty((3, MESH_LANES)), np.empty((3, MESH_LANES), np.float32)
    squares, sums = np.empty((len(table), MESH_LANES), np.float32), np.empty((8, MESH_LANES), np.float32)
    totals, away, part = np.empty((8, MESH_LANES)), np.empty(MESH_LANES), np.empty((4, MESH_LANES))
    some, lanes = np.empty((3, MESH_LANES)), np.empty(MESH_LANES, np.intp)
    for block in range(begin, end):
        first = np.intp(block) * MESH_LANES
        for l in range(MESH_LANES):
            row = min(first + l, len(places) - 1)
            for n in range(3):
                x[n, l] = places[row, n]
                y[n, l] = np.float32(places[row, n] - center[n])
        _block(x, y, corners, motion, table, squares, sums, totals, away, part, some, lanes)
        for l in range(min(MESH_LANES, len(places) - first)):
            outside = 0 if totals[0, l] > 0.0 else 4
            for n in range(3):
                out[first + l, n] = totals[outside + 1 + n, l] / totals[outside, l]
            out[first + l, 3] = np.sqrt(away[l]) if outside else 0.0


@njit(**FAST)
def meet_points(grid, z, wanted, sweeps):
    """Changes velocities [G,G,G,3] float32 so that those at points z [V,3] in [-1,1]^3 become wanted [V,3].

    Each point in turn, the least change of the nodes around it (Kaczmarz); nodes on the outer faces stay.
    """
    cells = grid.shape[0] - 1
    weights = np.empty(8)
    for _ in range(sweeps):
        for n in range(len(z)):
            s0, s1, s2 = (z[n] + 1.0) * (0.5 * cells)
            i = min(max(int(s0), 0), cells - 1)
            j = min(max(int(s1), 0), cells - 1)
            k = min(max(int(s2), 0), cells - 1)
            a, b, c = s0 - i, s1 - j, s2 - k
            square = 0.0
            for m in range(8):
                p, q, r = m & 1, (m >> 1) & 1, m >> 2
                w = (a if p else 1.0 - a) * (b if q else 1.0 - b) * (c if r else 1.0 - c)
                if min(i + p, min(j + q, k + r)) == 0 or max(i + p, max(j + q, k + r)) == cells:
                    w = 0.0
                weights[m] = w
                square += w * w
            if square < 1e-6:
                continue
            for o in range(3):
                left = wanted[n, o]
                for m in range(8):
                    left -= weights[m] * grid[k + (m >> 2), j + ((m >> 1) & 1), i + (m & 1), o]
                for m in range(8):
                    at = grid[k + (m >> 2), j + ((m >> 1) & 1), i + (m & 1)]
                    at[o] += np.float32(weights[m] * left / square)
