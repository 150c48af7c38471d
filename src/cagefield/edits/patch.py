"""What takes the place of the field where a discrete edit took something away, or brought something in.

A patch belongs to an edit and to the field that it was made for (`cagefield.patches`); it is no part of an
edit file. It is read in deformed space of the edits before its own.
"""

from __future__ import annotations

from dataclasses import dataclass

from cagefield.cages import Cage
from cagefield.fields.splat import SplatField
from cagefield.fields.voxel import VoxelField


@dataclass(frozen=True, eq=False)
class Patch:
    """Layers (`fields.layers`) of the field that an edit was made for.

    Attributes:
        region: outside of V, samples in this cage read `under`; it holds V^c. None where there is no `under`.
        under: what the region shows with the content of V^c gone: filled, and in its new light.
        part: what V shows, at its place in V^c; None where it is the field itself.
        place: of a paste (`Edit.source`), the cage in this field's grid where `part` has what V^c holds in
            the other scene.
        splats: of a paste into splats, those in V^c, in the other scene's space.
    """

    region: Cage | None = None
    under: VoxelField | None = None
    part: VoxelField | None = None
    place: Cage | None = None
    splats: SplatField | None = None

    @property
    def alone(self) -> Patch | None:
        """The patch without what it shows around V: that of a paste, or None."""
        return None if self.place is None else Patch(part=self.part, place=self.place)

    @property
    def layers(self) -> tuple[VoxelField, ...]:
        """`under` and `part`, those of them that there are."""
        return tuple(layer for layer in (self.under, self.part) if layer is not None)
