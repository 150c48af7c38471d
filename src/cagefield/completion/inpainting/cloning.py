"""Cloning: V^c filled with the content of a source cage, blended in gradients at the rim.

The content is read through the map of V^c onto the source cage. Its colors differ from those of the
surfaces around V^c. The differences at the rim are interpolated over V^c with weights 1 / distance^2 of the
nearest ones, and added: an approximation of the membrane that solves Laplace's equation.

Source: Farbman et al., "Coordinates for instant image cloning" (2009).
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from cagefield.completion.surfaces.block_extraction import sample_edited_field
from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.edits import EditMap
from cagefield.geometry.cage import Cage
from cagefield.typing import Mask
from cagefield.warps.hexahedron_map import HexahedronMap

RIM_NEIGHBORS = 24
"""Number of differences at the rim that a vertex averages."""


def clone_cage(
    block: GridBlock,
    below: EditMap,
    cages: tuple[Cage, Cage],
    inside: Mask,
    surface: Mask,
    preserve_opacity: bool = True,
) -> GridBlock:
    """Block with the content of a source cage in V^c, `inside` [X,Y,Z].

    cages: (V^c, source cage). surface [X,Y,Z]: mask of the surface vertices around V^c, to whose colors the
    content is blended. `preserve_opacity` as in `extract_block`.
    """
    inner, source = cages
    mask = np.asarray(inside)
    points = block.positions(mask)
    is_mapped, source_points, jacobian = HexahedronMap(source, inner)(points)
    density, sh = np.zeros(len(points), np.float32), np.zeros((len(points), *block.sh.shape[1:]), np.float32)
    inverse_jacobian = np.asarray(np.linalg.inv(jacobian), np.float64)
    density[is_mapped], sh[is_mapped] = sample_edited_field(
        block.field, below, source_points, inverse_jacobian, preserve_opacity=preserve_opacity
    )
    filled = block.with_density(mask, density, slots=True)
    coefficients = filled.sh.copy()
    rows = filled.slot[mask]
    coefficients[rows] = sh
    filled = GridBlock(block.field, block.low, filled.density, filled.slot, coefficients)
    # Pairs of surface vertices across the faces of V^c.
    rim = ndimage.binary_dilation(inside, iterations=2) & surface
    solid = filled.solid
    inner_rim = ndimage.binary_dilation(rim, iterations=3) & inside & solid & ndimage.binary_dilation(~solid)
    inner_vertices, rim_vertices = np.argwhere(inner_rim), np.argwhere(rim)
    if not len(inner_vertices) or not len(rim_vertices):
        return filled
    _, nearest = cKDTree(rim_vertices).query(inner_vertices)
    # Pair surfaces of one side: an upper side continues an upper side.
    inner_normals = filled.normals_at(inner_rim)
    faces_alike = (inner_normals * filled.normals_at(rim)[nearest]).sum(axis=1) > 0.3
    inner_vertices, inner_normals, nearest = (
        each[faces_alike] for each in (inner_vertices, inner_normals, nearest)
    )
    if not len(inner_vertices):
        return filled
    width = int(np.prod(sh.shape[1:]))
    inner_sh = coefficients[filled.slot[tuple(inner_vertices.T)]].reshape(-1, width)
    rim_sh = coefficients[filled.slot[tuple(rim_vertices[nearest].T)]].reshape(-1, width)
    vertices = np.argwhere(mask)
    count = min(RIM_NEIGHBORS, len(inner_vertices))
    distance, neighbors = cKDTree(inner_vertices).query(vertices, k=[*range(1, count + 1)])
    cosine = np.einsum("nc,nkc->nk", filled.normals_at(mask), inner_normals[neighbors])
    weight = np.maximum(cosine, 0.01) / np.maximum(distance, 0.5) ** 2
    weight /= weight.sum(axis=1, keepdims=True)
    correction = np.einsum("nk,nkc->nc", weight, (rim_sh - inner_sh)[neighbors])
    coefficients[rows] += correction.reshape(sh.shape).astype(np.float32)
    return filled
