"""The rim of a part blends into what it is put into: no seam where cuts go through matter.

In a rim along the faces of V^c, so many voxels wide, the part's density and colour fade into those of the
place where it is put down: w of its own and 1 - w of that place's, w rising from 0 at the faces to 1. The
part gets no thinner by this: what ends in the rim, or stands free at its new place, stays whole.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import ndimage

from cagefield.completion.surfaces.grid_block import GridBlock, interpolate_field
from cagefield.fields.sh_rotation import rotate_sh_each
from cagefield.geometry.cage import Cage
from cagefield.typing import Mask
from cagefield.warps.hexahedron_map import HexahedronMap

RIM_MARGIN_VERTICES = 2
"""Vertices beyond the faces that are read between vertices within, and two more."""

MIN_OWN_COLOR_SHARE = 0.05
"""How much of its own colour what stays whole has at the faces, at least, beside matter as dense."""


def feather_rim(
    part: GridBlock, there: GridBlock, inner: Cage, deformed: Cage, inside: Mask, width: float
) -> GridBlock:
    """A part's block, whose vertices `inside` [X,Y,Z] lie in V^c, with its rim fading into another block.

    `there` is what is in deformed space without the part; the rim is `width` voxels wide. Vertices whose
    place is outside of that block stay.
    """
    deep = ndimage.distance_transform_edt(inside)
    own = np.clip((deep - 0.5) / width, 0.0, 1.0)
    rim = ndimage.binary_dilation(inside, iterations=RIM_MARGIN_VERTICES) & (own < 1.0)
    affine = HexahedronMap(deformed, inner).affine
    if affine is None:
        rim &= inside
    points = part.positions(rim)
    if affine is None:
        within, moved, jacobian = HexahedronMap(deformed, inner)(points)
        rim[tuple(np.argwhere(rim)[~within].T)] = False
    else:
        A, b = affine
        moved, jacobian = points @ A.T + b, np.broadcast_to(A, (len(points), 3, 3))
    g = there.field.grid_coordinates(moved) - there.low
    known = ((g >= 0.0) & (g <= np.array(there.shape) - 1.0)).all(axis=1)
    rim[tuple(np.argwhere(rim)[~known].T)] = False
    jacobian = jacobian[known]
    density, sh = interpolate_field(there.layer(), moved[known])
    # Optical depth is kept: the part's density is multiplied by how much it is stretched.
    density = np.maximum(density, 0.0) * np.cbrt(np.abs(np.linalg.det(jacobian)))
    u, _, v = np.linalg.svd(jacobian)
    sh = rotate_sh_each(sh, np.asarray(np.swapaxes(u @ v, 1, 2)))
    share = own[rim]
    whole = np.maximum(part.density[rim], 0.0)
    before, new = whole * share, (1.0 - share) * density
    # Beside nothing it is left alone, also below zero, which makes its surface sharp.
    dense = np.where(new > 0.0, np.maximum(before + new, whole), part.density[rim])
    mixed = part.with_density(rim, dense.astype(np.float32), slots=True)
    rows, had = mixed.slot[rim], part.slot[rim] >= 0
    # What is empty there has no colour that would count: a surface beside it keeps its own.
    weight = np.where(had, np.maximum(before, MIN_OWN_COLOR_SHARE * whole + 1e-6), 0.0)
    other = np.where(new > 1e-6, new, np.where(had, 0.0, 1e-6))
    coefficients = mixed.sh.copy()
    total = np.maximum(weight + other, 1e-12)
    mean = weight[:, None, None] * coefficients[rows] + other[:, None, None] * sh
    coefficients[rows] = mean / total[:, None, None]
    return replace(mixed, sh=coefficients)
