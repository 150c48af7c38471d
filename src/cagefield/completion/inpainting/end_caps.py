"""A part's cut end is closed: where it was held, or stood, its own surface goes on.

The part and what it was cut from change roles: what touches the part from outside stands on one of the part's
faces, as `support_around` finds it, and that face is rebuilt under it.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from cagefield.completion.inpainting.support_inpainting import rebuilt
from cagefield.completion.lighting.light_change import UNSURE, Lighting, known_points
from cagefield.completion.surfaces.footprint import CLOSE, footprint_of
from cagefield.completion.surfaces.grid_block import Block
from cagefield.completion.surfaces.patch_bounds import RIM
from cagefield.completion.surfaces.support_plane import support_around
from cagefield.completion.surfaces.surfels import Surfels
from cagefield.completion.surfaces.visibility import Sight
from cagefield.edits.stack import EditStack
from cagefield.typing import Mask

TOUCHES = 4
"""What comes this near to a part touches it; voxels."""


def capped(
    block: Block,
    inside: Mask,
    part: Surfels,
    light: Lighting | None,
    below: EditStack,
    sight: Sight | None,
) -> Block:
    """The part's block, which is in its new light, with its face going on where it was held.

    As it is, where the part has no face that something stood on.
    """
    held = block.solid & ~inside
    held &= ndimage.binary_dilation(block.solid & inside, iterations=TOUCHES)
    if not held.any() or not len(part.points):
        return block
    at = block.coordinates(part.points)
    away = ndimage.distance_transform_edt(~held)
    away = np.asarray(ndimage.map_coordinates(away, at.T, order=1, mode="nearest"))
    near = away < max(RIM, 0.5 * float(np.median(np.ptp(at, axis=0))))
    support = support_around(held, part, at, near, max(block.spacing))
    if support is None:
        return block
    log = np.zeros(len(at)) if light is None else light.at(block, part.points)
    dark = log > UNSURE
    footprint = footprint_of(support, held, at[near & (away < CLOSE)], Surfels(at[dark], part.normals[dark]))
    if footprint is None:
        return block
    points = footprint.points(block)
    if sight is not None:
        footprint = footprint.without(known_points(points, below, sight, block, light), held)
    return rebuilt(block, footprint, ~inside) if footprint.hole.any() else block
