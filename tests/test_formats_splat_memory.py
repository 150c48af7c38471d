"""What reading files of splats takes, beside the splats."""

from __future__ import annotations

import gzip
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import pytest

from cagefield.errors import FieldError
from cagefield.formats.splat_files import read_splats, write_splats
from splat_scenes import random_splats

NAMES = ("means", "log_scales", "quaternions", "opacities", "sh")


@pytest.mark.parametrize("version", [3, 4])
def test_spz_files_are_read_with_little_memory(tmp_path: Path, version: Literal[3, 4]) -> None:
    splats = random_splats(200_000, degree=1)
    write_splats(splats, tmp_path / "a.spz", spz_version=version)
    held = sum(getattr(splats, name).nbytes for name in NAMES)
    read, most = _measured(lambda: read_splats(tmp_path / "a.spz"))
    assert len(read) == 200_000
    # The field, its unpacked file (a quarter of it), quaternions once more, and 32,768 splats in the decoder,
    # at 600 bytes each. A quarter of a million at a time, and a second field, took six times the field.
    assert most < 1.6 * held + 32_768 * 600


@pytest.mark.parametrize("version", [3, 4])
def test_spz_files_that_end_early_are_refused_with_little_memory(
    tmp_path: Path, version: Literal[3, 4]
) -> None:
    """They took thrice what they hold: all of it was unpacked at once before its end was missed."""
    file = tmp_path / "a.spz"
    write_splats(random_splats(200_000, degree=1), file, spz_version=version)
    whole = file.read_bytes()
    file.write_bytes(gzip.compress(gzip.decompress(whole)[:-1], 1) if version == 3 else whole[:-1])

    def refused() -> None:
        with pytest.raises(FieldError, match="no SPZ file"):
            read_splats(file)

    assert _measured(refused)[1] < 8 << 20


def _measured(work: Callable[[], Any]) -> tuple[Any, int]:
    """(what it returns, bytes that it took at most)."""
    tracemalloc.start()
    try:
        return work(), tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
