"""Mean value coordinates of closed triangle meshes: the float64 reference.

Notation: x a point, u_j the unit vector from x to vertex v_j, r_j its distance. A triangle (1, 2, 3), seen
from x, has the angles theta_i opposite to its vertices, and adds

    w_i = (theta_i - c_(i+1) theta_(i-1) - c_(i-1) theta_(i+1)) / (r_i sin theta_(i+1) s_(i-1))

to their weights; lambda_j = w_j / sum w. They reproduce affine functions everywhere, interpolate on the
surface, and are positive inside of a convex mesh. Inside of a concave one some may be negative.

Source: Ju, Schaefer, Warren, "Mean value coordinates for closed triangular meshes", SIGGRAPH 2005, figure 4.
"""

from __future__ import annotations

import numpy as np

from cagefield.geometry.triangle_mesh import Triangles
from cagefield.typing import Array

_ON_PLANE = 1e-12


def mean_value_coordinates(vertices: Array, triangles: Triangles, points: Array) -> Array:
    """lambda [N,V] of points [N,3] off the surface of a closed mesh, vertices [V,3], triangles [F,3]."""
    found = np.zeros((len(points), len(vertices)))
    for n, x in enumerate(points):
        found[n] = _weights(vertices, triangles, x)
    return found / found.sum(axis=1, keepdims=True)


def _weights(v: Array, t: Triangles, x: Array) -> Array:
    d = v - x
    r = np.linalg.norm(d, axis=1)
    u = (d / r[:, None])[t]  # [F,3,3]
    edges = np.roll(u, -1, axis=1) - np.roll(u, -2, axis=1)
    theta = 2.0 * np.arcsin((0.5 * np.linalg.norm(edges, axis=2)).clip(0.0, 1.0))
    h = 0.5 * theta.sum(axis=1, keepdims=True)
    sine, after, before = np.sin(theta), np.roll(theta, -1, axis=1), np.roll(theta, 1, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        c = 2.0 * np.sin(h) * np.sin(h - theta) / (np.sin(after) * np.sin(before)) - 1.0
        side = np.sign(np.einsum("fi,fi->f", u[:, 0], np.cross(u[:, 1], u[:, 2])))
        s = side[:, None] * np.sqrt((1.0 - c * c).clip(0.0))
        c_after, c_before = np.roll(c, -1, axis=1), np.roll(c, 1, axis=1)
        w = (theta - c_after * before - c_before * after) / (
            r[t] * np.roll(sine, -1, axis=1) * np.roll(s, 1, axis=1)
        )
    w[(np.abs(s) <= _ON_PLANE).any(axis=1) | ~np.isfinite(w).all(axis=1)] = 0.0
    total = np.zeros(len(v))
    np.add.at(total, t, w)
    return total
