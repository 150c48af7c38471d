"""What is no file, or one of any length, is refused in a line, at once and without memory."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cagefield.errors import CagefieldError, DatasetError, SceneError
from cagefield.files.npz import DEFLATED, read_array, read_arrays
from cagefield.files.safe_open import MAX_TEXT_BYTES, UnreadableError, check_regular, open_regular, read_text
from cagefield.scene.scene import Scene
from cagefield.server.editor.pasted_sources import sources_under
from cagefield.server.editor.persistence import SceneStore
from commands import refused
from scenes import ball_scene
from tiers import nightly_after_first

ROBUSTNESS = Path(__file__).parent / "robustness"

pytestmark = pytest.mark.skipif(os.name != "posix", reason="pipes and devices are POSIX's")


def test_texts_are_read_as_pathlib_reads_them(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    for content in ("", "a\r\nb\rc\n", "é" * 100_000):
        file.write_bytes(content.encode())
        assert read_text(file) == file.read_text(encoding="utf-8")
    assert check_regular(file) == 200_000
    with pytest.raises(UnreadableError, match="200000 bytes, at most 1000 are read"):
        read_text(file, 1000)
    with pytest.raises(FileNotFoundError):
        read_text(tmp_path / "none")
    with pytest.raises(IsADirectoryError):
        open_regular(tmp_path)
    # The system's files say that they hold nothing.
    assert "Name" in read_text("/proc/self/status") or sys.platform != "linux"
    with pytest.raises(UnreadableError, match="at most 10 are read"):
        read_text("/proc/self/status", 10)


def test_a_pipe_that_nobody_writes_to_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.json")
    with pytest.raises(UnreadableError, match="it is a pipe, not a file; write what"):
        read_text(tmp_path / "pipe.json")
    with pytest.raises(UnreadableError, match="it is a device, not a file"):
        read_text("/dev/zero")


@pytest.mark.parametrize(
    "name", ["field.safetensors", "edits.yaml", "cameras.json", "scene.json", "original.safetensors"]
)
def test_what_is_no_file_in_a_scene_is_called_what_it_is(tmp_path: Path, name: str) -> None:
    ball_scene().save(tmp_path / "scene")
    part = tmp_path / "scene" / name
    part.unlink(missing_ok=True)
    os.mkfifo(part)
    with pytest.raises(CagefieldError, match=f"{name}: it is a pipe, not a file"):
        Scene.open(tmp_path / "scene")
    part.unlink()
    part.symlink_to("/dev/zero")
    with pytest.raises(CagefieldError, match=f"{name}: it is a device, not a file"):
        Scene.open(tmp_path / "scene")
    part.unlink()
    part.mkdir()
    with pytest.raises(CagefieldError, match=rf"{name}( |: ).*([Ii]s a|it is a|a folder)"):
        Scene.open(tmp_path / "scene")


def test_a_camera_path_that_is_a_pipe_is_not_passed_over(tmp_path: Path) -> None:
    ball_scene().save(tmp_path / "scene")
    os.mkfifo(tmp_path / "scene" / "camera_path.json")
    store = SceneStore(Scene.open(tmp_path / "scene"), tmp_path / "scene")
    with pytest.raises(CagefieldError, match=r"camera_path.json cannot be read \(it is a pipe"):
        store.document()


def test_what_takes_the_place_of_a_file_meanwhile_is_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    os.mkfifo(tmp_path / "pipe")
    monkeypatch.setattr("cagefield.files.safe_open.check_regular", lambda *_: 0)
    with pytest.raises(UnreadableError, match="a pipe"):
        open_regular(tmp_path / "pipe")


@pytest.mark.nightly
def test_a_file_that_grows_is_read_no_further(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a").write_bytes(bytes(MAX_TEXT_BYTES + 1))
    monkeypatch.setattr("cagefield.files.safe_open.check_regular", lambda *_: 0)
    with pytest.raises(UnreadableError, match="at most"):
        read_text(tmp_path / "a")


def test_arrays_take_no_more_than_their_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = np.arange(34.0).reshape(2, 17)
    np.save(tmp_path / "a.npy", rows)
    assert (read_array(tmp_path / "a.npy") == rows).all()
    whole = (tmp_path / "a.npy").read_bytes()
    (tmp_path / "more.npy").write_bytes(whole.replace(b"(2, 17)", b"(9, 99)"))
    with pytest.raises(ValueError, match="says that it is an array of 7128 bytes"):
        read_array(tmp_path / "more.npy")
    np.save(tmp_path / "objects.npy", np.array([{}]), allow_pickle=True)
    with pytest.raises(ValueError, match="an array of object"):
        read_array(tmp_path / "objects.npy")
    np.savez_compressed(tmp_path / "a.npz", pictures=np.zeros((100, 100), np.uint8))
    with pytest.raises(ValueError, match="it says that it unpacks to"):
        read_arrays(tmp_path / "a.npz")
    assert read_arrays(tmp_path / "a.npz", DEFLATED)["pictures"].shape == (100, 100)
    monkeypatch.setattr("cagefield.files.memory.free_memory", lambda: 1000)
    with pytest.raises(ValueError, match=r"GB of memory, 0\.0 are free; end other programs"):
        read_arrays(tmp_path / "a.npz", DEFLATED)


def test_llff_poses_that_are_no_array_are_refused(tmp_path: Path) -> None:
    from cagefield.datasets.llff import load_llff

    with (tmp_path / "poses_bounds.npy").open("wb") as file:
        file.truncate(20 << 30)
    with pytest.raises(DatasetError, match="cannot be read as a NumPy array"):
        load_llff(tmp_path, None, 8)


@pytest.mark.parametrize(
    ("option", "line"),
    [
        ("--camera-path", "it is a device, not a file"),
        ("--dataparser-transforms", ""),
    ],
)
def test_the_command_line_reads_no_device(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], option: str, line: str
) -> None:
    ball_scene().save(tmp_path / "scene")
    assert line in refused(capsys, "render", tmp_path / "scene", option, "/dev/zero", "-o", tmp_path / "out")


@pytest.mark.parametrize("option", ["--token-file", "--certificate"])
def test_an_editor_reads_no_device(tmp_path: Path, capsys: pytest.CaptureFixture[str], option: str) -> None:
    ball_scene().save(tmp_path / "scene")
    assert "it is a device, not a file" in refused(capsys, "view", tmp_path / "scene", option, "/dev/zero")


def test_links_in_a_circle_are_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene, loop = tmp_path / "scene", tmp_path / "loop"
    ball_scene().save(scene)
    loop.symlink_to(loop)
    assert "does not exist" in refused(capsys, "info", loop)
    assert "does not exist" in refused(capsys, "view", loop, "--no-browser")
    (tmp_path / "e.yaml").write_text("edits: []\n")
    assert str(loop) in refused(capsys, "edit", scene, tmp_path / "e.yaml", "-o", loop)
    (tmp_path / "folder.sog").mkdir()
    assert "a folder without meta.json" in refused(
        capsys, "import", tmp_path / "folder.sog", "-o", tmp_path / "new"
    )


def test_links_in_a_circle_beside_a_scene_stop_no_editor(tmp_path: Path) -> None:
    ball_scene().save(tmp_path / "scene")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    assert sources_under(tmp_path, [tmp_path / "scene", tmp_path / "loop"], splats=True) == []
    store = SceneStore(Scene.open(tmp_path / "scene"), tmp_path / "scene")
    with contextlib.suppress(SceneError):  # Python up to 3.12 cannot say where that is
        assert store.place("loop/scene").is_relative_to(tmp_path)


READERS = {
    "some of each": (
        "edits.yaml",
        "scene folder",
        "transforms.json",
        "COLMAP, binary",
        "ply",
        "spz 4",
        "png",
    ),
    "scenes": ("voxel field", "nerf field", "autosave", "camera path", "keyframes"),
    "data sets": ("COLMAP, text", "LLFF", "points.ply", "jpg", "webp"),
    "splats": ("text ply", "spz 3", "splat", "ksplat", "sog", "sog folder", "glb", "training"),
}


@pytest.mark.skipif(sys.platform != "linux", reason="memory is measured by /proc")
@pytest.mark.parametrize("group", nightly_after_first(READERS))
def test_every_reader_refuses_what_is_no_file(tmp_path: Path, group: str) -> None:
    """Or reads an honest beginning; with 20 GB of holes as with devices and pipes, in little memory."""
    command = [sys.executable, str(ROBUSTNESS / "read_no_files.py"), str(tmp_path), *READERS[group]]
    said = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True).stdout
    found = [json.loads(line) for line in said.splitlines()]
    assert {each["reader"] for each in found} == set(READERS[group])
    for each in found:
        assert each["what"] in ("refused", "read"), each
        assert "\n" not in each["text"] and each["memory"] < 100 << 20, each
        assert each["seconds"] < 15.0, each  # most take milliseconds; other work may go on beside
