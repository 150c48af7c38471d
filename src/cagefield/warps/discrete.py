"""Discrete adjustment: only the inner region changes. Move, copy and delete."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cagefield.cages import Cage
from cagefield.typing import Array
from cagefield.warps.inner_map import HexahedronMap
from cagefield.warps.interfaces import Mapped


@dataclass(frozen=True)
class DiscreteWarp:
    """Move (V shows what was in V^c, the rest of V^c is empty), copy (V^c stays), delete (V^c is empty).

    `inner` maps V onto V^c; None deletes, and then `source` is the cage that is emptied.
    """

    source: Cage
    inner: HexahedronMap | None
    keep_source: bool = False

    def to_canonical(self, points: Array) -> Mapped:
        """In V: phi. In V^c minus V: lost (empty), or unchanged for a copy. Elsewhere unchanged."""
        mapped = Mapped.identity(points)
        inside = np.zeros(len(points), dtype=bool)
        if self.inner is not None:
            inside, canonical, J = self.inner(points)
            mapped.put(inside, canonical, J)
        if not self.keep_source:
            mapped.lost[:] = self.source.contains(points) & ~inside
        return mapped

    def to_deformed(self, points: Array) -> Mapped:
        """From V^c: into V, also for a copy (the map is single valued, and the original stays besides).

        Lost are the points of V outside V^c, which the moved content covers, and for a delete those of V^c.
        """
        mapped = Mapped.identity(points)
        if self.inner is None:
            mapped.lost[:] = self.source.contains(points)
            return mapped
        inside, deformed, J = self.inner.inverse(points)
        mapped.put(inside, deformed, J)
        mapped.lost[:] = self.inner.deformed.contains(points) & ~inside
        return mapped
