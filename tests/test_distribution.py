"""The distribution of test files over processes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from distribution import FAMILIES, LONG, long_first, unit_of

TESTS = Path(__file__).parent


def test_named_files_exist_and_stand_in_one_place() -> None:
    files = [path.stem for path in TESTS.rglob("test_*.py")]
    named = [name for names in FAMILIES.values() for name in names] + list(LONG)
    assert len(set(named)) == len(named)
    assert [name for name in named if files.count(name) != 1] == []


def test_long_files_come_first_and_the_order_within_files_stays() -> None:
    ids = [
        "tests/test_a.py::one",
        "tests/test_b.py::two",
        "tests/test_b.py::one",
        "tests/robustness/test_files.py::one[a::b]",
        "tests/test_pasting.py::one",
        "tests/test_renderer.py::one",
    ]
    assert [ids[index] for index in long_first(ids)] == [ids[5], ids[4], ids[3], ids[1], ids[2], ids[0]]
    assert unit_of(ids[4]) == unit_of(ids[5]) != unit_of(ids[3]) == "tests/robustness/test_files.py"


def test_processes_of_tests_keep_bytecode() -> None:
    """Also where PYTHONDONTWRITEBYTECODE is set for the whole run."""
    command = [sys.executable, "-c", "import sys; print(sys.dont_write_bytecode)"]
    assert subprocess.run(command, capture_output=True, text=True).stdout.split() == ["False"]


@pytest.mark.nightly
def test_files_of_a_family_run_in_one_process(tmp_path: Path) -> None:
    """As many tests as let both processes take files, each of which notes its process."""
    pytest.importorskip("xdist", reason="pytest-xdist is not installed")
    (tmp_path / "conftest.py").write_text(
        f"import sys; sys.path.insert(0, {str(TESTS)!r})\n"
        "from distribution import pytest_xdist_make_scheduler\n"
    )
    for name in (*FAMILIES["splats on the device"], *(f"test_other_{n}" for n in range(4))):
        (tmp_path / f"{name}.py").write_text(
            "import os, pathlib, time, pytest\n"
            "@pytest.mark.parametrize('n', range(6))\n"
            "def test(n):\n"
            "    time.sleep(0.02)\n"
            f"    with pathlib.Path({str(tmp_path)!r}, '{name}.txt').open('a') as file:\n"
            "        file.write(os.environ['PYTEST_XDIST_WORKER'] + '\\n')\n"
        )
    command = [sys.executable, "-m", "pytest", "-n", "2", "--dist", "loadfile", "-p", "no:cacheprovider"]
    done = subprocess.run([*command, str(tmp_path)], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    workers = {file.stem: file.read_text().split() for file in tmp_path.glob("*.txt")}
    assert all(len(each) == 6 and len(set(each)) == 1 for each in workers.values())
    family = {workers[name][0] for name in FAMILIES["splats on the device"]}
    assert len(family) == 1 and {each[0] for each in workers.values()} > family
