"""What several test modules share."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import editor_page
from cagefield import Scene, load_dataset
from cagefield.datasets.procedural import make_scene
from cagefield.training.voxel import train_voxel
from cagefield.training.voxel_config import VoxelConfig


def pytest_addoption(parser: pytest.Parser) -> None:
    """`--page-renderer`: tests of the editor open its page with `?render=page`."""
    parser.addoption(
        "--page-renderer",
        action="store_true",
        help="the editor's page draws with its own GPU in all tests of it",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Tells the pages who draws, and OpenMP's threads to sleep while they wait.

    OpenMP reads this when PyTorch or Numba load it, which is later. Threads that spin take the cores from
    other test processes, whose threads spin too: small networks then train five times slower.
    """
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    if config.getoption("--page-renderer"):
        editor_page.DRAWN_BY = "page"


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
