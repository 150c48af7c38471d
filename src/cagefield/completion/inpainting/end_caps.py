"""End caps: the surface of a part continued over the face where it was cut.

The part and its surroundings change roles: the solid vertices that touch the part from outside stand on a
face of the part, which `find_support` finds, and the face is inpainted beneath them.
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
from cagefield.compute.cancellation import check_cancelled
from cagefield.edits import EditMap
from cagefield.typing import Mask

TOUCH_DISTANCE_VERTICES = 4
"""Maximum distance of vertices that touch the part."""


def close_cut_end(
    block: GridBlock,
    inside: Mask,
    part: Surfels,
    light: LightChange | None,
    below: EditMap,
    visibility: CameraVisibility | None,
) -> GridBlock:
    """Block of a part with its face inpainted where the part was held; unchanged without such a face.

    block: in its new light; inside [X,Y,Z]: mask of V^c; part: surfels of the part; light: change of light
    on the part; visibility: visible surfaces of the field without edits.
    """
    check_cancelled()
    holder = block.solid & ~inside
    holder &= ndimage.binary_dilation(block.solid & inside, iterations=TOUCH_DISTANCE_VERTICES)
    if not holder.any() or not len(part.points):
        return block
    coordinates = block.block_coordinates(part.points)
    distance = ndimage.distance_transform_edt(~holder)
    distance = np.asarray(ndimage.map_coordinates(distance, coordinates.T, order=1, mode="nearest"))
    is_near = distance < max(SUPPORT_DISTANCE_VOXELS, 0.5 * float(np.median(np.ptp(coordinates, axis=0))))
    support = find_support(holder, part, coordinates, is_near, max(block.spacing))
    if support is None:
        return block
    log = np.zeros(len(coordinates)) if light is None else light.interpolate(block, part.points)
    is_shaded = log > MAX_TRUSTED_LOG_GAIN
    footprint = build_footprint(
        support,
        holder,
        coordinates[is_near & (distance < CONTACT_DISTANCE_VOXELS)],
        Surfels(coordinates[is_shaded], part.normals[is_shaded]),
    )
    if footprint is None:
        return block
    points = footprint.points(block)
    if visibility is not None:
        footprint = footprint.remove_known(is_reliable(points, below, visibility, block, light), holder)
    return inpaint_support(block, footprint, ~inside) if footprint.hole.any() else block
