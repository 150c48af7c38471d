"""A real editor server in a process of its own, and pages that talk to it as a browser's would."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import ssl
import subprocess
import sys
import time
import urllib.parse
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from websockets.sync.client import ClientConnection, connect

PATIENCE = 120.0
"""Seconds until what does not come is given up, messages and ends: both wait for kernels to compile."""


@dataclass
class EditorAt:
    """An editor, by the link that it printed."""

    link: str

    @property
    def port(self) -> int:
        match = re.search(r":(\d+)/", self.link)
        assert match
        return int(match.group(1))

    @property
    def scheme(self) -> str:
        """ "https" where it has a certificate, else "http"."""
        return self.link.partition(":")[0]

    @property
    def token(self) -> str:
        """Token of the link, after `?token=`."""
        return urllib.parse.unquote(self.link.partition("?token=")[2])

    @property
    def headers(self) -> dict[str, str]:
        """Request headers of a program that is let in."""
        return {"Authorization": f"Bearer {self.token}"}


@dataclass
class EditorServer(EditorAt):
    """A running `cagefield view`."""

    process: subprocess.Popen[str]

    def get(self, path: str) -> Any:
        """The answer to a request for a path, such as "/edits.yaml"."""
        address = f"http://localhost:{self.port}{path}"
        return urllib.request.urlopen(urllib.request.Request(address, headers=self.headers))

    def kill(self) -> None:
        """Ends it as a crash would."""
        self.process.send_signal(signal.SIGKILL)
        self.process.wait(10)

    def children(self) -> list[int]:
        """The numbers of the processes that it has started."""
        tasks = Path(f"/proc/{self.process.pid}/task").glob("*/children")
        return [int(pid) for task in tasks for pid in task.read_text().split()]


@contextlib.contextmanager
def editor_server(scene: Path, *options: str, errors: IO[str] | None = None) -> Iterator[EditorServer]:
    """`cagefield view SCENE` on a free port; its stderr goes to a file `errors`, if one is given."""
    process = subprocess.Popen(
        [sys.executable, "-m", "cagefield", "view", str(scene), "--port", "0", "--no-browser", *options],
        stdout=subprocess.PIPE,
        stderr=errors,
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
    )
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        match = re.search(r"https?://\S+", line)
        assert match, line
        yield EditorServer(match.group(0), process)
    finally:
        process.terminate()
        process.wait(PATIENCE)


@dataclass
class Picture:
    """A picture as a page gets it."""

    header: dict[str, Any]
    content: bytes
    depth: bytes


@dataclass
class PageClient:
    """An open page: it shows every picture at once, unless told to be slow."""

    socket: ClientConnection
    slow: bool = False
    pictures: list[Picture] = field(default_factory=list)
    messages: list[dict[str, Any]] = field(default_factory=list)
    joined: dict[str, Any] = field(default_factory=dict)
    """The state that the page found."""

    def send(self, kind: str, **values: Any) -> None:
        """One message to the server."""
        self.socket.send(json.dumps({"type": kind, **values}))

    def take(self, timeout: float) -> Picture | dict[str, Any]:
        """The next message; TimeoutError where none comes."""
        content = self.socket.recv(timeout)
        if isinstance(content, str):
            self.messages.append(json.loads(content))
            return self.messages[-1]
        length = int.from_bytes(content[:4], "little")
        header = json.loads(content[4 : 4 + length])
        if header["type"] == "edits":
            self.messages.append(header)
            self.send("presented", picture=header["picture"])
            return header  # type: ignore[no-any-return]
        if header["type"] == "highlight":
            assert len(content) == 4 + length + 6 * header["count"]
            self.messages.append(header)
            return header  # type: ignore[no-any-return]
        end = 4 + length + header["picture_bytes"]
        assert len(content) == end + header["depth_bytes"]
        self.pictures.append(Picture(header, content[4 + length : end], content[end:]))
        if not self.slow:
            self.send("presented", picture=header["picture"])
        return self.pictures[-1]

    def until(self, wanted: Callable[[dict[str, Any]], bool], timeout: float = PATIENCE) -> dict[str, Any]:
        """The next message, or header of a picture, that is wanted."""
        end = time.monotonic() + timeout
        while True:
            got = self.take(max(0.0, end - time.monotonic()))
            content = got.header if isinstance(got, Picture) else got
            if wanted(content):
                return content

    def state(self, wanted: Callable[[dict[str, Any]], bool] = lambda state: True) -> dict[str, Any]:
        """The next state that is wanted."""
        return self.until(lambda m: m["type"] == "state" and wanted(m))

    def notice(self) -> dict[str, Any]:
        """The next line for the user."""
        return self.until(lambda m: m["type"] == "notice")

    def final(self) -> dict[str, Any]:
        """The header of the next last part of a whole picture."""
        return self.until(lambda m: m["type"] == "picture" and m["final"])

    def look_from(self, hello: dict[str, Any], side: int = 96, seq: int = 1, moving: bool = False) -> None:
        """Sends the start camera, its picture `side` pixels wide and high."""
        camera = hello["start"] | {"width": side, "height": side, "seq": seq, "moving": moving}
        self.send(**(camera | {"kind": camera.pop("type")}))


def trusting_all() -> ssl.SSLContext:
    """TLS context that accepts an editor's certificate, whoever has signed it."""
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    return context


@contextlib.contextmanager
def page(
    server: EditorServer, *, slow: bool = False, known: bool = True
) -> Iterator[tuple[PageClient, dict[str, Any]]]:
    """A page that has just been opened, and what it was told first; `known` has the token's cookie."""
    origin = f"{server.scheme}://localhost:{server.port}"
    cookie = {"Cookie": f"cagefield_{server.port}={server.token}"} if known else {}
    encrypted = server.scheme == "https"
    address = f"{'wss' if encrypted else 'ws'}://localhost:{server.port}/socket"
    with connect(
        address,
        origin=origin,
        max_size=None,
        additional_headers=cookie,
        ssl=trusting_all() if encrypted else None,
    ) as socket:
        client = PageClient(socket, slow)
        hello = client.until(lambda m: m["type"] == "hello")
        client.joined = client.state()
        yield client, hello
