"""Bytes on a page's socket that are no messages: the socket closes, and other pages go on."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import closing

import pytest
from flood_kinds import frame, page_line

from certificates import certificate_of_localhost
from editor_server import EditorServer, editor_server, page
from scenes import ball_scene
from tiers import nightly_after_first


@pytest.fixture(scope="module", params=nightly_after_first(["http", "https"]))
def server(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[EditorServer]:
    """An editor, plain or encrypted."""
    folder = tmp_path_factory.mktemp("sockets")
    ball_scene().save(folder / "scene")
    options: list[str] = []
    if request.param == "https":
        file, key = certificate_of_localhost(folder)
        options = ["--certificate", str(file), "--certificate-key", str(key)]
    with editor_server(folder / "scene", *options) as running:
        yield running


@pytest.mark.parametrize(
    ("content", "code"),
    [(frame(0x81, b"\xff\xfe"), 1007), (b"\xff" * 100, 1002)],
    ids=["no text", "no frame"],
)
def test_bytes_that_are_no_message_close_the_socket(server: EditorServer, content: bytes, code: int) -> None:
    with page(server) as (other, _):
        with closing(page_line(server)) as line:
            line.sendall(content)
            assert code.to_bytes(2, "big") in _received(line)
        other.send("ask", request=1, what="path")
        assert other.until(lambda m: m["type"] == "answer")["request"] == 1


def _received(line: socket.socket) -> bytes:
    """All bytes until the other side ends the connection."""
    content = b""
    while part := line.recv(1 << 16):
        content += part
    return content
