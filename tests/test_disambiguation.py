"""Photos that look alike and show different things: told from the order in which photos were taken."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cagefield.datasets.sfm import disambiguation, structure_from_motion
from cagefield.datasets.sfm.disambiguation import (
    contradicting_pairs,
    distant_pairs,
    is_sequence,
    neighborhood_size,
)
from cagefield.datasets.sfm.registration_report import Matches

pycolmap = pytest.importorskip("pycolmap", reason="poses are found by pycolmap")


def _counts(n: int, reach: int, period: int | None = None) -> np.ndarray:
    """Matches of photos in order, fewer with distance, and again `period` photos further on."""
    apart = np.abs(np.arange(n)[:, None] - np.arange(n))
    if period is not None:
        apart = np.minimum(apart, np.abs(apart - period) + 1)
    return np.where(apart > 0, 200 * (apart < reach) // np.maximum(apart, 1), 0).astype(np.int64)


def test_photos_in_order_are_told_from_others():
    ordered = _counts(40, 6)
    assert is_sequence(ordered) and is_sequence(_counts(40, 6, period=20))
    shuffle = np.random.default_rng(0).permutation(40)
    assert not is_sequence(ordered[shuffle][:, shuffle])
    assert not is_sequence(np.full((40, 40), 200))  # all see the same
    assert not is_sequence(_counts(7, 6))


def test_far_pairs_are_those_beyond_the_neighbors():
    assert [neighborhood_size(n) for n in (9, 24, 40, 71, 500)] == [3, 3, 5, 8, 8]
    found = distant_pairs(_counts(40, 6, period=20))
    assert {j - i for i, j in found} == set(range(16, 25))


def test_pairs_half_a_turn_off_contradict_and_those_of_a_drifting_chain_do_not():
    true = Rotation.from_euler("Y", 10.0 * np.arange(40)[:, None], degrees=True).as_matrix()
    drifting = Rotation.from_euler("Y", 10.6 * np.arange(40)[:, None], degrees=True).as_matrix()
    chain = dict(enumerate(drifting))
    relative = {(i, i + 36): true[i + 36] @ true[i].T for i in range(4)}  # a full turn later, 22 degrees off
    relative |= {(i, i + 18): np.eye(3) for i in range(20)}  # the back, taken for the front
    assert contradicting_pairs(chain, relative) == {(i, i + 18) for i in range(20)}


@pytest.fixture(scope="module")
def synthetic(tmp_path_factory):
    """(database, model) of twelve photos whose matches are true."""
    options = pycolmap.SyntheticDatasetOptions(
        num_rigs=1, num_cameras_per_rig=1, num_frames_per_rig=12, num_points3D=200
    )
    path = tmp_path_factory.mktemp("synthetic") / "database.db"
    pycolmap.set_random_seed(0)
    with pycolmap.Database.open(path) as database:
        model = pycolmap.synthesize_dataset(options, database)
    return path, model


def _all_pairs(count: int) -> set[tuple[int, int]]:
    return {(i, j) for i in range(count) for j in range(i + 1, count)}


def test_relative_rotations_of_true_matches_agree_with_the_model(synthetic):
    path, model = synthetic
    relative = disambiguation.relative_rotations(path, model, _all_pairs(12))
    rotations = disambiguation.model_rotations(model)
    assert len(relative) > 40
    for (i, j), rotation in relative.items():
        np.testing.assert_allclose(rotation, rotations[j] @ rotations[i].T, atol=0.02)
    assert contradicting_pairs(rotations, relative) == set()
    turned = {**rotations, 5: rotations[5] @ Rotation.from_euler("Y", 120, degrees=True).as_matrix()}
    assert {5} == set.intersection(*({i, j} for i, j in contradicting_pairs(turned, relative)))


def _verified(path: Path) -> int:
    with pycolmap.Database.open(path) as database:
        return int(database.num_verified_image_pairs())


def test_removed_pairs_are_gone_from_the_copy_alone(synthetic):
    path, _ = synthetic
    before = _verified(path)
    copy = structure_from_motion.copy_without_pairs(path, {(0, 1), (3, 7)})
    assert _verified(copy) == before - 2 and _verified(path) == before


class _Model:
    def __init__(self, photos: int, points: int) -> None:
        self.num_reg_images, self.num_points3D = lambda: photos, lambda: points


@pytest.mark.parametrize(("pruned", "wins"), [((40, 900), True), ((40, 500), False), ((30, 900), False)])
def test_the_unfolded_model_must_not_lose_photos_or_points(tmp_path, monkeypatch, pruned, wins):
    (tmp_path / "database.db").write_bytes(b"")
    models = {"chain": _Model(40, 1000), "plain": _Model(40, 700), "pruned": _Model(*pruned)}
    mapped = iter(models.values())
    removed = []
    monkeypatch.setattr(structure_from_motion, "_map", lambda *_: [next(mapped)])
    monkeypatch.setattr(disambiguation, "remove_pairs", lambda _, pairs: removed.append(pairs))
    monkeypatch.setattr(disambiguation, "relative_rotations", lambda *_: {})
    monkeypatch.setattr(disambiguation, "model_rotations", lambda _: {})
    monkeypatch.setattr(disambiguation, "contradicting_pairs", lambda *_: {(2, 20)})
    counts = _counts(40, 6, period=20)
    matches = Matches(counts, np.zeros_like(counts, dtype=bool))
    (found,), _ = structure_from_motion.build_unambiguous_models(tmp_path, matches, 0, lambda *_: None)
    assert found is models["pruned" if wins else "plain"]
    assert removed == [distant_pairs(counts), {(2, 20)}]
