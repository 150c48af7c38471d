"""Blocks of a grid extended by vertices around them, and morphology on the part of a grid around a mask."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy import ndimage

from cagefield.completion import edit_context
from cagefield.completion.destination import FieldVertices
from cagefield.completion.edit_context import EditContext, extract_field_surfels
from cagefield.completion.lighting import light_change
from cagefield.completion.lighting.light_change import LightChange
from cagefield.completion.surfaces.block_extraction import extract_block, extract_vertices
from cagefield.completion.surfaces.block_union import (
    VertexRange,
    embed_mask,
    extend_blocks,
)
from cagefield.completion.surfaces.grid_block import NORMAL_DEVIATION_VERTICES
from cagefield.completion.surfaces.near_masks import (
    close_gaps,
    dilate,
    distances_near,
    fill_cavities,
    slices_around,
)
from cagefield.completion.surfaces.surfels import extract_surfels
from cagefield.completion.surfaces.visibility import render_visibility
from cagefield.edits import Edit, EditStack
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.scene.scene import Scene
from scenes import ball_field

INNER = Cage.box((0.2, 0.0, 0.1), (0.5, 0.5, 0.4))
BELOW = EditStack([Edit.continuous(INNER, INNER.grown(0.3), lattice=16).translate((0.1, 0.0, 0.1))])


def vertex_range(first: tuple[int, ...], last: tuple[int, ...]) -> VertexRange:
    return VertexRange(np.array(first), np.array(last))


@pytest.mark.parametrize(
    ("own", "beyond"),
    [
        (((0, 0, 0), (9, 9, 9)), None),
        (((0, 0, 0), (5, 9, 9)), ((6, 0, 0), (9, 9, 9))),
        (((0, 4, 0), (9, 9, 9)), ((0, 0, 0), (9, 3, 9))),
        (((-3, -3, 2), (12, 12, 20)), ((0, 0, 0), (9, 9, 1))),
        (((0, 0, 3), (9, 9, 6)), ((0, 0, 0), (9, 9, 9))),
        (((0, 0, 0), (5, 5, 9)), ((0, 0, 0), (9, 9, 9))),
        (((0, 0, 20), (9, 9, 30)), ((0, 0, 0), (9, 9, 9))),
    ],
)
def test_a_range_beyond_another_holds_all_its_other_vertices(
    own: tuple[tuple[int, ...], tuple[int, ...]], beyond: tuple[tuple[int, ...], tuple[int, ...]] | None
) -> None:
    whole = vertex_range((0, 0, 0), (9, 9, 9))
    found = whole.beyond(vertex_range(*own))
    assert (found is None) == (beyond is None)
    if found is not None and beyond is not None:
        assert (found.first.tolist(), found.last.tolist()) == tuple(list(each) for each in beyond)


@pytest.mark.parametrize("below", [EditStack(), BELOW])
def test_an_extended_block_is_that_of_all_its_vertices(below: EditStack) -> None:
    field = ball_field(resolution=33)
    block = extract_block(field, below, np.array([[-0.3, -0.4, -0.3], [0.4, 0.4, 0.2]]))
    whole = extract_block(field, below, np.array([[-0.3, -0.4, -0.3], [0.4, 0.7, 0.6]]))
    source = FieldVertices(field, below)
    changed = block.with_density(block.solid, np.zeros(int(block.solid.sum()), np.float32))
    extended, other = extend_blocks(block, changed, VertexRange.from_block(whole), source.extract)
    assert extended.shape == whole.shape and (extended.low == whole.low).all()
    np.testing.assert_array_equal(extended.density, whole.density)
    np.testing.assert_array_equal(extended.slot >= 0, whole.slot >= 0)
    stored = whole.slot >= 0
    np.testing.assert_array_equal(extended.sh[extended.slot[stored]], whole.sh[whole.slot[stored]])
    assert extend_blocks(whole, whole, VertexRange.from_block(block), source.extract) == (whole, whole)
    assert int((other.density != whole.density).sum()) == int(block.solid.sum())
    np.testing.assert_array_equal(other.slot >= 0, whole.slot >= 0)
    np.testing.assert_array_equal(embed_mask(whole, block, block.solid), other.density != whole.density)


def test_morphology_around_a_mask_is_that_of_the_whole_grid() -> None:
    rng = np.random.default_rng(0)
    mask = np.zeros((20, 15, 12), bool)
    mask[3:8, 9:14, 0:5] = rng.random((5, 5, 5)) > 0.6
    np.testing.assert_array_equal(dilate(mask, 3), ndimage.binary_dilation(mask, iterations=3))
    at = rng.uniform(-2.0, 22.0, (500, 3))
    whole = ndimage.distance_transform_edt(~mask)
    expected = ndimage.map_coordinates(whole, at.T, order=1, mode="nearest")
    found = distances_near(mask, at, 4.5)
    np.testing.assert_allclose(found[expected < 4.5], expected[expected < 4.5], atol=1e-12)
    assert np.isinf(found[expected >= 4.5]).all() and np.isfinite(found).any()
    none = np.zeros((5, 6, 7), bool)
    assert not none[slices_around(none, 2)].size and not dilate(none, 2).any()
    assert np.isinf(distances_near(none, at, 3.0)).all()


def test_normals_around_a_mask_are_those_of_the_block() -> None:
    field = ball_field(resolution=33)
    block = extract_vertices(field, EditStack(), np.zeros(3, np.int64), np.array(field.resolution))
    mask = np.zeros(block.shape, bool)
    mask[20:24, 10:16, 14:20] = True
    found = block.normals_at(mask)
    assert (np.abs(found) > 0.1).any()
    smooth = ndimage.gaussian_filter(1.0 - np.exp(-block.depth), NORMAL_DEVIATION_VERTICES)
    slope = -np.stack(np.gradient(smooth), axis=-1) / field.voxel_size
    length = np.maximum(np.linalg.norm(slope, axis=-1, keepdims=True), 1e-6)
    np.testing.assert_allclose(found, (slope / length)[mask], atol=1e-5)
    every = np.ones(block.shape, bool)
    np.testing.assert_allclose(block.normals_at(every), (slope / length)[every], atol=1e-5)


def test_gaps_and_cavities_are_those_of_scipy() -> None:
    rng = np.random.default_rng(5)
    for shape in ((3, 4, 5), (21, 30, 17)):
        mask = ndimage.gaussian_filter(rng.standard_normal(shape), 1.5) > 0.0
        padded = ndimage.binary_closing(np.pad(mask, 2), ndimage.generate_binary_structure(3, 2))
        np.testing.assert_array_equal(close_gaps(mask), padded[2:-2, 2:-2, 2:-2])
        shell = mask | ndimage.binary_dilation(mask)
        np.testing.assert_array_equal(fill_cavities(shell), ndimage.binary_fill_holes(shell))
    hollow = np.ones((5, 5, 5), bool)
    hollow[2, 2, 2] = False
    assert fill_cavities(hollow).all()


@pytest.mark.parametrize("contracted", [False, True])
def test_light_changes_only_around_surfels_whose_light_changed(contracted: bool) -> None:
    """The vertices left out are those whose mean over the surfels around is 0."""
    field = dataclasses.replace(ball_field(resolution=49), contracted=contracted)
    block = extract_vertices(field, EditStack(), np.zeros(3, np.int64), np.array(field.resolution))
    surface, voxel = extract_surfels(block), max(block.spacing)
    logs = np.where(surface.points[:, 0] > 0.55 * surface.points[:, 0].max(), -0.3, 0.0)
    change = LightChange.from_surfels(block, surface, logs, 2.0 * voxel)
    every = block.slot >= 0
    radius = light_change.MAX_LIGHT_DEPTH_VOXELS * voxel
    means = light_change._mean_logs(
        surface, logs, block.positions(every), block.normals_at(every), radius, 2.0 * voxel
    )
    whole = np.zeros(block.shape)
    whole[every] = np.nan_to_num(means)
    np.testing.assert_allclose(change.to_array(block), whole, atol=1e-12)
    assert 0 < change.mask.sum() < 2 * np.count_nonzero(whole) < np.isfinite(means).sum()
    half = np.zeros(block.shape, bool)
    half[:, :24] = True
    part = LightChange.from_surfels(block, surface, logs, 2.0 * voxel, where=half)
    np.testing.assert_array_equal(part.mask, change.mask & half)


def test_surfels_of_a_field_are_those_of_its_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = Scene(ball_field(resolution=41))
    monkeypatch.setattr("cagefield.completion.surfaces.visibility.CAMERA_COUNT", 4)
    monkeypatch.setattr("cagefield.completion.surfaces.visibility.IMAGE_SIZE_PIXELS", 60)
    field = scene.field
    assert isinstance(field, VoxelField)
    seen = render_visibility(scene.patcher._render, [], field.bounds)
    whole = extract_field_surfels(field, seen)
    assert whole is not None
    known = EditContext.build(field, EditStack(), Edit.delete(INNER), None, seen, surfels=whole)
    own = dataclasses.replace(known, surfels=None)
    at = known.remaining_coordinates
    is_inner = np.asarray(((at > 4.0) & (at < np.array(known.before.shape) - 5.0)).all(axis=1))
    inner = known.remaining.take(is_inner)
    # Both are means of the same cells, but at the rim of the block.
    assert len(inner.points) > 20
    assert own.remaining.distance(inner.points).max() < 0.01 * own.voxel
    moved = EditContext.build(field, BELOW, Edit.delete(INNER), None, seen, surfels=whole)
    assert moved.surfels is None and moved.visibility is None
    monkeypatch.setattr(edit_context, "MAX_SURFEL_VERTICES", 41**3 - 1)
    assert extract_field_surfels(field, seen) is None
