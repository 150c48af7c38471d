"""Read-only links, TLS, wrong tokens, the limit of connections, and processes of a killed server."""

from __future__ import annotations

import contextlib
import http.client
import json
import socket
import ssl
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
from websockets.sync.client import connect

from cagefield.server.web.launch import MAX_CONNECTIONS, Certificate
from cagefield.server.web.security import Attempts
from certificates import certificate_of_localhost
from commands import refused
from editor_server import EditorServer, editor_server, page
from scenes import ball_scene


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small scene folder."""
    folder = tmp_path_factory.mktemp("access") / "scene"
    ball_scene().save(folder)
    return folder


@pytest.fixture(scope="module")
def server(scene: Path) -> Iterator[tuple[EditorServer, EditorServer]]:
    """An editor as one who may edit has it, and as one who may look."""
    with editor_server(scene, "--read-only-link", "--token", "short-token") as running:
        assert running.process.stdout is not None
        line = running.process.stdout.readline()
        assert line.startswith("to look only: http://")
        yield running, EditorServer(line.split()[-1], running.process)


def status_of(server: EditorServer, path: str, method: str = "GET", **headers: str) -> int:
    connection = http.client.HTTPConnection("localhost", server.port, timeout=20)
    connection.request(method, path, headers={**server.headers, **headers})
    return connection.getresponse().status


def test_who_may_look_sees_all_and_changes_nothing(
    server: tuple[EditorServer, EditorServer], scene: Path
) -> None:
    editor, looker = server
    before = sorted(scene.parent.iterdir())
    with page(editor) as (mine, hello), page(looker) as (theirs, told):
        assert hello["read_only"] is False and told["read_only"] is True
        theirs.look_from(told)
        assert theirs.final()
        for kind, values in {
            "command": {"name": "save"},
            "save_as": {"path": "other"},
            "place": {},
            "load_edits": {"text": "edits: []"},
            "scene_change": {"preserve_opacity": False},
            "scale_change": {"meters_per_unit": 0.5},
            "put_hotspot": {"title": "a", "position": [0, 0, 0]},
            "move_hotspot": {"hotspot": 1},
            "tour_path": {},
            "play_begin": {"play": 1},
            "render": {"what": "test_views", "out": "pictures"},
            "export": {"form": "ply"},
            "set_path": {"keys": []},
            "drag_begin": {"drag": 1, "edit": 1, "target": "field"},
        }.items():
            theirs.send(kind, **values)
            assert "may look but not change" in theirs.notice()["text"], kind
        theirs.send("ask", request=3, what="path")
        assert theirs.until(lambda m: m["type"] == "answer")["request"] == 3
        mine.send("scene_change", preserve_opacity=False)
        assert theirs.state(lambda state: not state["preserve_opacity"])
        mine.send("command", name="undo")
        mine.state(lambda state: state["preserve_opacity"])
    assert status_of(looker, "/edits.yaml") == 200
    origin = {"Origin": f"http://localhost:{looker.port}"}
    assert status_of(looker, "/open?name=a.ply", "POST", **origin) == 403
    assert sorted(scene.parent.iterdir()) == before


def test_requests_above_the_limit_of_connections_get_503(server: tuple[EditorServer, EditorServer]) -> None:
    editor, _ = server
    with page(editor) as (client, _), contextlib.ExitStack() as idle:
        for _ in range(MAX_CONNECTIONS):
            idle.enter_context(socket.create_connection(("127.0.0.1", editor.port), timeout=20))
        assert status_of(editor, "/") == 503
        client.send("ask", request=1, what="path")  # an open page goes on
        assert client.until(lambda m: m["type"] == "answer")["request"] == 1
        idle.close()
        end = time.monotonic() + 20.0
        while status_of(editor, "/") == 503:
            assert time.monotonic() < end, "closed connections still count"
            time.sleep(0.05)


def test_odd_origins_and_hosts_are_refused(server: tuple[EditorServer, EditorServer]) -> None:
    for headers in ({"Origin": "http://["}, {"Host": "[::1"}, {"Host": "localhost:99999999"}):
        assert status_of(server[0], "/edits.yaml", **headers) == 403


def test_wrong_tokens_are_slowed_down(server: tuple[EditorServer, EditorServer]) -> None:
    editor, _ = server  # its address stays locked for seconds: no other test of it comes after this one
    found = [status_of(editor, "/edits.yaml", Authorization=f"Bearer guess{n}") for n in range(30)]
    assert found[0] == 403 and found[-1] == 429 and 18 <= found.count(403) <= 22
    forged = {"Authorization": "Bearer guess", "X-Forwarded-For": "192.0.2.7", "X-Forwarded-Proto": "https"}
    assert status_of(editor, "/edits.yaml", **forged) == 429
    # A token of so few characters is not even looked at meanwhile, or guesses would cost nothing.
    assert status_of(editor, "/edits.yaml") == 429
    attempts = Attempts()
    assert sum(attempts.wrong("a", 0.0) for _ in range(50)) == 20
    assert attempts.is_locked("a", 1.0) and not attempts.is_locked("b", 1.0)
    assert not attempts.is_locked("a", 6.0) and attempts.wrong("a", 6.0) and not attempts.wrong("a", 6.0)
    for n in range(Attempts.MOST_ADDRESSES + 10):
        attempts.wrong(str(n), 0.0)
    assert len(attempts._buckets) == Attempts.MOST_ADDRESSES


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A certificate of localhost's and its key."""
    return certificate_of_localhost(tmp_path_factory.mktemp("tls"))


@pytest.fixture
def another(tmp_path: Path) -> Path:
    """A scene folder that no other editor has open."""
    ball_scene().save(tmp_path / "scene")
    return tmp_path / "scene"


@pytest.mark.nightly
def test_pages_over_tls(another: Path, certificate: tuple[Path, Path]) -> None:
    file, key = certificate
    trusting = ssl.create_default_context(cafile=str(file))
    with editor_server(another, "--certificate", str(file), "--certificate-key", str(key)) as server:
        assert server.link.startswith("https://localhost:")
        place = f"https://localhost:{server.port}"
        asked = urllib.request.Request(place + "/edits.yaml", headers=server.headers)
        assert b"edits" in urllib.request.urlopen(asked, context=trusting).read()
        connection = http.client.HTTPSConnection("localhost", server.port, context=trusting)
        connection.request("GET", f"/?token={server.token}")
        assert "Secure" in str(connection.getresponse().headers["Set-Cookie"])
        with connect(
            f"wss://localhost:{server.port}/socket",
            ssl=trusting,
            origin=place,  # type: ignore[arg-type]
            additional_headers={"Cookie": f"cagefield_{server.port}={server.token}"},
        ) as client:
            assert json.loads(client.recv(30))["type"] == "hello"
        with pytest.raises((urllib.error.URLError, ConnectionError)):
            urllib.request.urlopen(f"http://localhost:{server.port}/", timeout=20)


@pytest.mark.nightly
def test_certificates_that_are_none(
    scene: Path, certificate: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, key = certificate
    Certificate(file, key)
    line = refused(capsys, "view", scene, "--certificate", file)
    assert f"{file}: no certificate with its key" in line
    assert "No such file" in refused(capsys, "view", scene, "--certificate", tmp_path / "none.pem")
    assert "give that too" in refused(capsys, "view", scene, "--certificate-key", key)


@pytest.mark.nightly
def test_a_token_from_a_file(another: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "token"
    file.write_text("a-token-of-mine\n")
    with editor_server(another, "--token-file", str(file)) as server:
        assert server.token == "a-token-of-mine"
        children = server.children()
        server.kill()
        end = time.monotonic() + 60.0
        while any(_runs(child) for child in children):
            assert time.monotonic() < end, "processes outlived a killed server"
            time.sleep(0.05)
    file.write_text("short")
    assert f"--token-file {file} is too short" in refused(capsys, "view", another, "--token-file", file)
    assert "No such file" in refused(capsys, "view", another, "--token-file", tmp_path / "none")
    assert "exclude each other" in refused(
        capsys, "view", another, "--token", "long-enough", "--token-file", file
    )


def _runs(process: int) -> bool:
    try:
        return ") Z" not in Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return False
