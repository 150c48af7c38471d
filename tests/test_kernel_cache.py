"""The kernels that are kept on the disk, and going on where they cannot be."""

import json
import os
import subprocess
import sys
import textwrap
import threading
import time
import warnings
from pathlib import Path

import pytest

from cagefield.compute import kernel_cache as kept
from cagefield.files import user_cache

MAP = """
import json
import numpy as np
from cagefield import Cage, Edit
from cagefield.edits import EditStack, Trilinear
from cagefield.edits import device_stack

inner = Cage.box((0, 0, 0), 0.5)
edit = Edit.continuous(inner, inner.grown(0.5), shell=Trilinear()).translate((0.1, 0, 0))
packed = device_stack.DeviceStack.from_stack(EditStack([edit]))
mapped = packed.to_canonical(np.zeros((1, 3)), np.ones((1, 3)))
seen = device_stack.map_samples._primal.src_ll_cache_observations
print(json.dumps([mapped[0].tolist(), seen.cache_stored, seen.cache_loaded]))
"""


DOUBLE = """
import sys
import numpy as np
import quadrants as qd
from cagefield.compute import devices
from cagefield.errors import warnings_in_one_line

I32 = qd.types.ndarray(qd.i32, 1)

@qd.kernel(fastcache=True)
def double(out: I32):
    for n in range(out.shape[0]):
        out[n] *= 2

@qd.kernel(fastcache=True)
def triple(out: I32):
    for n in range(out.shape[0]):
        out[n] *= 3

with warnings_in_one_line():
    devices.start()
    exec(sys.argv[1])
    values = np.array([1, 2], np.int32)
    double(values)
    triple(values)
print(values.tolist(), triple._primal.src_ll_cache_observations.cache_loaded)
"""

FULL_IN_THE_MIDDLE = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))"
LITTLE_ROOM = """
import shutil
from types import SimpleNamespace
shutil.disk_usage = lambda _: SimpleNamespace(free=1 << 20)
"""


def process(cache: Path, *args: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "XDG_CACHE_HOME": str(cache)}
    done = subprocess.run([sys.executable, *args], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done


def run(cache: Path) -> list[object]:
    done = process(cache, "-c", MAP)
    assert "PURE" not in done.stderr, done.stderr
    found: list[object] = json.loads(done.stdout.splitlines()[-1])
    return found


def test_a_second_process_loads_its_kernels_from_the_disk(tmp_path: Path) -> None:
    point, stored, loaded = run(tmp_path)
    assert (stored, loaded) == (True, False)
    again, stored, loaded = run(tmp_path)
    assert (stored, loaded) == (False, True)
    assert again == point


@pytest.mark.nightly
def test_processes_of_tests_write_their_kernels(tmp_path: Path) -> None:
    """Objects that `conftest.py` freezes after the collection would keep Quadrants' runtime alive."""
    conftest = Path(__file__).with_name("conftest.py")
    (tmp_path / "conftest.py").write_text(
        "import importlib.util, sys\n"
        f"sys.path.insert(0, {str(conftest.parent)!r})\n"
        f"spec = importlib.util.spec_from_file_location('suite', {str(conftest)!r})\n"
        "suite = importlib.util.module_from_spec(spec)\n"
        "spec.loader.exec_module(suite)\n"
        "pytest_collection_finish = suite.pytest_collection_finish\n"
        "pytest_sessionfinish = suite.pytest_sessionfinish\n"
    )
    (tmp_path / "test_map.py").write_text(
        f"from cagefield.edits import device_stack\n\ndef test():\n{textwrap.indent(MAP, '    ')}"
    )
    process(tmp_path / "cache", "-m", "pytest", "-q", "-p", "no:cacheprovider", str(tmp_path))
    assert list((tmp_path / "cache").rglob("*.qdc"))


@pytest.mark.nightly
def test_a_folder_that_cannot_be_made_is_done_without(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "double.py").write_text(DOUBLE)
    done = process(tmp_path / "file", str(tmp_path / "double.py"), "")
    assert done.stdout.splitlines()[-1] == "[6, 12] False"
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"cagefield: warning: compiled kernels cannot be kept in {tmp_path / 'file'}")
    assert "(Not a directory)" in line and "set XDG_CACHE_HOME to a folder that can be written" in line


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("trouble", "reason"),
    [
        (FULL_IN_THE_MIDDLE, "File too large"),
        (LITTLE_ROOM, "No space left on device"),
    ],
)
def test_a_disk_that_fails_in_the_middle_is_one_line_of_warning(
    tmp_path: Path, trouble: str, reason: str
) -> None:
    if "resource" in trouble:
        pytest.importorskip("resource", reason="limits of a process are POSIX's")
    (tmp_path / "double.py").write_text(DOUBLE)
    done = process(tmp_path / "cache", str(tmp_path / "double.py"), trouble)
    assert done.stdout.splitlines()[-1] == "[6, 12] False"
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"cagefield: warning: compiled kernels cannot be kept in {tmp_path / 'cache'}")
    assert f"({reason})" in line


@pytest.mark.nightly
@pytest.mark.parametrize(("trouble", "written"), [("", "True"), (LITTLE_ROOM, "False")])
def test_a_process_writes_no_kernels_as_it_ends_without_room(
    tmp_path: Path, trouble: str, written: str
) -> None:
    """On CUDA it would abort there; here it is seen by what Quadrants is told."""
    ends = [
        "import atexit",
        "from quadrants.lang import impl",
        "atexit.register(lambda: print(impl.current_cfg().offline_cache))",  # after what is registered later
        "from cagefield.compute import devices",
        "devices.start()",
        trouble,
    ]
    assert process(tmp_path / "cache", "-c", "\n".join(ends)).stdout.splitlines()[-1] == written


@pytest.mark.nightly
def test_a_full_disk_says_nothing_where_all_kernels_are_kept_already(tmp_path: Path) -> None:
    (tmp_path / "double.py").write_text(DOUBLE)
    assert process(tmp_path / "cache", str(tmp_path / "double.py"), "").stderr == ""
    done = process(tmp_path / "cache", str(tmp_path / "double.py"), LITTLE_ROOM)
    assert done.stdout.splitlines()[-1] == "[6, 12] True"
    assert done.stderr == ""


def test_a_folder_that_may_not_be_written_is_done_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert kept.kernel_cache() is not None
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.warns(UserWarning, match=r"cannot be kept in .* \(Permission denied\).*set XDG_CACHE_HOME"):
        assert kept.kernel_cache() is None


def test_a_lock_is_waited_for_and_then_done_without(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    folder = kept.kernel_cache()
    assert folder is not None
    lock = folder / "kernel_compilation_manager" / "qdcache.lock"
    lock.write_text("")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        threading.Timer(0.1, lock.unlink).start()
        assert kept.kernel_cache() == folder
    lock.write_text("")
    monkeypatch.setattr(kept, "LOCK_WAIT_SECONDS", 0.05)
    with pytest.warns(UserWarning, match=r"another process holds .*qdcache\.lock.*; remove that file"):
        assert kept.kernel_cache() is None


def test_folders_of_other_versions_and_locks_go_when_nobody_uses_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    kernels = tmp_path / "cagefield" / "kernels"
    for name, age in (("old", user_cache.MAX_UNUSED_SECONDS + 60.0), ("recent", 60.0)):
        (kernels / name).mkdir(parents=True)
        os.utime(kernels / name, 2 * (time.time() - age,))
    lock = kept.kernel_cache() / "kernel_compilation_manager" / "qdcache.lock"  # type: ignore[operator]
    folder = lock.parent.parent
    lock.write_text("")
    os.utime(lock, 2 * (time.time() - 2.0 * kept.MAX_LOCK_SECONDS,))
    kept.kernel_cache()
    assert not lock.exists()
    assert sorted(path.name for path in kernels.iterdir()) == sorted([folder.name, "recent"])
