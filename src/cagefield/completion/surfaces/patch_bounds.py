"""How far around its cages the patch of an edit can change what is seen."""

from __future__ import annotations

import numpy as np

from cagefield.edits import Edit
from cagefield.typing import Array

SUPPORT_DISTANCE_VOXELS = 6.0
"""A support is looked for within this distance of V^c, voxels, or within half of its size."""


SHADOW_LENGTH_DIAGONALS = 2.0
"""Cast shadows are followed so far, diagonals of what casts them."""

ANY_SHADOW_DIRECTIONS = np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 1.0, 0], [0, -1.0, 0], [0, 0, -1.0]])
"""Where shadows may fall of a light that is not known."""


def extrude_box(box: Array, falls: Array) -> Array:
    """A box [2,3] grown by where the shadows of what it holds may fall, directions [K,3]."""
    ways = (
        SHADOW_LENGTH_DIAGONALS
        * float(np.linalg.norm(box[1] - box[0]))
        * np.concatenate([np.zeros((1, 3)), falls])
    )
    return np.stack([box[0] + ways.min(axis=0), box[1] + ways.max(axis=0)])


NO_SHADOW_DIRECTIONS = np.zeros((0, 3))


def patch_box(
    edit: Edit, voxel: float, reach: float, *, settled: bool = True, falls: Array = NO_SHADOW_DIRECTIONS
) -> Array:
    """The box [2,3] (min, max) that a discrete edit's patch is made from; the patch lies in it. World units.

    `voxel` is the largest edge of a voxel. `reach` is that of the light (`Ambience.reach`), 0 where the light
    stays. Unless it is `settled`, the light at the part's new place stays, and its seam. Cast
    shadows go along that fall in directions [K,3], `falls`.
    """
    box = edit.inner.aabb if edit.source is None else edit.deformed.aabb
    box = extrude_box(box, falls)
    margin = max(SUPPORT_DISTANCE_VOXELS * voxel, 0.5 * float(np.median(box[1] - box[0])))
    if reach > 0.0:
        margin = max(margin, 1.5 * reach + SUPPORT_DISTANCE_VOXELS * voxel)
    if settled and (reach > 0.0 or len(falls) or (edit.feather > 0.0 and edit.source is None)):
        moved = extrude_box(edit.deformed.aabb, falls)
        box = np.stack([np.minimum(box[0], moved[0]), np.maximum(box[1], moved[1])])
    return np.asarray(box + margin * np.array([[-1.0], [1.0]]))
