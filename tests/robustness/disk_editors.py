"""Editors whose scene lies on a disk that fills up while a page edits."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from disks import PAGE, Filled, contents, disk, levels, resize, used

from editor_server import PageClient, editor_server, page

_POSE = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 3.0, 0.0, 0.0, 0.0, 1.0]
_EDIT = {
    "adjustment": "discrete",
    "inner": {"center": [0, 0, 0], "size": 1},
    "operations": [{"translate": [1e-3, 0, 0]}] * 20,
}


@dataclass(frozen=True)
class EditorAction:
    """What a page asks for; `says` finds in what the page is told how it went: (done?, words) or None."""

    ask: Callable[[PageClient, int], None]
    says: Callable[[dict[str, Any]], tuple[bool, str] | None]
    place: str
    """What the words must name."""


def _save(client: PageClient, number: int) -> None:
    client.send("command", name="save")


def _save_as(client: PageClient, number: int) -> None:
    client.send("save_as", path="copy", overwrite=True)


def _change(client: PageClient, number: int) -> None:
    client.send("change", edit=1, name=f"renamed {number}")


def _video(client: PageClient, number: int) -> None:
    client.send("render", what="camera_path", out="r.mp4", width=640, height=480, overwrite=True)


def _views(client: PageClient, number: int) -> None:
    client.send("render", what="test_views", out="views", width=320, height=240, overwrite=True)


def _notice(message: dict[str, Any]) -> tuple[bool, str] | None:
    if message["type"] != "notice" or message["level"] not in ("error", "info"):
        return None
    return message["level"] == "info", message["text"]


def _trouble(message: dict[str, Any]) -> tuple[bool, str] | None:
    if message["type"] == "notice" and message["level"] == "warning":
        return False, message["text"]
    if message["type"] == "answer":  # asked after the change, which was kept
        return True, ""
    return None


def _job(message: dict[str, Any]) -> tuple[bool, str] | None:
    if message["type"] != "job" or message["state"] == "running":
        return None
    return message["state"] == "done", message["text"]


EDITORS: dict[str, EditorAction] = {
    "view, save": EditorAction(_save, _notice, "scene"),
    "view, save as": EditorAction(_save_as, _notice, "copy"),
    "view, autosave": EditorAction(_change, _trouble, ".scene.cagefield-autosave.json"),
    "view, a video": EditorAction(_video, _job, "r.mp4"),
    "view, pictures": EditorAction(_views, _job, "views"),
}
"""What an editor writes, by its words in the table."""


def fill(name: str, source: Path, found: Filled, count: int) -> int:
    """An editor is asked for the same with more and more room; the bytes that its result takes."""
    action = EDITORS[name]
    with tempfile.TemporaryDirectory() as folder, disk(Path(folder) / "disk") as place:
        shutil.copytree(source / "voxels", place / "scene")
        with editor_server(place / "scene") as server, page(server) as (client, hello):
            client.look_from(hello)
            client.send("load_edits", text=json.dumps({"edits": [_EDIT] * 30}))
            client.state(lambda state: len(state["edits"]) == 30)
            keys = [{"c2w": _POSE, "fov_y_deg": fov, "seconds": 1.0} for fov in (40.0, 44.0)]
            client.send("set_path", keys=keys)
            client.state(lambda state: len(state["keys"]) == 2)
            before = contents(place)
            done, words = _asked(client, action, 0)
            if not done and words:
                raise RuntimeError(f"{name}: {words}")
            need = _written(before, contents(place))
            for number, left in enumerate(levels(need, count), start=1):
                _run(f"{name}, {left} bytes free", action, client, place, (number, left), found)
        return need


def _written(before: dict[str, bytes | None], after: dict[str, bytes | None]) -> int:
    """Bytes that the files take which are not what they were."""
    new = (content for name, content in after.items() if content and before.get(name) != content)
    return sum(-(-len(content) // PAGE) * PAGE for content in new)


def _run(
    where: str,
    action: EditorAction,
    client: PageClient,
    place: Path,
    run: tuple[int, int],
    found: Filled,
) -> None:
    number, left = run
    _change(client, 1000 + number)  # there is something to save, and it is kept
    client.send("ask", request=number, what="path")
    client.until(lambda m: m["type"] == "answer")
    resize(place, used(place) + left)
    before = contents(place)
    done, words = _asked(client, action, number)
    after = contents(place)
    resize(place, 1 << 30)
    found.runs += 1
    if done:
        found.fitted += 1
        return
    if not any(reason in words for reason in ("No space left", "Input/output error")):
        found.code += 1
        found.faults.append(f"{where}: said {words!r}")
    elif str(place / action.place) not in words or "\n" in words or ".part-" in words or ".new-" in words:
        found.line += 1
        found.faults.append(f"{where}: said {words!r}")
    found.compare(where, before, after, [key for key in after if key not in before])


def _asked(client: PageClient, action: EditorAction, number: int) -> tuple[bool, str]:
    """Whether it was done, and the words for it."""
    action.ask(client, number)
    if action.ask is _change:
        client.send("ask", request=-number, what="path")
    told = client.until(lambda message: action.says(message) is not None)
    said = action.says(told)
    assert said is not None
    if action.ask is _change and not said[0]:
        client.until(lambda message: message["type"] == "answer")
    return said
