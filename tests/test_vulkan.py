"""Kernels on Vulkan, in a process of its own: a GPU, or Mesa's software device (lavapipe)."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
START = "from cagefield.compute import devices; print(devices.start('vulkan'))"


def on_vulkan(*command: str) -> subprocess.CompletedProcess[str]:
    """Result of a Python command whose kernels run on Vulkan."""
    environment = {**os.environ, "CAGEFIELD_DEVICE": "vulkan"}
    return subprocess.run(
        [sys.executable, *command], capture_output=True, text=True, env=environment, cwd=TESTS.parent
    )


@pytest.fixture(scope="module")
def vulkan() -> None:
    started = on_vulkan("-c", START)
    if started.returncode != 0:
        reason = (started.stderr.strip().splitlines() or ["no message"])[-1]
        pytest.skip(f"no Vulkan device ({reason}); Debian's mesa-vulkan-drivers has one in software")
    assert started.stdout.strip() == "vulkan"


@pytest.mark.nightly
@pytest.mark.train
@pytest.mark.usefixtures("vulkan")
@pytest.mark.parametrize(
    ("name", "chosen"),
    [
        ("test_splat_training_device.py", "not trains_as_the_cpu_does"),
        ("test_splat_device.py", ""),
        ("test_device_sorting.py", ""),
        ("test_device_image.py", ""),
        ("test_launches.py", ""),
        ("test_renderer.py", "fused or edited_matches or own_camera or distorted"),
    ],
)
def test_kernels_on_vulkan(name: str, chosen: str) -> None:
    """Gradients and pictures against their oracles, steps against the CPU's, sorting, arguments of launches.

    Whole trainings take minutes.
    """
    options = ("-q", "-x", "-k", chosen, "-p", "no:cacheprovider")
    result = on_vulkan("-m", "pytest", str(TESTS / name), *options)
    assert result.returncode == 0, result.stdout[-4000:]
    assert " passed" in result.stdout and "skipped" not in result.stdout
