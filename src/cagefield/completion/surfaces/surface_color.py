"""Visible colors of a block's surfaces: volume rendering along the surfaces' normals.

A field's surfaces are foggy, a few vertices deep. In deep shade photos constrain each vertex little: some
are brighter than the visible color, some are below black, and a gain of light amplifies the difference.
Vertices whose light grows much get the visible color of the surface over them first.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.completion.surfaces.surfels import Surfels, extract_surfels
from cagefield.compute.cancellation import check_cancelled
from cagefield.typing import Array, Float32, Mask

RAY_START_VOXELS = 2.0
"""Distance in front of the surface at which a ray begins, voxels."""

RAY_END_VOXELS = 5.0
"""Depth beneath the surface at which a ray ends, voxels."""

RAY_STEP_VOXELS = 0.5
"""Step of a ray, voxels."""

MIN_DENOISED_LOG_GAIN = 0.2
"""Gain of light (log) above which colors are denoised."""

FULLY_DENOISED_LOG_GAIN = 0.6
"""Gain of light (log) above which the denoised color replaces the stored one."""

COLOR_NEIGHBORS = 4
"""Number of surfels whose mean color a vertex gets."""

MAX_COLOR_DEPTH_VOXELS = 8.0
"""Maximum distance of a denoised vertex from its surfels, voxels."""

CROP_MARGIN_VERTICES = 12
"""Margin of vertices in which surfaces are searched: MAX_COLOR_DEPTH_VOXELS and the support of a normal."""


def denoise_colors(block: GridBlock, where: Mask, log: Array) -> GridBlock:
    """Block without color noise at vertices `where` [X,Y,Z], whose light gains a factor exp(log) [N]."""
    check_cancelled()
    share = np.clip(
        (log - MIN_DENOISED_LOG_GAIN) / (FULLY_DENOISED_LOG_GAIN - MIN_DENOISED_LOG_GAIN), 0.0, 1.0
    )
    rows = np.flatnonzero(share > 0.0)
    if not len(rows):
        return block
    vertices = np.argwhere(where)[rows]
    crop = block.crop(
        vertices.min(axis=0) - CROP_MARGIN_VERTICES, vertices.max(axis=0) + CROP_MARGIN_VERTICES
    )
    surface = extract_surfels(crop)
    if not len(surface.points):
        return block
    voxel = max(block.spacing)
    distance, nearest = surface.nearest(
        block.positions(where)[rows], COLOR_NEIGHBORS, MAX_COLOR_DEPTH_VOXELS * voxel
    )
    has_surfel = np.isfinite(distance[:, 0])
    rows, distance, nearest = rows[has_surfel], distance[has_surfel], nearest[has_surfel]
    nearest = np.where(np.isfinite(distance), nearest, nearest[:, :1])
    surfel_rows, surfel_index = np.unique(nearest, return_inverse=True)
    colors, opacity = colors_along_normals(crop, surface.take(surfel_rows))
    surfel_index = surfel_index.reshape(nearest.shape)
    weight = np.exp(-0.5 * (distance**2 - distance[:, :1] ** 2) / voxel**2) * opacity[surfel_index]
    total = weight.sum(axis=1)
    mean = np.einsum("nk,nkbc->nbc", weight, colors[surfel_index]) / np.maximum(total, 1e-6)[:, None, None]
    sh, slot = block.sh.copy(), block.slot[where][rows]
    blend = (share[rows] * (total > 0.0))[:, None, None]
    sh[slot] += (blend * (mean - sh[slot])).astype(np.float32)
    return block.with_coefficients(sh)


def colors_along_normals(block: GridBlock, surface: Surfels) -> tuple[Float32, Float32]:
    """(spherical-harmonics coefficients [N,K,3], opacity [N]) rendered along the normals of surfels [N]."""
    start, size = block.block_coordinates(surface.points), np.array(block.shape)
    direction = surface.normals / np.array(block.spacing)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    flat = block.sh.reshape(len(block.sh), -1)
    colors = np.zeros((len(start), flat.shape[1]), np.float32)
    transmittance = np.ones(len(start), np.float32)
    for depth in np.arange(-RAY_START_VOXELS, RAY_END_VOXELS + 0.5 * RAY_STEP_VOXELS, RAY_STEP_VOXELS):
        check_cancelled()
        point = start - depth * direction
        inside = ((point >= 0.0) & (point <= size - 1)).all(axis=1)
        base = np.clip(np.floor(point).astype(np.int64), 0, size - 2)
        density, corners = np.zeros(len(start), np.float32), []
        for corner in product((0, 1), repeat=3):
            fraction = np.where(np.array(corner) == 1, point - base, 1.0 + base - point)
            weight = (fraction.prod(axis=1) * inside).astype(np.float32)
            vertex = tuple((base + np.array(corner)).T)
            density += weight * block.density[vertex]
            corners.append((weight, block.slot[vertex]))
        alpha = 1.0 - np.exp(-RAY_STEP_VOXELS * block.field.sample_spacing * np.maximum(density, 0.0))
        share = (transmittance * alpha).astype(np.float32)
        rows = np.flatnonzero(share > 1e-3)
        sample, total = np.zeros((len(rows), flat.shape[1]), np.float32), np.zeros(len(rows), np.float32)
        for weight, slot in corners:
            known = weight[rows] * (slot[rows] >= 0)
            sample += known[:, None] * flat[np.maximum(slot[rows], 0)]
            total += known
        colors[rows] += (share[rows] / np.maximum(total, 1e-6))[:, None] * sample
        transmittance -= share
    opacity = 1.0 - transmittance
    colors /= np.maximum(opacity, 1e-3)[:, None]
    return colors.reshape(-1, *block.sh.shape[1:]), opacity
