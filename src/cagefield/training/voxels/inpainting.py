"""Inpainting of vertices that no training photo shows: the ground under an object, the inside of an object.

Photos do not constrain these vertices, and an edit that moves an object away exposes them. Vertices up to
FILL_DEPTH_VOXELS from a visible surface become opaque. Their colors continue the visible surfaces around,
each
surface mostly within its own plane: under an object the ground continues, not the sides of the object.

For each axis a, the squared normal component n_a^2 of the surfaces and n_a^2 times their color are the
sources of a screened diffusion (1 - L^2 div K_a grad) u = 0, whose conductivity K_a is 1 in the plane normal
to a and NORMAL_CONDUCTIVITY along a. The color is the sum over axes of the diffused colors, over that of the
diffused weights.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse.linalg import cg

from cagefield.fields.voxel_field import VoxelField

FILL_DEPTH_VOXELS = 8
"""Maximum distance of an inpainted vertex from a visible surface."""

MIN_SURFACE_OPTICAL_DEPTH = 0.05
"""Minimum optical depth per voxel of a visible vertex that belongs to a surface."""

FILL_OPTICAL_DEPTH = 3.0
"""Optical depth per voxel of inpainted vertices."""

DIFFUSION_LENGTH_VOXELS = 6.0
"""L: screening length of the diffusion."""

NORMAL_CONDUCTIVITY = 1.0 / 16.0
"""Conductivity along a surface's normal, relative to the conductivity in its plane."""

MAX_RELATIVE_RESIDUAL = 1e-4
"""Relative residual at which conjugate gradients stop."""

MAX_SOLVER_STEPS = 200
"""Maximum number of steps of an iterative solver; see `solve_diffusion`."""


def fill_unseen(field: VoxelField, unseen: NDArray[np.bool_]) -> VoxelField:
    """Field whose vertices `unseen` [nx,ny,nz] are opaque up to FILL_DEPTH_VOXELS from visible surfaces.

    Other unseen vertices stay unchanged. Inpainted colors do not depend on the view direction.
    """
    voxel = float(field.voxel_size.max())
    density = np.zeros(field.resolution, np.float32)
    density.reshape(-1)[field.vertices] = field.density
    surface = (density * voxel > MIN_SURFACE_OPTICAL_DEPTH) & ~unseen
    target = unseen & (ndimage.distance_transform_edt(~surface) <= FILL_DEPTH_VOXELS)
    target_indices = np.flatnonzero(target)
    if not len(target_indices) or not surface.any():
        return field
    slot = np.zeros(density.size, np.int64)
    slot[field.vertices] = np.arange(len(field.vertices))
    colors = _diffuse_colors(
        target, surface, _squared_normals(density, surface), field.sh[slot[np.flatnonzero(surface)], 0]
    )
    stored = np.zeros(density.size, bool)
    stored[field.vertices] = True
    stored[target_indices] = True
    vertices = np.flatnonzero(stored)
    density.reshape(-1)[target_indices] = FILL_OPTICAL_DEPTH / voxel
    sh = field.sh[slot[vertices]]
    at = np.searchsorted(vertices, target_indices)
    sh[at] = 0.0
    sh[at, 0] = colors
    return VoxelField(
        field.bounds, field.resolution, vertices, density.reshape(-1)[vertices], sh, field.contracted
    )


def _squared_normals(density: NDArray[np.float32], surface: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Squared components [S,3] of the surface vertices' unit normals."""
    smooth = ndimage.gaussian_filter(np.minimum(density, np.median(density[surface])), 1.0)
    squares = np.stack([np.gradient(smooth, axis=axis)[surface] ** 2 for axis in range(3)], axis=-1)
    return np.asarray((squares + 1e-12) / (squares + 1e-12).sum(axis=-1, keepdims=True), np.float64)


def _diffuse_colors(
    target: NDArray[np.bool_],
    surface: NDArray[np.bool_],
    normals: NDArray[np.float64],
    colors: NDArray[np.float32],
) -> NDArray[np.float64]:
    """Colors [T,3] of the target vertices, diffused from the colors [S,3] of the surface vertices."""
    number = np.full(target.shape, -1, np.int64)
    number[target] = np.arange(target.sum())
    known = np.full(target.shape, -1, np.int64)
    known[surface] = np.arange(surface.sum())
    count = int(target.sum())
    links = [neighbor_pairs(number, number, axis) for axis in range(3)]
    surface_links = [neighbor_pairs(number, known, axis) for axis in range(3)]
    total = np.zeros((count, 4))
    for axis in range(3):
        weight = normals[:, axis : axis + 1]
        values_in = np.concatenate([weight, weight * colors], axis=1)
        diagonal = np.ones(count)
        source = np.zeros((count, 4))
        parts = []
        for other in range(3):
            share = DIFFUSION_LENGTH_VOXELS**2 * (NORMAL_CONDUCTIVITY if other == axis else 1.0)
            a, b = links[other]
            diagonal += share * np.bincount(a, minlength=count)
            parts.append((a, b, np.full(len(a), share)))
            a, b = surface_links[other]
            diagonal += share * np.bincount(a, minlength=count)
            for channel in range(4):
                source[:, channel] += share * np.bincount(a, values_in[b, channel], minlength=count)
        rows, columns, values = (np.concatenate(part) for part in zip(*parts, strict=True))
        total += solve_diffusion(
            sparse.csr_matrix((values, (rows, columns)), (count, count)), diagonal, source
        )
    return np.asarray(total[:, 1:] / np.maximum(total[:, :1], 1e-12))


def solve_diffusion(
    coupling: sparse.csr_matrix, diagonal: NDArray[np.float64], source: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Solution u [T,C] of (diag(diagonal) - coupling) u = source [T,C].

    `coupling` [T,T] >= 0 has row sums <= diagonal - 1. With the diagonal as preconditioner the eigenvalues
    are in [1 / max(diagonal), 2]: a condition number of at most 300 for DIFFUSION_LENGTH_VOXELS and
    NORMAL_CONDUCTIVITY, for which the error bound of conjugate gradients gives MAX_RELATIVE_RESIDUAL after
    111 steps. Where MAX_SOLVER_STEPS do not reach it for some column, all columns get MAX_SOLVER_STEPS Jacobi
    sweeps instead. Jacobi sweeps stop short of the solution, but every iterate is a sum of sources with equal
    weights >= 0 in all columns, so a ratio of columns stays within the sources' ratios; an unfinished iterate
    of conjugate gradients need not.

    Source: Saad, "Iterative Methods for Sparse Linear Systems" (2003), sections 6.11 and 4.2.
    """
    matrix = sparse.diags(diagonal) - coupling
    preconditioner = sparse.diags(1.0 / diagonal)
    columns_out = []
    for column in source.T:
        u, unfinished = cg(
            matrix, column, rtol=MAX_RELATIVE_RESIDUAL, maxiter=MAX_SOLVER_STEPS, M=preconditioner
        )
        if unfinished:
            return jacobi_sweeps(coupling, diagonal, source)
        columns_out.append(u)
    return np.stack(columns_out, axis=1)


def jacobi_sweeps(
    coupling: sparse.csr_matrix, diagonal: NDArray[np.float64], source: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Iterate u [T,C] of `solve_diffusion` after MAX_SOLVER_STEPS Jacobi sweeps from u = 0."""
    u = np.zeros_like(source)
    for _ in range(MAX_SOLVER_STEPS):
        u = (source + coupling @ u) / diagonal[:, None]
    return u


def neighbor_pairs(
    number: NDArray[np.int64], other: NDArray[np.int64], axis: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Neighbor pairs (a, b) along an axis: a numbered by `number`, b by `other`, pairs with -1 left out."""
    before, after = [slice(None)] * 3, [slice(None)] * 3
    before[axis], after[axis] = slice(None, -1), slice(1, None)
    pairs = []
    for one, two in ((tuple(before), tuple(after)), (tuple(after), tuple(before))):
        a, b = number[one], other[two]
        both = (a >= 0) & (b >= 0)
        pairs.append((a[both], b[both]))
    return np.concatenate([pairs[0][0], pairs[1][0]]), np.concatenate([pairs[0][1], pairs[1][1]])
