"""What shows of a block's surfaces, and light that brings out no noise."""

from __future__ import annotations

import numpy as np

from cagefield.completion.surfaces.block_extraction import extract_block
from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.completion.surfaces.surface_color import (
    FULLY_DENOISED_LOG_GAIN,
    MIN_DENOISED_LOG_GAIN,
    colors_along_normals,
    denoise_colors,
)
from cagefield.completion.surfaces.surfels import extract_surfels
from cagefield.edits import EditStack
from cagefield.fields.sh import C0
from cagefield.fields.voxel_field import VoxelField

VERTICES, TOP = 24, 12


def ground(seed: int = 0) -> GridBlock:
    """Foggy ground up to height TOP, gray 0.2 on the whole, each vertex with noise of its own."""
    shape = (VERTICES,) * 3
    z = np.broadcast_to(np.arange(VERTICES), shape)
    vertices = np.flatnonzero(z <= TOP + 1)
    solid = (z <= TOP).reshape(-1)[vertices]
    voxel = 2.0 / (VERTICES - 1)
    color = 0.2 + 0.15 * np.random.default_rng(seed).standard_normal((len(vertices), 1, 3))
    field = VoxelField(
        np.array([[-1.0] * 3, [1.0] * 3]),
        shape,
        vertices,
        np.where(solid, 0.7 / voxel, 0.0).astype(np.float32),
        ((color - 0.5) / C0).astype(np.float32),
    )
    return extract_block(field, EditStack(), field.bounds)


def inner(block: GridBlock) -> np.ndarray:
    """[X,Y,Z]: the ground's topmost vertices, away from the block's faces."""
    where = np.zeros(block.shape, bool)
    where[4:-4, 4:-4, TOP - 1 : TOP + 1] = True
    return where


def test_what_shows_is_the_mean_of_what_a_ray_meets():
    block = ground()
    surface = extract_surfels(block)
    facing = surface.normals[:, 2] > 0.9
    colors, opacity = colors_along_normals(block, surface.take(facing))
    mean = 0.5 + C0 * colors[:, 0]
    assert opacity.min() > 0.9
    assert mean.std() < 0.7 * 0.15 and abs(float(mean.mean()) - 0.2) < 0.02


def test_light_that_grows_brings_no_noise_out():
    block = ground()
    where = inner(block)
    before = block.mean_colors(where)
    after = denoise_colors(
        block, where, np.full(int(where.sum()), FULLY_DENOISED_LOG_GAIN + 0.1)
    ).mean_colors(where)
    assert after.std() < 0.6 * before.std()
    assert abs(after.mean() - before.mean()) < 0.02


def test_light_that_stays_or_fades_changes_no_color():
    block = ground()
    where = inner(block)
    for log in (-1.0, 0.0, MIN_DENOISED_LOG_GAIN):
        assert denoise_colors(block, where, np.full(int(where.sum()), log)) is block


def test_blocks_without_surfaces_stay():
    block = ground()
    empty = block.with_density(np.ones(block.shape, bool), np.zeros(block.density.size, np.float32))
    where = empty.slot >= 0
    assert denoise_colors(empty, where, np.ones(int(where.sum()))) is empty
