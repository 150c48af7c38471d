"""Programs that are killed where they write: at the n-th call that changes something, or at any moment.

A process is forked for each kill, so that what it imports is imported once. Python tells of every such call
(`sys.addaudithook`) just before it is made; the call after it is the next kill point.
"""

from __future__ import annotations

import contextlib
import os
import random
import shutil
import signal
import struct
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from cagefield import Scene
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.session import Session
from scenes import ball_scene
from splat_scenes import ball_of_splats

_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC
_EVENTS = (
    "os.rename",
    "os.remove",
    "os.mkdir",
    "os.rmdir",
    "os.link",
    "os.symlink",
    "os.truncate",
    "os.chmod",
)
EDITS = """edits:
  - name: moved
    adjustment: discrete
    inner: {center: [0, 0, 0], size: 1}
    operations: [{translate: [1, 0, 0]}]
"""
PATIENCE = 120.0
"""Seconds after which work that does not end is killed."""

Say = Callable[[int], None]


@dataclass(frozen=True)
class Command:
    """What is killed: `work` runs in a folder that `make` has filled; `check` says what is wrong afterwards.

    `work` says numbers of what it has promised; `check` is given the last one. A user then does the same once
    more, after which `check` must pass too, and nothing hidden be left.
    """

    make: Callable[[Path], None]
    work: Callable[[Path, Say], None]
    check: Callable[[Path, int], str | None]


@dataclass
class Killed:
    """What came of some kills."""

    kills: int = 0
    lost: int = 0
    unreadable: int = 0
    left: int = 0
    """Kills after which hidden files were there once the command had been run again."""
    faults: list[str] = field(default_factory=list)


def forked(
    work: Callable[[Say], None], folder: Path, at: int, after: float | None = None
) -> tuple[bool, int, int]:
    """(whether it was killed, calls that it made, the last number it said) of work in a process of its own.

    It is killed at call number `at` that changes something in `folder`, or by its parent `after` seconds.
    """
    reading, writing = os.pipe()
    process = os.fork()
    if process == 0:
        os.close(reading)
        _run(work, folder, at, writing)
    os.close(writing)
    return _waited(process, reading, after)


def started(name: str, folder: Path, at: int, after: float | None = None) -> tuple[bool, int, int]:
    """The same of a command with kernels, whose threads no forked process has: in a new one."""
    reading, writing = os.pipe()
    arguments = [sys.executable, __file__, name, str(folder), str(at), str(writing)]
    paths = os.pathsep.join((*sys.path, str(Path(__file__).resolve().parent.parent)))
    process = subprocess.Popen(arguments, pass_fds=[writing], env=os.environ | {"PYTHONPATH": paths})
    os.close(writing)
    return _waited(process.pid, reading, after)


def _waited(process: int, reading: int, after: float | None) -> tuple[bool, int, int]:
    timer = threading.Timer(PATIENCE if after is None else after, _kill, (process,))
    timer.start()
    said = bytearray()
    while part := os.read(reading, 1 << 16):
        said += part
    os.close(reading)
    _, status = os.waitpid(process, 0)
    timer.cancel()
    timer.join()
    numbers = list(struct.iter_unpack("<bq", said[: len(said) // 9 * 9]))
    if not os.WIFSIGNALED(status) and os.waitstatus_to_exitcode(status) != 0:
        raise RuntimeError(f"the work failed; its error is on stderr ({status})")
    calls = max((value for kind, value in numbers if kind == 0), default=0)
    last = max((value for kind, value in numbers if kind == 1), default=-1)
    return os.WIFSIGNALED(status), calls, last


def _kill(process: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(process, signal.SIGKILL)


def _run(work: Callable[[Say], None], folder: Path, at: int, writing: int) -> None:
    """In the process that is killed: never returns."""
    code = 1
    try:
        calls, root = 0, str(folder.resolve())

        def hook(event: str, arguments: tuple[Any, ...]) -> None:
            nonlocal calls
            if not _changes(event, arguments, root):
                return
            calls += 1
            os.write(writing, struct.pack("<bq", 0, calls))
            if calls == at:
                os.kill(os.getpid(), signal.SIGKILL)

        sys.addaudithook(hook)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            work(lambda number: os.write(writing, struct.pack("<bq", 1, number)) and None)
        code = 0
    except BaseException:
        import traceback

        traceback.print_exc()
    finally:
        os._exit(code)


def _changes(event: str, arguments: tuple[Any, ...], root: str) -> bool:
    """Whether an event of Python's is a call that changes something in a folder."""
    if event == "ctypes.dlsym":
        return "renameat2" in arguments
    if event == "open":
        path, _, flags = arguments
        return (
            isinstance(path, (str, bytes)) and bool(flags & _WRITING) and os.fsdecode(path).startswith(root)
        )
    return event in _EVENTS and any(
        isinstance(path, (str, bytes, os.PathLike)) and os.fsdecode(path).startswith(root)
        for path in arguments
    )


# ---- the commands ----


def _cli(*arguments: object) -> None:
    from cagefield.cli import main

    with open(os.devnull, "w") as nowhere:
        sys.stdout = sys.stderr = nowhere
        code = main([str(argument) for argument in arguments])
    if code != 0:
        raise RuntimeError(f"exit code {code}")


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


def scene_problem(folder: Path, said: int, name: str = "scene") -> str | None:
    """What is wrong with the scene: not readable, the user's file gone, or not what was promised."""
    try:
        scene = Scene.open(folder / name)
    except Exception as error:
        return f"unreadable: {error}"
    if name == "scene" and not (folder / name / "notes.txt").is_file():
        return "lost: the user's file"
    if (
        said >= 1
        and (folder / "x.ply").is_file() is False
        and [edit.name for edit in scene.edits] != ["moved"]
    ):
        return "lost: the edit"
    return None


def new_problem(folder: Path, said: int) -> str | None:
    """The same of a scene that may not be there yet."""
    if said < 1 and not (folder / "new").exists():
        return scene_problem(folder, 0)
    return scene_problem(folder, said, "new") or scene_problem(folder, 0)


def _file_problem(ending: str) -> Callable[[Path, int], str | None]:
    def problem(folder: Path, said: int) -> str | None:
        from cagefield.formats.splat_files import read_splats

        out = folder / f"out{ending}"
        if not out.exists():
            return "lost: the file" if said >= 1 else None
        try:
            if ending != ".html":
                read_splats(out)
            elif not out.read_text().rstrip().endswith("</html>"):
                return "unreadable: the page is cut off"
        except Exception as error:
            return f"unreadable: {error}"
        return None

    return problem


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


def _trained_problem(folder: Path, said: int) -> str | None:
    if said < 1 and not (folder / "new").exists():
        return None
    try:
        Scene.open(folder / "new")
    except Exception as error:
        return f"unreadable: {error}"
    return None


def _render(folder: Path, say: Say) -> None:
    _cli("render", folder / "scene", "-o", folder / "out", "--turntable", "3", "--size", "32", "--overwrite")
    say(1)


def _pictures_problem(folder: Path, said: int) -> str | None:
    from cagefield.rendering.images import read_image

    pictures = sorted((folder / "out").glob("[0-9]*.png"))
    if said >= 1 and len(pictures) != 3:
        return f"lost: {3 - len(pictures)} pictures"
    try:
        for picture in pictures:
            read_image(picture)
    except Exception as error:
        return f"unreadable: {error}"
    return None


COMMANDS: dict[str, Command] = {
    "edit --overwrite": Command(_make, _edit, scene_problem),
    "edit -o": Command(_make, _edit_new, new_problem),
    "import --overwrite": Command(_make_splats, _import, scene_problem),
    "export .ply": Command(_make_splats, _export(".ply"), _file_problem(".ply")),
    "export .spz": Command(_make_splats, _export(".spz"), _file_problem(".spz")),
    "export .html": Command(_make_splats, _export(".html"), _file_problem(".html")),
    "convert": Command(_make_splats, _convert, _file_problem(".spz")),
    "changes and saves": Command(_make, _session, _session_problem),
    "save as": Command(_make, _save_as, new_problem),
}
"""What writes without kernels: a process for each kill takes a tenth of a second."""

SLOW_COMMANDS: dict[str, Command] = {
    "train": Command(_make_photos, _train, _trained_problem),
    "render": Command(_make, _render, _pictures_problem),
}
"""Others: seconds for each kill."""


def kill(
    command: Command, name: str, folder: Path, at: int, found: Killed, after: float | None = None
) -> bool:
    """One kill in an empty folder; False where the command came to its end before. Counts what is wrong."""
    command.make(folder)
    was_killed, _, said = _process(command, name, folder, at, after)
    if not was_killed:
        return False
    where = f"{name}, call {at}" if after is None else f"{name}, after {after:.3f} s"
    found.kills += 1
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        problem = command.check(folder, said)
        if problem is None:
            _process(command, name, folder, 0)
            again = command.check(folder, 1 if command.work is not _session else 2 * SESSION_STEPS)
            problem = None if again is None else f"{again} (after the next start)"
    if problem is not None:
        found.faults.append(f"{where}: {problem}")
        if "unreadable" in problem:
            found.unreadable += 1
        else:
            found.lost += 1
    left = [
        str(file.relative_to(folder))
        for file in folder.rglob(".*")
        if not file.name.endswith("cagefield-lock")
    ]
    if left:
        found.left += 1
        found.faults.append(f"{where}: left {left}")
    return True


@cache
def _warm() -> None:
    """Imports what commands need, once for all forked processes."""
    from cagefield.cli import parse

    parse(["info", "scene"])


def _process(
    command: Command, name: str, folder: Path, at: int, after: float | None = None
) -> tuple[bool, int, int]:
    if name in SLOW_COMMANDS:
        return started(name, folder, at, after)
    return forked(lambda say: command.work(folder, say), folder, at, after)


def calls_of(name: str, folder: Path) -> tuple[int, float]:
    """(calls that the command makes, seconds that it takes) in an empty folder."""
    _warm()
    command = {**COMMANDS, **SLOW_COMMANDS}[name]
    command.make(folder)
    begun = time.monotonic()
    _, calls, _ = _process(command, name, folder, 0)
    return calls, time.monotonic() - begun


def moments(count: int, seconds: float, seed: int) -> list[float]:
    """Random moments while a command runs."""
    chance = random.Random(seed)
    return [chance.uniform(0.0, seconds) for _ in range(count)]


if __name__ == "__main__":
    _name, _folder, _at, _writing = sys.argv[1:]
    _work = {**COMMANDS, **SLOW_COMMANDS}[_name].work
    _run(lambda say: _work(Path(_folder), say), Path(_folder), int(_at), int(_writing))
