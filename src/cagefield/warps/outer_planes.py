"""The outer cage as six half-spaces, and a weight that falls to 0 at them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cagefield.geometry.cage import FACES, Cage
from cagefield.typing import Array


@dataclass(frozen=True)
class OuterPlanes:
    """Half-spaces n_k . x <= b_k, k = 0 to 5, whose intersection lies in an outer cage.

    normals [6,3] are unit vectors that point outwards. A face that is no plane is taken at the innermost of
    its corners.
    """

    normals: Array
    offsets: Array

    @classmethod
    def from_cage(cls, outer: Cage) -> OuterPlanes:
        """The half-spaces of an outer cage."""
        normals, offsets = np.empty((6, 3)), np.empty(6)
        for k, ids in enumerate(FACES.values()):
            face = outer.corners[list(ids)]
            n = np.cross(face[3] - face[0], face[2] - face[1])
            n /= np.linalg.norm(n)
            normals[k] = n if n @ (face.mean(axis=0) - outer.center) > 0.0 else -n
            offsets[k] = (face @ normals[k]).min()
        return cls(normals, offsets)

    def distances(self, points: Array) -> Array:
        """b_k - n_k . x [N,6] of points [N,3], positive inside."""
        return np.asarray(self.offsets - points @ self.normals.T)

    def weight(self, points: Array, width: float) -> tuple[Array, Array]:
        """(w [N], dw/dx [N,3]): 1 where all distances are at least `width`, falling to 0 at the planes.

        w = prod_k S(d_k / width), S(s) = 3 s^2 - 2 s^3.
        """
        s = (self.distances(points) / width).clip(0.0, 1.0)
        each = s * s * (3.0 - 2.0 * s)
        slope = -6.0 * s * (1.0 - s) / width
        gradient = np.zeros_like(points)
        for k in range(6):
            others = np.delete(each, k, axis=1).prod(axis=1)
            gradient += (others * slope[:, k])[:, None] * self.normals[k]
        return each.prod(axis=1), gradient

    def slope_bound(self, width: float) -> float:
        """Bound of |dw/dx| for a width of at most half the distance of opposite faces that are parallel.

        dw/dx is a sum of the normals of the planes within `width`, each times 1.5 / width at most. Of two
        parallel planes only one is that near.
        """
        pairs = self.normals.reshape(3, 2, 3)
        is_parallel = np.abs(pairs.sum(axis=1)).max() < 1e-9
        near = pairs[:, 0] if is_parallel else self.normals
        return float(1.5 / width * np.sqrt(len(near)) * np.linalg.norm(near, 2))
