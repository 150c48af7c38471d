"""Filling what no photo showed: the ground under a part, the inside of a thing.

Photos say nothing of it, so a trained field holds anything there, and an edit that moves a part away shows
it. It is filled a few voxels deep, opaque, with colours that go on from the surfaces around, each mostly in
its own plane: under a part, the ground continues, not the part's sides.

For each axis a, the surfaces' weight n_a^2 (n their normals) and weight times colour are spread by a screened
diffusion, (1 - L^2 div K_a grad) u = 0, whose conductivity K_a is 1 in the plane across a and less along a.
The colour is the sum of the spread colours over that of the spread weights.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse.linalg import cg

from cagefield.fields.voxel_field import VoxelField

DEPTH = 8
"""How far from a seen surface is filled, voxels."""

SURFACE = 0.05
"""Optical depth per voxel from which on a seen vertex belongs to a surface."""

OPAQUE = 3.0
"""Optical depth per voxel of what is filled."""

REACH = 6.0
"""L: how far colours spread before nearer surfaces outweigh them, voxels."""

ACROSS = 1.0 / 16.0
"""Conductivity across a surface's plane, over that in it."""

TOLERANCE = 1e-4
"""Relative residual to which the diffusion is solved."""

MOST_STEPS = 200
"""Steps of an iterative solution, at most; see `solve_diffusion`."""


def filled(field: VoxelField, unseen: NDArray[np.bool_]) -> VoxelField:
    """The field with its vertices `unseen` [nx,ny,nz] opaque up to DEPTH voxels from what was seen.

    Other unseen vertices stay as they are. Every colour that is filled is the same in all directions.
    """
    voxel = float(field.voxel_size.max())
    density = np.zeros(field.resolution, np.float32)
    density.reshape(-1)[field.vertices] = field.density
    surface = (density * voxel > SURFACE) & ~unseen
    target = unseen & (ndimage.distance_transform_edt(~surface) <= DEPTH)
    where = np.flatnonzero(target)
    if not len(where) or not surface.any():
        return field
    slot = np.zeros(density.size, np.int64)
    slot[field.vertices] = np.arange(len(field.vertices))
    colours = _spread(target, surface, _normals(density, surface), field.sh[slot[np.flatnonzero(surface)], 0])
    stored = np.zeros(density.size, bool)
    stored[field.vertices] = True
    stored[where] = True
    vertices = np.flatnonzero(stored)
    density.reshape(-1)[where] = OPAQUE / voxel
    sh = field.sh[slot[vertices]]
    at = np.searchsorted(vertices, where)
    sh[at] = 0.0
    sh[at, 0] = colours
    return VoxelField(
        field.bounds, field.resolution, vertices, density.reshape(-1)[vertices], sh, field.contracted
    )


def _normals(density: NDArray[np.float32], surface: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Squares [S,3] of the components of the surface vertices' unit normals."""
    smooth = ndimage.gaussian_filter(np.minimum(density, np.median(density[surface])), 1.0)
    squares = np.stack([np.gradient(smooth, axis=axis)[surface] ** 2 for axis in range(3)], axis=-1)
    return np.asarray((squares + 1e-12) / (squares + 1e-12).sum(axis=-1, keepdims=True), np.float64)


def _spread(
    target: NDArray[np.bool_],
    surface: NDArray[np.bool_],
    normals: NDArray[np.float64],
    colours: NDArray[np.float32],
) -> NDArray[np.float64]:
    """Colours [T,3] at the target vertices, spread from those [S,3] of the surface vertices."""
    number = np.full(target.shape, -1, np.int64)
    number[target] = np.arange(target.sum())
    known = np.full(target.shape, -1, np.int64)
    known[surface] = np.arange(surface.sum())
    count = int(target.sum())
    links = [links_of(number, number, axis) for axis in range(3)]
    inlets = [links_of(number, known, axis) for axis in range(3)]
    total = np.zeros((count, 4))
    for axis in range(3):
        weight = normals[:, axis : axis + 1]
        given = np.concatenate([weight, weight * colours], axis=1)
        diagonal = np.ones(count)
        source = np.zeros((count, 4))
        parts = []
        for other in range(3):
            share = REACH**2 * (ACROSS if other == axis else 1.0)
            a, b = links[other]
            diagonal += share * np.bincount(a, minlength=count)
            parts.append((a, b, np.full(len(a), share)))
            a, b = inlets[other]
            diagonal += share * np.bincount(a, minlength=count)
            for channel in range(4):
                source[:, channel] += share * np.bincount(a, given[b, channel], minlength=count)
        rows, columns, values = (np.concatenate(part) for part in zip(*parts, strict=True))
        total += solve_diffusion(
            sparse.csr_matrix((values, (rows, columns)), (count, count)), diagonal, source
        )
    return np.asarray(total[:, 1:] / np.maximum(total[:, :1], 1e-12))


def solve_diffusion(
    pull: sparse.csr_matrix, diagonal: NDArray[np.float64], source: NDArray[np.float64]
) -> NDArray[np.float64]:
    """u [T,C] with (diag(diagonal) - pull) u = source [T,C]; pull [T,T] >= 0 with row sums <= diagonal - 1.

    With the diagonal as preconditioner the eigenvalues are in [1 / max(diagonal), 2]: a condition number of
    300 at most for REACH and ACROSS, for which the bound on the error of conjugate gradients gives TOLERANCE
    after 111 steps. Where MOST_STEPS of them do not reach it for some column, all get as many sweeps of
    Jacobi's instead. Those stop short of the solution, but each u of theirs is a sum of sources with the same
    weights >= 0 in all columns, so that a ratio of columns stays between those of the sources; an unfinished
    u of conjugate gradients is not.

    Source: Saad, "Iterative Methods for Sparse Linear Systems" (2003), sections 6.11 and 4.2.
    """
    matrix = sparse.diags(diagonal) - pull
    guide = sparse.diags(1.0 / diagonal)
    solved = []
    for column in source.T:
        u, unfinished = cg(matrix, column, rtol=TOLERANCE, maxiter=MOST_STEPS, M=guide)
        if unfinished:
            return jacobi_sweeps(pull, diagonal, source)
        solved.append(u)
    return np.stack(solved, axis=1)


def jacobi_sweeps(
    pull: sparse.csr_matrix, diagonal: NDArray[np.float64], source: NDArray[np.float64]
) -> NDArray[np.float64]:
    """u [T,C] of `solve_diffusion` after MOST_STEPS sweeps of Jacobi's from u = 0."""
    u = np.zeros_like(source)
    for _ in range(MOST_STEPS):
        u = (source + pull @ u) / diagonal[:, None]
    return u


def links_of(
    number: NDArray[np.int64], other: NDArray[np.int64], axis: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs (a, b) of neighbours along an axis: a numbered by `number`, b by `other`, both not -1."""
    before, after = [slice(None)] * 3, [slice(None)] * 3
    before[axis], after[axis] = slice(None, -1), slice(1, None)
    pairs = []
    for one, two in ((tuple(before), tuple(after)), (tuple(after), tuple(before))):
        a, b = number[one], other[two]
        both = (a >= 0) & (b >= 0)
        pairs.append((a[both], b[both]))
    return np.concatenate([pairs[0][0], pairs[1][0]]), np.concatenate([pairs[0][1], pairs[1][1]])
