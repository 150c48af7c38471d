"""Editors on disks that fill up while a page edits: with the scene, or with what pages send and fetch."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import tempfile
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import mock

from disks import BYTES, Filled, contents, disk
from shortages import Names, Shortage

from cagefield.formats.splats.splat_files import write_splats
from editor_server import EditorServer, PageClient, editor_server, page
from own_cache import cache_of_its_own
from splat_scenes import ball_of_splats

_POSE = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 3.0, 0.0, 0.0, 0.0, 1.0]
_EDIT = {
    "adjustment": "discrete",
    "inner": {"center": [0, 0, 0], "size": 1},
    "operations": [{"translate": [1e-3, 0, 0]}] * 20,
}
_REASONS = ("No space left", "Input/output error", "Disk quota exceeded")

Said = tuple[bool, str]
"""Whether it was done, and the words for it."""


@dataclass(frozen=True)
class EditorAction:
    """Request of a page, by its socket or by HTTP, and its outcome."""

    ask: Callable[[EditorServer, PageClient, int], Said]
    place: str
    """Path or word that the message must name."""
    scene: str = "voxels"
    """Of `disk_commands.sources`."""
    comes_again: bool = False
    """It opens another scene, for which the page comes again."""


def _until(client: PageClient, says: Callable[[dict[str, Any]], Said | None]) -> Said:
    said = says(client.until(lambda message: says(message) is not None))
    assert said is not None
    return said


def _save(server: EditorServer, client: PageClient, number: int) -> Said:
    client.send("command", name="save")
    return _until(client, _notice)


def _save_as(server: EditorServer, client: PageClient, number: int) -> Said:
    client.send("save_as", path="copy", overwrite=True)
    return _until(client, _notice)


def _change(server: EditorServer, client: PageClient, number: int) -> Said:
    client.send("change", edit=1, name=f"renamed {number}")
    client.send("ask", request=-number, what="path")
    said = _until(client, _trouble)
    if not said[0]:
        client.until(lambda message: message["type"] == "answer")
    return said


def _video(server: EditorServer, client: PageClient, number: int) -> Said:
    client.send("render", what="camera_path", out="r.mp4", width=640, height=480, overwrite=True)
    return _until(client, _job)


def _views(server: EditorServer, client: PageClient, number: int) -> Said:
    client.send("render", what="test_views", out="views", width=320, height=240, overwrite=True)
    return _until(client, _job)


def _export(server: EditorServer, client: PageClient, number: int) -> Said:
    client.send("export", form="ply")
    said = _until(client, _job)
    if said[0]:
        job = client.messages[-1]
        server.get(f"/exports/{job['job']}/{job['out']}").read()
    return said


def _frames(server: EditorServer, client: PageClient, number: int) -> Said:
    client.send("export", form="ply", along_path=True, fps=1)
    return _until(client, _job)


def _open(server: EditorServer, client: PageClient, number: int) -> Said:
    """Sends a file that no page has sent before."""
    with tempfile.TemporaryDirectory() as folder:
        write_splats(ball_of_splats(3000 + number), Path(folder) / "x.ply")
        content = (Path(folder) / "x.ply").read_bytes()
    origin = {"Origin": f"http://localhost:{server.port}"}
    request = urllib.request.Request(
        f"http://localhost:{server.port}/open?name=sent{number}.ply", content, server.headers | origin
    )
    try:
        with urllib.request.urlopen(request, timeout=120.0) as response:
            response.read()
            return True, ""
    except urllib.error.HTTPError as error:
        words = error.read().decode()
        return False, words if error.code == 400 else f"{error.code}: {words}"


def _notice(message: dict[str, Any]) -> Said | None:
    if message["type"] != "notice" or message["level"] not in ("error", "info"):
        return None
    return message["level"] == "info", message["text"]


def _trouble(message: dict[str, Any]) -> Said | None:
    if message["type"] == "notice" and message["level"] == "warning":
        return False, message["text"]
    if message["type"] == "answer":  # asked after the change, which was kept
        return True, ""
    return None


def _job(message: dict[str, Any]) -> Said | None:
    if message["type"] == "notice" and message["level"] == "error":  # it did not begin
        return False, message["text"]
    if message["type"] != "job" or message["state"] == "running":
        return None
    return message["state"] == "done", message["text"]


EDITORS: dict[str, EditorAction] = {
    "view, save": EditorAction(_save, "scene"),
    "view, save as": EditorAction(_save_as, "copy"),
    "view, autosave": EditorAction(_change, ".scene.cagefield-autosave.json"),
    "view, a video": EditorAction(_video, "r.mp4"),
    "view, pictures": EditorAction(_views, "views"),
    "view, an export": EditorAction(_export, "tmp", scene="splats"),
    "view, an export of frames": EditorAction(_frames, "tmp", scene="splats"),
    "view, a file from a page": EditorAction(_open, "", scene="splats", comes_again=True),
}
"""Files that an editor writes, by their words in the table."""


@contextlib.contextmanager
def _on(place: Path) -> Iterator[None]:
    """Has editors' temporary files and cache on a disk, but for kernels, which stay where they are."""
    cache_of_its_own(place / "cache")
    (place / "tmp").mkdir()
    with mock.patch.dict(os.environ, TMPDIR=str(place / "tmp"), XDG_CACHE_HOME=str(place / "cache")):
        yield


def fill(name: str, source: Path, found: Filled, count: int, short: Shortage = BYTES) -> int:
    """An editor is asked for the same with more and more left; what its result takes of that."""
    action = EDITORS[name]
    with tempfile.TemporaryDirectory() as folder, disk(Path(folder) / "disk") as place:
        shutil.copytree(source / action.scene, place / "scene")
        elsewhere = _on(place) if action.scene == "splats" else contextlib.nullcontext()
        opened = source / "x.ply" if action.comes_again else place / "scene"
        with elsewhere, editor_server(opened) as server, page(server) as (client, hello):
            if not action.comes_again:
                _prepare(client, hello, 30 if action.scene == "voxels" else 1)
            need = _need(action, server, client, place, short)
            for number, left in enumerate(short.levels(need, count), start=1):
                where = f"{name}, {left} {short.words}"
                _run(where, action, (server, client), place, (number, left), found, short)
        return need


def _prepare(client: PageClient, hello: dict[str, Any], edits: int) -> None:
    """Edits, and a camera path."""
    client.look_from(hello)
    client.send("load_edits", text=json.dumps({"edits": [_EDIT] * edits}))
    client.state(lambda state: len(state["edits"]) == edits)
    keys = [{"c2w": _POSE, "fov_y_deg": fov, "seconds": 1.0} for fov in (40.0, 44.0)]
    client.send("set_path", keys=keys)
    client.state(lambda state: len(state["keys"]) == 2)


def _need(
    action: EditorAction, server: EditorServer, client: PageClient, place: Path, short: Shortage
) -> int:
    """Bytes and names of the result, which is made once with room."""
    before = contents(place)
    short.begin(place)
    done, words = action.ask(server, client, 0)
    if not done and words:
        raise RuntimeError(words)
    if short.needs_library:
        need = short.taken(place)
        short.lift(place)
        return need
    after = contents(place)
    if isinstance(short, Names):
        return len(set(after) - set(before)) + 4  # and those that are there on the way
    new = (content for name, content in after.items() if content and before.get(name) != content)
    return sum(-(-len(content) // 4096) * 4096 for content in new)


def _run(
    where: str,
    action: EditorAction,
    editor: tuple[EditorServer, PageClient],
    place: Path,
    run: tuple[int, int],
    found: Filled,
    short: Shortage,
) -> None:
    (server, client), (number, left) = editor, run
    if not action.comes_again:
        client.send("change", edit=1, name=f"named {number}")  # there is something to save, and it is kept
        client.send("ask", request=number, what="path")
        client.until(lambda m: m["type"] == "answer")
    short.limit(place, left)
    before = contents(place)
    done, words = action.ask(server, client, number)
    refused = short.refused()
    short.lift(place)
    after = contents(place)
    found.runs += 1
    if done:
        found.fitted += 1
        if refused:
            found.code += 1
            found.faults.append(f"{where}: done, {refused} calls were refused")
        return
    if not any(reason in words for reason in _REASONS):
        found.code += 1
        found.faults.append(f"{where}: said {words!r}")
    elif str(place / action.place) not in words or "\n" in words or ".part-" in words or ".new-" in words:
        found.line += 1
        found.faults.append(f"{where}: said {words!r}")
    if action.comes_again and server.get("/edits.yaml").status != 200:
        found.code += 1
        found.faults.append(f"{where}: the editor does not go on")
    found.compare(where, before, after, [key for key in after if key not in before])
