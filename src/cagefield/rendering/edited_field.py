"""A field as its edits make it, to be asked at points of deformed space."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cagefield.edits import EditMap
from cagefield.edits.device_stack import DeviceStack
from cagefield.fields.protocol import Field
from cagefield.typing import Array, Float32


@dataclass(frozen=True, eq=False)
class EditedField:
    """A `Field` in deformed space: sigma(p) = |J d| sigma_c(p_c) of the canonical field along d.

    |J d| is 1 where `preserve_opacity` is False; sigma is 0 where an edit left nothing.
    """

    field: Field
    edits: EditMap
    bounds: NDArray[np.float64]
    preserve_opacity: bool = True

    @cached_property
    def _stack(self) -> DeviceStack:
        return DeviceStack.from_stack(self.edits)

    def __call__(self, positions: Float32, viewdirs: Float32) -> tuple[Float32, Float32]:
        """(sigma [N], rgb [N,3]) at deformed positions [N,3] along unit viewdirs [N,3]."""
        points, along, stretch, places = self._stack.to_canonical(
            np.asarray(positions, np.float32), np.asarray(viewdirs, np.float32)
        )
        sigma, rgb = self.field(points, along)
        for layer, place in zip(self.edits.layers, self.edits.places, strict=True):
            rows = np.flatnonzero(places == place)
            if len(rows):
                sigma[rows], rgb[rows] = layer(points[rows], along[rows])
        if self.preserve_opacity:
            sigma = sigma * stretch
        return np.where(places < 0, 0.0, sigma).astype(np.float32), rgb


def edited_bounds(bounds: Array, edits: EditMap) -> NDArray[np.float64]:
    """The box [2,3] of a field's bounds and of all that active edits move somewhere else."""
    boxes = np.concatenate([bounds[None], *(step.boxes for step in edits.steps)])
    return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])
