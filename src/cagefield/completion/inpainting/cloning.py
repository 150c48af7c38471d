"""V^c filled with the content of another cage, blended in gradients at the rim.

The content of the source cage is read through the map of V^c onto it. Its colours differ from those of the
surfaces around V^c; the differences at the rim, spread over V^c, are added, each vertex taking the mean of
the nearest ones weighted by 1 / distance^2: an approximation of the membrane that solves Laplace's equation.

Source: Farbman et al., "Coordinates for instant image cloning" (2009).
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from cagefield.completion.surfaces.grid_block import GridBlock, sample_edited_field
from cagefield.edits import EditStack
from cagefield.geometry.cage import Cage
from cagefield.typing import Mask
from cagefield.warps.hexahedron_map import HexahedronMap

RIM_NEIGHBORS = 24
"""Differences at the rim that a vertex takes the mean of."""


def clone_cage(
    block: GridBlock,
    below: EditStack,
    cages: tuple[Cage, Cage],
    inside: Mask,
    surface: Mask,
    preserve_opacity: bool = True,
) -> GridBlock:
    """The block with the vertices in V^c, `inside` [X,Y,Z], showing what is in the source cage.

    cages: (V^c, the source cage). surface [X,Y,Z]: the surface vertices around V^c, to whose colours it is
    blended. `preserve_opacity` as for `block_of`.
    """
    inner, source = cages
    where = np.asarray(inside)
    points = block.positions(where)
    within, found, jacobian = HexahedronMap(source, inner)(points)
    density, sh = np.zeros(len(points), np.float32), np.zeros((len(points), *block.sh.shape[1:]), np.float32)
    turn = np.asarray(np.linalg.inv(jacobian), np.float64)
    density[within], sh[within] = sample_edited_field(
        block.field, below, found, turn, preserve_opacity=preserve_opacity
    )
    filled = block.with_density(where, density, slots=True)
    coefficients = filled.sh.copy()
    rows = filled.slot[where]
    coefficients[rows] = sh
    filled = GridBlock(block.field, block.low, filled.density, filled.slot, coefficients)
    # Pairs across the faces of V^c, both of them at a surface.
    rim = ndimage.binary_dilation(inside, iterations=2) & surface
    solid = filled.solid
    facing = ndimage.binary_dilation(rim, iterations=3) & inside & solid & ndimage.binary_dilation(~solid)
    at, to = np.argwhere(facing), np.argwhere(rim)
    if not len(at) or not len(to):
        return filled
    _, nearest = cKDTree(to).query(at)
    # Upper sides go on with upper sides, not with what lies under them.
    along = filled.normals
    alike = (along[tuple(at.T)] * along[tuple(to[nearest].T)]).sum(axis=1) > 0.3
    at, nearest = at[alike], nearest[alike]
    if not len(at):
        return filled
    width = int(np.prod(sh.shape[1:]))
    own = coefficients[filled.slot[tuple(at.T)]].reshape(-1, width)
    there = coefficients[filled.slot[tuple(to[nearest].T)]].reshape(-1, width)
    places = np.argwhere(where)
    count = min(RIM_NEIGHBORS, len(at))
    distance, chosen = cKDTree(at).query(places, k=[*range(1, count + 1)])
    facing_same = np.einsum("nc,nkc->nk", along[where], along[tuple(at.T)][chosen])
    weight = np.maximum(facing_same, 0.01) / np.maximum(distance, 0.5) ** 2
    weight /= weight.sum(axis=1, keepdims=True)
    added = np.einsum("nk,nkc->nc", weight, (there - own)[chosen])
    coefficients[rows] += added.reshape(sh.shape).astype(np.float32)
    return filled
