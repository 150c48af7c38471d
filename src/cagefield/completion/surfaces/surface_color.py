"""What shows of a block's surfaces: the colours that rays along their normals come back with.

A field's surfaces are foggy, a few vertices deep. In deep shade photos say little of each vertex: some are
brighter than all that shows, some are below black, and light that is multiplied brings that out. So what is
to become much brighter gets the colour that shows of the surface over it first.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np

from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.completion.surfaces.surfels import Surfels, extract_surfels
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
"""Vertices around those whose colours change that surfaces are looked for in: DEEP, and a normal's own."""


def denoise_colors(block: GridBlock, where: Mask, log: Array) -> GridBlock:
    """The block, without noise at vertices `where` [X,Y,Z] whose light is to be multiplied by e^log [N]."""
    share = np.clip(
        (log - MIN_DENOISED_LOG_GAIN) / (FULLY_DENOISED_LOG_GAIN - MIN_DENOISED_LOG_GAIN), 0.0, 1.0
    )
    rows = np.flatnonzero(share > 0.0)
    if not len(rows):
        return block
    at = np.argwhere(where)[rows]
    near = block.cropped(at.min(axis=0) - CROP_MARGIN_VERTICES, at.max(axis=0) + CROP_MARGIN_VERTICES)
    surface = extract_surfels(near)
    if not len(surface.points):
        return block
    voxel = max(block.spacing)
    found, nearest = surface.nearest(
        block.positions(where)[rows], COLOR_NEIGHBORS, MAX_COLOR_DEPTH_VOXELS * voxel
    )
    over = np.isfinite(found[:, 0])
    rows, found, nearest = rows[over], found[over], nearest[over]
    nearest = np.where(np.isfinite(found), nearest, nearest[:, :1])
    used, place = np.unique(nearest, return_inverse=True)
    colours, opacity = colors_along_normals(near, surface.take(used))
    place = place.reshape(nearest.shape)
    weight = np.exp(-0.5 * (found**2 - found[:, :1] ** 2) / voxel**2) * opacity[place]
    total = weight.sum(axis=1)
    mean = np.einsum("nk,nkbc->nbc", weight, colours[place]) / np.maximum(total, 1e-6)[:, None, None]
    sh, slot = block.sh.copy(), block.slot[where][rows]
    part = (share[rows] * (total > 0.0))[:, None, None]
    sh[slot] += (part * (mean - sh[slot])).astype(np.float32)
    return replace(block, sh=sh)


def colors_along_normals(block: GridBlock, surface: Surfels) -> tuple[Float32, Float32]:
    """(coefficients [N,K,3], opacity [N]) of what shows of surface elements [N] along their normals."""
    at, size = block.coordinates(surface.points), np.array(block.shape)
    along = surface.normals / np.array(block.spacing)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    flat = block.sh.reshape(len(block.sh), -1)
    colours = np.zeros((len(at), flat.shape[1]), np.float32)
    left = np.ones(len(at), np.float32)
    for depth in np.arange(-RAY_START_VOXELS, RAY_END_VOXELS + 0.5 * RAY_STEP_VOXELS, RAY_STEP_VOXELS):
        point = at - depth * along
        inside = ((point >= 0.0) & (point <= size - 1)).all(axis=1)
        base = np.clip(np.floor(point).astype(np.int64), 0, size - 2)
        density, corners = np.zeros(len(at), np.float32), []
        for corner in product((0, 1), repeat=3):
            fraction = np.where(np.array(corner) == 1, point - base, 1.0 + base - point)
            weight = (fraction.prod(axis=1) * inside).astype(np.float32)
            vertex = tuple((base + np.array(corner)).T)
            density += weight * block.density[vertex]
            corners.append((weight, block.slot[vertex]))
        stopped = 1.0 - np.exp(-RAY_STEP_VOXELS * block.field.sample_spacing * np.maximum(density, 0.0))
        share = (left * stopped).astype(np.float32)
        rows = np.flatnonzero(share > 1e-3)
        sample, total = np.zeros((len(rows), flat.shape[1]), np.float32), np.zeros(len(rows), np.float32)
        for weight, slot in corners:
            known = weight[rows] * (slot[rows] >= 0)
            sample += known[:, None] * flat[np.maximum(slot[rows], 0)]
            total += known
        colours[rows] += (share[rows] / np.maximum(total, 1e-6))[:, None] * sample
        left -= share
    opacity = 1.0 - left
    colours /= np.maximum(opacity, 1e-3)[:, None]
    return colours.reshape(-1, *block.sh.shape[1:]), opacity
