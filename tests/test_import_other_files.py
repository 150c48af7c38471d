"""`cagefield import` of a wrong path, or of a file of another program: one line with the cure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cagefield.errors import FieldError
from cagefield.formats.external.read_external import read_external
from cagefield.formats.splats.open_splats import open_splats
from commands import refused
from ngp_files import snapshot, write


def test_a_folder_of_a_training_names_its_checkpoint(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    newest = tmp_path / "run" / "nerfstudio_models" / "step-000000009.ckpt"
    newest.parent.mkdir(parents=True)
    for path in (newest, newest.with_name("step-000000005.ckpt")):
        path.write_bytes(b"PK\x03\x04")
    error = refused(capsys, "import", tmp_path / "run", "-o", tmp_path / "scene")
    assert f"give a file of splats or a checkpoint, such as {newest}" in error
    error = refused(capsys, "import", newest.parent.parent.parent, "-o", tmp_path / "scene")
    assert error.rstrip().endswith("give a file of splats or a checkpoint")


def test_a_config_is_no_checkpoint(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "config.yml").write_text("pipeline: {}\n")
    error = refused(capsys, "import", tmp_path / "config.yml", "-o", tmp_path / "scene")
    assert "a config; give the checkpoint of its training, step-*.ckpt" in error


@pytest.mark.parametrize("name", ["a.th", "a.npz", "a.pt", "a.ingp"])
def test_checkpoints_in_the_place_of_splats_are_imported_first(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    if name == "a.ingp":
        write(path, {})
    else:
        with path.open("wb") as file:
            np.savez(file, a=np.zeros(3))
    with pytest.raises(FieldError, match=rf"no splats; of a checkpoint `cagefield import .*{name} -o SCENE`"):
        open_splats(path)


@pytest.mark.parametrize("mode", ["Image", "sdf"])
def test_snapshots_of_something_else_than_nerfs(tmp_path: Path, mode: str) -> None:
    content = snapshot()
    content["snapshot"]["mode"] = mode
    with pytest.raises(FieldError, match=f"in mode {mode.lower()}; only NeRFs are read, save a snapshot"):
        read_external(write(tmp_path / "a.ingp", content))


def test_a_config_of_networks_is_no_snapshot(tmp_path: Path) -> None:
    with pytest.raises(FieldError, match="it holds encoding, no snapshot; save one in Instant-NGP"):
        read_external(write(tmp_path / "base.msgpack", {"encoding": {}}))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"pipeline": {"_model.field.mlp_base.weight": 1}}, "nerfstudio, of another model than nerfacto and"),
        ({"weights": 1}, "of no program that is read: it holds weights; these are nerf-pytorch, TensoRF"),
    ],
)
def test_checkpoints_of_other_programs(tmp_path: Path, content: dict[str, object], message: str) -> None:
    torch = pytest.importorskip("torch")
    torch.save(content, tmp_path / "a.pt")
    with pytest.raises(FieldError, match=message):
        read_external(tmp_path / "a.pt")
