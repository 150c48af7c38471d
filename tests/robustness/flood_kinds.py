"""Pages and programs that flood an editor."""

from __future__ import annotations

import contextlib
import http.client
import itertools
import json
import socket
import ssl
import threading
import time
from collections.abc import Callable, Iterator

from websockets.sync.client import ClientConnection, connect

from editor_server import EditorAt, trusting_all

Flood = Callable[[EditorAt, threading.Event], None]
"""Floods an editor until the event is set."""


@contextlib.contextmanager
def _socket(server: EditorAt) -> Iterator[ClientConnection]:
    origin = f"{server.scheme}://localhost:{server.port}"
    cookie = {"Cookie": f"cagefield_{server.port}={server.token}"}
    encrypted = server.scheme == "https"
    with connect(
        f"{'wss' if encrypted else 'ws'}://localhost:{server.port}/socket",
        ssl=trusting_all() if encrypted else None,
        origin=origin,  # type: ignore[arg-type]
        max_size=None,
        additional_headers=cookie,
        close_timeout=1,
        ping_interval=None,
    ) as client:
        yield client


def _sending(content: Callable[[int], str | bytes], pause: float = 0.0) -> Flood:
    """Sends messages as fast as they are taken; opens another socket when it is closed."""

    def flood(server: EditorAt, over: threading.Event) -> None:
        number = 0
        while not over.is_set():
            with contextlib.suppress(Exception), _socket(server) as client:
                threading.Thread(target=_read, args=(client,), daemon=True).start()
                while not over.is_set():
                    client.send(content(number))
                    number += 1
                    if pause:
                        time.sleep(pause)

    return flood


def _always(content: str | bytes) -> Callable[[int], str | bytes]:
    return lambda _: content


def _read(client: ClientConnection) -> None:
    with contextlib.suppress(Exception):
        for _ in client:
            pass


def _edits(count: int, operations: int) -> str:
    edit = {
        "inner": {"center": [0, 0, 0], "size": 1},
        "outer": {"margin": 0.5},
        "operations": [{"translate": [1e-6, 0, 0]}] * operations,
    }
    return json.dumps({"type": "load_edits", "text": json.dumps({"edits": [edit] * count})})


def page_line(server: EditorAt, *, waiting: bool = True) -> socket.socket:
    """A page's socket, whose line back is small; no message has been read from it."""
    place = f"localhost:{server.port}"
    head = (
        f"GET /socket HTTP/1.1\r\nHost: {place}\r\nOrigin: {server.scheme}://{place}\r\n"
        f"Cookie: cagefield_{server.port}={server.token}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    )
    line = socket.socket()
    line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    line.settimeout(20)
    line.connect(("127.0.0.1", server.port))
    if server.scheme == "https":
        line = trusting_all().wrap_socket(line, server_hostname="localhost")
    line.sendall(head.encode())
    answer = b""
    while waiting and not answer.endswith(b"\r\n\r\n"):  # what comes before it would be passed over
        part = line.recv(1)
        if not part:
            raise ConnectionResetError("the page was not let in")
        answer += part
    return line


def frame(kind: int, content: bytes) -> bytes:
    """A frame of a page's, of fewer than 126 bytes; its mask changes nothing."""
    return bytes([kind, 0x80 | len(content), 0, 0, 0, 0]) + content


def _never_reading(content: bytes, pages: int = 20) -> Flood:
    """Pages that send messages with answers and read none: their receive buffers are small, and stay full."""

    def flood(server: EditorAt, over: threading.Event) -> None:
        lines: list[socket.socket | None] = [None] * pages
        while not over.is_set():
            for number, line in enumerate(lines):
                try:
                    if line is None:
                        line = page_line(server)
                        line.setblocking(False)
                        lines[number] = line
                    line.send(content * 50)
                except (BlockingIOError, ssl.SSLWantWriteError):  # full
                    pass
                except OSError:  # closed: another page
                    lines[number] = None
            time.sleep(0.05)
        for line in lines:
            if line is not None:
                line.close()

    return flood


def _beginning(start: bytes) -> Flood:
    """Opens lines that say this much and no more, and holds the newest 600."""

    def flood(server: EditorAt, over: threading.Event) -> None:
        lines: list[socket.socket] = []
        while not over.is_set():
            with contextlib.suppress(OSError):
                line = socket.create_connection(("127.0.0.1", server.port), timeout=5)
                line.sendall(start)
                lines.append(line)
            if len(lines) > 600:
                lines.pop(0).close()
        for line in lines:
            line.close()

    return flood


def _screenshots(server: EditorAt, over: threading.Event) -> None:
    """Pictures of the newest page; every second client hangs up while its picture is made."""
    for number in itertools.count():
        if over.is_set():
            return
        with contextlib.suppress(OSError, http.client.HTTPException):
            client = http.client.HTTPConnection("localhost", server.port, timeout=20)
            client.request("GET", "/screenshot.png", headers=server.headers)
            if number % 2:
                client.getresponse().read()
            else:
                time.sleep(0.01)
            client.close()


def _wrong_tokens(server: EditorAt, over: threading.Event) -> None:
    number = 0
    while not over.is_set():
        number += 1
        with contextlib.suppress(OSError, http.client.HTTPException):
            client = http.client.HTTPConnection("localhost", server.port, timeout=20)
            client.request("GET", "/edits.yaml", headers={"Authorization": f"Bearer {number:040}"})
            client.getresponse().read()
            client.close()


FLOODS: dict[str, Flood] = {
    "small messages": _sending(lambda _: '{"type": "presented", "picture": 1}'),
    "messages that are none": _sending(lambda number: '{"type": "x' + "y" * (number % 5000) + '"}'),
    "binary messages": _sending(_always(bytes(1 << 16))),
    "messages of a megabyte": _sending(_always('{"type": "' + "x" * 1_000_000 + '"}')),
    "edit files of 300 edits": _sending(_always(_edits(300, 1))),
    "edits of 2,000 operations": _sending(_always(_edits(1, 2000))),
    "changes that all pages are told of": _sending(
        lambda number: json.dumps({"type": "scene_change", "preserve_opacity": bool(number % 2)})
    ),
    "pages that never read": _never_reading(frame(0x81, b'{"type": "nothing"}')),
    "requests half sent": _beginning(b"GET /edits.yaml HTTP/1.1\r\nHost: local"),
    "screenshots": _screenshots,
    "wrong tokens": _wrong_tokens,
}
"""The floods, by what they are of."""
