"""Map of an edit stack evaluated by the renderer's kernel, in float32."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from cagefield.edits.device_stack import DeviceStack
from cagefield.edits.edit_map import EditMap, SpaceMap
from cagefield.edits.mapped_samples import KernelSamples
from cagefield.fields.voxel_field import VoxelField
from cagefield.typing import Array


@dataclass(frozen=True)
class KernelMap(SpaceMap):
    """The map of `edits` in float32, as pictures show it. Raises `EditError` as `DeviceStack.from_stack`."""

    edits: EditMap

    @property
    def boxes(self) -> Array:
        return self.edits.boxes

    @property
    def layers(self) -> tuple[VoxelField, ...]:
        return self.edits.layers

    @cached_property
    def _packed(self) -> DeviceStack:
        return DeviceStack.from_stack(self.edits)

    def to_canonical(self, points: ArrayLike, viewdirs: ArrayLike | None = None) -> KernelSamples:
        """Canonical samples of deformed points [N,3] and unit view directions [N,3], +z by default."""
        p = np.asarray(points, np.float32)
        d = np.broadcast_to(np.array([0, 0, 1], np.float32), p.shape) if viewdirs is None else viewdirs
        canonical, along, stretch, places = self._packed.to_canonical(p, np.asarray(d, np.float32))
        layer = np.minimum(places, 0).astype(np.int64)
        for number, place in enumerate(self.edits.places, start=1):
            layer[places == place] = number
        grade = self._packed.grade(p) if self._packed.is_graded else None
        return KernelSamples(canonical, along, stretch, layer, grade)
