"""Specks: what is taken out of a field, and what stays."""

from __future__ import annotations

import numpy as np

from cagefield.fields.voxel_field import VoxelField
from cagefield.training.voxels.floater_removal import MAX_FLOATER_VERTICES, remove_floaters

N = 64


def field_of(density: np.ndarray) -> VoxelField:
    """A field on a unit cube with this optical depth per voxel [N,N,N]; all vertices are stored."""
    count = density.size
    sh = np.zeros((count, 1, 3), np.float32)
    return VoxelField(
        np.array([[0.0] * 3, [1.0] * 3]),
        (N, N, N),
        np.arange(count),
        (density * (N - 1)).reshape(-1).astype(np.float32),
        sh,
    )


def kept(field: VoxelField) -> np.ndarray:
    """Mask [N,N,N] of the stored vertices."""
    full = np.zeros(N**3, bool)
    full[field.vertices] = True
    return full.reshape(N, N, N)


def block_and_specks() -> np.ndarray:
    density = np.zeros((N, N, N))
    density[2:50, 2:50, 2:50] = (
        1.0  # 110,592 vertices: a thousandth of them is more than MAX_FLOATER_VERTICES
    )
    density[55:58, 55:58, 55:58] = 1.0  # a speck of 27
    density[55:60, 10:15, 10:15] = 1.0  # 125 vertices: no speck
    return density


def test_a_small_cloud_goes_and_a_larger_one_stays() -> None:
    found = kept(remove_floaters(field_of(block_and_specks())))
    assert not found[53:61, 53:61, 53:61].any()
    assert found[55:60, 10:15, 10:15].all() and found[2:50, 2:50, 2:50].all()
    assert 3**3 < MAX_FLOATER_VERTICES < 5**3


def test_what_touches_a_cloud_that_stays_is_no_speck() -> None:
    density = block_and_specks()
    density[50:52, 50:52, 50:52] = 1.0  # corner to corner with the block
    found = kept(remove_floaters(field_of(density)))
    assert found[50:52, 50:52, 50:52].all()


def test_the_skirt_of_what_stays_is_kept_and_empty_space_is_not() -> None:
    density = block_and_specks()
    density[50, 2:50, 2:50] = 0.01  # thinner than a cloud, next to one
    found = kept(remove_floaters(field_of(density)))
    assert found[50, 2:50, 2:50].all()
    assert not found[52:54, 2:50, 2:50].any()


def test_small_things_in_a_small_scene_stay() -> None:
    density = np.zeros((N, N, N))
    density[10:13, 10:13, 10:13] = 1.0
    density[30:33, 30:33, 30:33] = 1.0
    found = kept(remove_floaters(field_of(density)))
    assert found[10:13, 10:13, 10:13].all() and found[30:33, 30:33, 30:33].all()


def test_an_empty_field_stays_as_it_is() -> None:
    empty = field_of(np.zeros((N, N, N)))
    assert remove_floaters(empty) is empty
