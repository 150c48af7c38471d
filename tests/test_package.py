"""The package as installed: what it pulls in, what it exports, how quickly it starts."""

from __future__ import annotations

import ast
import importlib
import importlib.metadata
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
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


RUNTIMES = {
    "PIL", "imageio_ffmpeg", "llvmlite", "numba", "pi_heif", "pycolmap", "pydantic", "quadrants", "rich",
    "starlette", "torch", "tyro", "uvicorn", "websockets", "zstandard",
}  # fmt: skip
"""Compute runtimes, servers, command lines and readers of images and poses."""

NEEDS_IMAGES = {"Dataset", "load_dataset", "read_splats", "train_splat", "train_voxel", "write_splats"}
"""Exports that read images, photos or splat files, and import Pillow or zstandard (SPZ)."""

NEEDS_KERNELS = {"SplatRenderer"}
"""Exports that import a compute runtime: Numba for splats."""


def loaded_packages(code: str) -> set[str]:
    """Top-level names in `sys.modules` after the code, in a process of its own."""
    shown = "import sys; print(*sorted({name.partition('.')[0] for name in sys.modules}))"
    return set(in_new_process(f"{code}\n{shown}").stdout.split())


def test_mathematics_imports_no_runtime() -> None:
    names = sorted(set(dir(cagefield)) - NEEDS_IMAGES - NEEDS_KERNELS)
    assert {"Cage", "Camera", "Edit", "EditStack", "Scene", "SplatField", "VoxelField"} <= set(names)
    code = "\n".join(["import cagefield", *(f"cagefield.{name}" for name in names)])
    modules = [
        "cameras.camera_paths", "cameras.keyframes", "edits.edit_files", "fields.analytic",
        "fields.splat_mixture", "geometry.cage", "images.metrics", "warps",
    ]  # fmt: skip
    loaded = loaded_packages("\n".join([code, *(f"import cagefield.{module}" for module in modules)]))
    assert {"numpy", "cagefield"} <= loaded
    assert sorted(loaded & RUNTIMES) == []


def test_names_about_files_import_their_decoders_alone() -> None:
    code = "\n".join(["import cagefield", *(f"cagefield.{name}" for name in sorted(NEEDS_IMAGES))])
    assert loaded_packages(code) & RUNTIMES == {"PIL", "zstandard"}


def test_a_map_of_points_needs_no_runtime() -> None:
    code = """
import numpy as np
from cagefield import Cage, Edit, EditStack
cage = Cage.box((0, 0, 0), 1.0)
edit = Edit.continuous(cage, cage.grown(0.5)).translate((0.1, 0, 0))
moved = EditStack([edit]).to_canonical(np.array([[0.1, 0.0, 0.0]]), np.array([[0.0, 0.0, 1.0]]))
np.testing.assert_allclose(moved.points, [[0.0, 0.0, 0.0]], atol=1e-9)
"""
    assert loaded_packages(code) & RUNTIMES == set()


def test_public_names_are_listed_once() -> None:
    """The stub of a package is its only list: type checkers read it, and `lazy_loader` at run time."""
    package = Path(cagefield.__file__).parent
    stubs = sorted(package.rglob("*.pyi"))
    assert package / "__init__.pyi" in stubs
    for stub in stubs:
        name = ".".join(["cagefield", *stub.relative_to(package).parent.parts])
        module = importlib.import_module(name)
        imports = [node for node in ast.parse(stub.read_text()).body if isinstance(node, ast.ImportFrom)]
        listed = {alias.name: f"{name}.{node.module}" for node in imports for alias in node.names}
        assert sorted(listed) == dir(module) == sorted(module.__all__)
        assert len(listed) == sum(len(node.names) for node in imports), f"{name} lists a name twice"
        for public, home in listed.items():
            try:
                expected = getattr(importlib.import_module(home), public)
            except ModuleNotFoundError as error:
                assert error.name == "torch", home  # the extra nerf is not installed
                continue
            assert getattr(module, public) is expected


def test_wheel_includes_stubs_and_the_type_marker() -> None:
    settings = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    section = settings.partition("[tool.setuptools.package-data]")[2].partition("\n[")[0]
    assert '"py.typed"' in section and '"**/*.pyi"' in section


def test_kernel_modules_print_nothing() -> None:
    done = in_new_process("import cagefield.edits.device_stack, cagefield.rendering.voxels.kernels.march")
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


def _installs(text: str) -> list[set[str]]:
    """The extras of each command in a text that installs the package from its folder."""
    found = re.findall(r"\bpip install (?:-e )?'?\.(?:\[([\w,]+)\])?'?(?=\s|`|$)", text)
    return [set(extras.split(",")) - {""} for extras in found]


def _with_those_within(extras: set[str]) -> set[str]:
    """The extras and those that they hold, as `dev = ["cagefield[test]", ...]` does."""
    held = {name: set[str]() for name in importlib.metadata.metadata("cagefield").get_all("Provides-Extra")}
    for text in importlib.metadata.requires("cagefield") or []:
        requirement = Requirement(text)
        if canonicalize_name(requirement.name) == "cagefield":
            for name in held:
                if requirement.marker is not None and requirement.marker.evaluate({"extra": name}):
                    held[name] |= requirement.extras
    every = set[str]()
    pending = list(extras)
    while pending:
        name = pending.pop()
        assert name in held, f"no extra {name}"
        if name not in every:
            every.add(name)
            pending.extend(held[name])
    return every


def test_checks_run_what_the_readme_and_contributing_say() -> None:
    """Install and test commands of a user, of a contributor and of `.ci/run` agree."""
    readme, contributing, checks = (
        (ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "CONTRIBUTING.md", ".ci/run")
    )
    steps = [line.strip().removeprefix("step ") for line in checks.splitlines()]
    tests = "python -m pytest -n 2 --dist loadfile"
    assert "pip install . && cagefield demo" in readme.splitlines() and "pip install ." in steps
    assert f"pip install '.[test]' && {tests}" in readme.splitlines()
    assert tests in contributing.splitlines() and f"| tests | `{tests}` |" in contributing.splitlines()
    (tested,) = [step for step in steps if "pytest" in step]
    assert tested.partition(" 2>&1 | tee ")[0] == tests
    # Extras that the pages install are installed by the checks, by name or within another extra.
    # PyTorch of the extra nerf comes from its CPU build.
    installed = _with_those_within(set().union(*_installs(checks)))
    for page in (readme, contributing):
        extras = _installs(page)
        assert any("test" in _with_those_within(each) for each in extras)
        assert set().union(*extras) - {"nerf"} <= installed
    assert any("pip install 'torch==" in step for step in steps)
    # The table of CONTRIBUTING: each tool with these options (mkdocs with some more).
    table = re.findall(
        r"^\| [^|]+ \| `([^`]+)`(?:, in `web/`)? \|$", contributing[: contributing.index("| tier |")], re.M
    )
    commands = [command for row in table for command in row.split(" && ")]
    assert len(commands) >= 10
    for command in commands:
        if not command.startswith("pip install"):
            assert any(step == command or step.startswith(f"{command} ") for step in steps), command


def test_workflow_runs_the_checks_of_the_repository() -> None:
    workflow = yaml.safe_load((ROOT / ".github/workflows/checks.yml").read_text(encoding="utf-8"))
    jobs = workflow["jobs"]
    commands = {name: [step["run"] for step in job["steps"] if "run" in step] for name, job in jobs.items()}
    checks = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    for name in ("lint", "page"):
        tools = [
            run for run in commands[name] if run.startswith(("ruff", "mypy", "lint-imports", "mkdocs", "npm"))
        ]
        assert len(tools) >= 5
        for run in tools:
            assert f"step {run}" in checks or f"step env PYTHON=python {run}" in checks, run
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (tests,) = [run for run in commands["tests"] if "pytest" in run]
    assert f"&& {tests}\n" in readme
    quick = next(run for run in commands["pythons"] if "pytest" in run).split()
    files = [word for word in quick if word.startswith("tests/")]
    assert len(files) > 10 and all((ROOT / file).is_file() for file in files)


def test_pythons_of_the_workflow_are_those_of_the_package() -> None:
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    promised = re.findall(r'"Programming Language :: Python :: (3\.\d+)"', project)
    workflow = yaml.safe_load((ROOT / ".github/workflows/checks.yml").read_text(encoding="utf-8"))
    assert workflow["jobs"]["pythons"]["strategy"]["matrix"]["python"] == promised
    assert f'requires-python = ">={promised[0]}"' in project


def test_pre_commit_has_the_formatter_of_the_project() -> None:
    hooks = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))
    (revision,) = [repo["rev"] for repo in hooks["repos"] if "ruff" in repo["repo"]]
    (bounds,) = re.findall(r'"ruff([^"]+)"', (ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert SpecifierSet(bounds).contains(revision.removeprefix("v"))


def test_no_two_modules_import_each_other() -> None:
    grimp = pytest.importorskip("grimp", reason="import-linter is not installed (extra dev)")
    graph = grimp.build_graph("cagefield")
    pairs = {(m, other) for m in graph.modules for other in graph.find_modules_directly_imported_by(m)}
    assert sorted(pair for pair in pairs if pair[::-1] in pairs and pair[0] < pair[1]) == []
