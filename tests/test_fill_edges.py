"""Edges of a support: their sides stay as they are, and have a light of their own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cagefield.completion.inpainting.support_inpainting import inpaint_support
from cagefield.completion.lighting.light_change import LightChange
from cagefield.completion.surfaces.block_extraction import extract_block
from cagefield.completion.surfaces.footprint import Footprint, build_footprint
from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.completion.surfaces.support_plane import Support
from cagefield.completion.surfaces.surfels import Surfels, extract_surfels
from cagefield.edits import EditStack
from cagefield.fields.voxel_field import VoxelField

C0 = 0.28209479177387814
VOXEL = 0.05
TOP, EDGE = 20, 30
"""The highest vertex of a slab, and its last along x."""


def slab() -> GridBlock:
    """A slab that ends at x = EDGE, red on its top and blue on its side."""
    x, _, z = np.meshgrid(*(np.arange(41),) * 3, indexing="ij")
    solid = (z <= TOP) & (z > TOP - 12) & (x <= EDGE)
    side = solid & (x > EDGE - 3) & (z < TOP - 1)
    rgb = np.where(side[..., None], [0.1, 0.1, 0.8], [0.8, 0.1, 0.1])[solid]
    field = VoxelField(
        np.array([[-1.0] * 3, [1.0] * 3]),
        (41, 41, 41),
        np.flatnonzero(solid),
        np.full(int(solid.sum()), 80.0, np.float32),
        ((rgb - 0.5) / C0).astype(np.float32)[:, None],
    )
    return extract_block(field, EditStack(), np.array([[-1.0] * 3, [1.0] * 3]))


def near_the_edge(block: GridBlock) -> tuple[Footprint, np.ndarray]:
    """(a footprint whose hole reaches the edge, what was removed: a box 5 voxels from it)."""
    top = TOP - int(block.low[2])
    support = Support(np.array([0.0, 0.0, top]), np.array([0.0, 0.0, 1.0]), np.eye(3)[:2], np.zeros((0, 3)))
    shape = block.shape[:2]
    x, y = np.meshgrid(np.arange(shape[0]), np.arange(shape[1]), indexing="ij")
    edge = EDGE - int(block.low[0])
    columns = x <= edge
    hole = columns & (x > edge - 16) & (np.abs(y - shape[1] // 2) < 6)
    removed = np.zeros(block.shape, bool)
    removed[edge - 14 : edge - 4, shape[1] // 2 - 5 : shape[1] // 2 + 5, top + 1 : top + 8] = True
    zero = np.zeros(2, np.int64)
    return Footprint(support, zero, hole, columns & ~hole, columns, np.zeros(shape)), removed


def test_the_side_of_an_edge_stays_under_a_fill() -> None:
    block = slab()
    footprint, removed = near_the_edge(block)
    filled = inpaint_support(block, footprint, removed)
    x, y, z = np.meshgrid(*(np.arange(n) for n in block.shape), indexing="ij")
    x, z = x + block.low[0], z + block.low[2]
    side = (x == EDGE) & (z < TOP - 1) & (z >= TOP - 4) & (np.abs(y - block.shape[1] // 2) < 6)
    assert side.any()
    np.testing.assert_array_equal(filled.density[side], block.density[side])
    np.testing.assert_array_equal(filled.mean_colors(side), block.mean_colors(side))
    further = (x == EDGE - 8) & (z == TOP) & (np.abs(y - block.shape[1] // 2) < 4)
    assert (filled.density[further] > 0.0).all() and (filled.mean_colors(further)[:, 0] > 0.6).all()


def test_light_on_a_top_does_not_reach_around_its_edge() -> None:
    block = slab()
    surface = extract_surfels(block).downsample(2.0 * VOXEL)
    up = surface.normals[:, 2] > 0.8
    light = LightChange.from_surfels(block, surface, np.where(up, 1.0, 0.0), 2.0 * VOXEL)
    dense = light.to_array(block)
    x, y, z = np.meshgrid(*(np.arange(n) for n in block.shape), indexing="ij")
    x, z = x + block.low[0], z + block.low[2]
    amid = np.abs(y - block.shape[1] // 2) < 10
    assert dense[amid & (x == EDGE) & (z == TOP - 1)].mean() < 0.12
    assert dense[amid & (x == EDGE - 2) & (z == TOP)].mean() > 0.76


def test_the_sides_of_a_support_are_not_among_what_is_unsure() -> None:
    """In deep shade only what faces as the support does is filled."""
    block = slab()
    wide, _ = near_the_edge(block)
    cells = np.argwhere(wide.has_surface)
    members = np.column_stack([cells, np.full(len(cells), wide.support.point[2])]).astype(np.float64)
    support = Support(wide.support.point, wide.support.normal, wide.support.axes, members)
    part = np.zeros(block.shape, bool)
    middle = np.array(block.shape) // 2
    part[middle[0] - 3 : middle[0] + 3, middle[1] - 3 : middle[1] + 3, int(support.point[2]) + 1 :] = True
    aside = members[(members[:, 0] < 12) & (members[:, 1] < 12)]
    level, steep = (Surfels(aside, np.tile(n, (len(aside), 1))) for n in ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]))
    filled, kept = (build_footprint(support, part, np.zeros((0, 3)), unsure) for unsure in (level, steep))
    assert filled is not None and kept is not None
    assert filled.hole.sum() > kept.hole.sum() + 50


def test_stripes_go_on_under_what_was_removed() -> None:
    block = slab()
    x, y, z = np.meshgrid(*(np.arange(n) for n in block.shape), indexing="ij")
    wave = 0.5 + 0.3 * np.sin(2.0 * np.pi * y / 8.0)
    shown = block.slot >= 0
    striped = block.with_colors(shown, np.repeat(wave[shown][:, None], 3, axis=1))
    footprint, _ = near_the_edge(block)
    middle = (x > 10) & (x < 20) & (np.abs(y - block.shape[1] // 2) < 6)
    footprint = replace(footprint, hole=middle[..., 0], surroundings=footprint.has_surface & ~middle[..., 0])
    blank = striped.with_colors(shown & middle, np.full((int((shown & middle).sum()), 3), 0.9))
    above = z + block.low[2] - TOP
    filled = inpaint_support(blank, footprint, middle & (above > 0) & (above < 6))
    at = middle & (z + block.low[2] == TOP)
    assert np.abs(filled.mean_colors(at)[:, 0] - wave[at]).mean() < 0.06
