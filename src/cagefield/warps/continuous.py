"""Continuous adjustment: the inner region moves, the shell around it gives way, nothing else changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cagefield.geometry.cage import Cage
from cagefield.typing import Array
from cagefield.warps.hexahedron_map import HexahedronMap
from cagefield.warps.interfaces import InnerMap, Mapped, NoInnerMap, Shell
from cagefield.warps.lattice import Lattice


@dataclass(frozen=True)
class ContinuousWarp:
    """phi in V, phi' in V^o minus V, the identity outside V^o.

    With a lattice, phi' in `to_canonical` is interpolated from it; V, if it is a hexahedron, and the outside
    stay exact. `to_deformed` is always exact, so with a lattice the round trip closes to the lattice's error.
    """

    inner: InnerMap
    outer: Cage
    shell: Shell
    lattice: Lattice | None = None

    @property
    def hexahedra(self) -> HexahedronMap | None:
        """`inner` where the inner cage is a hexahedron: kernels know no other regions than hexahedra."""
        return self.inner if isinstance(self.inner, HexahedronMap) else None

    def to_canonical(self, points: Array) -> Mapped:
        """Deformed points [N,3] to canonical space."""
        if self.lattice is None:
            return _by_region(points, self.inner, self.outer, self.shell.to_canonical)
        inner = self.hexahedra or NoInnerMap()
        return _by_region(points, inner, self.outer, self.lattice.to_canonical)

    def shell_points(self, samples: int, seed: int = 0) -> Array:
        """Random points [N,3], N <= `samples`, of those that a lattice interpolates: in V^o, and outside of V
        where that is a hexahedron. Drawn in the outer cage's frame, the others rejected.
        """
        origin, frame = self.outer.frame
        points = origin + np.random.default_rng(seed).random((samples, 3)) @ frame.T
        points = points[self.outer.contains(points)]
        return points[~(self.hexahedra or NoInnerMap())(points)[0]]

    def to_deformed(self, points: Array) -> Mapped:
        """Canonical points [N,3] to deformed space."""
        return _by_region(points, self.inner.inverse, self.outer, self.shell.to_deformed)


def _by_region(
    points: Array, inner: InnerMap, outer: Cage, shell: Callable[[Array], tuple[Array, Array]]
) -> Mapped:
    mapped = Mapped.identity(points)
    in_outer = outer.contains(points)
    rows = np.flatnonzero(in_outer)
    in_inner, inner_points, inner_J = inner(points[rows])
    mapped.put(rows[in_inner], inner_points, inner_J)
    rest = rows[~in_inner]
    if len(rest):
        mapped.put(rest, *shell(points[rest]))
    return mapped
