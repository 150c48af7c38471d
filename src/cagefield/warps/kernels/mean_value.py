"""Numba kernel of a mesh cage: blends of its vertices' motion by mean value coordinates, and its distance.

The weights are those of `geometry.mean_value`, in the vector form of Floater, Kos and Reimers, "Mean value
coordinates in 3D" (2005): a triangle seen in the unit vectors u_1, u_2, u_3 adds w_i / r_i with

    m = 1/2 sum_i theta_i n_i,    w_i = m . (u_(i+1) x u_(i-1)) / (u_1 . (u_2 x u_3)),

n_i the unit normal of u_(i+1) x u_(i-1), theta_i the angle between these two. Each edge is computed once for
its two triangles. `MESH_LANES` points go through together: the innermost loops run over them.
"""

from __future__ import annotations

import numpy as np
from numba import prange
from numpy.polynomial import chebyshev

from cagefield.compute.numba_cache import FAST, njit

U = np.uintp

MESH_LANES = 32

_LEAST_DET = 1e-10
"""Least |u_1 . (u_2 x u_3)|: below it the point is in the plane of the triangle."""


def _arc_cosine_terms(degree: int = 14) -> tuple[float, ...]:
    """Coefficients, highest first, of P on [0,1] with arccos c = sqrt(1 - c) P(c), to 1e-11."""
    nodes = 0.5 + 0.5 * np.cos(np.pi * (np.arange(200) + 0.5) / 200)
    fit = chebyshev.Chebyshev.fit(nodes, np.arccos(nodes) / np.sqrt(1.0 - nodes), degree, domain=[0, 1])
    return tuple(float(term) for term in fit.convert(kind=np.polynomial.Polynomial).coef[::-1])


_T = _arc_cosine_terms()


@njit(**FAST)
def _see(x, vertices, edges, u, near, arc, cross, away):
    """Writes u [V,3,L] and near [V,L] = 1 / r of the vertices from x [3,L]; of the edges, cross [E,3,L] =
    u_a x u_b and arc [E,L] = theta / (2 sin theta); and away [L], the squared distance from the edges."""
    for j in range(U(len(vertices))):
        for l in range(U(MESH_LANES)):
            d0, d1, d2 = vertices[j, 0] - x[0, l], vertices[j, 1] - x[1, l], vertices[j, 2] - x[2, l]
            r = 1.0 / np.sqrt(d0 * d0 + d1 * d1 + d2 * d2 + 1e-300)
            near[j, l] = r
            u[j, 0, l], u[j, 1, l], u[j, 2, l] = r * d0, r * d1, r * d2
    for l in range(U(MESH_LANES)):
        away[l] = 1e300
    for e in range(U(len(edges))):
        a, b = U(edges[e, 0]), U(edges[e, 1])
        g0, g1, g2 = (
            vertices[b, 0] - vertices[a, 0],
            vertices[b, 1] - vertices[a, 1],
            vertices[b, 2] - vertices[a, 2],
        )
        square = g0 * g0 + g1 * g1 + g2 * g2
        for l in range(U(MESH_LANES)):
            a0, a1, a2 = u[a, 0, l], u[a, 1, l], u[a, 2, l]
            b0, b1, b2 = u[b, 0, l], u[b, 1, l], u[b, 2, l]
            c0, c1, c2 = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
            cross[e, 0, l], cross[e, 1, l], cross[e, 2, l] = c0, c1, c2
            c = a0 * b0 + a1 * b1 + a2 * b2
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
            sharp = p / np.sqrt(1.0 + size)
            sine = np.sqrt(max(c0 * c0 + c1 * c1 + c2 * c2, 1e-24))
            behind = 1.0 if c < 0.0 else 0.0
            arc[e, l] = (0.5 - behind) * sharp + 0.5 * np.pi * behind / sine
        for l in range(U(MESH_LANES)):
            a0, a1, a2 = u[a, 0, l], u[a, 1, l], u[a, 2, l]
            r = 1.0 / near[a, l]
            t = min(max(-r * (a0 * g0 + a1 * g1 + a2 * g2) / square, 0.0), 1.0)
            d0, d1, d2 = r * a0 + t * g0, r * a1 + t * g1, r * a2 + t * g2
            away[l] = min(away[l], d0 * d0 + d1 * d1 + d2 * d2)


@njit(**FAST)
def _weigh(x, faces, sides, signs, walls, motion, u, near, arc, cross, away, sums):
    """Adds all triangles to sums [8,L]: weights and weighted motion, first signed, then their sizes; lowers
    away [L] to the squared distance from the triangles."""
    part = np.empty((4, MESH_LANES))
    for n in range(8):
        for l in range(U(MESH_LANES)):
            sums[n, l] = 0.0
    for f in range(U(len(faces))):
        i, j, k = U(faces[f, 0]), U(faces[f, 1]), U(faces[f, 2])
        p, q, s = U(sides[f, 0]), U(sides[f, 1]), U(sides[f, 2])  # edges (j, k), (k, i), (i, j)
        sp, sq, ss = signs[f, 0], signs[f, 1], signs[f, 2]
        h0, h1, h2, h3 = walls[f, 0], walls[f, 1], walls[f, 2], walls[f, 3]
        a0, a1, a2, a3 = walls[f, 4], walls[f, 5], walls[f, 6], walls[f, 7]
        b0, b1, b2, b3 = walls[f, 8], walls[f, 9], walls[f, 10], walls[f, 11]
        c0, c1, c2, c3 = walls[f, 12], walls[f, 13], walls[f, 14], walls[f, 15]
        i0, i1, i2 = motion[i, 0], motion[i, 1], motion[i, 2]
        j0, j1, j2 = motion[j, 0], motion[j, 1], motion[j, 2]
        k0, k1, k2 = motion[k, 0], motion[k, 1], motion[k, 2]
        for l in range(U(MESH_LANES)):
            p0, p1, p2 = sp * cross[p, 0, l], sp * cross[p, 1, l], sp * cross[p, 2, l]
            q0, q1, q2 = sq * cross[q, 0, l], sq * cross[q, 1, l], sq * cross[q, 2, l]
            s0, s1, s2 = ss * cross[s, 0, l], ss * cross[s, 1, l], ss * cross[s, 2, l]
            m0 = arc[p, l] * p0 + arc[q, l] * q0 + arc[s, l] * s0
            m1 = arc[p, l] * p1 + arc[q, l] * q1 + arc[s, l] * s1
            m2 = arc[p, l] * p2 + arc[q, l] * q2 + arc[s, l] * s2
            det = u[i, 0, l] * p0 + u[i, 1, l] * p1 + u[i, 2, l] * p2
            scale = 1.0 / (det if abs(det) > _LEAST_DET else 1e300)
            wi = scale * near[i, l] * (m0 * p0 + m1 * p1 + m2 * p2)
            wj = scale * near[j, l] * (m0 * q0 + m1 * q1 + m2 * q2)
            wk = scale * near[k, l] * (m0 * s0 + m1 * s1 + m2 * s2)
            total = wi + wj + wk
            part[0, l] = total
            part[1, l] = wi * i0 + wj * j0 + wk * k0
            part[2, l] = wi * i1 + wj * j1 + wk * k1
            part[3, l] = wi * i2 + wj * j2 + wk * k2
        # Loops of their own: in one with the other, compilers use no vector instructions.
        for n in range(U(4)):
            for l in range(U(MESH_LANES)):
                sums[n, l] += part[n, l]
                sums[n + U(4), l] += part[n, l] if part[0, l] >= 0.0 else -part[n, l]
        for l in range(U(MESH_LANES)):
            h = h0 * x[0, l] + h1 * x[1, l] + h2 * x[2, l] - h3
            a = a0 * x[0, l] + a1 * x[1, l] + a2 * x[2, l] - a3
            b = b0 * x[0, l] + b1 * x[1, l] + b2 * x[2, l] - b3
            c = c0 * x[0, l] + c1 * x[1, l] + c2 * x[2, l] - c3
            d = h * h if min(a, min(b, c)) >= 0.0 else 1e300
            away[l] = min(away[l], d)


@njit(parallel=True, **FAST)
def blend_motion(places, vertices, edges, faces, sides, signs, walls, motion, out):
    """Writes out [N,4]: the motion blended at places [N,3], and their distance from the mesh, 0 inside.

    vertices [V,3] and their motion [V,3]; edges [E,2]; faces [F,3], with the edges opposite to each vertex,
    sides [F,3], and 1 or -1 where these go along the face or against it, signs [F,3]; walls [F,16], planes
    n . x - b of the faces and, perpendicular to them, of their edges, inwards.

    Inside, the blend is that of the mean value coordinates; outside, of the sizes of their triangles' parts,
    all positive: a mean of the vertices' motion that does not grow with the distance. Both are the motion of
    the surface on it. The sum of the weights is positive inside, negative outside.
    """
    blocks = (len(places) + MESH_LANES - 1) // MESH_LANES
    for part in prange(blocks):
        first = np.intp(part) * MESH_LANES
        x, away, sums = np.empty((3, MESH_LANES)), np.empty(MESH_LANES), np.empty((8, MESH_LANES))
        u, near = np.empty((len(vertices), 3, MESH_LANES)), np.empty((len(vertices), MESH_LANES))
        cross, arc = np.empty((len(edges), 3, MESH_LANES)), np.empty((len(edges), MESH_LANES))
        for l in range(U(MESH_LANES)):
            row = min(first + l, len(places) - 1)
            x[0, l], x[1, l], x[2, l] = places[row, 0], places[row, 1], places[row, 2]
        _see(x, vertices, edges, u, near, arc, cross, away)
        _weigh(x, faces, sides, signs, walls, motion, u, near, arc, cross, away, sums)
        for l in range(min(MESH_LANES, len(places) - first)):
            outside = 0 if sums[0, l] > 0.0 else 4
            for n in range(3):
                out[first + l, n] = sums[outside + 1 + n, l] / sums[outside, l]
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
