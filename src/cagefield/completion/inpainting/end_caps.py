"""A part's cut end is closed: where it was held, or stood, its own surface goes on.

The part and what it was cut from change roles: what touches the part from outside stands on one of the part's
faces, as `support_around` finds it, and that face is rebuilt under it.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from cagefield.completion.inpainting.support_inpainting import inpaint_support
from cagefield.completion.lighting.light_change import MAX_TRUSTED_LOG_GAIN, LightChange, is_reliable
from cagefield.completion.surfaces.footprint import CONTACT_DISTANCE_VOXELS, build_footprint
from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.completion.surfaces.patch_bounds import SUPPORT_DISTANCE_VOXELS
from cagefield.completion.surfaces.support_plane import find_support
from cagefield.completion.surfaces.surfels import Surfels
from cagefield.completion.surfaces.visibility import CameraVisibility
from cagefield.edits.stack import EditStack
from cagefield.typing import Mask

TOUCH_DISTANCE_VERTICES = 4
"""What comes this near to a part touches it; voxels."""


def close_cut_end(
    block: GridBlock,
    inside: Mask,
    part: Surfels,
    light: LightChange | None,
    below: EditStack,
    sight: CameraVisibility | None,
) -> GridBlock:
    """The part's block, which is in its new light, with its face going on where it was held.

    As it is, where the part has no face that something stood on.
    """
    held = block.solid & ~inside
    held &= ndimage.binary_dilation(block.solid & inside, iterations=TOUCH_DISTANCE_VERTICES)
    if not held.any() or not len(part.points):
        return block
    at = block.coordinates(part.points)
    away = ndimage.distance_transform_edt(~held)
    away = np.asarray(ndimage.map_coordinates(away, at.T, order=1, mode="nearest"))
    near = away < max(SUPPORT_DISTANCE_VOXELS, 0.5 * float(np.median(np.ptp(at, axis=0))))
    support = find_support(held, part, at, near, max(block.spacing))
    if support is None:
        return block
    log = np.zeros(len(at)) if light is None else light.at(block, part.points)
    dark = log > MAX_TRUSTED_LOG_GAIN
    footprint = build_footprint(
        support, held, at[near & (away < CONTACT_DISTANCE_VOXELS)], Surfels(at[dark], part.normals[dark])
    )
    if footprint is None:
        return block
    points = footprint.points(block)
    if sight is not None:
        footprint = footprint.without(is_reliable(points, below, sight, block, light), held)
    return inpaint_support(block, footprint, ~inside) if footprint.hole.any() else block
