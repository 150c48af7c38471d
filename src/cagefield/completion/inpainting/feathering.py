"""Feathering: the rim of a moved part blended into its destination, for cuts without a seam.

In a rim along the faces of V^c, `width` voxels wide, the part's density and color are mixed with those of
the destination: w of its own and 1 - w of the destination's, w rising from 0 at the faces to 1. The part's
own density never falls below its unfeathered value: a thin part, or a free end, stays whole.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import ndimage

from cagefield.completion.surfaces.block_extraction import interpolate_field
from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.fields.sh_rotation import rotate_sh_each
from cagefield.typing import Mask
from cagefield.warps.hexahedron_map import HexahedronMap

RIM_MARGIN_VERTICES = 2
"""Margin of vertices outside V^c that interpolation inside it reads."""

MIN_OWN_COLOR_SHARE = 0.05
"""Minimum weight of the part's own color at the faces, beside matter of the same density."""


def feather_rim(
    part: GridBlock, destination: GridBlock, onto: HexahedronMap, inside: Mask, width: float
) -> GridBlock:
    """Block of a part whose rim fades into the block of its destination.

    onto: map of V^c onto V; inside [X,Y,Z]: mask of V^c; destination: the deformed space without the part;
    width: of the rim, voxels. A vertex whose destination is outside that block stays.
    """
    depth = ndimage.distance_transform_edt(inside)
    own_share = np.clip((depth - 0.5) / width, 0.0, 1.0)
    rim = ndimage.binary_dilation(inside, iterations=RIM_MARGIN_VERTICES) & (own_share < 1.0)
    affine = onto.affine
    if affine is None:
        rim &= inside
    points = part.positions(rim)
    if affine is None:
        is_mapped, moved, jacobian = onto(points)
        rim[tuple(np.argwhere(rim)[~is_mapped].T)] = False
    else:
        A, b = affine
        moved, jacobian = points @ A.T + b, np.broadcast_to(A, (len(points), 3, 3))
    g = destination.field.grid_coordinates(moved) - destination.low
    is_inside = ((g >= 0.0) & (g <= np.array(destination.shape) - 1.0)).all(axis=1)
    rim[tuple(np.argwhere(rim)[~is_inside].T)] = False
    jacobian, g = jacobian[is_inside], np.floor(g[is_inside]).astype(np.int64)
    if not len(g):
        return part
    around = destination.crop(g.min(axis=0) - 1, g.max(axis=0) + 2)
    density, sh = interpolate_field(around.to_layer(), moved[is_inside])
    # Keep optical depth: rendering divides the density in V by the stretch.
    density = np.maximum(density, 0.0) * np.cbrt(np.abs(np.linalg.det(jacobian)))
    u, _, v = np.linalg.svd(jacobian)
    sh = rotate_sh_each(sh, np.asarray(np.swapaxes(u @ v, 1, 2)))
    share = own_share[rim]
    own_density = np.maximum(part.density[rim], 0.0)
    faded, added = own_density * share, (1.0 - share) * density
    # Beside empty space keep the density, also a negative one: its zero crossing places the surface.
    density_in_rim = np.where(added > 0.0, np.maximum(faded + added, own_density), part.density[rim])
    mixed = part.with_density(rim, density_in_rim.astype(np.float32), slots=True)
    rows, has_color = mixed.slot[rim], part.slot[rim] >= 0
    # An empty destination has no color: a surface beside it keeps its own.
    own_weight = np.where(has_color, np.maximum(faded, MIN_OWN_COLOR_SHARE * own_density + 1e-6), 0.0)
    destination_weight = np.where(added > 1e-6, added, np.where(has_color, 0.0, 1e-6))
    coefficients = mixed.sh.copy()
    total = np.maximum(own_weight + destination_weight, 1e-12)
    mean = own_weight[:, None, None] * coefficients[rows] + destination_weight[:, None, None] * sh
    coefficients[rows] = mean / total[:, None, None]
    return replace(mixed, sh=coefficients)
