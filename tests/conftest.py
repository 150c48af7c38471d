"""Options, markers and fixtures that several test modules share.

Markers by file: `browser`, `train` and `robust`, for the quick tier of contributors (CONTRIBUTING.md);
`nightly` stands at the tests themselves.
"""

from __future__ import annotations

import gc
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

import pytest

import editor_page
from cagefield import Scene, load_dataset
from cagefield.cli import edit_preparation
from cagefield.procedural import make_scene
from cagefield.training.voxels.train_voxels import train_voxel
from cagefield.training.voxels.voxel_config import VoxelConfig
from chromium import close_chromium
from distribution import long_first, pytest_xdist_make_scheduler  # noqa: F401
from own_cache import cache_of_its_own


def pytest_addoption(parser: pytest.Parser) -> None:
    """`--page-renderer`: tests of the editor open its page with `?render=page`."""
    parser.addoption(
        "--page-renderer",
        action="store_true",
        help="the editor's page draws with its own GPU in all tests of it",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Tells the pages who draws, kernels to run on the CPU unless CAGEFIELD_DEVICE names another device, and
    threads not to spin while they wait. Patches of edits are kept in a cache of this run's own; bytecode
    too, where PYTHONDONTWRITEBYTECODE keeps it out of the source tree: hundreds of processes would compile
    all modules that they import.

    Test processes share the cores: threads that spin take them from the other processes, whose threads spin
    too, and small networks and products of small matrices then take five to twenty times as long. Libraries
    read this when they are loaded: OpenMP with PyTorch and Numba, later; OpenBLAS in the processes that this
    one starts, those of `pytest -n` and the editor's.
    """
    if "PYTEST_XDIST_WORKER" not in os.environ:
        own = Path(tempfile.mkdtemp(prefix="cagefield-tests-"))
        cache_of_its_own(own)
        os.environ["XDG_CACHE_HOME"] = str(own)
        if os.environ.pop("PYTHONDONTWRITEBYTECODE", None):
            os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix = str(own / "bytecode")
            sys.dont_write_bytecode = False
        config.add_cleanup(lambda: shutil.rmtree(own, ignore_errors=True))
    os.environ.setdefault("CAGEFIELD_DEVICE", "cpu")
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    edit_preparation.MAX_SECONDS = 0.0  # tests of commands need no light
    if config.getoption("--page-renderer"):
        editor_page.DRAWN_BY = "page"
    config.add_cleanup(close_chromium)
    config.option.loadscopereorder = False  # the order is that of `long_first`


_MARKERS = {
    "browser": r"test_(editor|page|field_page|exporting_page|exporting_splats)\w*\.py$",
    "train": r"test_(training|cli_train|poses|pose_verification|folds|moving_features|repeated_views|matching"
    r"|splat_fitting|captures|capture_variations|cli_export|resolution|free_space|nerf_scene|examples)\w*\.py$",
    "robust": r"robustness/test_\w+\.py$|test_server_(access|floods|damage|vanishing)\w*\.py$",
}
"""Marker of the tests in files whose path matches."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Adds the markers of `_MARKERS`; in processes of `pytest -n`, orders tests by `long_first`."""
    for item in items:
        for marker, pattern in _MARKERS.items():
            if re.search(pattern, item.path.as_posix()):
                item.add_marker(marker)
    if "PYTEST_XDIST_WORKER" in os.environ:
        items[:] = [items[index] for index in long_first(item.nodeid for item in items)]


def pytest_collection_finish() -> None:
    """Takes modules and tests, over half a million objects, out of Python's later searches for garbage."""
    gc.collect()
    gc.freeze()


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish() -> None:
    """Writes the kernels that this process compiled to the disk, after which none can be launched.

    Quadrants does it when its runtime is freed: never, where an object that was frozen or is kept holds it.
    """
    gc.unfreeze()
    impl = sys.modules.get("quadrants.lang.impl")
    program = None if impl is None else impl.get_runtime()._prog
    if program is not None:
        program.dump_cache_data_to_disk()


@pytest.fixture(scope="session")
def trained_digger(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The scene folder of a digger, trained for seconds on 20 small photos; to be copied."""
    folder = tmp_path_factory.mktemp("digger")
    data = load_dataset(make_scene("digger", folder / "photos", views=20, size=80, test_views=1))
    result = train_voxel(
        data,
        VoxelConfig(
            steps=240, resolution=64, batch_rays=2048, sh_degree=1, lr=(8.0, 2.0), laplacian_reg=2e-4
        ),
    )
    Scene.trained(result, data).save(folder / "digger")
    return folder / "digger"
