"""Slots of layers: written once while a layer lives, free afterwards, other layers untouched."""

from __future__ import annotations

import gc

import numpy as np

from cagefield.fields.voxel_field import VoxelField
from cagefield.rendering.voxels.layer_slots import GROWTH, LayerSlots
from cagefield.typing import Float32

BOUNDS = np.array([[0.0] * 3, [1.0] * 3])
SIDE = 12


def field_of(count: int, seed: int) -> VoxelField:
    """A field of so many vertices in random places, with random content of degree 1."""
    rng = np.random.default_rng(seed)
    vertices = np.sort(rng.choice(SIDE**3, count, replace=False))
    density = rng.uniform(1.0, 9.0, count).astype(np.float32)
    return VoxelField(BOUNDS, (SIDE,) * 3, vertices, density, rng.normal(size=(count, 4, 3)))


def check_stored(density: Float32, sh: Float32, slots: np.ndarray, field: VoxelField) -> None:
    """The slots have the field's content."""
    np.testing.assert_array_equal(density[slots], field.density)
    np.testing.assert_array_equal(sh.reshape(-1, 4, 3)[slots], field.sh)


def test_slots_have_the_content_of_the_field_and_of_each_layer() -> None:
    field, first, second = field_of(300, 0), field_of(70, 1), field_of(40, 2)
    shared = LayerSlots(field)
    density, sh, slots = shared.store((first, second, first))
    check_stored(density, sh, shared.index[field.vertices], field)
    assert density[0] == 0.0 and not sh[:12].any() and shared.index.astype(bool).sum() == 300
    for layer, numbers in zip((first, second, first), slots, strict=True):
        check_stored(density, sh, numbers, layer)
    assert len(np.unique(np.concatenate([shared.index[field.vertices], *slots[:2]]))) == 410


def test_a_layer_is_written_once_and_its_slots_are_free_when_it_is_gone() -> None:
    kept = field_of(60, 1)
    shared = LayerSlots(field_of(300, 0))
    before = shared.store((field_of(50, 2), kept))
    gc.collect()
    after = shared.store((kept, field_of(45, 3)))
    assert np.shares_memory(before[0], after[0]) and np.shares_memory(before[1], after[1])
    np.testing.assert_array_equal(before[2][1], after[2][0])
    check_stored(after[0], after[1], after[2][0], kept)
    assert after[2][1].min() == before[2][0].min()


def test_arrays_that_grow_leave_those_before_as_they_were() -> None:
    field, first = field_of(200, 0), field_of(80, 1)
    shared = LayerSlots(field)
    density, sh, (slots,) = shared.store((first,))
    large = field_of(int(GROWTH * 200), 2)
    longer, more, numbers = shared.store((first, large))
    assert not np.shares_memory(density, longer)
    check_stored(density, sh, slots, first)
    for layer, own in zip((first, large), numbers, strict=True):
        check_stored(longer, more, own, layer)
    check_stored(longer, more, shared.index[field.vertices], field)


def test_a_field_without_vertices_takes_layers() -> None:
    layer = field_of(40, 1)
    empty = VoxelField(BOUNDS, (SIDE,) * 3, np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 4, 3)))
    density, sh, (slots,) = LayerSlots(empty).store((layer,))
    check_stored(density, sh, slots, layer)
