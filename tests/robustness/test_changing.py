"""Files that other programs change while they are read, and scenes that change beneath an open editor."""

from __future__ import annotations

import mmap
import os
import queue
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
from kill_command import EDITS

from cagefield.datasets.colmap import colmap_model
from cagefield.edits import EditStack, load_edits
from cagefield.edits.edit_files import save_edits
from cagefield.errors import CagefieldError, DatasetError, FieldError, SceneError
from cagefield.fields.tensor_file import read_header
from cagefield.formats.splats.splat_files import open_splats, read_source, write_splats
from cagefield.scene.scene import Scene
from cagefield.scene.scene_files import field_states
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.scene_lock import SceneLock
from cagefield.server.editor.session import Session
from cagefield.server.render_worker.process import Worker
from cagefield.server.render_worker.tasks import Answered, Failed, PageFieldTask, Ready, Replaced, Result
from cagefield.server.web import launch
from editor_server import EditorServer, editor_server, page
from scenes import ball_scene
from splat_scenes import ball_of_splats, splat_scene

FIELD = "field.safetensors"

_READ = """
import sys, time
from cagefield.errors import FieldError
from cagefield.scene.scene_files import read_field
end = time.monotonic() + 3
while time.monotonic() < end:
    try:
        read_field(sys.argv[1])
    except FieldError:
        pass
"""


def test_a_field_that_is_cut_off_while_it_is_read_is_a_line(tmp_path: Path) -> None:
    """Mapped into memory, it ended the process: a bus error."""
    splat_scene().save(tmp_path / "scene")
    file = tmp_path / "scene" / FIELD
    with file.open("rb") as stream:
        _, tensors = read_header(stream)
        os.truncate(file, file.stat().st_size - 4)
        last = max(tensors.values(), key=lambda tensor: tensor.begin)
        with pytest.raises(ValueError, match="it has become shorter while it was read"):
            last.read(stream)
    with pytest.raises(FieldError, match=r"not a readable field file \(it has .* bytes, its header says"):
        Scene.open(tmp_path / "scene")


def test_a_field_that_is_copied_over_while_it_is_read(tmp_path: Path) -> None:
    splat_scene().save(tmp_path / "scene")
    file = tmp_path / "scene" / FIELD
    whole, over = file.read_bytes(), threading.Event()

    def copy() -> None:
        while not over.is_set():
            with file.open("wb") as stream:
                for start in range(0, len(whole), 4096):
                    stream.write(whole[start : start + 4096])

    copying = threading.Thread(target=copy)
    copying.start()
    try:
        command = [sys.executable, "-c", _READ, str(file)]
        ended = subprocess.run(command, capture_output=True, text=True, timeout=60)
    finally:
        over.set()
        copying.join()
    assert (ended.returncode, ended.stderr) == (0, "")


@pytest.mark.parametrize("ending", [".ply", ".compressed.ply", ".splat", ".glb"])
def test_splats_that_are_cut_off_while_they_are_read_are_a_line(tmp_path: Path, ending: str) -> None:
    file = tmp_path / f"a{ending}"
    write_splats(ball_of_splats(300), file)
    source = open_splats(file)
    os.truncate(file, file.stat().st_size // 2)
    with pytest.raises(FieldError, match="it has become shorter while it was read"):
        read_source(source)


_CUT_OFF = """
import os, sys
from pathlib import Path
from cagefield.datasets.colmap import colmap_files
from cagefield.errors import DatasetError
file, walk = Path(sys.argv[1]), colmap_files._walk
def cut_off(*args):
    os.truncate(file, 100)
    walk(*args)
colmap_files._walk = cut_off
try:
    colmap_files.check_complete(file.parent)
except DatasetError as error:
    print(error)
"""


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A COLMAP model whose files are longer than what is mapped or read at a time."""
    pycolmap = pytest.importorskip("pycolmap", reason="pycolmap is not installed")
    options = pycolmap.SyntheticDatasetOptions()
    options.num_rigs, options.num_frames_per_rig, options.num_points3D = 1, 5, 200
    folder: Path = tmp_path_factory.mktemp("model")
    pycolmap.synthesize_dataset(options).write_binary(folder)
    return folder


@pytest.mark.parametrize("name", ["images.bin", "points3D.bin"])
def test_a_colmap_model_that_is_cut_off_while_it_is_looked_at_is_a_line(
    model: Path, tmp_path: Path, name: str
) -> None:
    """Mapped into memory, it ended the process."""
    file = tmp_path / name
    shutil.copyfile(model / name, file)
    assert file.stat().st_size > 2 * mmap.PAGESIZE
    ended = subprocess.run([sys.executable, "-c", _CUT_OFF, str(file)], capture_output=True, text=True)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert ended.stdout.startswith(f"{file}: the file is cut off after ")


@pytest.mark.parametrize("meets", ["nothing", "an error"])
def test_a_colmap_model_that_changes_while_it_is_read_is_refused(
    model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, meets: str
) -> None:
    """pycolmap reads zeros from a file that ends before, and says nothing."""
    shutil.copytree(model, tmp_path, dirs_exist_ok=True)
    assert colmap_model.read_model(tmp_path)[1]

    def read(folder: Path) -> Any:
        os.truncate(folder / "cameras.bin", 30)
        if meets == "an error":
            raise IndexError("unordered_map::at")
        return whole

    import pycolmap

    whole = pycolmap.Reconstruction(tmp_path)
    monkeypatch.setattr(pycolmap, "Reconstruction", read)
    with pytest.raises(DatasetError, match=r"cameras\.bin: it has changed while it was read; wait until"):
        colmap_model.read_model(tmp_path)


def _opened(folder: Path) -> tuple[SceneStore, Session]:
    scene = Scene.open(folder)
    store = SceneStore(scene, folder)
    session = Session(store.document(), scene.field.bounds, scene.field.sample_spacing)
    session.load_edits(EDITS, False)
    return store, session


def test_edits_are_not_saved_onto_another_field_unasked(tmp_path: Path) -> None:
    """Its edits are the same, none, so that these alone do not tell."""
    ball_scene().save(tmp_path / "scene")
    store, session = _opened(tmp_path / "scene")
    splat_scene().save(tmp_path / "scene", overwrite=True)
    save_edits(EditStack([]), tmp_path / "scene" / "edits.yaml")
    with pytest.raises(SceneError, match=r"field\.safetensors was replaced by another program"):
        store.save(session)
    assert len(load_edits(tmp_path / "scene" / "edits.yaml")) == 0
    store.save(session)
    assert len(load_edits(tmp_path / "scene" / "edits.yaml")) == 1
    store.save(session)  # known from then on
    (tmp_path / "scene" / FIELD).unlink()
    with pytest.raises(SceneError, match="was replaced by another program"):
        store.save(session)


def test_an_editor_reads_what_the_one_before_it_saved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It has the scene to itself before it reads it, or what the other one saves meanwhile would be lost."""
    ball_scene().save(tmp_path / "scene")
    file = tmp_path / ".scene.cagefield-lock"
    held: list[bool] = []

    def opens(path: Path, **_: object) -> Scene:
        held.append(file.exists())
        raise SceneError("enough")

    monkeypatch.setattr(launch.Scene, "open", opens)
    with pytest.raises(SceneError, match="enough"):
        launch.open_cached(tmp_path / "scene", None)
    assert held == [True] and not file.exists()
    lock = SceneLock(tmp_path / "scene")
    lock.release()


@pytest.mark.parametrize("what", ["camera_path.json", "edits.yaml"])
def test_an_editor_that_does_not_start_leaves_no_lock(tmp_path: Path, what: str) -> None:
    ball_scene().save(tmp_path / "scene")
    (tmp_path / "scene" / what).unlink(missing_ok=True)
    os.mkfifo(tmp_path / "scene" / what)
    with pytest.raises(CagefieldError, match=what):
        launch.open_cached(tmp_path / "scene", None)
    assert [file.name for file in tmp_path.iterdir()] == ["scene"]


PATIENCE = 120.0


def _field_of(worker: Worker, results: queue.Queue[Result]) -> object:
    """What a rendering process has read, as pages get it."""
    worker.send(PageFieldTask(-1))
    answer = results.get(timeout=PATIENCE)
    assert isinstance(answer, Answered), answer
    return answer.value


@pytest.mark.nightly
@pytest.mark.parametrize("becomes", ["another", "none", "the same"])
def test_a_renderer_that_starts_again_shows_the_scene_that_was_opened(tmp_path: Path, becomes: str) -> None:
    """It read what was there then: another scene beneath the edits, and nobody was told."""
    folder = tmp_path / "scene"
    splat_scene().save(folder)
    store, results = SceneStore(Scene.open(folder), folder), queue.Queue[Result]()
    worker = Worker(str(folder), "cpu", results.put, lambda: None)
    worker.files, worker.write_opened = store.files, store.write_opened
    worker.background = store.scene.background
    worker.start()
    try:
        assert results.get(timeout=PATIENCE) == Ready()
        before = _field_of(worker, results)
        worker.close()
        if becomes == "another":
            ball_scene().save(folder, overwrite=True)
        elif becomes == "none":
            (folder / FIELD).unlink()
        else:
            save_edits(EditStack([]), folder / "edits.yaml")  # as saving does
            manifest = folder / "scene.json"
            manifest.write_text(manifest.read_text().replace('"background"', '"before"'))
            assert Scene.open(folder).background != store.scene.background
        worker.start()
        said = [Ready()] if becomes == "the same" else [Replaced(), Ready()]
        assert [results.get(timeout=PATIENCE) for _ in said] == said
        assert _field_of(worker, results) == before
    finally:
        worker.close()


@pytest.mark.nightly
def test_a_renderer_is_not_given_half_a_scene(tmp_path: Path) -> None:
    """There is no room for the copy: that is said, and no other scene shown."""
    folder = tmp_path / "scene"
    splat_scene().save(folder)
    results: queue.Queue[Result | None] = queue.Queue()

    def no_room(_: Path) -> None:
        raise OSError(28, "No space left on device")

    worker = Worker(str(folder), "cpu", results.put, lambda: results.put(None))
    worker.files, worker.write_opened = field_states(folder), no_room
    ball_scene().save(folder, overwrite=True)
    worker.start()
    try:
        assert results.get(timeout=PATIENCE) == Replaced()
        failed = results.get(timeout=PATIENCE)
        assert isinstance(failed, Failed)
        assert failed.text.startswith("the scene that was opened cannot be kept for pictures: ")
        assert failed.text.endswith("No space left on device")
        assert results.get(timeout=PATIENCE) is None
    finally:
        worker.close()


def _renderer(server: EditorServer) -> int:
    lines = {pid: Path(f"/proc/{pid}/cmdline").read_bytes() for pid in server.children()}
    (renderer,) = (pid for pid, line in lines.items() if b"spawn_main" in line)
    return renderer


@pytest.mark.nightly
def test_pages_are_told_that_their_scene_was_replaced(tmp_path: Path) -> None:
    folder = tmp_path / "scene"
    splat_scene().save(folder)
    said = f"{folder} was replaced by another program"
    with editor_server(folder) as server, page(server) as (client, hello):
        client.look_from(hello)
        client.until(lambda message: message["type"] == "picture")  # the renderer has the scene
        ball_scene().save(folder, overwrite=True)
        os.kill(_renderer(server), signal.SIGKILL)
        notice = client.until(lambda message: said in message.get("text", ""))
        assert notice["level"] == "warning" and "stay those of the scene that was opened" in notice["text"]
        with page(server) as (late, _):
            late.until(lambda message: said in message.get("text", ""))
        client.send("save_as", path="kept", overwrite=False)
        client.until(lambda message: "saved to" in message.get("text", ""))
        with page(server) as (last, again):
            last.look_from(again)
            last.until(lambda message: message["type"] == "picture")
            assert not [message for message in last.messages if said in message.get("text", "")]
    kept = Scene.open(tmp_path / "kept").field
    assert type(kept) is type(splat_scene().field)
