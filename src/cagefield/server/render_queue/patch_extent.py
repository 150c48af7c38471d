"""Where the patches of discrete edits show: the server has the edits, the rendering process their patches."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from cagefield.completion.continuous_relighting import light_box
from cagefield.completion.lighting.ambient_occlusion import REACHES, reaches_of
from cagefield.completion.patcher import wants_light, wants_patch
from cagefield.completion.surfaces.patch_bounds import EVERYWHERE, NOWHERE, patch_box
from cagefield.completion.surfaces.splat_voxelization import coarsest_voxel
from cagefield.edits import Edit
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.typing import Array


class PatchExtent:
    """See the module. Of one field."""

    def __init__(self, field: VoxelField | SplatField) -> None:
        self._field = field

    @cached_property
    def _reach(self) -> float:
        if isinstance(self._field, VoxelField):
            return max(reaches_of(self._field), default=0.0)
        return REACHES[-1] * float(np.linalg.norm(self._field.bounds[1] - self._field.bounds[0]))

    def boxes(self, edit: Edit) -> Array:
        """Boxes [B,2,3] (min, max) in deformed space outside which the edit, patched, changes nothing."""
        if not (wants_patch(edit) or wants_light(edit)):
            return edit.boxes
        reach = 0.0 if edit.relight == "none" else self._reach
        if isinstance(self._field, VoxelField):
            voxel = float(self._field.voxel_size.max())
        else:
            voxel = coarsest_voxel(_box(edit, 0.0, reach))
        box = _box(edit, voxel, reach)
        return np.concatenate([edit.boxes, box[None]])


def _box(edit: Edit, voxel: float, reach: float) -> Array:
    # Where the light comes from is found out elsewhere.
    falls = NOWHERE if edit.relight in ("occlusion", "none") else EVERYWHERE
    if edit.adjustment == "continuous":
        return light_box(edit, voxel, reach, falls)
    return patch_box(edit, voxel, reach, falls=falls)
