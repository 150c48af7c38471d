"""Exported pages in headless Chromium, without a server or with one that stops in the middle."""

from __future__ import annotations

import dataclasses
import http.server
import io
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from cagefield.cameras.camera import Camera
from cagefield.edits import EditStack
from cagefield.scene.scene import Scene
from chromium import chromium_context
from gpu_objects import COUNT
from page_fields import SIZE

SCREENSHOTS = 6
"""Most screenshots of one picture."""


@contextmanager
def shown(address: Path | str, touch: bool = False, size: int = SIZE) -> Iterator[Any]:
    """The page of a file, its first whole picture drawn, or of an address; it asks no other for anything."""
    complaints: list[str] = []
    asked: list[str] = []
    viewport = {"width": size, "height": size}
    with chromium_context(viewport=viewport, has_touch=touch, is_mobile=touch) as context:
        page = context.new_page()
        page.add_init_script(f"({COUNT})()")
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda said: complaints.append(said.text))
        page.on("request", lambda request: asked.append(request.url))
        url = address.as_uri() if isinstance(address, Path) else address
        page.goto(url, wait_until="commit")
        if isinstance(address, Path):
            settle(page)
        yield page
    assert complaints == [], complaints
    own = (url.rsplit("/", 1)[0], "data:", "blob:")
    assert [other for other in asked if not other.startswith(own)] == [], asked


def until(page: Any, condition: str, seconds: float = 120.0) -> None:
    """Waits until an expression is true; the page's policy forbids waiting inside it."""
    begun = time.monotonic()
    while not page.evaluate(condition):
        waited = time.monotonic() - begun
        assert waited < seconds, f"never came true: {condition}"
        time.sleep(min(0.05 + 0.1 * waited, 0.25))


def settle(page: Any, level: str = "level?.last") -> None:
    """Waits for the whole picture of the full level, or of a level, in `page`, a page or a frame."""
    until(page, f"Boolean(window.cagefieldViewer?.viewer?.renderer?.{level} && cagefieldViewer.viewer.whole)")
    page.evaluate(
        """document.querySelectorAll(".bar, .message, .arrived").forEach(e => e.style.visibility = "hidden")
        || new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"""
    )


def pixels(page: Any) -> NDArray[np.uint8]:
    """RGB pixels [H,W,3] of a page at rest, once two screenshots in a row are equal, of SCREENSHOTS at most.

    A page that is composed in software on a busy machine may lag behind its own canvas.
    """
    before = b""
    for _ in range(SCREENSHOTS):
        now = page.screenshot()
        if now == before:
            break
        before = now
    return np.asarray(Image.open(io.BytesIO(now)).convert("RGB"))


def rendered(scene: Scene, camera: Camera, edits: bool = True) -> NDArray[np.uint8]:
    if not edits:
        scene = dataclasses.replace(scene, edits=EditStack([]))
    frame = scene.render(camera, background=scene.background)
    assert frame is not None
    return frame.rgb8()


@contextmanager
def web_server(
    root: Path,
    cuts: Mapping[str, int],
    go_on: threading.Event,
    own: Mapping[str, threading.Event] = MappingProxyType({}),
    others: threading.Event | None = None,
) -> Iterator[str]:
    """A server of a folder; of files named in `cuts` only so many bytes come before `go_on` is set.

    Files in `own` have an event of their own, and the others wait for `others` where that is given.
    """

    class Handler(http.server.SimpleHTTPRequestHandler):
        def do_GET(self) -> None:
            path = root / self.path.split("?")[0].lstrip("/")
            data, cut = path.read_bytes(), cuts.get(path.name, 0)
            self.send_response(200)
            self.send_header("Content-Type", self.guess_type(str(path)))
            self.send_header("Content-Length", str(len(data)))
            self.end_headers()
            self.wfile.write(data[:cut])
            self.wfile.flush()
            if cut:
                own.get(path.name, others or go_on).wait(120.0)
            self.wfile.write(data[cut:])

        def log_message(self, *words: object) -> None:
            """Says nothing."""

    server = http.server.ThreadingHTTPServer(("localhost", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http://localhost:{server.server_address[1]}"
    finally:
        for event in (go_on, *own.values(), others):
            if event is not None:
                event.set()
        server.shutdown()
        server.server_close()
        thread.join()
