"""What a voxel training chooses itself: resolution, harmonics, rates, and the stages on the way."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from cagefield.training.voxels.schedule import MAX_FIRST_RESOLUTION, Schedule, stages
from cagefield.training.voxels.voxel_config import VoxelConfig
from cagefield.training.voxels.voxel_defaults import (
    BATCH_RAYS,
    MAX_AUTO_RESOLUTION,
    MIN_AUTO_RESOLUTION,
    VoxelSettings,
    resolve_settings,
)


def chosen(
    config: VoxelConfig, side: int, threads: int | None = 2, *, unbounded: bool = False
) -> VoxelSettings:
    """The choices for 20 photos, upright and lying, with this longer side."""
    sizes = np.array([[side, side // 2], [side // 3, side]] * 10)
    return resolve_settings(config, sizes, unbounded=unbounded, threads=threads)


def test_the_resolution_grows_with_the_photos_as_far_as_there_is_time():
    long = [chosen(VoxelConfig(minutes=60.0), side).resolution for side in (32, 100, 200, 400, 800)]
    assert long == [MIN_AUTO_RESOLUTION, 88, 176, 360, MAX_AUTO_RESOLUTION]
    assert chosen(VoxelConfig(minutes=1e4), 4000, threads=None).resolution == MAX_AUTO_RESOLUTION


def test_the_resolution_grows_with_the_root_of_the_time_and_of_the_threads():
    short = chosen(VoxelConfig(minutes=0.5), 800).resolution
    assert MIN_AUTO_RESOLUTION < short < MAX_AUTO_RESOLUTION / 2
    # Rounded to multiples of 8.
    assert chosen(VoxelConfig(minutes=2.0), 800).resolution == pytest.approx(2 * short, abs=12)
    assert chosen(VoxelConfig(minutes=0.5), 800, threads=8).resolution == pytest.approx(2 * short, abs=12)


def test_the_laplacian_grows_with_the_rays_of_a_batch():
    for unbounded in (False, True):
        cpu = chosen(VoxelConfig(minutes=1.0), 400, unbounded=unbounded)
        gpu = chosen(VoxelConfig(minutes=1.0), 400, threads=None, unbounded=unbounded)
        few = chosen(VoxelConfig(steps=10, batch_rays=1024), 400, unbounded=unbounded)
        assert gpu.laplacian_reg / gpu.batch_rays == pytest.approx(cpu.laplacian_reg / cpu.batch_rays)
        assert few.laplacian_reg == pytest.approx(cpu.laplacian_reg / 4)
    assert chosen(VoxelConfig(laplacian_reg=1e-4, batch_rays=1024), 400).laplacian_reg == 1e-4


def test_a_run_of_given_steps_chooses_the_same_on_every_machine():
    found = {chosen(VoxelConfig(steps=4000), 800, threads) for threads in (1, 2, 64, None)}
    assert len(found) == 1
    assert chosen(VoxelConfig(steps=16000), 800).resolution > found.pop().resolution


def test_what_is_named_is_taken():
    named = VoxelConfig(
        resolution=90,
        sh_degree=0,
        lr=(3.0, 1.0),
        laplacian_reg=0.0,
        view_dependence_reg=0.1,
        distortion_reg=0.02,
    )
    for unbounded in (False, True):
        assert chosen(named, 400, unbounded=unbounded) == VoxelSettings(
            90, 0, (3.0, 1.0), 0.0, 0.1, 0.02, BATCH_RAYS
        )


@pytest.mark.parametrize("final", [16, 48, 256, 400, 512, 1024])
def test_stages_begin_coarse_and_end_at_the_resolution(final):
    found = stages(final)
    resolutions, starts = zip(*found, strict=True)
    assert resolutions[0] <= MAX_FIRST_RESOLUTION + 1 and resolutions[-1] == final
    assert starts[0] == 0.0 and starts[-1] == 0.4
    assert all(a < b for a, b in itertools.pairwise(starts))
    # A grid at most doubles at once: each new vertex lies within a cell of the grid before.
    assert all(a <= b <= 2 * a + 1 for a, b in itertools.pairwise(resolutions))


def test_only_the_first_stage_has_fewer_harmonics():
    schedule = Schedule(96, 2, by_clock=False)
    degrees = [schedule.sh_degree]
    while not schedule.is_last:
        schedule.enter_next(0)
        degrees.append(schedule.sh_degree)
    assert degrees == [1, 2, 2, 2]
    assert Schedule(96, 0, by_clock=False).sh_degree == 0


def test_by_the_clock_no_grid_is_pruned_or_refined_before_batches_have_met_it():
    """A compilation or another program takes time too: what no batch has met would be lost."""
    schedule = Schedule(320, 1, by_clock=True)
    schedule.enter_next(100)
    assert schedule.resolution == 140
    least = 140**2 // 128 + 1
    assert not schedule.is_pruning_due(0.5, 101) and not schedule.is_over(0.5, 101)
    assert schedule.is_pruning_due(0.5, 100 + least)
    schedule.prune(100 + least)
    assert not schedule.is_pruning_due(0.5, 2000) and not schedule.is_over(0.5, 101 + least)
    assert schedule.is_over(0.5, 100 + 2 * least)
    steps = Schedule(320, 1, by_clock=False)
    steps.enter_next(100)
    assert steps.is_pruning_due(0.5, 101) and steps.is_over(0.5, 101)
