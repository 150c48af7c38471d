"""The editor's server as pages meet it: a real process on a real port."""

from __future__ import annotations

import asyncio
import contextlib
import io
import json
import os
import signal
import socket
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from cagefield.edits import load_edits
from cagefield.errors import CagefieldError
from cagefield.server.protocol.common import MAX_MESSAGE_BYTES
from cagefield.server.render_queue.coordinator import Page
from cagefield.server.web.websocket import errors_reported_to
from editor_server import PATIENCE, EditorServer, PageClient, editor_server, page
from scenes import ball_scene
from sent_pictures import pixels_of

BALL = {"inner": {"center": [0, 0, 0], "size": 1.1}, "outer": {"margin": 0.4}, "lattice": 16, "name": "ball"}


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[EditorServer]:
    path = tmp_path_factory.mktemp("editor") / "ball"
    ball_scene().save(path)
    # Tests save into folders of their own.
    with editor_server(path, "--root", str(tmp_path_factory.getbasetemp())) as running:
        yield running


def load(client: PageClient, *edits: dict[str, Any]) -> dict[str, Any]:
    """The state after the stack was replaced by these edits."""
    client.send("load_edits", text=json.dumps({"edits": list(edits)}))
    return client.state(
        lambda s: s["revision"] > client.joined["revision"] and s["history"][-1] == "Load edits"
    )


def pixels(client: PageClient, side: int = 96) -> np.ndarray[Any, Any]:
    """The last whole picture that the page was sent, put together from its tiles."""
    out = np.zeros((side, side, 3), np.uint8)
    for picture in client.pictures:
        header = picture.header
        if header["full_width"] == side:
            x, y = header["x"], header["y"]
            part = pixels_of(picture.content, header["format"], header["width"], header["height"])
            out[y : y + header["height"], x : x + header["width"]] = part
    return out


def red_at(picture: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Mean (column, row) of the ball's pixels."""
    rows, columns = np.nonzero(picture[..., 1] < 128)
    return np.array([columns.mean(), rows.mean()])


def test_a_page_is_told_what_there_is_and_sent_a_whole_picture(server: EditorServer) -> None:
    with page(server) as (client, hello):
        assert hello["name"] == "ball" and len(hello["cameras"]) == 2
        assert hello["bounds"] == [[-1, -1, -1], [1, 1, 1]]
        state = client.joined
        assert state["history"][0] == "Open" and state["path"].endswith("ball")
        client.look_from(hello)
        header = client.final()
        assert (header["full_width"], header["full_height"], header["camera"]) == (96, 96, 1)
        picture = pixels(client)
        # The ball is red in the middle and the corners are the white background.
        assert picture[48, 48, 0] > 150 and picture[48, 48, 1] < 120
        assert (picture[0, 0] > 250).all()
        depth = np.frombuffer(client.pictures[-1].depth, "<u2")
        size = header["depth_width"] * header["depth_height"]
        assert depth.size == size and (depth < 65535).any() and (depth == 65535).any()
        nearest = depth.min() * header["depth_scale"]
        assert abs(nearest - 2.5) < 0.1  # camera at 3.0, the ball's radius is 0.5


def test_a_page_is_told_how_much_of_the_renderer_is_ready(server: EditorServer) -> None:
    with page(server) as (client, hello):
        told = [client.until(lambda m: m["type"] == "preparing")]
        client.look_from(hello)
        while told[-1]["done"] < told[-1]["of"]:
            told.append(client.until(lambda m: m["type"] == "preparing"))
        assert told[-1]["of"] > 1
        assert [m["done"] for m in told] == list(range(told[0]["done"], told[-1]["of"] + 1))


def test_a_drag_moves_the_picture_and_the_state(server: EditorServer) -> None:
    with page(server) as (client, hello):
        number = load(client, BALL)["edits"][0]["id"]
        client.look_from(hello)
        client.final()
        before = red_at(pixels(client))
        right = np.array(hello["start"]["c2w"]).reshape(4, 4)[:3, 0]
        client.send("drag_begin", drag=1, edit=number, target="field")
        for n in range(1, 6):
            by = (0.06 * n * right).tolist()
            client.send("drag", drag=1, seq=n, operation={"kind": "translate", "by": by})
        answer = client.until(lambda m: m["type"] == "dragged" and m["seq"] == 5)
        assert answer["part"] == 1.0 and answer["why"] is None
        shown = client.until(lambda m: m["type"] == "picture" and m["seq"] == 5)
        assert shown["drag"] == 1
        by = (0.3 * right).tolist()
        client.send("drag_end", drag=1, seq=6, operation={"kind": "translate", "by": by})
        state = client.state(lambda s: s["history"][-1] == "Move of ball")
        assert state["edits"][0]["operations"] and not state["saved"]
        client.until(lambda m: m["type"] == "picture" and m["final"] and m["revision"] >= state["revision"])
        after = red_at(pixels(client))
        # 0.3 to the right of the 2 * 3 * tan(fov / 2) that 96 pixels show at the ball's distance.
        fov = np.radians(hello["start"]["fov_y_deg"])
        expected = 0.3 / (2.0 * 3.0 * np.tan(0.5 * fov)) * 96
        assert abs(after[0] - before[0] - expected) < 1.5 and abs(after[1] - before[1]) < 1.0


def test_a_drag_stops_at_the_outer_cage(server: EditorServer) -> None:
    with page(server) as (client, _):
        state = load(client, BALL)
        client.send("drag_begin", drag=3, edit=state["edits"][0]["id"], target="field")
        client.send("drag", drag=3, seq=1, operation={"kind": "translate", "by": [0.8, 0, 0]})
        answer = client.until(lambda m: m["type"] == "dragged")
        assert 0.45 < answer["part"] <= 0.5 and "must stay inside the outer cage" in answer["why"]
        client.send("drag_cancel", drag=3)
        state = client.state(lambda s: s["edits"][0]["deformed"] == s["edits"][0]["inner"])
        assert state["edits"][0]["operations"] == []


@pytest.mark.parametrize("how", ["undo", "remove"])
def test_a_page_is_told_once_that_its_drag_was_given_up(server: EditorServer, how: str) -> None:
    with page(server) as (one, _), page(server) as (two, _):
        loaded = load(one, BALL)
        number, entry = loaded["edits"][0]["id"], loaded["entry"]
        shift = {"kind": "translate", "by": [0.1, 0, 0]}
        two.send("apply", edit=number, target="field", operation=shift)
        one.state(lambda s: s["entry"] == entry + 1)
        one.send("drag_begin", drag=7, edit=number, target="field")
        one.send("drag", drag=7, seq=1, operation=shift)
        one.until(lambda m: m["type"] == "dragged")
        two.send("command", name=how, edit=number)
        one.until(lambda m: m["type"] == "drag_over" and m["drag"] == 7)
        one.messages.clear()
        state = one.state(lambda s: s["entry"] == (entry if how == "undo" else entry + 2))
        # On their way before the page has heard of it.
        one.send("drag", drag=7, seq=2, operation=shift)
        one.send("drag_end", drag=7, seq=3, operation=shift)
        one.send("ask", request=5, what="edit_text", edit=number)
        one.until(lambda m: m["type"] == "answer" and m["request"] == 5)
        told = [m["text"] for m in one.messages if m["type"] == "notice" and "drag" in m["text"]]
        assert len(told) == 1 and told[0].startswith("this drag is over")
        assert all(m["entry"] == state["entry"] for m in one.messages if m["type"] == "state")


def test_two_pages_show_the_same_and_look_from_their_own_cameras(server: EditorServer) -> None:
    with page(server) as (one, hello), page(server) as (two, _):
        number = load(one, BALL)["edits"][0]["id"]
        two.state(lambda s: s["edits"][0]["id"] == number)
        one.look_from(hello, 96)
        two.look_from(hello, 48)
        one.final()
        assert two.final()["full_width"] == 48
        two.send("apply", edit=number, target="field", operation={"kind": "translate", "by": [0.1, 0, 0]})
        states = [client.state(lambda s: s["history"][-1] == "Move of ball") for client in (one, two)]
        assert states[0] == states[1]
        one.final()
        two.final()
        one.send("command", name="undo")
        states = [client.state(lambda s: not s["edits"][0]["operations"]) for client in (one, two)]
        assert states[0]["entry"] == states[1]["entry"]


def both_see(*pages: PageClient, entry: int) -> dict[str, Any]:
    """The state of all pages, one and the same, at an entry of the history; their next pictures are, too."""
    states = [client.state(lambda s: s["entry"] == entry) for client in pages]
    assert all(state == states[0] for state in states)
    for client in pages:
        client.until(
            lambda m: m["type"] == "picture" and m["final"] and m["revision"] >= states[0]["revision"]
        )
    for client in pages[1:]:
        np.testing.assert_array_equal(pixels(client), pixels(pages[0]))
    return states[0]


@pytest.mark.nightly
def test_two_pages_drag_undo_redo_and_save_a_lattice(server: EditorServer) -> None:
    """Each page drags a row of one lattice, one undoes, one redoes; its file gives both of them the same."""
    lattice = {"points": [2, 2, 3], "interpolation": "bspline"}
    edit = BALL | {"inner": {"center": [0, 0, 0], "size": 1.1, "lattice": lattice}}
    rows = [{"kind": "move_points", "points": [8, 9], "by": [0.0, 0.15, 0.1]}]
    rows.append({"kind": "move_points", "points": [10, 11], "by": [0.1, 0.0, 0.2]})
    with page(server) as (one, hello), page(server) as (two, _):
        loaded = load(one, edit)
        number, entry, points = loaded["edits"][0]["id"], loaded["entry"], []
        for client in (one, two):
            client.look_from(hello)
        two.state(lambda s: s["entry"] == entry)
        for client in (one, two):
            client.final()
        plain = pixels(one)
        for drag, (mover, row) in enumerate(zip((one, two), rows, strict=True), 1):
            mover.send("drag_begin", drag=drag, edit=number, target="field")
            mover.send("drag", drag=drag, seq=1, operation=row)
            assert mover.until(lambda m: m["type"] == "dragged")["part"] == 1.0
            mover.send("drag_end", drag=drag, seq=2, operation=row)
            state = both_see(one, two, entry=entry + drag)
            points.append(state["edits"][0]["points"]["deformed"])
        moved = pixels(two)
        assert points[0] != points[1] and np.abs(moved.astype(int) - plain).max() > 50
        two.send("command", name="undo")
        assert both_see(one, two, entry=entry + 1)["edits"][0]["points"]["deformed"] == points[0]
        one.send("command", name="redo")
        assert both_see(one, two, entry=entry + 2)["edits"][0]["points"]["deformed"] == points[1]
        np.testing.assert_array_equal(pixels(one), moved)
        one.send("command", name="save")
        states = [client.state(lambda s: s["saved"]) for client in (one, two)]
        assert states[0] == states[1]
        text = (Path(states[0]["path"]) / "edits.yaml").read_text()
        for name in ("undo", "undo"):
            one.send("command", name=name)
        both_see(one, two, entry=entry)
        two.send("load_edits", text=text)  # a replay of the file
        replayed = both_see(one, two, entry=entry + 1)
        assert replayed["edits"][0]["points"]["deformed"] == points[1]
        np.testing.assert_array_equal(pixels(two), moved)


def test_a_page_that_shows_slowly_has_one_picture_waiting_and_two_at_rest(server: EditorServer) -> None:
    with page(server, slow=True) as (client, hello):
        seq, after, end = 0, 0, time.monotonic() + PATIENCE
        while after < 60 and time.monotonic() < end:
            seq, after = seq + 1, after + (len(client.pictures) >= 1)
            client.look_from(hello, 96 + seq % 50, seq=seq, moving=True)
            with contextlib.suppress(TimeoutError):
                client.take(0.03)
        assert len(client.pictures) == 1
        client.look_from(hello, 96 + seq % 50, seq=seq, moving=False)
        end = time.monotonic() + 2.0
        while time.monotonic() < end:
            with contextlib.suppress(TimeoutError):
                client.take(0.03)
        assert len(client.pictures) == 2
        seq += 1
        client.look_from(hello, 96 + seq % 50, seq=seq, moving=True)
        client.send("presented", picture=client.pictures[-1].header["picture"])
        header = client.until(lambda m: m["type"] == "picture")
        # The newest camera, or one that the server heard while it was on its way.
        assert header["camera"] > seq - 5


def test_malformed_messages_get_a_clear_error_and_harm_nothing(server: EditorServer) -> None:
    with page(server) as (client, _):
        before = load(client, BALL)
        number = before["edits"][0]["id"]
        for text, words in (
            ("not json", "malformed message: Invalid JSON"),
            ("[]", "malformed message"),
            ('{"type": "explode"}', "malformed message"),
            ('{"type": "presented", "picture": "x"}', "malformed message: presented.picture"),
            ('{"type": "undo", "extra": 1}', "malformed message"),
            (
                '{"type": "camera", "seq": 1, "c2w": [1], "width": 9, "height": 9, "fov_y_deg": 1}',
                "camera.c2w",
            ),
            ('{"type": "go_to", "entry": -1}', "go_to.entry"),
        ):
            client.socket.send(text)
            notice = client.notice()
            assert notice["level"] == "error" and words in notice["text"], notice
            assert "\n" not in notice["text"]
        client.socket.send(b"\x00\x01")
        assert "must be text" in client.notice()["text"]
        client.send("camera", seq=1, c2w=[0.0] * 16, width=64, height=64, fov_y_deg=50)
        assert client.notice()["level"] == "error"
        client.send("command", name="remove", edit=999)
        assert "edit 999 is not there any more" in client.notice()["text"]
        client.send("command", name="remove")
        assert "choose an edit" in client.notice()["text"]
        client.send("set_cage", edit=number, cage="inner", corners=[[0, 0, 0]] * 8)
        assert "cage has zero size" in client.notice()["text"]
        client.send("command", name="select", edit=number)
        assert client.state()["edits"] == before["edits"]


def test_a_message_that_is_too_big_ends_its_socket_and_no_other(server: EditorServer) -> None:
    with page(server) as (other, _):
        with page(server) as (client, _):
            client.socket.send(json.dumps({"type": "load_edits", "text": "x" * MAX_MESSAGE_BYTES}))
            with pytest.raises(ConnectionClosed) as closed:
                client.until(lambda m: False, 20.0)
            assert closed.value.rcvd is not None and closed.value.rcvd.code == 1009
        other.send("command", name="undo")
        other.state()


def test_too_many_messages_are_passed_over(server: EditorServer) -> None:
    with page(server) as (client, _):
        for _ in range(1500):
            client.send("presented", picture=0)
        assert "too many messages" in client.notice()["text"]
        time.sleep(0.5)
        client.send("command", name="undo")
        client.state()


@pytest.mark.parametrize(
    "headers",
    [
        {"origin": "http://evil.example"},
        {"origin": None},
        {"origin": "http://evil.example:PORT", "host": "evil.example:PORT"},
    ],
    ids=["other origin", "no origin", "rebound name"],
)
def test_sockets_of_other_sites_are_refused(server: EditorServer, headers: dict[str, str | None]) -> None:
    port = str(server.port)
    origin = headers["origin"] and headers["origin"].replace("PORT", port)
    host = headers.get("host") or "localhost:PORT"
    with (
        socket.create_connection(("localhost", server.port)) as plain,
        pytest.raises(InvalidStatus, match="403"),
        connect(
            f"ws://{host.replace('PORT', port)}/socket",
            sock=plain,
            origin=origin,
            additional_headers=server.headers,
        ),
    ):
        pass


def test_requests_under_another_name_are_refused(server: EditorServer) -> None:
    request = urllib.request.Request(
        f"http://localhost:{server.port}/edits.yaml", headers={**server.headers, "Host": "evil.example"}
    )
    with pytest.raises(urllib.error.HTTPError) as refused:
        urllib.request.urlopen(request)
    assert refused.value.code == 403 and b"does not answer to" in refused.value.read()


def test_the_page_the_edit_file_and_a_screenshot_are_served(server: EditorServer, tmp_path: Path) -> None:
    with page(server) as (client, hello):
        load(client, BALL)
        client.look_from(hello, 64)
        client.final()
        with server.get("/") as answer:
            assert answer.status == 200 and "default-src 'self'" in answer.headers["Content-Security-Policy"]
            assert answer.headers["Cross-Origin-Resource-Policy"] == "same-origin"
        file = tmp_path / "edits.yaml"
        file.write_bytes(server.get("/edits.yaml").read())
        assert [edit.name for edit in load_edits(file)] == ["ball"]
        shot = server.get(f"/screenshot.png?page={hello['page']}").read()
        assert Image.open(io.BytesIO(shot)).size == (64, 64)
        assert server.get("/screenshot.png").read() == shot  # of the newest page
        with pytest.raises(urllib.error.HTTPError, match="404"):
            server.get("/screenshot.png?page=999")
        with pytest.raises(urllib.error.HTTPError, match="404"):
            server.get("/screenshot.png?page=" + "9" * 5000)
        with pytest.raises(urllib.error.HTTPError, match="404"):  # and leads to no other site
            server.get(f"//other.example/?token={server.token}")


def test_cages_are_placed_on_the_surface_and_fitted(server: EditorServer) -> None:
    with page(server) as (client, hello):
        load(client)
        client.look_from(hello, 96)
        client.final()
        client.send("ask", request=5, what="surface", x=0.5, y=0.5)
        answer = client.until(lambda m: m["type"] == "answer" and m["request"] == 5)
        assert abs(np.linalg.norm(answer["point"]) - 0.5) < 0.1
        outwards = np.array(answer["point"]) / np.linalg.norm(answer["point"])
        # The ball is made of whole voxels, a quarter of its radius: its normals are those of stairs.
        assert outwards @ np.array(answer["normal"]) > 0.85
        client.send("ask", request=6, what="surface", x=0.01, y=0.01)
        assert client.until(lambda m: m["type"] == "answer")["point"] is None
        client.send("place", x=0.01, y=0.01)
        assert "no surface under the mouse" in client.notice()["text"]
        client.send("place", x=0.5, y=0.5)
        edit = client.state(lambda s: len(s["edits"]) == 1)["edits"][0]
        middle = np.mean(edit["inner"], axis=0)
        np.testing.assert_allclose(middle, answer["point"], atol=1e-6)
        client.send("set_cage", edit=edit["id"], cage="inner", corners=box(0.9))
        client.send("fit_inner", edit=edit["id"])
        state = client.state(lambda s: s["history"][-1].startswith("Fit"))
        fitted = np.array(state["edits"][0]["inner"])
        # The ball's radius is 0.5, its edge fades over one voxel of 0.125, and a probe is 1.8 / 40.
        assert 0.45 < fitted.max() < 0.7 and -0.7 < fitted.min() < -0.45
        for what, edit_id in (("grid", 999), ("edit_text", None)):
            client.send("ask", request=8, what=what, edit=edit_id)
            answer = client.until(lambda m: m["type"] in ("answer", "notice") and m.get("request", 8) == 8)
            assert answer["type"] == "answer" and answer["failed"]
            assert client.notice()["level"] == "error"
        client.send("ask", request=7, what="grid", edit=edit["id"])
        assert client.until(lambda m: m["type"] == "answer" and m["request"] == 7)


def box(half: float) -> list[list[float]]:
    return [[half * (2 * (k >> a & 1) - 1) for a in range(3)] for k in range(8)]


def renderer(server: EditorServer) -> int:
    """The number of the rendering process."""
    (pid,) = [
        pid for pid in server.children() if "resource_tracker" not in Path(f"/proc/{pid}/cmdline").read_text()
    ]
    return pid


def test_a_question_that_waits_for_the_renderer_holds_up_nothing_else(server: EditorServer) -> None:
    with page(server) as (client, hello):
        number = load(client, BALL)["edits"][0]["id"]
        client.look_from(hello, 48)
        client.final()
        os.kill(renderer(server), signal.SIGSTOP)
        try:
            client.send("ask", request=9, what="surface", x=0.5, y=0.5)
            client.send(
                "apply", edit=number, target="field", operation={"kind": "translate", "by": [0.1, 0, 0]}
            )
            client.state(lambda s: s["edits"][0]["operations"])
            assert not any(m["type"] == "answer" for m in client.messages)
        finally:
            os.kill(renderer(server), signal.SIGCONT)
        assert client.until(lambda m: m["type"] == "answer")["request"] == 9


def test_what_the_server_did_not_expect_is_told_too(caplog: pytest.LogCaptureFixture) -> None:
    one = Page(1)
    with errors_reported_to(one):
        raise ZeroDivisionError("by zero")
    with errors_reported_to(one):
        raise CagefieldError("a line\nwith its cure")
    first, second = (json.loads(asyncio.run(one.send_queue.get())) for _ in range(2))
    assert "could not do that (ZeroDivisionError: by zero)" in first["text"] and "by zero" in caplog.text
    assert second["text"] == "a line with its cure"


def test_a_lost_renderer_is_started_again_and_nothing_is_lost(server: EditorServer) -> None:
    with page(server) as (client, hello):
        state = load(client, BALL)
        client.look_from(hello, 64)
        client.final()
        os.kill(renderer(server), signal.SIGKILL)
        assert "started again" in client.notice()["text"]
        assert client.final()["full_width"] == 64
        number = state["edits"][0]["id"]
        client.send("apply", edit=number, target="field", operation={"kind": "translate", "by": [0.1, 0, 0]})
        assert len(client.state(lambda s: s["edits"][0]["operations"])["edits"]) == 1


def test_a_video_and_the_test_views_are_rendered_in_the_background(
    server: EditorServer, tmp_path: Path
) -> None:
    with page(server) as (client, hello):
        load(client, BALL)
        pose = hello["start"]["c2w"]
        keys = [
            {"c2w": pose, "fov_y_deg": 40.0, "seconds": 0.2, "parts": {}},
            {"c2w": pose, "fov_y_deg": 50.0},
        ]
        client.send("set_path", keys=keys)
        client.state(lambda s: len(s["keys"]) == 2)
        video, folder = tmp_path / "path.mp4", tmp_path / "views"
        client.send("render", what="camera_path", out=str(video), width=32, height=32, fps=20)
        client.send("render", what="test_views", out=str(folder), width=32, height=32)
        first = client.until(lambda m: m["type"] == "job")
        assert first["state"] == "running" and first["total"] == 5
        client.until(lambda m: m["type"] == "job" and m["what"] == "camera_path" and m["state"] == "done")
        client.until(lambda m: m["type"] == "job" and m["what"] == "test_views" and m["state"] == "done")
        client.final() if client.pictures else None
        end = time.monotonic() + 30.0
        while not video.exists() and time.monotonic() < end:
            time.sleep(0.1)
        assert video.stat().st_size > 500
        assert sorted(file.name for file in folder.glob("*.png")) == ["0000.png", "0001.png"]
        client.send("render", what="camera_path", out=str(video), width=32, height=32)
        assert "exists already" in client.notice()["text"]


def test_a_page_that_plays_the_path_sees_the_edits_as_far_as_they_have_gone(server: EditorServer) -> None:
    with page(server) as (client, hello), page(server) as (other, _):
        number = load(client, BALL)["edits"][0]["id"]
        by = (0.3 * np.array(hello["start"]["c2w"]).reshape(4, 4)[:3, 0]).tolist()
        client.send("apply", edit=number, target="field", operation={"kind": "translate", "by": by})
        start = {name: hello["start"][name] for name in ("c2w", "fov_y_deg")}
        client.send("set_path", keys=[start | {"seconds": 2.0, "parts": {number: 0.0}}, start])
        state = client.state(lambda s: [key["parts"] for key in s["keys"]] == [{str(number): 0.0}, {}])
        client.look_from(hello)

        def seen(revision: int) -> tuple[int, np.ndarray[Any, Any]]:
            """A whole picture of a revision from that one on, and where the ball is on it."""
            last = client.until(lambda m: m["type"] == "picture" and m["whole"] and m["revision"] >= revision)
            return last["revision"], red_at(pixels(client))

        revision, whole = seen(state["revision"])
        client.send("ask", request=3, what="path")
        told = client.until(lambda m: m["type"] == "answer" and m["request"] == 3)["stills"]
        assert len(told) == 61 and all(np.allclose(still["c2w"], start["c2w"]) for still in told)

        client.send("play_begin", play=1)
        begun = {"type": "preview", "page": hello["page"], "play": 1, "on": True}
        for each in (client, other):
            assert each.until(lambda m: m["type"] == "preview") == begun
        revision, first = seen(revision + 1)
        client.send("play", play=1, seconds=1.0)
        revision, middle = seen(revision + 1)
        # The ball goes from where it is in the field to where the edit takes it, evenly between two keys.
        assert whole[0] - first[0] > 6.0
        assert middle == pytest.approx(0.5 * (first + whole), abs=1.0)
        client.send("play_end", play=1)
        for each in (client, other):
            # The server tells of the state first: pictures from then on are of it.
            end = each.state(lambda s: s["pictured"] > revision)
            assert end["history"] == state["history"] and end["edits"][0]["operations"]
            assert each.until(lambda m: m["type"] == "preview") == begun | {"on": False}
        assert seen(end["pictured"])[1] == pytest.approx(whole, abs=0.1)


def test_a_cancelled_video_leaves_nothing(server: EditorServer, tmp_path: Path) -> None:
    with page(server) as (client, hello):
        pose = hello["start"]["c2w"]
        keys = [{"c2w": pose, "fov_y_deg": 40.0, "seconds": 60.0}, {"c2w": pose, "fov_y_deg": 50.0}]
        client.send("set_path", keys=keys)
        client.send("render", what="camera_path", out=str(tmp_path / "a.mp4"), width=64, height=64)
        job = client.until(lambda m: m["type"] == "job" and m["done"] > 2)
        client.send("cancel_job", job=job["job"])
        client.until(lambda m: m["type"] == "job" and m["state"] == "cancelled")
        client.send("cancel_job", job=job["job"])
        assert "over already" in client.notice()["text"]
        end = time.monotonic() + 30.0
        while list(tmp_path.iterdir()) and time.monotonic() < end:
            time.sleep(0.1)
        assert not list(tmp_path.iterdir())


@pytest.mark.nightly
def test_a_server_that_is_killed_in_a_drag_loses_no_more_than_the_drag(tmp_path: Path) -> None:
    scene = tmp_path / "ball"
    ball_scene().save(scene)
    with editor_server(scene) as first, page(first) as (client, _):
        state = load(client, BALL)
        number = state["edits"][0]["id"]
        client.send("apply", edit=number, target="field", operation={"kind": "translate", "by": [0.1, 0, 0]})
        client.state(lambda s: s["edits"][0]["operations"])
        client.send("drag_begin", drag=1, edit=number, target="field")
        client.send("drag", drag=1, seq=1, operation={"kind": "translate", "by": [0, 0.1, 0]})
        client.until(lambda m: m["type"] == "dragged")
        first.kill()
    with editor_server(scene) as second, page(second) as (client, _):
        state = client.joined
        assert state["edits"][0]["operations"] == ["translation by (0.1, 0, 0)"]
        assert state["history"] == ["Open", "Restore unsaved changes"] and not state["saved"]
        assert "restored" in client.notice()["text"]
        client.send("command", name="save")
        assert client.state(lambda s: s["saved"])
    assert [file.name for file in tmp_path.iterdir()] == ["ball"]
    assert len(load_edits(scene / "edits.yaml")[0].operations) == 1


def test_with_a_token_only_its_holders_get_in(tmp_path: Path) -> None:
    scene = tmp_path / "ball"
    ball_scene().save(scene)
    with editor_server(scene, "--token", "a-long-token") as server:
        link = f"http://localhost:{server.port}/"
        assert server.link.endswith("?token=a-long-token")
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(link)
        with pytest.raises(InvalidStatus, match="403"), page(server, known=False):
            pass
        opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
        with opener.open(server.link) as answer:
            assert answer.url == link
        with opener.open(link) as answer:
            assert answer.status == 200
