"""What several test modules share."""

from __future__ import annotations

from pathlib import Path

import pytest

from cagefield import Scene, load_dataset
from cagefield.datasets.procedural import make_scene
from cagefield.training.voxel import train_voxel
from cagefield.training.voxel_config import VoxelConfig


@pytest.fixture(scope="session")
def trained_digger(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The scene folder of a digger, trained for seconds on 20 small photos; to be copied."""
    folder = tmp_path_factory.mktemp("digger")
    data = load_dataset(make_scene("digger", folder / "photos", views=20, size=80, test_views=1))
    result = train_voxel(
        data,
        VoxelConfig(steps=240, resolution=64, batch_rays=2048, sh_degree=1, rate=(8.0, 2.0), smooth=2e-4),
    )
    Scene.trained(result, data).save(folder / "digger")
    return folder / "digger"
