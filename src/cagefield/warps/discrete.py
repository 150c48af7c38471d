"""Discrete adjustment: only the inner region changes. Move, copy, delete and paste."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cagefield.geometry.cage import Cage
from cagefield.typing import Array
from cagefield.warps.hexahedron_map import HexahedronMap
from cagefield.warps.interfaces import Mapped


@dataclass(frozen=True)
class DiscreteWarp:
    """Move (V shows the content of V^c, the rest of V^c is empty), copy (V^c stays), delete (V^c is empty).

    `inner` maps V onto V^c; None deletes, and then `source` is the cage that is emptied. `patched` is the
    region, V^c and its surroundings, where a patch takes the place of the field (`edits.patch`). The
    content of V is `pasted` where it comes from another scene: nothing of this scene goes there.
    """

    source: Cage
    inner: HexahedronMap | None
    keep_source: bool = False
    patched: Cage | None = None
    pasted: bool = False

    @property
    def region(self) -> Cage | None:
        """Where the field is not read outside of V: the patched region, V^c, or nothing for a copy."""
        return self.patched or (None if self.keep_source else self.source)

    def to_canonical(self, points: Array) -> Mapped:
        """In V: phi. In the region minus V: lost (empty, or read from a patch). Elsewhere unchanged."""
        mapped = Mapped.identity(points)
        inside = np.zeros(len(points), dtype=bool)
        if self.inner is not None:
            inside, canonical, J = self.inner(points)
            mapped.put(inside, canonical, J)
            mapped.inside[:] = inside
        if self.region is not None:
            mapped.lost[:] = self.region.contains(points) & ~inside
        return mapped

    def to_deformed(self, points: Array) -> Mapped:
        """From V^c: into V, also for a copy (the map is single valued, and the original stays besides).

        Lost are the points of V outside V^c, which the moved content covers, and for a delete those of V^c. A
        paste moves no point of this scene.
        """
        mapped = Mapped.identity(points)
        if self.inner is None:
            mapped.lost[:] = self.source.contains(points)
            return mapped
        if self.pasted:
            return mapped
        inside, deformed, J = self.inner.inverse(points)
        mapped.put(inside, deformed, J)
        mapped.lost[:] = self.inner.deformed.contains(points) & ~inside
        return mapped
