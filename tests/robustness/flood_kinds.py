"""Pages and programs that flood an editor."""

from __future__ import annotations

import contextlib
import http.client
import itertools
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator

from websockets.sync.client import ClientConnection, connect

from editor_server import EditorAt

Flood = Callable[[EditorAt, threading.Event], None]
"""Floods an editor until the event is set."""


@contextlib.contextmanager
def _socket(server: EditorAt) -> Iterator[ClientConnection]:
    origin = f"http://localhost:{server.port}"
    cookie = {"Cookie": f"cagefield_{server.port}={server.token}"}
    with connect(
        f"ws://localhost:{server.port}/socket",
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


def _never_reading(server: EditorAt, over: threading.Event) -> None:
    """Pages that send what has answers, and read none: their lines are small, and stay full."""
    key = f"cagefield_{server.port}={server.token}"
    head = (
        f"GET /socket HTTP/1.1\r\nHost: localhost:{server.port}\r\nOrigin: http://localhost:{server.port}\r\n"
        f"Cookie: {key}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    )
    text = b'{"type": "nothing"}'
    frame = bytes([0x81, 0x80 | len(text), 0, 0, 0, 0]) + text
    lines = []
    for _ in range(20):
        line = socket.socket()
        line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        line.connect(("127.0.0.1", server.port))
        line.sendall(head.encode())
        line.setblocking(False)
        lines.append(line)
    while not over.is_set():
        for line in lines:
            with contextlib.suppress(OSError):
                line.send(frame * 50)
        time.sleep(0.05)
    for line in lines:
        line.close()


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
    "pages that never read": _never_reading,
    "requests half sent": _beginning(b"GET /edits.yaml HTTP/1.1\r\nHost: local"),
    "handshakes half sent": _beginning(b"\x16\x03\x01"),
    "connections that never shake hands": _beginning(b""),
    "screenshots": _screenshots,
    "wrong tokens": _wrong_tokens,
}
"""The floods, by what they are of."""

ENCRYPTED = ("handshakes half sent", "connections that never shake hands")
"""Those of an editor with a certificate."""
