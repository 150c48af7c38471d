"""Weight of a continuous edit's grade between its cages, in canonical space.

Notation as in `FlowShell`: xi are affine coordinates of the inner cage, pushed outwards until [-1,1]^3 holds
all its points; z those of the outer cage, pulled inwards until all its corners are outside of (-1,1)^3; h and
H the distances of their pairs of faces from their centers. With p = 4,

    d_i = |e|_p,  e_a = h_a max(|xi_a| - 1, 0);    1 / d_o = |1 / D|_p,  D_a = H_a (1 - z_a^2) / 2,
    w = g^2 (3 - 2 g),  g = d_o / (d_i + d_o)

in the shell; w = 1 where d_i = 0, and 0 where some |z_a| >= 1: 1 in the inner cage, 0 outside the outer one,
and smooth between them. Of a lattice or a mesh cage the inner region is the box, along its own axes, that
holds it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from cagefield.geometry import hexahedron
from cagefield.geometry.cage import Cage
from cagefield.typing import Array


@dataclass(frozen=True)
class GradeFalloff:
    """Weight of a grade between two cages.

    Each frame is [4,3]: rows 0 to 2 the matrix W, row 3 the center c of the affine coordinates W (p - c).
    """

    inner: Array
    outer: Array

    @classmethod
    def between(cls, inner: Cage, outer: Cage) -> GradeFalloff:
        """Falloff from a canonical inner cage to an outer cage."""
        points = np.concatenate([inner.corners, inner.handles])
        W, c = _center_frame(inner.corners)
        y = (points - c) @ W.T
        around = _frame(W, c, y.min(axis=0), y.max(axis=0))
        W, c = _center_frame(outer.corners)
        y = (outer.corners - c) @ W.T
        high = np.where(hexahedron.BITS == 1.0, y, np.inf).min(axis=0)
        low = np.where(hexahedron.BITS == 0.0, y, -np.inf).max(axis=0)
        return cls(around, _frame(W, c, low, high))

    def weights(self, points: ArrayLike) -> Array:
        """w [N] in [0, 1] at canonical points [N,3]."""
        p = np.asarray(points, np.float64)
        xi, z = (np.abs((p - frame[3]) @ frame[:3].T) for frame in (self.inner, self.outer))
        h, H = (1.0 / np.linalg.norm(frame[:3], axis=1) for frame in (self.inner, self.outer))
        d_i = (((h * np.maximum(xi - 1.0, 0.0)) ** 4).sum(axis=1)) ** 0.25
        D = 0.5 * H * np.maximum(1.0 - z * z, 1e-12)
        d_o = ((D**-4).sum(axis=1)) ** -0.25
        g = d_o / (d_i + d_o)
        w = np.where((z >= 1.0).any(axis=1), 0.0, g * g * (3.0 - 2.0 * g))
        return np.where((xi <= 1.0).all(axis=1), 1.0, w)


def _center_frame(corners: Array) -> tuple[Array, Array]:
    """(W [3,3], c [3]) of the affine coordinates at the center of a hexahedron [8,3]."""
    C = hexahedron.coefficients(corners)
    return hexahedron.center_inverse(C), C[0]


def _frame(W: Array, c: Array, low: Array, high: Array) -> Array:
    """Frame [4,3] whose coordinates are -1 at `low` and 1 at `high` of y = W (p - c)."""
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    return np.concatenate([W / half[:, None], (c + np.linalg.solve(W, middle))[None]])
