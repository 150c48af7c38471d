"""Messages of pages: honest seeds, and an editor that follows them."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path
from typing import Any

from reader_seeds import Reader, example_edits
from scene_readers import make_scene_folder, opened_scene

from cagefield.edits import dump_edits
from cagefield.errors import CagefieldError
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.session import Session
from scenes import ball_scene

_MESSAGES = 51


def _make_messages(folder: Path) -> None:
    make_scene_folder(folder)
    start = ball_scene().cameras["test"][0]
    camera = {"seq": 1, "c2w": start.c2w.reshape(-1).tolist(), "width": 64, "height": 48, "fov_y_deg": 40.0}
    corners = example_edits()[0].inner.corners.tolist()
    key = {"c2w": camera["c2w"], "fov_y_deg": 40.0, "seconds": 1.0, "parts": {"1": 0.5}}
    move = {"kind": "translate", "by": [0.1, 0.0, 0.0]}
    messages: list[dict[str, Any]] = [
        {"type": "camera", **camera},
        {"type": "display", "view": "depth", "split": 0.5},
        {"type": "presented", "picture": 1},
        {"type": "drawing", "here": "all"},
        {"type": "drag_begin", "drag": 1, "edit": 1, "target": "field"},
        {"type": "drag", "drag": 1, "seq": 1, "operation": move},
        {"type": "drag_end", "drag": 1, "seq": 2, "operation": move},
        {"type": "apply", "edit": 1, "target": "field", "operation": move},
        {"type": "set_cage", "edit": 1, "cage": "inner", "corners": corners},
        {"type": "place", "x": 0.5, "y": 0.5},
        {"type": "outer_margin", "edit": 1, "margin": 0.5},
        {
            "type": "change",
            "edit": 1,
            "name": "x",
            "enabled": True,
            "lattice": 16,
            "shell": "flow",
            "width": 0.5,
        },
        {"type": "scene_change", "preserve_opacity": False},
        {"type": "select_region", "shape": "lasso", "points": [[0.1, 0.1], [0.9, 0.2], [0.5, 0.9]]},
        {"type": "select_region", "shape": "brush", "points": [[0.5, 0.5]], "radius": 0.1, "through": True},
        {"type": "select_range", "attribute": "opacity", "low": 0.0, "high": 0.5, "mode": "add"},
        {"type": "select_flood", "x": 0.5, "y": 0.5, "threshold": 0.3, "reach": 0.5},
        {"type": "select_floaters", "strength": 0.5, "mode": "subtract"},
        *({"type": "change_selection", "change": c} for c in ("all", "none", "invert", "grow", "shrink")),
        {"type": "selection_cage", "margin": 2.0},
        {"type": "isolate", "on": True},
        {"type": "ask", "request": 3, "what": "histogram", "attribute": "hue"},
        *({"type": "command", "name": n, "edit": 1} for n in ("undo", "redo", "duplicate", "select", "save")),
        {"type": "command", "name": "remove_last_operation", "edit": 1},
        {"type": "mirror", "edit": 1, "axis": "x"},
        {"type": "reorder", "edit": 1, "to": 1},
        {"type": "go_to", "entry": 0},
        {"type": "save_as", "path": "other"},
        {"type": "load_edits", "text": dump_edits(example_edits(), format="json"), "append": False},
        {"type": "load_edits", "text": dump_edits(example_edits()), "append": True},
        {"type": "ask", "request": 1, "what": "edit_text", "edit": 1},
        {"type": "ask", "request": 2, "what": "path"},
        {"type": "set_path", "keys": [key, key], "loop": True},
        {"type": "play_begin", "play": 1},
        {"type": "play", "play": 1, "seconds": 0.5},
        {"type": "play_end", "play": 1},
        {"type": "render", "what": "camera_path", "out": "a.mp4", "width": 64, "height": 64, "fps": 4.0},
        {"type": "cancel_job", "job": 1},
        {
            "type": "put_hotspot",
            "title": "<b>a</b>",
            "text": "one\ntwo",
            "position": [0.0, 0.0, 0.5],
            "camera": {"c2w": camera["c2w"], "fov_y_deg": 40.0},
        },
        {"type": "put_hotspot", "hotspot": 1, "title": "b", "position": [0.0, 0.5, 0.0]},
        {"type": "move_hotspot", "hotspot": 2, "to": 0},
        {"type": "move_hotspot", "hotspot": 1},
        {"type": "tour_path", "stop": 2.0},
    ]
    assert len(messages) == _MESSAGES
    for number, message in enumerate(messages):
        (folder / f"message{number:02}.json").write_text(json.dumps(message))


_BEGUN_BY = {
    "message05.json": "message04.json",
    "message06.json": "message04.json",
    "message42.json": "message41.json",
    "message43.json": "message41.json",
    "message47.json": "message46.json",
    "message48.json": "message46.json",
    "message49.json": "message46.json",
    "message50.json": "message46.json",
}
"""Messages of a drag, a preview or a hotspot need one that begins it."""


def _read_messages(folder: Path) -> None:
    """The damaged message, or all that are whole, to an editor whose rendering process is never started."""
    from pydantic import ValidationError

    from cagefield.server.protocol.client_messages import page_messages
    from cagefield.server.protocol.validation_errors import refusal
    from cagefield.server.render_queue.coordinator import Coordinator
    from cagefield.server.web.handlers import MessageHandlers
    from cagefield.server.web.launch import hello_of

    scene = opened_scene(folder / "scene")
    store = SceneStore(scene, folder / "scene")
    coordinator = Coordinator(Session(store.document(), scene.field.bounds, 0.1), store, "cpu")
    page = coordinator.join(hello_of(scene, "scene"))
    handlers = MessageHandlers(coordinator, page)
    said = json.loads((folder / "which").read_text()) if (folder / "which").is_file() else None
    files = [said] if said else sorted(file.name for file in folder.glob("message*.json"))
    if said in _BEGUN_BY:
        files.insert(0, _BEGUN_BY[said])
    refused: CagefieldError | None = None
    refused_by = ""
    for name in files:
        text = (folder / name).read_bytes().decode("utf-8", "replace")
        try:
            rest = handlers.handle(page_messages.validate_json(text))
            if rest is not None:
                rest.close()
        except ValidationError as error:
            refused, refused_by = CagefieldError(refusal(error)), name
        except CagefieldError as error:
            refused, refused_by = error, name
        coordinator.state().model_dump_json()
    with contextlib.suppress(OSError):
        store.autosave_path.unlink()
    if refused is not None and refused_by == said:
        raise refused


MESSAGE_READERS: dict[str, Reader] = {
    "messages": Reader(
        _make_messages, _read_messages, {f"message{number:02}.json": "json" for number in range(_MESSAGES)}
    ),
}
