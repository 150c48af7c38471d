"""Pages and programs that go away in the middle: the server keeps running, and says nothing."""

from __future__ import annotations

import asyncio
import json
import logging
import socket
import struct
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from starlette.websockets import WebSocket, WebSocketDisconnect

from cagefield.server.web.launch import open_scene
from cagefield.server.web.websocket import serve_page
from editor_server import PATIENCE, EditorServer, editor_server, page
from scenes import ball_scene


def connected(server: EditorServer) -> socket.socket:
    """A connection that ends without a farewell when it is closed."""
    peer = socket.create_connection(("127.0.0.1", server.port))
    peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    return peer


def upgrade(server: EditorServer, origin: str | None = None) -> bytes:
    host = f"localhost:{server.port}"
    return (
        f"GET /socket HTTP/1.1\r\nHost: {host}\r\nOrigin: {origin or 'http://' + host}\r\n"
        f"Authorization: Bearer {server.token}\r\n"
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    ).encode()


def _get(server: EditorServer, path: str) -> bytes:
    host, token = f"localhost:{server.port}", server.token
    return f"GET {path} HTTP/1.1\r\nHost: {host}\r\nAuthorization: Bearer {token}\r\n\r\n".encode()


def frame(text: str) -> bytes:
    """A text message, masked by zeros."""
    content = text.encode()
    return b"\x81" + struct.pack(">BH", 0x80 | 126, len(content)) + bytes(4) + content


def says_nothing(_: EditorServer, __: socket.socket) -> None:
    pass


def asks_half(server: EditorServer, peer: socket.socket) -> None:
    peer.sendall(upgrade(server)[:60])


def is_refused(server: EditorServer, peer: socket.socket) -> None:
    peer.sendall(upgrade(server, "http://other.example"))


def goes_at_once(server: EditorServer, peer: socket.socket) -> None:
    peer.sendall(upgrade(server))


def says_half(server: EditorServer, peer: socket.socket) -> None:
    peer.sendall(upgrade(server) + frame('{"type": "play_end", "play": 1}')[:12])


def asks_and_goes(server: EditorServer, peer: socket.socket) -> None:
    peer.sendall(upgrade(server))
    peer.recv(400)
    pose = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 3, 0, 0, 0, 1]
    camera = {"type": "camera", "c2w": pose, "width": 64, "height": 64, "fov_y_deg": 50}
    questions = [{"type": "ask", "request": n, "what": "surface"} for n in range(20)]
    for message in ({**camera, "seq": 1}, *questions, {**camera, "seq": 2}):
        peer.sendall(frame(json.dumps(message)))
    time.sleep(0.2)


def is_too_many(server: EditorServer, peer: socket.socket) -> None:
    peer.sendall(upgrade(server))
    peer.sendall(frame('{"type": "presented", "picture": 1}') * 3000)
    time.sleep(0.2)


def downloads(server: EditorServer, peer: socket.socket) -> None:
    peer.sendall(_get(server, "/index.html"))


def wants_a_screenshot(server: EditorServer, peer: socket.socket) -> None:
    peer.sendall(_get(server, "/screenshot.png"))


VANISHING: list[Callable[[EditorServer, socket.socket], None]] = [
    says_nothing,
    asks_half,
    is_refused,
    goes_at_once,
    says_half,
    asks_and_goes,
    is_too_many,
    downloads,
    wants_a_screenshot,
]


@pytest.mark.nightly
def test_peers_that_vanish_leave_no_trace(tmp_path: Path) -> None:
    ball_scene().save(tmp_path / "ball")
    with tempfile.TemporaryFile("w+") as errors, editor_server(tmp_path / "ball", errors=errors) as server:
        with page(server) as (client, hello):
            client.look_from(hello)
            client.final()
            for _ in range(3):
                for way in VANISHING:
                    with connected(server) as peer:
                        way(server, peer)
            client.look_from(hello, 64, seq=2)
            client.until(lambda m: m["type"] == "picture" and m["camera"] == 2 and m["final"])
        with page(server) as (client, hello):
            client.look_from(hello)
            client.final()
        errors.seek(0)
        assert errors.read() == ""


def played_socket(receiving: Exception | None, sending: Exception | None) -> WebSocket:
    """A page that connects, says nothing, and goes or fails with these errors."""
    said = iter([{"type": "websocket.connect"}])

    async def receive() -> dict[str, Any]:
        for message in said:
            return message
        if receiving is not None:
            raise receiving
        await asyncio.Event().wait()
        raise AssertionError

    async def send(message: Any) -> None:
        if message["type"] == "websocket.send" and sending is not None:
            raise sending

    return WebSocket({"type": "websocket", "path": "/socket", "headers": []}, receive, send)


@pytest.mark.parametrize(
    ("receiving", "sending"),
    [
        (None, WebSocketDisconnect(1006)),
        (None, BrokenPipeError(32, "Broken pipe")),
        (None, ConnectionResetError(104, "Connection reset by peer")),
        (ConnectionResetError(104, "Connection reset by peer"), None),
    ],
)
def test_a_page_that_is_gone_is_no_error(
    tmp_path: Path, receiving: Exception | None, sending: Exception | None, caplog: pytest.LogCaptureFixture
) -> None:
    ball_scene().save(tmp_path / "ball")
    coordinator, hello = open_scene(tmp_path / "ball")
    asyncio.run(asyncio.wait_for(serve_page(played_socket(receiving, sending), coordinator, hello), PATIENCE))
    assert coordinator.pages == {} and caplog.text == ""


@pytest.mark.parametrize("error", [RuntimeError("broken"), ValueError("broken")])
def test_an_error_that_no_lost_page_explains_is_logged_and_the_page_leaves(
    tmp_path: Path, error: Exception, caplog: pytest.LogCaptureFixture
) -> None:
    ball_scene().save(tmp_path / "ball")
    coordinator, hello = open_scene(tmp_path / "ball")
    with caplog.at_level(logging.ERROR):
        asyncio.run(asyncio.wait_for(serve_page(played_socket(None, error), coordinator, hello), PATIENCE))
    assert coordinator.pages == {} and "a page's socket failed" in caplog.text and "broken" in caplog.text
