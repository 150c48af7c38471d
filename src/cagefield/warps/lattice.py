"""A shell map from a lattice: the displacement to canonical space, sampled on R^3 nodes and interpolated.

Node (i, j, k) sits at o + F (i, j, k) / (R - 1), with o the origin and F the edge vectors of the box that
the outer cage's affine frame spans, widened until it holds all of its corners. Displacements are canonical
minus deformed position, in world units, stored [R,R,R,3] with z slowest and x fastest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cagefield.geometry.cage import Cage
from cagefield.geometry.hexahedron import BITS
from cagefield.typing import Array


@dataclass(frozen=True)
class Lattice:
    """Trilinear interpolation of a displacement over the outer cage's box.

    Parameters: origin o [3], frame F [3,3] with the box's edge vectors as columns, displacement [R,R,R,3].
    """

    origin: Array
    frame: Array
    displacement: Array

    @classmethod
    def sample(cls, to_canonical: Callable[[Array], Array], outer: Cage, resolution: int) -> Lattice:
        """The lattice of a map given as a function of deformed points [N,3]; R = resolution nodes an axis."""
        origin, frame = outer.frame
        g = np.linspace(0.0, 1.0, resolution)
        displacement = np.empty((resolution,) * 3 + (3,))
        y, x = np.meshgrid(g, g, indexing="ij")
        for k, z in enumerate(g):  # one slice at a time: a lattice of 256^3 needs no more memory than itself
            nodes = origin + np.stack([x.ravel(), y.ravel(), np.full(x.size, z)], axis=1) @ frame.T
            displacement[k] = (to_canonical(nodes) - nodes).reshape(resolution, resolution, 3)
        return cls(origin, frame, displacement)

    @property
    def resolution(self) -> int:
        """Nodes along each axis."""
        return len(self.displacement)

    @cached_property
    def to_nodes(self) -> Array:
        """[3,3] that takes world offsets from the origin to node units."""
        return np.asarray((self.resolution - 1) * np.linalg.inv(self.frame))

    def to_canonical(self, points: Array) -> tuple[Array, Array]:
        """(canonical points [N,3], Jacobians [N,3,3]) of deformed points [N,3] in the box."""
        at = ((points - self.origin) @ self.to_nodes.T).clip(0.0, self.resolution - 1.0)
        cell = np.minimum(at.astype(np.intp), self.resolution - 2)
        f = at - cell
        value, slope = np.zeros_like(points), np.zeros((len(points), 3, 3))
        for bits in BITS:
            i, j, k = (cell + bits.astype(np.intp)).T
            node = self.displacement[k, j, i]
            w = np.where(bits == 1.0, f, 1.0 - f)
            value += node * w.prod(axis=1, keepdims=True)
            for a, (b, c) in enumerate(((1, 2), (0, 2), (0, 1))):
                slope[:, :, a] += node * ((2.0 * bits[a] - 1.0) * w[:, b] * w[:, c])[:, None]
        return points + value, np.eye(3) + slope @ self.to_nodes
