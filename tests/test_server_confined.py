"""Where pages may write, and who may edit a scene."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

from cagefield.cameras.keyframes import Keyframe
from cagefield.cli import main
from cagefield.errors import CagefieldError, SceneError
from cagefield.files.stale_files import hidden_name
from cagefield.images.image_files import write_video
from cagefield.scene.scene import Scene
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.scene_lock import SceneLock
from cagefield.server.editor.session import Session
from cagefield.server.protocol.client_messages import RenderJob
from cagefield.server.render_queue.background import BackgroundWork
from cagefield.server.render_worker.job_files import MARK
from scenes import ball_scene, files_of


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A small scene folder in a folder of its own."""
    ball_scene().save(tmp_path / "root" / "scene")
    return tmp_path / "root" / "scene"


def opened(scene: Path, root: Path | None = None) -> tuple[SceneStore, Session]:
    store = SceneStore(Scene.open(scene), scene, root=root)
    field = store.scene.field
    return store, Session(store.document(), field.bounds, field.sample_spacing)


def outside(scene: Path) -> list[str]:
    """Places that no page may write to."""
    (scene.parent / "way out").symlink_to(scene.parent.parent)
    (scene.parent.parent / "rooted").mkdir()
    return [
        "../x",
        str(scene.parent.parent / "x"),
        "/etc/x",
        "a/../../x",
        "way out/x",
        "~/x",
        ".",
        "..",
        "x\0y",
        str(scene.parent) + "ed/x",
        "~nobody-of-that-name/x",
    ]


def test_pages_save_within_the_root(scene: Path) -> None:
    store, session = opened(scene)
    places = outside(scene)
    before = files_of(scene.parent.parent)
    for path in places:
        with pytest.raises(SceneError, match=r"lies outside|is no place"):
            store.save_as(session, path, True)
    assert files_of(scene.parent.parent) == before
    store.save_as(session, "deep/new", False)
    assert store.path == scene.parent / "deep" / "new"
    wide, session = opened(scene, scene.parent.parent)
    wide.save_as(session, str(scene.parent.parent / "x"), False)
    assert (scene.parent.parent / "x" / "scene.json").is_file()


def test_pages_render_within_the_root_and_over_their_own_pictures(scene: Path) -> None:
    store, session = opened(scene)
    work = BackgroundWork(session, store, lambda: None, lambda message: None)
    for path in outside(scene):
        with pytest.raises(CagefieldError, match=r"lies outside|is no place"):
            work.render(RenderJob(what="test_views", out=path, overwrite=True))
    photos = scene.parent / "photos"
    photos.mkdir()
    (photos / "0000.png").write_bytes(b"a photo")
    with pytest.raises(CagefieldError, match="holds what no editor rendered, and is left as it is"):
        work.render(RenderJob(what="test_views", out="photos", overwrite=True))
    (photos / MARK).touch()
    work.render(RenderJob(what="test_views", out="photos", overwrite=True))
    c2w = ball_scene().cameras["test"][0].c2w.reshape(-1).tolist()
    session.set_path(tuple(Keyframe(tuple(c2w), 50.0, 1.0) for _ in range(2)), True)
    film = scene.parent / "holiday.mp4"
    film.write_bytes(b"a film")
    with pytest.raises(CagefieldError, match="is a video that cagefield did not make, and stays"):
        work.render(RenderJob(what="camera_path", out="holiday.mp4", overwrite=True))
    write_video(film, [np.zeros((16, 16, 3), np.uint8)] * 2)
    with pytest.raises(CagefieldError, match="exists already"):
        work.render(RenderJob(what="camera_path", out="holiday.mp4"))


_HOLDER = textwrap.dedent("""
    import sys
    from pathlib import Path
    from cagefield.server.editor.scene_lock import SceneLock
    lock = SceneLock(Path(sys.argv[1]))
    print("held", flush=True)
    sys.stdin.read()
""")


def test_a_second_editor_is_told_who_has_the_scene(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    holder = subprocess.Popen(
        [sys.executable, "-c", _HOLDER, str(scene)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert holder.stdout is not None and holder.stdout.readline() == "held\n"
    try:
        assert main(["view", str(scene), "--no-browser", "--port", "0"]) == 2
        line = capsys.readouterr().err
        assert f"is open in another editor (process {holder.pid}); use its page, or end it first" in line
        store, session = opened(scene)
        other = scene.parent / "other"
        SceneLock(other).release()
        store.save_as(session, "other", False)
    finally:
        holder.kill()
        holder.wait()
    assert (scene.parent / ".scene.cagefield-lock").is_file()  # left by the one that was killed
    first, second = SceneLock(scene), SceneLock(scene)  # one process as often as it wants
    first.release()
    first.release()
    with pytest.raises(subprocess.CalledProcessError):
        subprocess.run(
            [sys.executable, "-c", _HOLDER, str(scene)], check=True, input=b"", capture_output=True
        )
    command = [sys.executable, "-c", _HOLDER, str(scene)]
    assert subprocess.run(command, input=b"", capture_output=True).returncode != 0
    second.release()
    assert not (scene.parent / ".scene.cagefield-lock").exists()
    assert subprocess.run(command, input=b"", capture_output=True).returncode == 0


def test_the_lock_goes_with_the_scene(scene: Path) -> None:
    store, session = opened(scene)
    store.lock()
    store.save_as(session, "new", False)
    assert [file.name for file in scene.parent.glob(".*lock")] == [".new.cagefield-lock"]
    with pytest.raises(SceneError, match="exists already"):
        store.save_as(session, "scene", False)
    assert [file.name for file in scene.parent.glob(".*lock")] == [".new.cagefield-lock"]
    store.close()
    assert list(scene.parent.glob(".*lock")) == []


def test_the_next_editor_removes_what_an_ended_one_was_rendering(scene: Path) -> None:
    """A killed editor's video beside the scene; another's, that goes on, and the user's own files stay."""
    ours = hidden_name(scene.with_name("video.mp4"), "part")
    ended = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True)
    pid = f"-{ended.stdout.decode().strip()}-"
    for name in (ours, ours.replace(f"-{os.getpid()}-", pid), ".video.mp4", ".old.part-3.mp4"):
        (scene.parent / name).write_text("half")
    folder = scene.parent / hidden_name(scene.with_name("pictures"), "new").replace(f"-{os.getpid()}-", pid)
    folder.mkdir()
    aside = folder.with_name(folder.name.replace(".new-", ".old-"))
    aside.mkdir()
    store, _ = opened(scene)
    store.lock()
    store.close()
    left = {file.name for file in scene.parent.iterdir()}
    assert left == {"scene", ours, ".video.mp4", ".old.part-3.mp4", aside.name}
