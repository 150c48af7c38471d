"""Training end to end: it learns, the seed decides, an interrupted run continues to the same field."""

from __future__ import annotations

import os
import signal
from dataclasses import replace

import numpy as np
import pytest

from cagefield.compute import devices
from cagefield.datasets import load_dataset
from cagefield.errors import CagefieldError
from cagefield.procedural import make_scene
from cagefield.training.progress import Snapshots
from cagefield.training.voxels import batches, voxel_run
from cagefield.training.voxels.inpainting import FILL_OPTICAL_DEPTH
from cagefield.training.voxels.train_voxels import train_voxel
from cagefield.training.voxels.voxel_config import VoxelConfig

devices.start()

REPRODUCIBLE = not devices.is_gpu()
"""On a GPU many rays add to one voxel, in any order."""

CONFIG = VoxelConfig(steps=150, resolution=48, batch_rays=1024, sh_degree=1)


def assert_same(found, expected):
    """Equal, or on a GPU as close as sums in another order stay over a run."""
    np.testing.assert_allclose(found, expected, atol=0.0 if REPRODUCIBLE else 1e-2, rtol=0.0)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    folder = tmp_path_factory.mktemp("data") / "plant"
    make_scene("plant", folder, views=16, size=48, test_views=4)
    return load_dataset(folder)


def test_the_box_that_the_photos_come_with_is_read(dataset):
    assert not dataset.unbounded
    assert (dataset.bounds[1] - dataset.bounds[0]).max() < 2.6  # the plant, not the default 3 units


@pytest.fixture(scope="module")
def trained(dataset):
    return train_voxel(dataset, CONFIG)


def test_it_learns_views_it_has_not_seen(trained):
    assert trained.finished
    assert trained.steps == 150
    # A white picture scores about 12 dB on this scene, a gray silhouette about 17.
    assert trained.test_psnr > 21
    assert trained.test_ssim > 0.75
    assert trained.train_psnr > trained.test_psnr - 1
    # Space is empty but for the scene.
    assert len(trained.field.vertices) < 0.4 * np.prod(trained.field.resolution)


@pytest.mark.nightly
def test_the_seed_decides(dataset, trained):
    again = train_voxel(dataset, CONFIG, evaluate=False)
    assert_same(again.field.density, trained.field.density)
    assert_same(again.field.sh, trained.field.sh)
    other = train_voxel(dataset, replace(CONFIG, seed=1), evaluate=False)
    assert other.field.density.shape != trained.field.density.shape or not np.array_equal(
        other.field.density, trained.field.density
    )


def test_a_gpu_with_a_ray_per_lane_learns_the_same(dataset, monkeypatch):
    """As far as a CPU can tell: its threads take the rays as a GPU's lanes do, and add up with atomics.

    Without smoothing, which is of what the first of a CPU's accumulators has met, and a GPU has one. Threads
    add in any order, and Adam makes a whole step of a gradient hardly above rounding: a few vertices
    may differ.
    """
    few = replace(CONFIG, steps=20, laplacian_reg=0.0)
    expected = train_voxel(dataset, few, evaluate=False).field
    for lanes in (1 << 15, 300):  # all rays at once, and in several turns
        with monkeypatch.context() as patched:
            patched.setattr(devices, "is_gpu", lambda: True)
            patched.setattr(batches, "MAX_GPU_RAYS", lanes)
            found = train_voxel(dataset, few, evaluate=False).field
        np.testing.assert_array_equal(found.vertices, expected.vertices)
        assert np.quantile(np.abs(found.density - expected.density), 0.99) < 1e-3
        assert np.quantile(np.abs(found.sh - expected.sh), 0.99) < 1e-4


def test_interrupted_and_resumed_is_as_uninterrupted(dataset, trained, tmp_path):
    checkpoint = tmp_path / "run.npz"

    def press_ctrl_c(progress):
        if progress.step == 90:
            os.kill(os.getpid(), signal.SIGINT)

    first = train_voxel(dataset, CONFIG, checkpoint=checkpoint, on_progress=press_ctrl_c, evaluate=False)
    assert not first.finished
    assert first.steps < 150
    assert checkpoint.is_file()
    second = train_voxel(dataset, CONFIG, checkpoint=checkpoint, resume=True, evaluate=False)
    assert second.finished
    np.testing.assert_array_equal(second.field.vertices, trained.field.vertices)
    assert_same(second.field.density, trained.field.density)

    def no_step(progress):
        raise AssertionError("a finished run took a step")

    written = checkpoint.stat().st_mtime_ns
    third = train_voxel(
        dataset, CONFIG, checkpoint=checkpoint, resume=True, on_progress=no_step, evaluate=False
    )
    assert third.finished and third.steps == 150
    assert checkpoint.stat().st_mtime_ns == written
    assert_same(third.field.density, trained.field.density)


class _Clock:
    """A clock that goes on by a hundredth of a second whenever it is read, and as told."""

    now = 0.0

    def perf_counter(self) -> float:
        self.now += 0.01
        return self.now


@pytest.mark.nightly
def test_snapshots_are_the_field_on_the_way_and_take_no_training_time(dataset, trained, monkeypatch):
    fields, seconds = {}, {}
    clock = _Clock()
    monkeypatch.setattr(voxel_run, "time", clock)

    def take(progress, field):
        fields[progress.step] = field
        clock.now += 1000.0

    def look(progress):
        seconds[progress.step] = progress.seconds

    result = train_voxel(
        dataset, CONFIG, on_progress=look, snapshots=Snapshots(take, steps=(90, 2, 150)), evaluate=False
    )
    assert list(fields) == [2, 90, 150]
    # At the end, what no photo showed is filled; the rest stays.
    kept = np.searchsorted(trained.field.vertices, fields[150].vertices)
    same = np.isclose(
        trained.field.density[kept], fields[150].density, rtol=0.0, atol=0.0 if REPRODUCIBLE else 1e-2
    )
    assert same.mean() > 0.7 and not same.all()
    assert (
        trained.field.density[kept][~same] == np.float32(FILL_OPTICAL_DEPTH / trained.field.voxel_size.max())
    ).all()
    assert_same(result.field.density, trained.field.density)
    assert seconds[91] - seconds[90] < 1.0


def test_snapshots_by_the_clock_come_once_each(dataset):
    seen = []
    train_voxel(
        dataset,
        replace(CONFIG, steps=4),
        snapshots=Snapshots(lambda progress, _: seen.append(progress.seconds), minutes=(1e-9, 2e-9)),
        evaluate=False,
    )
    assert len(seen) == 1 and seen[0] > 0
    times = Snapshots(lambda progress, field: None, steps=(3,), minutes=(0.5, 0.51))
    assert times.is_due((2, 0.0), (3, 1.0)) and not times.is_due((3, 0.0), (4, 1.0))
    assert times.is_due((4, 29.0), (5, 30.0)) and not times.is_due((5, 30.0), (6, 30.5))
    assert times.is_due((6, 30.5), (7, 31.0)) and not times.is_due((7, 31.0), (8, 60.0))


@pytest.mark.parametrize(
    ("settings", "message"),
    [({"steps": (5, 0)}, "after step 0; it must be"), ({"minutes": (-1.0,)}, r"after -1.0 minutes; it must")],
)
def test_impossible_snapshots_are_named(settings, message):
    with pytest.raises(CagefieldError, match=message):
        Snapshots(print, **settings)


def test_a_damaged_or_foreign_checkpoint_is_refused(dataset, tmp_path):
    with pytest.raises(CagefieldError, match="no checkpoint"):
        train_voxel(dataset, CONFIG, checkpoint=tmp_path / "none.npz", resume=True)
    bad = tmp_path / "bad.npz"
    bad.write_bytes(b"PK\x03\x04 not really")
    with pytest.raises(CagefieldError, match="not a readable checkpoint"):
        train_voxel(dataset, CONFIG, checkpoint=bad, resume=True)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"steps": 0}, "steps is 0"),
        ({"resolution": 4}, "resolution is 4"),
        ({"sh_degree": 3}, "sh_degree is 3"),
        ({"minutes": -1.0}, "minutes is -1"),
    ],
)
def test_impossible_settings_are_named(settings, message):
    with pytest.raises(CagefieldError, match=message):
        VoxelConfig(**settings)


def test_a_damaged_box_is_named(dataset, tmp_path):
    import json
    import shutil

    shutil.copytree(dataset.path, tmp_path / "data")
    path = tmp_path / "data" / "transforms_train.json"
    document = json.loads(path.read_text())
    document["aabb"] = [[1, 1, 1], [0, 2, 2]]
    path.write_text(json.dumps(document))
    with pytest.raises(CagefieldError, match="'aabb' must be"):
        load_dataset(tmp_path / "data")


def test_a_run_by_the_clock_gives_each_stage_its_steps(dataset):
    """However slow the machine, a grid has learnt something before it is refined."""
    result = train_voxel(dataset, VoxelConfig(minutes=0.001, resolution=48, batch_rays=256), evaluate=False)
    assert result.finished
    assert len(result.field.vertices) > 8
