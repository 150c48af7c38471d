"""Numba's kernels that are kept on the disk, and going on where they cannot be."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cagefield.compute import kernel_cache
from cagefield.files import user_cache

PACKAGE = Path(kernel_cache.__file__).parents[1]

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


@pytest.mark.nightly
def test_a_second_process_loads_its_kernels_from_the_disk(tmp_path: Path) -> None:
    assert ask(tmp_path) == ("True False 0", [])
    assert ask(tmp_path) == ("True False 1", [])
    # A damaged file costs no more than compiling again.
    (file,) = tmp_path.rglob("*overlaps*.nbc")
    file.write_bytes(b"damaged")
    printed, warned = ask(tmp_path)
    assert printed == "True False 0"
    assert len(warned) == 1 and "compiled kernels cannot be kept in" in warned[0]


@pytest.mark.nightly
def test_a_new_installation_of_the_same_source_loads_its_kernels(tmp_path: Path) -> None:
    """It writes the files of the source anew, with other times."""
    module = tmp_path / "installed.py"
    module.write_text(
        "from cagefield.compute.numba_cache import njit\n\n"
        "@njit(cache=True)\ndef twice(x):\n    return 2.0 * x\n\n"
        "print(twice(1.5), sum(twice.stats.cache_hits.values()))\n"
    )
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache")}
    for hits in (0, 1):
        os.utime(module, (hits, 1e9 + hits))
        done = subprocess.run([sys.executable, str(module)], env=environment, capture_output=True, text=True)
        assert done.stdout.split() == ["3.0", str(hits)], done.stderr


@pytest.mark.nightly
def test_a_folder_that_cannot_be_made_is_done_without(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    printed, warned = ask(tmp_path / "file")
    assert printed == "True False 0"
    (line,) = warned
    assert line.startswith(f"cagefield: warning: compiled kernels cannot be kept in {tmp_path / 'file'}")
    assert "(Not a directory)" in line and "set XDG_CACHE_HOME to a folder that can be written" in line


@pytest.mark.nightly
def test_a_disk_that_fails_in_the_middle_is_one_line_of_warning(tmp_path: Path) -> None:
    pytest.importorskip("resource", reason="limits of a process are POSIX's")
    printed, warned = ask(tmp_path, FULL_IN_THE_MIDDLE)
    assert printed == "True False 0"
    (line,) = warned
    assert "(File too large)" in line


def imported_modules(file: Path) -> set[Path]:
    """Modules of the package whose functions and constants a kernel module imports; `typing` has neither."""
    found: set[Path] = set()
    for node in ast.walk(ast.parse(file.read_bytes())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("cagefield."):
            for name in (str(node.module), *(f"{node.module}.{alias.name}" for alias in node.names)):
                path = PACKAGE.parent.joinpath(*name.split(".")).with_suffix(".py")
                if path.is_file() and path.parent.name not in ("compute", "files") and path.stem != "typing":
                    found.add(path)
    return found


def test_a_change_of_a_module_that_kernels_import_changes_the_digest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Constants, of the harmonics for instance, are compiled into kernels of other modules."""
    kernels = [file for file in PACKAGE.rglob("*.py") if b"numba_cache import" in file.read_bytes()]
    modules = {file for file in kernels if file.parent.name == "kernels"}
    modules = modules.union(*map(imported_modules, modules))
    names = {file.relative_to(PACKAGE).as_posix() for file in modules}
    assert {"fields/sh.py", "rendering/splats/kernels/blending.py", "warps/flow_table.py"} < names
    package = tmp_path / "cagefield"
    shutil.copytree(PACKAGE, package, ignore=lambda folder, names: [n for n in names if n == "static"])
    monkeypatch.setattr(user_cache, "__file__", str(package / "files" / "user_cache.py"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))

    def folder() -> Path | None:
        user_cache.source_digest.cache_clear()
        return kernel_cache.numba_kernel_folder.__wrapped__()

    try:
        before = folder()
        (package / "scene" / "scene.py").write_text("")
        assert before is not None and folder() == before
        for file in modules:
            copy = package / file.relative_to(PACKAGE)
            content = copy.read_bytes()
            copy.write_bytes(content + b"C0 = 1.0\n")
            assert folder() != before, file
            copy.write_bytes(content)
    finally:
        user_cache.source_digest.cache_clear()
