"""The runtime and the kernels that it keeps on the disk."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from cagefield import devices

MAP = """
import json
import numpy as np
from cagefield import Cage, Edit
from cagefield.edits import EditStack
from cagefield.warps import device

inner = Cage.box((0, 0, 0), 0.5)
edit = Edit(inner, inner.grown(0.5), shell="trilinear").translate((0.1, 0, 0))
mapped = device.DeviceStack.from_stack(EditStack([edit])).to_canonical(np.zeros((1, 3)), np.ones((1, 3)))
seen = device._map_samples._primal.src_ll_cache_observations
print(json.dumps([mapped[0].tolist(), seen.cache_stored, seen.cache_loaded]))
"""


def run(cache: Path) -> list[object]:
    environment = {**os.environ, "XDG_CACHE_HOME": str(cache)}
    done = subprocess.run(
        [sys.executable, "-c", MAP], env=environment, capture_output=True, text=True, check=True
    )
    assert "PURE" not in done.stderr, done.stderr
    found: list[object] = json.loads(done.stdout.splitlines()[-1])
    return found


def test_a_second_process_loads_its_kernels_from_the_disk(tmp_path: Path) -> None:
    point, stored, loaded = run(tmp_path)
    assert (stored, loaded) == (True, False)
    again, stored, loaded = run(tmp_path)
    assert (stored, loaded) == (False, True)
    assert again == point


def test_a_folder_that_cannot_be_made_is_done_without(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    point, stored, loaded = run(tmp_path / "file")
    assert (stored, loaded) == (False, False) and point == run(tmp_path / "folder")[0]


def test_folders_of_other_versions_and_locks_go_when_nobody_uses_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    kernels = tmp_path / "cagefield" / "kernels"
    for name, age in (("old", devices.KEPT_SECONDS + 60.0), ("recent", 60.0)):
        (kernels / name).mkdir(parents=True)
        os.utime(kernels / name, 2 * (time.time() - age,))
    lock = devices.kernel_cache() / "kernel_compilation_manager" / "qdcache.lock"  # type: ignore[operator]
    lock.parent.mkdir()
    lock.write_text("")
    folder = devices.kernel_cache()
    assert folder is not None and lock.exists()
    os.utime(lock, 2 * (time.time() - 2.0 * devices.LOCKED_SECONDS,))
    devices.kernel_cache()
    assert not lock.exists()
    assert sorted(path.name for path in kernels.iterdir()) == sorted([folder.name, "recent"])
