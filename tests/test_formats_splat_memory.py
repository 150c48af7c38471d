"""What reading files of splats takes, beside the splats."""

from __future__ import annotations

import tracemalloc
from pathlib import Path
from typing import Literal

import pytest

from cagefield.formats.splat_files import read_splats, write_splats
from splat_scenes import random_splats

NAMES = ("means", "log_scales", "quaternions", "opacities", "sh")


@pytest.mark.parametrize("version", [3, 4])
def test_spz_files_are_read_with_little_memory(tmp_path: Path, version: Literal[3, 4]) -> None:
    splats = random_splats(200_000, degree=1)
    write_splats(splats, tmp_path / "a.spz", spz_version=version)
    held = sum(getattr(splats, name).nbytes for name in NAMES)
    tracemalloc.start()
    try:
        read = read_splats(tmp_path / "a.spz")
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert len(read) == 200_000
    # The field, its unpacked file (a quarter of it), quaternions once more, and 32,768 splats in the decoder,
    # at 600 bytes each. A quarter of a million at a time, and a second field, took six times the field.
    assert most < 1.6 * held + 32_768 * 600
