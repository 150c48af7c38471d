"""Disturbed cameras: angles, offsets and focal lengths as stated."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from benchmarks.captures.perturbation import perturbed
from benchmarks.commands.bench_captures import BenchCaptures

from cagefield.cameras.camera import Camera
from cagefield.datasets import Dataset, View, load_dataset
from cagefield.procedural import make_capture


@pytest.fixture
def dataset() -> Dataset:
    eyes = np.random.default_rng(3).uniform(2, 9, (40, 3))
    views = [
        View(f"{i}.jpg", Camera.look_at(eye, (1, 1, 1), width=64, height=48, fov_x=0.8), Path(f"{i}.jpg"))
        for i, eye in enumerate(eyes)
    ]
    bounds = np.array([[0.0, 0.0, 0.0], [2.0, 2.0, 2.0]])
    return Dataset(
        "d", Path("d"), tuple(views[:30]), tuple(views[30:38]), tuple(views[38:]), True, bounds, False
    )


def pairs(before: Dataset, after: Dataset) -> list[tuple[View, View]]:
    return [
        pair
        for split in ("train", "test", "val")
        for pair in zip(getattr(before, split), getattr(after, split), strict=True)
    ]


def test_every_camera_is_turned_by_a_degree_and_moved_by_a_hundredth_of_its_distance(dataset):
    turns, shifts, factors = [], [], []
    for old, new in pairs(dataset, perturbed(dataset, 1)):
        assert (old.name, old.camera.width, old.camera.cx) == (new.name, new.camera.width, new.camera.cx)
        turn = new.camera.c2w[:3, :3] @ old.camera.c2w[:3, :3].T
        assert np.degrees(np.arccos((np.trace(turn) - 1) / 2)) == pytest.approx(1.0, abs=1e-6)
        turns.append(np.array([turn[2, 1], turn[0, 2], turn[1, 0]]) / np.sin(np.radians(1.0)))
        shift = new.camera.origin - old.camera.origin
        distance = np.linalg.norm(old.camera.origin - 1.0)
        assert np.linalg.norm(shift) == pytest.approx(0.01 * distance, rel=1e-9)
        shifts.append(shift / np.linalg.norm(shift))
        factors.append(new.camera.fx / old.camera.fx)
        assert new.camera.fy / old.camera.fy == pytest.approx(factors[-1], rel=1e-12)
    # 40 random directions: the mean of one component has the deviation sqrt(1/3/40) = .09
    assert np.abs(np.mean(turns, axis=0)).max() < 0.35 and np.abs(np.mean(shifts, axis=0)).max() < 0.35
    assert 0.95 <= min(factors) < 0.965 and 1.035 < max(factors) <= 1.05


def test_the_seed_decides_and_nothing_else_changes(dataset):
    first, again, other = (perturbed(dataset, seed) for seed in (0, 0, 1))
    assert all(np.array_equal(a.camera.c2w, b.camera.c2w) for a, b in pairs(first, again))
    assert not any(np.array_equal(a.camera.c2w, b.camera.c2w) for a, b in pairs(first, other))
    assert np.array_equal(first.bounds, dataset.bounds) and first.points is dataset.points


def test_the_benchmark_disturbs_the_cameras_that_it_reads(tmp_path):
    room = make_capture("room-chair", tmp_path / "room", views=3, size=32, points=False)
    read = BenchCaptures((str(room),), perturb_poses=True, keep_poses=True, seed=5)._open(
        str(room), tmp_path
    )[0]
    expected = perturbed(load_dataset(room), 5)
    assert len(read.test) == 1
    for old, new in pairs(expected, read):
        np.testing.assert_array_equal(old.camera.c2w, new.camera.c2w)
        assert old.camera.fx == new.camera.fx
