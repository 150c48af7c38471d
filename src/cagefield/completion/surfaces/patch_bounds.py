"""Bounds of the patch of an edit: how far around its cages the patch may change the image."""

from __future__ import annotations

import numpy as np

from cagefield.edits import Edit, Paste
from cagefield.typing import Array

SUPPORT_DISTANCE_VOXELS = 6.0
"""Distance from V^c within which a support is searched, voxels; half the size of V^c where that is more."""


SHADOW_LENGTH_DIAGONALS = 2.0
"""Maximum length of a cast shadow, in diagonals of the box of the content that casts it."""

ANY_SHADOW_DIRECTIONS = np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 1.0, 0], [0, -1.0, 0], [0, 0, -1.0]])
"""Directions [5,3] that bound the cast shadows of a light of unknown direction."""

NO_SHADOW_DIRECTIONS = np.zeros((0, 3))
"""Directions [0,3] of no cast shadow."""


def extrude_box(box: Array, shadow_directions: Array) -> Array:
    """Box [2,3] that holds a box [2,3] and its cast shadows along `shadow_directions` [K,3]; world units."""
    offsets = (
        SHADOW_LENGTH_DIAGONALS
        * float(np.linalg.norm(box[1] - box[0]))
        * np.concatenate([np.zeros((1, 3)), shadow_directions])
    )
    return np.stack([box[0] + offsets.min(axis=0), box[1] + offsets.max(axis=0)])


def patch_box(
    edit: Edit, voxel: float, max_radius: float, *, shadow_directions: Array = NO_SHADOW_DIRECTIONS
) -> Array:
    """World-space box [2,3] (min, max) in which the removal of a part changes content and light.

    Of a paste the box around its place.

    Args:
        voxel: the longest edge of a voxel, world units.
        max_radius: the largest occlusion radius (`LightModel.max_radius`), world units; 0 if the light
            stays.
        shadow_directions: directions [K,3] of cast shadows.
    """
    box = edit.inner.aabb if not isinstance(edit, Paste) else edit.deformed.aabb
    return _with_margin(extrude_box(box, shadow_directions), voxel, max_radius)


def destination_box(
    edit: Edit, voxel: float, max_radius: float, *, shadow_directions: Array | None = None
) -> Array | None:
    """World-space box [2,3] in which a part changes light, or blends a seam, at its new place.

    None where it does neither; arguments as in `patch_box`.
    """
    directions = NO_SHADOW_DIRECTIONS if shadow_directions is None else shadow_directions
    has_seam = edit.feather > 0.0 and not isinstance(edit, Paste)
    if max_radius == 0.0 and not len(directions) and not has_seam:
        return None
    return _with_margin(extrude_box(edit.deformed.aabb, directions), voxel, max_radius)


def _with_margin(box: Array, voxel: float, max_radius: float) -> Array:
    """Box [2,3] with room for a support, and for light; arguments as in `patch_box`."""
    margin = max(SUPPORT_DISTANCE_VOXELS * voxel, 0.5 * float(np.median(box[1] - box[0])))
    if max_radius > 0.0:
        margin = max(margin, 1.5 * max_radius + SUPPORT_DISTANCE_VOXELS * voxel)
    return np.asarray(box + margin * np.array([[-1.0], [1.0]]))
