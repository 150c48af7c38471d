"""Camera paths as pages and scene folders give them: each bad value is one line with its cure."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from pydantic import ValidationError

from cagefield.cameras.keyframe_files import dump_path
from cagefield.cameras.keyframes import Keyframe
from cagefield.edits import Edit, EditStack, dump_edits
from cagefield.errors import CagefieldError, CameraError
from cagefield.geometry.cage import Cage
from cagefield.server.protocol import client_messages, server_messages
from cagefield.server.protocol.validation_errors import refusal
from cagefield.server.render_queue.coordinator import Coordinator
from cagefield.server.web.app import application
from cagefield.server.web.handlers import MessageHandlers
from cagefield.server.web.launch import open_scene
from cagefield.server.web.security import Guard
from scenes import ball_scene

POSE = np.eye(4).ravel().tolist()
BALL = Edit.move(Cage.box((0, 0, 0), 1.1), name="ball").translate((0.1, 0, 0))


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    ball_scene().with_edits(EditStack([BALL])).save(tmp_path / "ball")
    return tmp_path / "ball"


def set_path(*keys: Any, **more: Any) -> str:
    return json.dumps({"type": "set_path", "keys": list(keys), **more})


def key(**changed: Any) -> dict[str, Any]:
    return {"c2w": POSE, "fov_y_deg": 50.0, "seconds": 2.0, "parts": {"1": 0.5}} | changed


def said(coordinator: Coordinator, hello: server_messages.Hello, text: str) -> str | None:
    """What the page's user is told of a message; None where it is followed."""
    try:
        rest = MessageHandlers(coordinator, coordinator.join(hello)).handle(
            client_messages.page_messages.validate_json(text)
        )
        if rest is not None:
            asyncio.run(rest)
    except ValidationError as error:
        return refusal(error)
    except CagefieldError as error:
        return str(error)
    return None


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (set_path(key(), key(c2w=[1.0])), "keyframe 2: its camera (c2w) must be 16 finite numbers"),
        (set_path(key(c2w=[np.nan, *POSE[1:]])), "keyframe 1: its camera (c2w) must be 16 finite"),
        (set_path(key(c2w=[0.0] * 15 + [1.0])), "keyframe 1: c2w is not a rigid motion"),
        (set_path(key(fov_y_deg="wide")), "keyframe 1: its field of view (fov_y_deg) must be a number"),
        (set_path(key(fov_y_deg=180)), "keyframe 1: the field of view is 180; give 0.2 to 178 degrees"),
        (set_path(key(), key(seconds=0)), "keyframe 2: the time to the next key is 0 s; give 0.01 to 3600"),
        (set_path(key(seconds=[])), "keyframe 1: its time to the next one (seconds) must be a number"),
        (set_path(key(parts={"1": 7})), "keyframe 1: the part of edit 1 is 7; give 0 to 1"),
        (set_path(key(parts={"0": 1})), "keyframe 1: a part of edit 0 is given; edits are numbered from 1"),
        (set_path(key(parts={"ball": 1})), "keyframe 1: its parts of edits (parts) must be numbers from"),
        (set_path(key(fov=50)), 'keyframe 1: unknown key "fov"; the keys here are c2w, fov_y_deg'),
        (set_path(3), "keyframe 1 must have the keys c2w, fov_y_deg, seconds, parts"),
        (set_path(*([key()] * 501)), "keys must be a list of keyframes, at most 500; remove some"),
        (set_path(key(), loop="round"), "loop must be true or false"),
        (set_path(key(), circle=True), 'unknown key "circle"; the keys here are keys and loop'),
    ],
)  # fmt: skip
def test_a_bad_value_in_a_message_is_named_with_its_cure(scene: Path, text: str, told: str) -> None:
    coordinator, hello = open_scene(scene)
    line = said(coordinator, hello, text)
    assert line is not None and line.startswith(f"the camera path is not taken: {told}"), line
    assert "\n" not in line
    assert coordinator.session.document.keys == ()


def test_a_good_path_is_taken_and_told_to_pages(scene: Path) -> None:
    coordinator, hello = open_scene(scene)
    widest = key(fov_y_deg=178, seconds=3600, parts={"1": 1})
    assert said(coordinator, hello, set_path(key(fov_y_deg=0.2, seconds=0.01), widest, loop=True)) is None
    state = coordinator.state()
    assert [k.model_dump(mode="json") for k in state.keys][1] == widest and state.loop


def test_other_malformed_messages_say_what_to_do(scene: Path) -> None:
    line = said(*open_scene(scene), '{"type": "undo"}')
    assert line is not None and line.startswith("malformed message: ") and line.endswith("; reload the page")


@pytest.mark.parametrize("length", [None, 200])
def test_a_camera_paths_file_is_not_read_as_edits(scene: Path, length: int | None) -> None:
    coordinator, hello = open_scene(scene)
    text = dump_path((Keyframe(tuple(POSE), 50.0),), loop=False)[:length]
    line = said(coordinator, hello, json.dumps({"type": "load_edits", "text": text}))
    assert line is not None and line.startswith(
        "this is a camera path, and no edits; save it as camera_path.json"
    )
    edits = dump_edits(EditStack([BALL, BALL]), format="json")
    assert said(coordinator, hello, json.dumps({"type": "load_edits", "text": edits})) is None
    assert len(coordinator.session.document.entries) == 2


def test_a_scene_whose_path_is_damaged_is_not_opened(scene: Path) -> None:
    document = json.loads(dump_path((Keyframe(tuple(POSE), 50.0),), loop=False))
    document["keyframes"][0]["cagefield_parts"] = {"1": 7}
    (scene / "camera_path.json").write_text(json.dumps(document))
    with pytest.raises(
        CameraError, match=r"camera_path\.json: keyframes\[0\]: the part of edit 1 is 7; give 0"
    ):
        open_scene(scene)


def test_a_path_that_is_too_long_for_a_file_changes_no_file(scene: Path) -> None:
    coordinator, hello = open_scene(scene)
    hour = key(seconds=3600)
    assert said(coordinator, hello, set_path(hour, hour, hour)) is None
    edits = (scene / "edits.yaml").read_bytes()
    coordinator.session.preserve_opacity(False)
    coordinator.session.remove(1)
    with pytest.raises(CameraError, match="make it shorter"):
        coordinator.save()
    assert (scene / "edits.yaml").read_bytes() == edits and not (scene / "camera_path.json").exists()
    answer = asyncio.run(fetched(coordinator, hello, "/camera_path.json"))
    assert answer.status_code == 409 and "make it shorter" in answer.text


async def fetched(coordinator: Coordinator, hello: server_messages.Hello, path: str) -> httpx.Response:
    transport = httpx.ASGITransport(application(coordinator, hello, Guard("localhost", 80)))
    async with httpx.AsyncClient(transport=transport, base_url="http://localhost:80") as client:
        return await client.get(path)
