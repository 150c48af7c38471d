"""What reading files of splats takes, beside the splats."""

from __future__ import annotations

import gzip
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from cagefield.errors import FieldError
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.splat_files import read_splats, write_splats
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


def test_small_spz_files_of_many_splats_take_little_beside_the_field(tmp_path: Path) -> None:
    """Packed to a fiftieth of what it holds, as splats that are alike are."""
    few = random_splats(40_000, degree=0)
    columns = {name: np.repeat(getattr(few, name), 5, axis=0) for name in NAMES}
    columns["sh"] = np.zeros((200_000, 16, 3), np.float32)
    columns |= {"log_scales": np.full_like(columns["log_scales"], -3.0)}
    splats = SplatField(**columns)
    write_splats(splats, tmp_path / "a.spz")
    held = sum(getattr(splats, name).nbytes for name in NAMES)
    assert 20 * (tmp_path / "a.spz").stat().st_size < held
    read, most = _measured(lambda: read_splats(tmp_path / "a.spz"))
    # Quaternions once more (3 MB), 4 MB of what is unpacked, 4096 splats in the decoder at 600 bytes each.
    assert len(read) == 200_000 and most < held + (12 << 20)


@pytest.mark.parametrize("version", [3, 4])
def test_spz_files_that_end_early_are_refused_with_little_memory(
    tmp_path: Path, version: Literal[3, 4]
) -> None:
    """They took thrice what they hold: all of it was unpacked at once before its end was missed."""
    file = tmp_path / "a.spz"
    write_splats(random_splats(200_000, degree=1), file, spz_version=version)
    whole = file.read_bytes()
    file.write_bytes(gzip.compress(gzip.decompress(whole)[:-1], 1) if version == 3 else whole[:-1])
    assert _taken_by_refusal(file, "no SPZ file") < 8 << 20


@pytest.mark.nightly
def test_splats_none_of_which_is_visible_are_refused_with_little_memory(tmp_path: Path) -> None:
    """All of them were read first. A part of what is unpacked is in memory, and a part that is decoded."""
    splats = random_splats(200_000, degree=1)
    write_splats(replace(splats, opacities=np.zeros(200_000, np.float32)), tmp_path / "a.spz")
    assert _taken_by_refusal(tmp_path / "a.spz", "a.spz: the file holds no splat that is visible") < 12 << 20


def test_splats_that_are_visible_may_be_the_last(tmp_path: Path) -> None:
    splats = random_splats(20_000, degree=0)
    opacities = np.zeros(20_000, np.float32)
    opacities[-1] = 1.0
    write_splats(replace(splats, opacities=opacities), tmp_path / "a.spz")
    read = read_splats(tmp_path / "a.spz")
    assert len(read) == 20_000 and (read.opacities > 0.5).sum() == 1


def _taken_by_refusal(file: Path, why: str) -> int:
    """Bytes that a file takes before it is refused."""

    def refused() -> None:
        with pytest.raises(FieldError, match=why):
            read_splats(file)

    return _measured(refused)[1]


def _measured(work: Callable[[], Any]) -> tuple[Any, int]:
    """(what it returns, bytes that it took at most)."""
    tracemalloc.start()
    try:
        return work(), tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
