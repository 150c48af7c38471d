"""Sockets of pages that misbehave: pings, parts and texts without end, no goodbye."""

from __future__ import annotations

import socket
import ssl
import time
from collections.abc import Iterator
from contextlib import closing, suppress
from pathlib import Path
from typing import IO

import pytest
from flood_kinds import frame, page_line
from floods import memory

from cagefield.server.web.patient_socket import MOST_PARTS
from certificates import certificate_of_localhost
from editor_server import EditorServer, editor_server, page, trusting_all
from scenes import ball_scene

FULL = (BlockingIOError, ssl.SSLWantReadError, ssl.SSLWantWriteError)


@pytest.fixture(scope="module", params=["http", "https"])
def server(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[EditorServer, Path]]:
    """An editor, plain or encrypted, and the file of what it says on stderr."""
    folder = tmp_path_factory.mktemp("sockets")
    ball_scene().save(folder / "scene")
    options: list[str] = []
    if request.param == "https":
        file, key = certificate_of_localhost(folder)
        options = ["--certificate", str(file), "--certificate-key", str(key)]
    errors: IO[str]
    with (
        (folder / "stderr").open("w") as errors,
        editor_server(folder / "scene", *options, errors=errors) as running,
    ):
        yield running, folder / "stderr"


def _received(line: socket.socket) -> bytes:
    """All that comes until the other side ends the connection."""
    content = b""
    try:
        while part := line.recv(1 << 16):
            content += part
    except OSError:  # at once
        pass
    return content


def _exchanged(line: socket.socket, wanted: int, content: bytes) -> int:
    """Sends `content`, and returns the bytes that came, once as many as wanted have."""
    line.setblocking(False)
    got, end = 0, time.monotonic() + 60
    while (content or got < wanted) and time.monotonic() < end:
        with suppress(*FULL):
            content = content[line.send(content) if content else 0 :]
        try:
            got += len(line.recv(1 << 16))
        except FULL:
            time.sleep(0.001)
    return got


def test_every_ping_is_answered_where_the_answers_are_read(server: tuple[EditorServer, Path]) -> None:
    with closing(page_line(server[0])) as line:
        assert _exchanged(line, 3000 * 127, frame(0x89, bytes(125)) * 3000) >= 3000 * 127


def test_pings_whose_answers_nobody_reads_take_no_memory(server: tuple[EditorServer, Path]) -> None:
    before, sent = memory(server[0].process.pid), 0
    with closing(page_line(server[0])) as line:
        line.setblocking(False)
        pings, end = frame(0x89, bytes(125)) * 500, time.monotonic() + 2
        while time.monotonic() < end:
            try:
                sent += line.send(pings)
            except FULL:
                time.sleep(0.001)
        with page(server[0]):  # another one is let in
            assert memory(server[0].process.pid) - before < 32 << 20
    assert sent > 1 << 20


def test_a_text_that_is_none_closes_the_socket(server: tuple[EditorServer, Path]) -> None:
    with closing(page_line(server[0])) as line:
        line.sendall(frame(0x81, b"\xff\xfe"))
        assert b"no UTF-8" in _received(line)
    assert "Traceback" not in server[1].read_text()


def test_a_message_of_too_many_parts_closes_the_socket(server: tuple[EditorServer, Path]) -> None:
    with closing(page_line(server[0])) as line:
        line.sendall(frame(0x01, b"") + frame(0x00, b"") * (MOST_PARTS + 1))
        assert b"too many parts" in _received(line)
    assert "Traceback" not in server[1].read_text()


def test_what_is_no_frame_is_no_traceback(server: tuple[EditorServer, Path]) -> None:
    """Before the server has let the page in, and after that."""
    for waiting in (False, True):
        with closing(page_line(server[0], waiting=waiting)) as line:
            # What comes before it is let in is passed over: the socket stays until pings fail, 40 s.
            line.settimeout(2)
            line.sendall(b"\xff" * 100)
            _received(line)
    assert "Traceback" not in server[1].read_text()


def test_a_client_that_says_no_goodbye_is_left(server: tuple[EditorServer, Path]) -> None:
    line = socket.create_connection(("127.0.0.1", server[0].port), timeout=20)
    if server[0].scheme == "https":
        line = trusting_all().wrap_socket(line, server_hostname="localhost")
    line.sendall(b"GET /nothing HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
    assert _received(line).startswith(b"HTTP/1.1 4")
    begun = time.monotonic()
    with socket.socket(fileno=line.detach()) as plain:  # TLS says nothing any more
        plain.settimeout(20)
        _received(plain)
    assert time.monotonic() - begun < 10  # asyncio's own: half a minute
