"""Measures the editor in headless Chromium: from the mouse's move to the presented frame that shows it.

python -m benchmarks.editor_latency SCENE [-o benchmarks/results/editor.md]

The arm of the digger is dragged up and down by the gizmo in an 800x600 window, as a continuous edit. A move
counts from the time of its mouse event to the time at which the frame after the one that drew it begins, by
the page's own clock. Moves that no picture shows, because a newer one was there, have no latency. Letting go
is measured in a window whose picture is 800x800.
"""

from __future__ import annotations

import math
import re
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from playwright.sync_api import Page, sync_playwright

from benchmarks.common.machine import cpu_model
from cagefield.compute import devices
from cagefield.errors import CagefieldError

EDITS = """\
version: 1
edits:
  - name: arm
    inner: {center: [0.68, -0.11, 0.35], size: [0.5, 0.5, 1.1]}
    outer: {margin: 0.35}
    lattice: 64
"""
FLAGS = [
    "--headless",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]
FRAME = (46, 68)
"""Width and height of the window that is not the picture, with the panel closed."""
PATIENCE = 180.0


@dataclass
class EditorLatency:
    """Measure the editor's latency on a scene of the built-in digger."""

    scene: tyro.conf.Positional[Path]
    """Scene folder; it is copied, not changed."""
    seconds: float = 8.0
    """How long the mouse drags."""
    out: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """File to write the table to, as well."""

    def run(self) -> None:
        """Prints the table.

        Raises:
            CagefieldError: there is no Chromium.
        """
        chromium = shutil.which("chromium") or shutil.which("google-chrome")
        if chromium is None:
            raise CagefieldError("no chromium on this machine; install it to measure the editor")
        with tempfile.TemporaryDirectory() as scratch, sync_playwright() as playwright:
            scene = Path(scratch) / "scene"
            shutil.copytree(self.scene, scene)
            server = subprocess.Popen(
                [sys.executable, "-m", "cagefield", "view", str(scene), "--port", "0", "--no-browser"],
                stdout=subprocess.PIPE,
                text=True,
            )
            browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
            try:
                assert server.stdout is not None
                link = re.search(r"http://\S+", server.stdout.readline())
                if link is None:
                    raise CagefieldError(f"cagefield view {self.scene} did not start")
                page = browser.new_page(viewport={"width": 800, "height": 600})
                page.goto(link.group(0))
                table = measured(page, self.seconds)
            finally:
                browser.close()
                server.terminate()
                server.wait(10)
        machine = f"{cpu_model()}, {devices.threads()} cores, pages drawn in software"
        command = "python -m benchmarks.editor_latency SCENE"
        text = f"# The editor's latency\n\n{table}\nMachine: {machine}. `{command}`\n"
        print(text)
        if self.out is not None:
            self.out.write_text(text)


def measured(page: Page, seconds: float) -> str:
    """The table."""
    until(page, "Boolean(window.cagefield && cagefield.now.state)")
    page.keyboard.press("n")
    page.set_input_files(
        "input[type=file]", {"name": "arm.yaml", "mimeType": "text/yaml", "buffer": EDITS.encode()}
    )
    until(page, "cagefield.now.state.edits.length === 1 && cagefield.now.state.selected !== null")
    page.click(".tools .mode-edit")
    settle(page)
    drag(page, 1.0)  # kernels compile, rates are measured
    settle(page)
    first = page.evaluate("cagefield.latency.moves.length")
    shown = page.evaluate("cagefield.latency.presented.length")
    drag(page, seconds)
    moves = page.evaluate(f"cagefield.latency.moves.slice({first})")
    pictures = page.evaluate(f"cagefield.latency.presented.slice({shown}).filter(p => p.drag > 0)")
    settle(page)
    page.set_viewport_size({"width": 800 + FRAME[0], "height": 800 + FRAME[1]})
    until(page, "cagefield.picture.full_width === 800 && cagefield.picture.full_height === 800")
    settle(page)
    lets_go = []
    for _ in range(3):
        let_go = drag(page, 1.0)
        finals = f"cagefield.latency.presented.filter(p => p.final && p.drag === 0 && p.time > {let_go})"
        until(page, f"{finals}.length > 0")
        final = page.evaluate(f"{finals}[0]")
        settle(page)
        assert final["fullWidth"] == 800, final
        lets_go.append(final["time"] - let_go)
    return rows(moves, pictures, lets_go)


def rows(moves: list[dict[str, Any]], pictures: list[dict[str, Any]], lets_go: list[float]) -> str:
    """The table of what was measured, milliseconds."""
    lines = np.array([m["lines"] - m["moved"] for m in moves if m["lines"] is not None])
    seen = [m for m in moves if m["presented"] is not None]
    if len(seen) < 2:
        raise CagefieldError("no picture came during the drag")

    def column(after: str, before: str) -> np.ndarray[Any, Any]:
        return np.array([m[after] - m[before] for m in seen])

    whole = column("presented", "moved")
    render, encode = (np.array([m[key] for m in seen]) for key in ("renderMs", "encodeMs"))
    decode, present = column("decoded", "received"), column("presented", "decoded")
    rest = whole - render - encode - decode - present
    span = (pictures[-1]["time"] - pictures[0]["time"]) / 1000
    table = [
        f"{len(moves)} moves, {len(seen)} pictures of {int(np.median([m['width'] for m in seen]))} pixels"
        f" width (median), {(len(pictures) - 1) / span:.1f} a second",
        "",
        "| milliseconds | median | 90% |",
        "| --- | --: | --: |",
        row("mouse move to presented cage lines", lines),
        row("mouse move to presented picture", whole),
        row("... server: rendering, map and occupancy", render),
        row("... server: encoding", encode),
        row("... page: decoding", decode),
        row("... page: drawing, to the beginning of the next frame", present),
        row("... between: socket, pacing, waiting for the picture before", rest),
        row("letting go to the whole 800x800 picture", np.array(lets_go)),
    ]
    return "\n".join(table) + "\n"


def row(name: str, values: np.ndarray[Any, Any]) -> str:
    return f"| {name} | {np.median(values):.0f} | {np.percentile(values, 90):.0f} |"


def drag(page: Page, seconds: float) -> float:
    """Drags the gizmo's z handle up and down; the page's time just before it lets go."""
    grip = page.evaluate("cagefield.grip('Z')")
    page.mouse.move(grip["x"], grip["y"])
    page.mouse.down()
    start = time.monotonic()
    while (t := time.monotonic() - start) < seconds:
        page.mouse.move(grip["x"], grip["y"] - 40 * (1 - math.cos(3.0 * t)) / 2)
        time.sleep(0.012)
    let_go = float(page.evaluate("performance.now()"))
    page.mouse.up()
    return let_go


def settle(page: Page) -> None:
    """Waits for the whole picture of the last edit."""
    until(page, "cagefield.settled && cagefield.picture.revision === cagefield.now.state.revision")


def until(page: Page, condition: str) -> None:
    end = time.monotonic() + PATIENCE
    while not page.evaluate(condition):
        if time.monotonic() > end:
            raise CagefieldError(f"the page never came to: {condition}")
        time.sleep(0.01)


if __name__ == "__main__":
    tyro.cli(EditorLatency).run()
