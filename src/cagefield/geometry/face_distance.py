"""Signed distance of a point from the faces of a cage."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from cagefield.geometry.cage import FACES, Cage
from cagefield.geometry.cage_checks import vector
from cagefield.typing import Array


def outside_by(cage: Cage, point: ArrayLike) -> tuple[str, float]:
    """(face, distance) of the face of the cage that the point [3] is furthest outside of.

    The distance is signed, positive outside, and measured from the face's nearest point along the outward
    normal there; for planar faces it is the distance to the face's plane.
    """
    p = vector(point, "point")
    best = ("", -np.inf)
    for name, ids in FACES.items():
        distance = _face_distance(cage, ids, p, outward=1.0 if name[0] == "+" else -1.0)
        if distance > best[1]:
            best = (name, distance)
    return best


def _face_distance(cage: Cage, ids: tuple[int, ...], p: Array, outward: float) -> float:
    """Signed distance of p from the bilinear face with corners `ids`, along its normal nearest to p."""
    v = cage.corners[list(ids)]
    axis = next(a for a in range(3) if len({k >> a & 1 for k in ids}) == 1)
    # The face's two directions taken in cyclic order span the axis' positive normal; y has them swapped.
    sign = outward if axis != 1 else -outward
    normal = np.cross(v[3] - v[0], v[2] - v[1])
    size = float(np.linalg.norm(normal))
    if abs(float((v[1] - v[0]) @ normal)) <= 1e-9 * size**1.5:
        return sign * float((p - v[0]) @ normal) / size
    a, b = np.meshgrid(np.linspace(0.0, 1.0, 9), np.linspace(0.0, 1.0, 9))
    s, t = a.ravel(), b.ravel()
    grid = np.outer((1 - s) * (1 - t), v[0]) + np.outer(s * (1 - t), v[1])
    grid += np.outer((1 - s) * t, v[2]) + np.outer(s * t, v[3])
    nearest = int(np.argmin(((grid - p) ** 2).sum(axis=1)))
    st = np.array([s[nearest], t[nearest]])
    for _ in range(20):
        ds = (1 - st[1]) * (v[1] - v[0]) + st[1] * (v[3] - v[2])
        dt = (1 - st[0]) * (v[2] - v[0]) + st[0] * (v[3] - v[1])
        x = v[0] + st[0] * (v[1] - v[0]) + st[1] * dt
        before = st
        st = np.clip(st + np.linalg.lstsq(np.stack([ds, dt], axis=1), p - x, rcond=None)[0], 0.0, 1.0)
        if np.abs(st - before).max() < 1e-12:
            break
    normal = np.cross(ds, dt)
    return sign * float((p - x) @ normal) / float(np.linalg.norm(normal))
