"""What takes the place of the field where a discrete edit took something away.

A patch belongs to an edit and to the field that it was made for (`cagefield.patches`); it is no part of an
edit file. It is read in deformed space of the edits before its own.
"""

from __future__ import annotations

from dataclasses import dataclass

from cagefield.cages import Cage
from cagefield.fields.voxel import VoxelField


@dataclass(frozen=True, eq=False)
class Patch:
    """Layers (`fields.layers`) of the field that an edit was made for.

    Attributes:
        region: outside of V, samples in this cage read `under`; it holds V^c.
        under: what the region shows with the content of V^c gone: filled, and in its new light.
        part: what V shows, at its place in V^c; None where it is the field itself.
    """

    region: Cage
    under: VoxelField
    part: VoxelField | None = None

    @property
    def layers(self) -> tuple[VoxelField, ...]:
        """`under`, and `part` where there is one."""
        return (self.under,) if self.part is None else (self.under, self.part)
