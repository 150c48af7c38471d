"""Edits as renderers take them: with the patches of the field that they were prepared for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cagefield.edits.edit import Delete, Discrete, Edit, Paste, bounds_of
from cagefield.edits.patch import Pasted, Patch, SplatPatch
from cagefield.errors import EditError
from cagefield.fields.voxel_field import VoxelField
from cagefield.typing import Array
from cagefield.warps import Warp
from cagefield.warps.discrete import DiscreteWarp


@dataclass(frozen=True)
class PreparedEdit:
    """An edit, and the content that it shows instead of the field (`cagefield.completion`); in no edit file.

    Parameters
    - edit: the edit of the document.
    - patch: of a discrete edit, the content of the region around V^c after the edit.
    - pasted: of a paste, the content read from its source.
    - light: of a continuous edit, a patch in canonical space of the edit that changes the light before the
      edit moves anything.
    - is_light: whether this is the `light` of an edit.
    """

    edit: Edit
    patch: Patch | SplatPatch | None = None
    pasted: Pasted | None = None
    light: PreparedEdit | None = None
    is_light: bool = False

    @cached_property
    def steps(self) -> tuple[PreparedEdit, ...]:
        """Maps of the edit, first to last: that of its light, if any, and its own; none where it is not
        shown."""
        if not (self.edit.enabled and self.edit.changes_anything):
            return ()
        return (self,) if self.light is None else (self.light, replace(self, light=None))

    @property
    def is_light_alone(self) -> bool:
        """Whether splats change in their light alone: the step of a continuous edit's light."""
        return isinstance(self.patch, SplatPatch) and self.is_light and self.patch.is_light_alone

    @property
    def is_bare(self) -> bool:
        """True where the map is that of the edit alone."""
        return self.patch is None and self.pasted is None

    @property
    def under(self) -> VoxelField | None:
        """Layer shown in the patch's region, or None."""
        return self.patch.under if isinstance(self.patch, Patch) else None

    @property
    def part(self) -> VoxelField | None:
        """Layer shown in V in place of the field, or None."""
        if self.pasted is not None:
            return self.pasted.part
        return self.patch.part if isinstance(self.patch, Patch) else None

    @property
    def layers(self) -> tuple[VoxelField, ...]:
        """`under` and `part`, as far as they are set."""
        return tuple(layer for layer in (self.under, self.part) if layer is not None)

    @property
    def boxes(self) -> Array:
        """Deformed-space boxes [B,2,3] (min, max), B 0 to 2, outside which the edit changes nothing."""
        if self.patch is None or not self.edit.changes_anything:
            return self.edit.boxes
        cages = [] if isinstance(self.edit, Delete) else [self.edit.deformed]
        return np.array([cage.aabb for cage in [*cages, self.patch.region]]).reshape(-1, 2, 3)

    @property
    def bounds(self) -> Array:
        """The box [2,3] that holds `boxes`; (inf, -inf) for an edit that changes nothing."""
        return bounds_of(self.boxes)

    @cached_property
    def exact_warp(self) -> Warp:
        """The map without a lattice. Raises `EditError` where the edit cannot be evaluated."""
        return self._patched(self.edit.exact_warp)

    @cached_property
    def warp(self) -> Warp:
        """The map through the edit's lattice, if any. Raises `EditError` as `exact_warp` does."""
        return self._patched(self.edit.warp)

    def without_lattice(self) -> PreparedEdit:
        """The prepared edit evaluated exactly."""
        return replace(self, edit=self.edit.without_lattice())

    def unread(self) -> EditError:
        """Error of a paste whose source has not been read."""
        assert isinstance(self.edit, Paste)
        return self.edit.unread()

    def _patched(self, warp: Warp) -> Warp:
        if self.is_bare or not isinstance(warp, DiscreteWarp) or not isinstance(self.edit, Discrete):
            return warp
        if self.pasted is not None and self.pasted.place is not None:
            warp = replace(warp, inner=self.edit.map_between(self.pasted.place, self.edit.deformed))
        return replace(warp, patched=None if self.patch is None else self.patch.read_instead)
