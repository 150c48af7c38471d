"""The editor's page in headless Chromium, as a test drives it: mouse, keys, and what is on the screen."""

from __future__ import annotations

import contextlib
import io
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from chromium import chromium_context

PATIENCE = 120.0
"""Seconds until what does not come is given up: the first pictures wait for kernels to compile."""

DRAWN_BY: str | None = None
"""Who draws pages that are opened without saying so: the server where the page has no GPU, `page` with
`pytest --page-renderer`."""

USUAL = (
    "ReadPixels",
    "CONTEXT_LOST",
    "Context Lost",
    "Context Restored",
    "ERR_CONNECTION_REFUSED",
    "status of 400",
)
"""Chromium's own words on the console where pictures are read back, where a test takes the GPU's context or
the server away, and where the server refuses a file."""

Point = tuple[float, float]


def asking(link: str, render: str) -> str:
    """The editor's link that says who draws."""
    return f"{link}{'&' if '?' in link else '?'}render={render}"


def _asked(link: str) -> str:
    return link if DRAWN_BY is None or "render=" in link else asking(link, DRAWN_BY)


@dataclass
class EditorPage:
    """An open page of the editor."""

    page: Any

    def until(self, condition: str, seconds: float = PATIENCE) -> None:
        """Waits until an expression in the page is true; its policy forbids waiting inside it."""
        begun = time.monotonic()
        while not self.page.evaluate(condition):
            waited = time.monotonic() - begun
            assert waited < seconds, f"never came true: {condition}; {self.page.evaluate(_SUMMARY)}"
            # To ask costs milliseconds of a processor that the page and its server need.
            time.sleep(min(0.05 + 0.1 * waited, 0.25))

    def ready(self) -> None:
        """Waits for the server's state and a whole picture."""
        self.until("Boolean(window.cagefield && window.cagefield.now.state)")
        self.settle()

    def settle(self) -> None:
        """Waits for the whole picture of what is to be seen."""
        self.until(
            "cagefield.settled"
            " && cagefield.picture.full_width === document.querySelector('.view').clientWidth"
        )

    @property
    def state(self) -> dict[str, Any]:
        """The server's state as the page knows it."""
        return cast(dict[str, Any], self.page.evaluate("cagefield.now.state"))

    @property
    def edits(self) -> list[dict[str, Any]]:
        """The edits, without the errors of their lattices, which are measured later."""
        return [{**edit, "lattice_error": None} for edit in self.state["edits"]]

    @property
    def edit(self) -> dict[str, Any]:
        """The selected edit."""
        state = self.state
        return next(edit for edit in state["edits"] if edit["id"] == state["selected"])

    def changed(self, action: Any) -> dict[str, Any]:
        """The state after an action that made an entry of the history, or went to another one."""
        before = self.state
        action()
        self.until(
            f"cagefield.drag === null && (cagefield.now.state.entry !== {before['entry']}"
            f" || cagefield.now.state.saved !== {str(before['saved']).lower()}"
            f" || cagefield.now.state.selected !== {before['selected'] or 'null'})"
        )
        self.settle()
        return self.state

    def load(self, file: Path) -> dict[str, Any]:
        """The state after an edit file was loaded."""
        return self.changed(lambda: self.page.set_input_files("input[type=file]", file))

    def loaded(self, file: Path) -> EditorPage:
        """The page with the edits of a file, the last one selected, in Edit mode."""
        self.load(file)
        self.tools(mode="edit", tool="translate", axes="world")
        return self

    def fill(self, label: str, value: float, axis: str = "x") -> dict[str, Any]:
        """The state after a number was typed into a field of the panel."""

        def type_in() -> None:
            field = (
                self.page.locator(".pane .tp-lblv", has_text=label).locator("input").nth("xyz".index(axis))
            )
            field.fill(str(value))
            field.press("Enter")

        return self.changed(type_in)

    def said(self, words: str) -> str:
        """The line that the page shows, once it has these words."""
        self.until(f"document.querySelector('.status .message').textContent.includes({words!r})")
        return cast(str, self.page.inner_text(".status .message"))

    def tab(self, link: str) -> EditorPage:
        """One more page of the same browser."""
        page = self.page.context.new_page()
        page.goto(_asked(link))
        return EditorPage(page)

    def press(self, *keys: str) -> None:
        for key in keys:
            self.page.keyboard.press(key)

    def tools(self, **wanted: str) -> None:
        """Sets the page's tools by its buttons: tool="rotate", mode="edit", axes="cage", cage="outer"."""
        for name, value in wanted.items():
            self.page.click(f".tools .{name}-{value}")

    def part(self, kind: str, index: int, cage: str = "deformed") -> Point:
        """Where a corner, an edge or a face of the selected edit's cage is in the window."""
        at = self.page.evaluate(
            f"cagefield.screen(cagefield.now.state.selected, '{kind}', {index}, '{cage}')"
        )
        return at["x"], at["y"]

    def grip(self, axis: str) -> Point:
        """Where the gizmo's handle is taken hold of."""
        at = self.page.evaluate(f"cagefield.grip('{axis}')")
        assert at is not None, f"the gizmo has no handle {axis} that the mouse could reach"
        return at["x"], at["y"]

    @contextlib.contextmanager
    def held(self, start: Point, by: Point, steps: int = 4) -> Iterator[None]:
        """With the left button held: the mouse has moved from `start` by some pixels."""
        mouse = self.page.mouse
        mouse.move(*start)
        mouse.down()
        for n in range(1, steps + 1):
            mouse.move(start[0] + by[0] * n / steps, start[1] + by[1] * n / steps)
        try:
            yield
        finally:
            mouse.up()

    def drag(self, start: Point, by: Point) -> dict[str, Any]:
        """The selected edit after a drag."""

        def move() -> None:
            with self.held(start, by):
                pass

        self.changed(move)
        return self.edit

    def pixels(self, cages: bool = False) -> NDArray[np.float64]:
        """The picture on the screen [H,W,3] in [0,1]; the cages are taken off for it, unless wanted, and what
        the page says of actions before."""
        self.page.bring_to_front()
        self.page.evaluate("document.querySelector('.toasts').style.visibility = 'hidden'")
        if not cages:
            self.press("Shift+O")
            self.until("!cagefield.now.cages")
        self.page.mouse.move(2, 2)
        self.page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        image = Image.open(io.BytesIO(self.page.screenshot(clip=self.box)))
        self.page.evaluate("document.querySelector('.toasts').style.visibility = ''")
        if not cages:
            self.press("Shift+O")
        return np.asarray(image.convert("RGB"), dtype=np.float64) / 255.0

    @property
    def box(self) -> dict[str, float]:
        """The canvas in the window."""
        return cast(dict[str, float], self.page.locator("canvas").bounding_box())


@contextlib.contextmanager
def editor_page(
    link: str, width: int = 640, height: int = 460, *, touch: bool = False, usual: tuple[str, ...] = USUAL
) -> Iterator[EditorPage]:
    """A page of the editor; skips without Chromium. Errors and words on the console fail the test."""
    complaints: list[str] = []
    with chromium_context(
        viewport={"width": width, "height": height},
        permissions=["clipboard-read", "clipboard-write"],
        has_touch=touch,
        is_mobile=touch,
    ) as context:
        page = context.new_page()
        page.on("dialog", lambda dialog: dialog.accept())
        context.on("weberror", lambda error: complaints.append(str(error.error)))
        context.on("console", lambda said: complaints.append(said.text))
        page.goto(_asked(link))
        yield EditorPage(page)
    left = [said for said in complaints if not any(word in said for word in usual)]
    assert left == [], left


_SUMMARY = (
    "JSON.stringify([cagefield.now.connection, cagefield.now.notice, cagefield.now.state?.revision,"
    " cagefield.picture, cagefield.camera.seq, cagefield.drag, cagefield.quiet, cagefield.page,"
    " cagefield.now.state?.pictured, document.querySelector('.status')?.textContent])"
)
