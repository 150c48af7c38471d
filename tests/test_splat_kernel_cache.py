"""Numba's kernels that are kept on the disk, and going on where they cannot be."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cagefield.compute import numba_cache

# `overlaps` is the kernel that compiles fastest.
ASK = """
import sys
from cagefield.errors import warnings_in_one_line

with warnings_in_one_line():
    exec(sys.argv[1])
    import numpy as np
    from cagefield.rendering.splats.kernels.tile_binning import overlaps

    packed = np.zeros(16, np.float32)
    packed[:6] = 8.0, 8.0, 1.0, 0.0, 1.0, 1.0
    print(overlaps(packed, 0, 0), overlaps(packed, 4, 0), sum(overlaps.stats.cache_hits.values()))
"""
FULL_IN_THE_MIDDLE = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))"


def ask(cache: Path, trouble: str = "") -> tuple[str, list[str]]:
    """What a process of its own prints, and its warnings."""
    done = subprocess.run(
        [sys.executable, "-c", ASK, trouble],
        env={**os.environ, "XDG_CACHE_HOME": str(cache)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip(), done.stderr.splitlines()


def test_a_second_process_loads_its_kernels_from_the_disk(tmp_path: Path) -> None:
    assert ask(tmp_path) == ("True False 0", [])
    assert ask(tmp_path) == ("True False 1", [])
    # A damaged file costs no more than compiling again.
    (file,) = tmp_path.rglob("*overlaps*.nbc")
    file.write_bytes(b"damaged")
    printed, warned = ask(tmp_path)
    assert printed == "True False 0"
    assert len(warned) == 1 and "compiled kernels cannot be kept in" in warned[0]


def test_a_folder_that_cannot_be_made_is_done_without(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    printed, warned = ask(tmp_path / "file")
    assert printed == "True False 0"
    (line,) = warned
    assert line.startswith(f"cagefield: warning: compiled kernels cannot be kept in {tmp_path / 'file'}")
    assert "(Not a directory)" in line and "set XDG_CACHE_HOME to a folder that can be written" in line


def test_a_disk_that_fails_in_the_middle_is_one_line_of_warning(tmp_path: Path) -> None:
    pytest.importorskip("resource", reason="limits of a process are POSIX's")
    printed, warned = ask(tmp_path, FULL_IN_THE_MIDDLE)
    assert printed == "True False 0"
    (line,) = warned
    assert "(File too large)" in line


def test_a_change_of_what_a_module_imports_is_another_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "cagefield"
    source = Path(numba_cache.__file__).parents[1]
    names = ["rendering/splats/kernels/blending.py", "rendering/splats/kernels/projection.py", "fields/sh.py"]
    for name in names:
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source / name, package / name)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(numba_cache, "_PACKAGE", package)
    folder_of = numba_cache._folder_of.__wrapped__
    blending, projection = (str(package / name) for name in names[:2])
    before = [folder_of(blending), folder_of(projection)]
    assert folder_of(blending) == before[0] and before[0] != before[1]
    # The harmonics' constants are compiled into both, by way of the projection.
    with (package / "fields" / "sh.py").open("a") as file:
        file.write("C0 = 1.0\n")
    assert folder_of(blending) != before[0] and folder_of(projection) != before[1]
    between = folder_of(projection)
    with Path(blending).open("a") as file:
        file.write("MORE = 1.0\n")
    assert folder_of(projection) == between
