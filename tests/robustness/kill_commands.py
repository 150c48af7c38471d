"""The commands that are killed, what they do, and what is wrong afterwards."""

from __future__ import annotations

import contextlib
import io
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from kill_checks import (
    file_problem,
    mesh_problem,
    new_problem,
    photos_problem,
    pictures_problem,
    poses_problem,
    scene_problem,
    trained_problem,
    video_problem,
)
from kill_points import Say

from cagefield import Scene
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.session import Session
from posed_photos import photos_alone
from scenes import ball_scene
from splat_scenes import ball_of_splats

EDITS = """edits:
  - name: moved
    adjustment: discrete
    inner: {center: [0, 0, 0], size: 1}
    operations: [{translate: [1, 0, 0]}]
"""


@dataclass(frozen=True)
class Command:
    """What is killed: `work` runs in a folder that `make` has filled; `check` says what is wrong afterwards.

    `work` says numbers of what it has promised; `check` is given the last one. A user then does the same once
    more, after which `check` must pass too, and nothing hidden be left.
    """

    make: Callable[[Path], None]
    work: Callable[[Path, Say], None]
    check: Callable[[Path, int], str | None]


def _cli(*arguments: object) -> None:
    from cagefield.cli import main

    said = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
        code = main([str(argument) for argument in arguments])
    if code != 0:
        raise RuntimeError(f"exit code {code}: {said.getvalue().splitlines()[-1:]}")


def _make(folder: Path) -> None:
    ball_scene().save(folder / "scene")
    (folder / "scene" / "notes.txt").write_text("mine")
    (folder / "e.yaml").write_text(EDITS)


def _make_splats(folder: Path) -> None:
    from cagefield.formats.splat_files import write_splats

    _make(folder)
    shutil.rmtree(folder / "scene")
    Scene(ball_of_splats(50), cameras=ball_scene().cameras).save(folder / "scene")
    (folder / "scene" / "notes.txt").write_text("mine")
    write_splats(ball_of_splats(50), folder / "x.ply")


def _edit(folder: Path, say: Say) -> None:
    _cli("edit", folder / "scene", folder / "e.yaml", "--overwrite")
    say(1)


def _edit_new(folder: Path, say: Say) -> None:
    _cli("edit", folder / "scene", folder / "e.yaml", "-o", folder / "new", "--overwrite")
    say(1)


def _import(folder: Path, say: Say) -> None:
    _cli("import", folder / "x.ply", "-o", folder / "scene", "--overwrite")
    say(1)


def _export(ending: str) -> Callable[[Path, Say], None]:
    def work(folder: Path, say: Say) -> None:
        out = folder / f"out{ending}"
        _cli("export", folder / "scene", "-o", out, *(["--overwrite"] if out.exists() else []))
        say(1)

    return work


def _convert(folder: Path, say: Say) -> None:
    _cli(
        "convert",
        folder / "x.ply",
        folder / "out.spz",
        *(["--overwrite"] if (folder / "out.spz").exists() else []),
    )
    say(1)


SESSION_STEPS = 9


def _session(folder: Path, say: Say) -> None:
    """An editor: names an edit n, keeps it, and says 2 n; at every third saves it and says 2 n + 1."""
    scene = Scene.open(folder / "scene")
    store = SceneStore(scene, folder / "scene")
    store.lock()
    session = Session(store.recovered() or store.document(), scene.field.bounds, scene.field.sample_spacing)
    if not session.document.entries:
        session.load_edits(EDITS, False)
    for number in range(1, SESSION_STEPS + 1):
        session.change(session.document.entries[0].id, name=f"n{number}")
        store.autosave(session)
        say(2 * number)
        if number % 3 == 0:
            store.save(session)
            say(2 * number + 1)
    store.close()


def _session_problem(folder: Path, said: int) -> str | None:
    problem = scene_problem(folder, 0)
    if problem is not None or said < 2:
        return problem
    scene = Scene.open(folder / "scene")
    store = SceneStore(scene, folder / "scene")
    document = store.recovered() or store.document()
    names = [entry.edit.name for entry in document.entries]
    if not names or not names[0].startswith("n") or int(names[0][1:]) < said // 2:
        return f"lost: change {said // 2} was kept, {names} is there"
    return None


def _save_as(folder: Path, say: Say) -> None:
    scene = Scene.open(folder / "scene")
    store = SceneStore(scene, folder / "scene")
    store.lock()
    session = Session(store.document(), scene.field.bounds, scene.field.sample_spacing)
    session.load_edits(EDITS, False)
    store.save_as(session, "new", True)
    say(1)
    store.close()


def _train(folder: Path, say: Say) -> None:
    _cli(
        "train", folder / "photos", "-o", folder / "new", "--steps", "4", "--resolution", "16", "--overwrite"
    )
    say(1)


def _make_photos(folder: Path) -> None:
    from cagefield.datasets.procedural import make_scene

    _make(folder)
    make_scene("chair", folder / "photos", views=4, size=16, test_views=1)


def _render(folder: Path, say: Say) -> None:
    _cli("render", folder / "scene", "-o", folder / "out", "--turntable", "3", "--size", "32", "--overwrite")
    say(1)


def _render_video(folder: Path, say: Say) -> None:
    arguments = ("--turntable", "6", "--size", "96", "--overwrite")
    _cli("render", folder / "scene", "-o", folder / "out.mp4", *arguments)
    say(1)


def _bake(folder: Path, say: Say) -> None:
    arguments = ("--resolution", "16", "--compare", "0", "--overwrite")
    _cli("bake", folder / "scene", "-o", folder / "new", *arguments)
    say(1)


def _mesh(folder: Path, say: Say) -> None:
    _cli("export", folder / "scene", "-o", folder / "mesh.glb", "--as", "mesh", "--overwrite")
    say(1)


def _make_scene(folder: Path, say: Say) -> None:
    arguments = ("--views", "2", "--test-views", "1", "--size", "16", "--overwrite")
    _cli("make-scene", "chair", "-o", folder / "out", *arguments)
    say(1)


@cache
def _posed() -> tempfile.TemporaryDirectory[str]:
    """Photos without poses, and the data set that was made of them; made once, by another process."""
    folder = tempfile.TemporaryDirectory(prefix="cagefield-posed-")
    photos = photos_alone(Path(folder.name) / "photos")
    command = [sys.executable, "-m", "cagefield", "poses", str(photos), "-o", f"{folder.name}/data"]
    subprocess.run(command, check=True, capture_output=True)
    return folder


def _make_posed(folder: Path) -> None:
    shutil.copytree(_posed().name, folder, dirs_exist_ok=True)
    (folder / "data" / "notes.txt").write_text("mine")


def _poses(folder: Path, say: Say) -> None:
    from cagefield.datasets import matching

    matching._FEW = 3  # six pairs are matched in two processes, as those of many photos are
    _cli("poses", folder / "photos", "-o", folder / "data", "--overwrite")
    say(1)


COMMANDS: dict[str, Command] = {
    "edit --overwrite": Command(_make, _edit, scene_problem),
    "edit -o": Command(_make, _edit_new, new_problem),
    "import --overwrite": Command(_make_splats, _import, scene_problem),
    "export .ply": Command(_make_splats, _export(".ply"), file_problem(".ply")),
    "export .spz": Command(_make_splats, _export(".spz"), file_problem(".spz")),
    "export .html": Command(_make_splats, _export(".html"), file_problem(".html")),
    "convert": Command(_make_splats, _convert, file_problem(".spz")),
    "changes and saves": Command(_make, _session, _session_problem),
    "save as": Command(_make, _save_as, new_problem),
}
"""What writes without kernels: a process for each kill takes a tenth of a second."""

SLOW_COMMANDS: dict[str, Command] = {
    "train": Command(_make_photos, _train, trained_problem),
    "render, pictures": Command(_make, _render, pictures_problem),
    "render .mp4": Command(_make, _render_video, video_problem),
    "bake": Command(_make_splats, _bake, trained_problem),
    "export --as mesh": Command(_make, _mesh, mesh_problem),
    "make-scene": Command(_make, _make_scene, photos_problem),
    "poses": Command(_make_posed, _poses, poses_problem),
}
"""Others: seconds for each kill."""
