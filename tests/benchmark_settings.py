"""Settings of benchmarks for tests."""

from __future__ import annotations

from benchmarks.common.workbench import Settings

from cagefield.training.voxels.voxel_config import VoxelConfig

TINY = Settings(
    views=8,
    size=32,
    test_views=3,
    config=VoxelConfig(steps=60, resolution=24),
    exact_size=24,
    exact_views=2,
    compared_size=16,
    compared_views=1,
)
"""Sizes of a benchmark that runs in seconds."""
