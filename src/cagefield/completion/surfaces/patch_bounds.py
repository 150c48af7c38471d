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
    edit: Edit,
    voxel: float,
    max_radius: float,
    *,
    include_destination: bool = True,
    shadow_directions: Array = NO_SHADOW_DIRECTIONS,
) -> Array:
    """World-space box [2,3] (min, max) in which a discrete edit's patch is computed, and lies.

    Args:
        voxel: the longest edge of a voxel, world units.
        max_radius: the largest occlusion radius (`LightModel.max_radius`), world units; 0 if the light
            stays.
        include_destination: whether the patch changes light, or blends a seam, at the part's new place.
        shadow_directions: directions [K,3] of cast shadows.
    """
    box = edit.inner.aabb if not isinstance(edit, Paste) else edit.deformed.aabb
    box = extrude_box(box, shadow_directions)
    margin = max(SUPPORT_DISTANCE_VOXELS * voxel, 0.5 * float(np.median(box[1] - box[0])))
    if max_radius > 0.0:
        margin = max(margin, 1.5 * max_radius + SUPPORT_DISTANCE_VOXELS * voxel)
    if include_destination and (
        max_radius > 0.0 or len(shadow_directions) or (edit.feather > 0.0 and not isinstance(edit, Paste))
    ):
        destination = extrude_box(edit.deformed.aabb, shadow_directions)
        box = np.stack([np.minimum(box[0], destination[0]), np.maximum(box[1], destination[1])])
    return np.asarray(box + margin * np.array([[-1.0], [1.0]]))
