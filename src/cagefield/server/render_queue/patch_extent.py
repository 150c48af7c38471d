"""Where the patches of discrete edits show: the server has the edits, the rendering process their patches."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from cagefield.completion.continuous_relighting import light_box
from cagefield.completion.lighting.ambient_occlusion import RADII_DIAGONALS, occlusion_radii
from cagefield.completion.patch_stages import needs_patch, needs_relighting
from cagefield.completion.surfaces.patch_bounds import ANY_SHADOW_DIRECTIONS, NO_SHADOW_DIRECTIONS, patch_box
from cagefield.completion.surfaces.splat_voxelization import max_voxel_size
from cagefield.edits import Continuous, Edit
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.server.editor.identity_cache import IdentityCache
from cagefield.typing import Array

MAX_KNOWN = 64
"""Edits whose boxes are remembered: those of drags come and go."""


class PatchExtent:
    """See the module. Of one field."""

    def __init__(self, field: VoxelField | SplatField) -> None:
        self._field = field
        self._known: IdentityCache[Edit, Array] = IdentityCache(MAX_KNOWN)

    @cached_property
    def _reach(self) -> float:
        if isinstance(self._field, VoxelField):
            return max(occlusion_radii(self._field), default=0.0)
        return RADII_DIAGONALS[-1] * float(np.linalg.norm(self._field.bounds[1] - self._field.bounds[0]))

    def boxes(self, edit: Edit) -> Array:
        """Boxes [B,2,3] (min, max) in deformed space outside which the edit, patched, changes nothing.

        Remembered for the edits that were asked about last.
        """
        found = self._known.get(edit)
        return self._known.put(edit, self._boxes(edit)) if found is None else found

    def _boxes(self, edit: Edit) -> Array:
        if not (needs_patch(edit) or needs_relighting(edit)):
            return edit.boxes
        reach = 0.0 if edit.relight == "none" else self._reach
        if isinstance(self._field, VoxelField):
            voxel = float(self._field.voxel_size.max())
        else:
            voxel = max_voxel_size(_box(edit, 0.0, reach))
        box = _box(edit, voxel, reach)
        return np.concatenate([edit.boxes, box[None]])


def _box(edit: Edit, voxel: float, reach: float) -> Array:
    # Where the light comes from is found out elsewhere.
    falls = NO_SHADOW_DIRECTIONS if edit.relight in ("occlusion", "none") else ANY_SHADOW_DIRECTIONS
    if isinstance(edit, Continuous):
        return light_box(edit, voxel, reach, falls)
    return patch_box(edit, voxel, reach, shadow_directions=falls)
