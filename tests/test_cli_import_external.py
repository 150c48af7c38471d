"""`cagefield import` of other programs' checkpoints as a user errs: one line with the cure, and no scene."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip("torch", reason="checkpoints are PyTorch's")

import nerfacto_files
import ngp_files
from cagefield import Scene
from commands import printed, refused
from plenoctree_files import plenoctree_arrays, write_plenoctree
from svox2_files import svox2_arrays, write_svox2
from svraster_files import svraster_content, write_svraster
from tensorf_files import tensorf_content, write_tensorf

FILES: dict[str, Callable[[Path], Path]] = {
    "TensoRF": lambda folder: write_tensorf(folder / "a.th", tensorf_content()),
    "nerfacto": nerfacto_files.write_run,
    "SVRaster": lambda folder: write_svraster(folder / "a.pt", svraster_content(outside=0)),
    "svox2": lambda folder: write_svox2(folder / "a.npz", svox2_arrays()),
    "PlenOctree": lambda folder: write_plenoctree(folder / "a.npz", plenoctree_arrays()),
    "Instant-NGP": lambda folder: ngp_files.write(folder / "a.ingp", ngp_files.snapshot()),
}


@pytest.fixture(params=FILES)
def program(request: pytest.FixtureRequest) -> str:
    name: str = request.param
    return name


@pytest.fixture
def file(program: str, tmp_path: Path) -> Path:
    """A checkpoint of each program in turn."""
    return FILES[program](tmp_path)


@pytest.mark.nightly  # one program's command runs in its own tests with every change
def test_the_command_makes_a_scene(
    file: Path, program: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = printed(capsys, "import", file, "-o", tmp_path / "scene", "--resolution", 16, "--compare", 0)
    assert out.startswith(program) and out.endswith(f"scene written to {tmp_path / 'scene'}\n")
    assert Scene.open(tmp_path / "scene").cameras["test"]


def test_wrong_paths(file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    missing = file.with_name("missing" + file.suffix)
    assert f"{missing}: no such" in refused(capsys, "import", missing, "-o", tmp_path / "scene")
    file.with_name("folder").mkdir()
    error = refused(capsys, "import", file.with_name("folder"), "-o", tmp_path / "scene")
    assert "a folder" in error and not (tmp_path / "scene").exists()


def test_truncated_files(file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    content = file.read_bytes()
    for count in (0, 10, len(content) // 3, 9 * len(content) // 10, len(content) - 1):
        file.write_bytes(content[:count])
        error = refused(capsys, "import", file, "-o", tmp_path / "scene")
        assert str(file) in error and "copy it again" in error, count
    assert not (tmp_path / "scene").exists()


def test_configs(file: Path, program: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """nerfacto needs its own; the other programs' files hold their options."""
    other = tmp_path / "other.yml"
    for text in (None, "a: [1, 2\n  - b: {", "a: 1\n", "\0\1\2"):
        if text is not None:
            other.write_text(text)
        error = refused(capsys, "import", file, "-o", tmp_path / "scene", "--config", other)
        assert ("leave out the config" in error) == (program != "nerfacto") and str(other) in error
    assert not (tmp_path / "scene").exists()


def test_options_of_other_files(
    file: Path, program: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["import", file, "-o", tmp_path / "scene"]
    assert "are for splats" in refused(capsys, *words, "--up", "z-up")
    assert "is for splats of a USD file" in refused(capsys, *words, "--time-code", 1)
    assert "--fov-deg is for a nerf-pytorch" in refused(capsys, *words, "--fov-deg", 40)
    assert "does not exist; give the folder" in refused(capsys, *words, "--data", tmp_path / "none")
    if program != "svox2":
        assert "is for a grid of svox2" in refused(capsys, *words, "--data-scale", 0.5)
    assert not (tmp_path / "scene").exists()
