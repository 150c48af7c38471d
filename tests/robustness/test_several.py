"""Several people at one scene: nobody's work is lost, and a second server is told why not."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cagefield.edits import EditStack, Translate, load_edits, parse_edits
from cagefield.server.editor.history import MAX_ENTRIES
from editor_server import EditorServer, PageClient, editor_server, page
from scenes import ball_scene, files_of

BALL = {"inner": {"center": [0, 0, 0], "size": 1}, "adjustment": "discrete", "name": "ball"}
OTHER = {"inner": {"center": [0, 0, 0.5], "size": 0.4}, "adjustment": "discrete", "name": "other"}


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    ball_scene().save(tmp_path / "scene")
    return tmp_path / "scene"


@pytest.fixture
def server(scene: Path) -> Iterator[EditorServer]:
    """An editor of a scene whose edits are `ball` and `other`."""
    with editor_server(scene) as running:
        with page(running) as (client, _):
            client.send("load_edits", text=json.dumps({"edits": [BALL, OTHER]}))
            client.state(lambda state: len(state["edits"]) == 2)
        yield running


def by(x: float = 0.0, y: float = 0.0) -> dict[str, Any]:
    return {"kind": "translate", "by": [x, y, 0.0]}


def settled(client: PageClient) -> dict[str, Any]:
    """The state after all that the page has sent; notices that came before it stay in `messages`."""
    number = len(client.messages) + 1
    client.send("ask", request=number, what="sources")
    client.until(lambda m: m["type"] == "answer" and m["request"] == number)
    states = [message for message in client.messages if message["type"] == "state"]
    return states[-1]


def edits_of(server: EditorServer) -> EditStack:
    """The edits as the server has them."""
    return parse_edits(server.get("/edits.yaml").read().decode())


def errors(client: PageClient) -> list[str]:
    return [m["text"] for m in client.messages if m["type"] == "notice" and m["level"] == "error"]


def middle(state: dict[str, Any], edit: int) -> np.ndarray[Any, Any]:
    """The middle [3] of where an edit's inner cage is shown."""
    corners = next(shown["deformed"] for shown in state["edits"] if shown["id"] == edit)
    return np.mean(corners, axis=0)


def test_two_people_drag_one_edit(server: EditorServer) -> None:
    """Each drag becomes an entry of the history, one after the other, however their moves come."""
    with page(server) as (one, _), page(server) as (two, _):
        edit = one.joined["edits"][0]["id"]
        for client in (one, two):
            client.send("drag_begin", drag=1, edit=edit, target="field")
        for n in range(1, 6):
            one.send("drag", drag=1, seq=n, operation=by(x=0.02 * n))
            two.send("drag", drag=1, seq=n, operation=by(y=0.04 * n))
        one.send("drag_end", drag=1, seq=6, operation=by(x=0.1))
        settled(one)
        two.send("drag_end", drag=1, seq=6, operation=by(y=0.2))
        state = settled(two)
        assert state == settled(one) | {"revision": state["revision"]}
        # 1e-5: corners travel as 6 digits.
        np.testing.assert_allclose(middle(state, edit), (0.1, 0.2, 0.0), atol=1e-5)
        assert errors(one) == errors(two) == []
        assert edits_of(server)[0].operations == (Translate((0.1, 0.2, 0)),)  # two moves, joined
        one.send("command", name="undo")  # takes back the last, whoever did it
        np.testing.assert_allclose(middle(settled(one), edit), (0.1, 0.0, 0.0), atol=1e-5)


def test_one_removes_what_another_drags(server: EditorServer) -> None:
    with page(server) as (one, _), page(server) as (two, _):
        ball, other = (edit["id"] for edit in one.joined["edits"])
        one.send("drag_begin", drag=1, edit=ball, target="field")
        one.send("drag", drag=1, seq=1, operation=by(x=0.1))
        settled(one)
        two.send("command", name="remove", edit=ball)
        settled(two)
        one.send("drag", drag=1, seq=2, operation=by(x=0.2))
        one.send("drag_end", drag=1, seq=3, operation=by(x=0.3))
        state = settled(one)
        assert [edit["id"] for edit in state["edits"]] == [other]
        assert len(errors(one)) >= 1 and all("drag is over" in text or "edit" in text for text in errors(one))
        assert errors(two) == []
        two.send("command", name="undo")
        state = settled(two)
        assert [edit["id"] for edit in state["edits"]] == [ball, other]
        np.testing.assert_allclose(middle(state, ball), 0.0, atol=1e-5)


def test_one_saves_while_another_drags(server: EditorServer, scene: Path) -> None:
    """The file has the edits without the drag, which goes on, and is there with the next save."""
    with page(server) as (one, _), page(server) as (two, _):
        edit = one.joined["edits"][0]["id"]
        one.send("drag_begin", drag=1, edit=edit, target="field")
        one.send("drag", drag=1, seq=1, operation=by(x=0.1))
        settled(one)
        two.send("command", name="save")
        assert "saved to" in two.notice()["text"]
        assert [(e.name, e.operations) for e in load_edits(scene / "edits.yaml")] == [
            ("ball", ()), ("other", ())
        ]  # fmt: skip
        state = settled(two)
        assert state["saved"]
        np.testing.assert_allclose(middle(state, edit), (0.1, 0.0, 0.0), atol=1e-5)
        one.send("drag", drag=1, seq=2, operation=by(x=0.2))
        one.send("drag_end", drag=1, seq=3, operation=by(x=0.3))
        assert not settled(one)["saved"] and errors(one) == errors(two) == []
        two.send("command", name="save")
        two.until(lambda m: m["type"] == "notice" and "saved to" in m["text"])
        assert load_edits(scene / "edits.yaml")[0].operations == (Translate((0.3, 0, 0)),)


@pytest.mark.nightly
def test_a_second_server_says_who_has_the_scene_and_the_next_one_finds_all(scene: Path) -> None:
    command = [sys.executable, "-m", "cagefield", "view", str(scene), "--port", "0", "--no-browser"]
    with editor_server(scene) as first, page(first) as (client, _):
        client.send("load_edits", text=json.dumps({"edits": [BALL]}))
        client.state(lambda state: len(state["edits"]) == 1)
        before = files_of(scene.parent)
        second = subprocess.run(command, capture_output=True, text=True, timeout=120)
        assert second.returncode == 2 and second.stdout == ""
        assert second.stderr == (
            f"cagefield: {scene} is open in another editor (process {first.process.pid}); use its page, "
            "or end it first\n"
        )
        assert files_of(scene.parent) == before
        client.send("change", edit=client.messages[-1]["edits"][0]["id"], name="renamed")
        client.state(lambda state: state["edits"][0]["name"] == "renamed")
        first.kill()
    with editor_server(scene) as third, page(third) as (client, _):
        assert [edit["name"] for edit in client.joined["edits"]] == ["renamed"]
        assert "restored" in client.notice()["text"]


@pytest.mark.nightly
def test_a_page_that_was_away_for_an_hour(server: EditorServer, scene: Path) -> None:
    """It left amid a drag, and missed more changes than the history keeps; its edit is gone."""
    with page(server) as (away, _), page(server) as (there, _):
        ball, other = (edit["id"] for edit in away.joined["edits"])
        away.send("drag_begin", drag=7, edit=ball, target="field")
        away.send("drag", drag=7, seq=1, operation=by(x=0.1))
        settled(away)
        away.socket.close()
        there.state(lambda state: abs(middle(state, ball)[0]) < 1e-5)  # the drag went with its page
        there.send("command", name="remove", edit=ball)
        for n in range(MAX_ENTRIES + 20):
            there.send("change", edit=other, name=f"hour {n}")
            if n % 20 == 0:
                settled(there)
        there.send("command", name="save")
        there.until(lambda m: m["type"] == "notice" and "saved to" in m["text"])
        now = settled(there)
        assert len(now["history"]) <= MAX_ENTRIES + 1
        with page(server) as (back, hello):
            assert back.joined["edits"] == now["edits"] and back.joined["history"] == now["history"]
            back.look_from(hello)
            stale: list[dict[str, Any]] = [
                {"kind": "drag", "drag": 7, "seq": 2, "operation": by(x=0.2)},
                {"kind": "drag_end", "drag": 7, "seq": 3, "operation": by(x=0.3)},
                {"kind": "change", "edit": ball, "name": "mine"},
                {"kind": "apply", "edit": ball, "target": "field", "operation": by(x=1)},
                {"kind": "command", "name": "remove", "edit": ball},
                {"kind": "reorder", "edit": ball, "to": 0},
            ]
            for number, message in enumerate(stale, start=1):
                back.send(**message)
                state = settled(back)
                assert len(errors(back)) == number, message
                assert state["edits"] == now["edits"] and state["saved"]
            back.send("presented", picture=99)
            back.send("drag_cancel", drag=7)
            back.send("apply", edit=other, target="field", operation=by(y=0.1))
            assert settled(back)["edits"] == settled(there)["edits"]
            assert len(errors(back)) == len(stale) and errors(there) == []
    (edit,) = edits_of(server)
    assert edit.name == f"hour {MAX_ENTRIES + 19}" and edit.operations == (Translate((0, 0.1, 0)),)
    assert load_edits(scene / "edits.yaml")[0].operations == ()
