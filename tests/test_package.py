"""The package as installed: what it pulls in, what it exports, how quickly it starts."""

from __future__ import annotations

import importlib.metadata
import subprocess
import sys
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import cagefield

ROOT = Path(__file__).parents[1]


def in_new_process(code: str, *options: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *options, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )


def test_import_loads_no_runtime_and_is_quick() -> None:
    code = """
import sys, time
start = time.perf_counter()
import cagefield
print(time.perf_counter() - start)
print(*sorted({name.partition(".")[0] for name in sys.modules}))
"""
    seconds, modules = in_new_process(code).stdout.splitlines()
    heavy = {"torch", "quadrants", "scipy", "numpy", "PIL", "tyro", "rich", "starlette", "fastapi", "uvicorn"}
    assert not heavy & set(modules.split())
    # 1 s is the promise; the lazy package itself takes a few milliseconds, so a busy machine stays below it.
    assert float(seconds) < 1.0


def test_kernel_modules_print_nothing() -> None:
    done = in_new_process(
        "import cagefield.edits.device.device_stack, cagefield.rendering.voxels.kernels.march"
    )
    assert done.stdout == done.stderr == ""


def test_every_export_is_what_it_says() -> None:
    names = [name for name in dir(cagefield) if name != "__version__"]
    assert {"Cage", "Camera", "Edit", "EditStack", "Scene", "VoxelField", "load_dataset"} <= set(names)
    for name in names:
        assert getattr(cagefield, name).__name__ == name
        assert getattr(cagefield, name) is getattr(cagefield, name)


def test_unknown_export_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="No cagefield attribute Nerf"):
        cagefield.Nerf  # noqa: B018


def test_python_api_needs_no_compute_runtime_to_edit() -> None:
    code = """
import sys
from cagefield import Cage, Edit, EditStack
EditStack([Edit.delete(Cage.box((0, 0, 0), 1.0))])
assert "quadrants" not in sys.modules and "torch" not in sys.modules
"""
    in_new_process(code)


def test_base_dependencies_hold_no_torch_and_no_cuda() -> None:
    pending, seen = ["cagefield"], set[str]()
    while pending:
        name = pending.pop()
        if name in seen:
            continue
        seen.add(name)
        for text in importlib.metadata.requires(name) or []:
            requirement = Requirement(text)
            if requirement.marker is None or requirement.marker.evaluate({"extra": ""}):
                pending.append(canonicalize_name(requirement.name))
    assert {"numpy", "quadrants", "tyro"} <= seen
    assert not [name for name in seen if name.startswith(("torch", "nvidia", "cuda", "jax", "tensorflow"))]


def test_version_is_the_installed_one() -> None:
    assert importlib.metadata.version("cagefield") == cagefield.__version__


def test_package_is_typed() -> None:
    assert (Path(cagefield.__file__).parent / "py.typed").is_file()


def test_checks_run_what_the_readme_says() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    checks = (ROOT / ".ci" / "run").read_text(encoding="utf-8").replace("step ", "").splitlines()
    assert "pip install . && cagefield demo" in readme and "pip install ." in checks
    tests = "python -m pytest -n 2 --dist loadfile"
    assert f"pip install '.[test]' && {tests}" in readme
    assert "pip install '.[test]'" in checks and checks[-1] == tests


def test_no_two_modules_import_each_other() -> None:
    grimp = pytest.importorskip("grimp", reason="import-linter is not installed (extra dev)")
    graph = grimp.build_graph("cagefield")
    pairs = {(m, other) for m in graph.modules for other in graph.find_modules_directly_imported_by(m)}
    assert sorted(pair for pair in pairs if pair[::-1] in pairs and pair[0] < pair[1]) == []
