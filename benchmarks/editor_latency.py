"""Latency of the first drags in a fresh editor, in headless Chromium whose page draws in software.

python -m benchmarks.editor_latency SCENE... [--repeats 5] [-o benchmarks/results/editor.md]

Each repetition starts `cagefield view`, waits for the first whole picture, adds a cage around the middle of
the content, and drags it up, down, up by the gizmo: 1.5 s with ten moves of the mouse, then until the final
picture. Kernels are cached on disk, as from a second start on (`--empty-cache`: none are), and so is the
field's light, as `cagefield train` and `import` leave it (`--unlit`: it is not); patches are not. A move
counts from its mouse event to the frame after the one that drew its picture, by the page's clock. After
letting go the whole picture without light counts, then the final one.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tyro
from playwright.sync_api import Page, sync_playwright

import cagefield
from benchmarks.common.chromium_flags import GPU_FLAGS, SOFTWARE_FLAGS
from benchmarks.common.machine import cpu_model
from cagefield.compute import devices
from cagefield.errors import CagefieldError
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.scene.scene import Scene
from cagefield.server.editor.session import LATTICE

Kind = Literal["continuous", "discrete"]

WINDOW = 1104, 850
"""Width and height of the window; the picture is 1058x782, with the panel closed."""
DRAGS, DRAG_SECONDS, DRAG_PX = 3, 1.5, 40
PATIENCE = 300.0

PREPARATION = (
    "import sys; from cagefield.cli.edit_preparation import prepare_edits; prepare_edits(sys.argv[1])"
)
"""Program that does what the commands that make scenes do last."""


@dataclass
class Drag:
    """One drag: milliseconds from its first move to the first picture of it, and after letting go."""

    pictures: int
    width: int
    """Median width of the moving pictures, pixels; 0 without any."""
    first: float
    """First moving picture after the first move; NaN where none came before letting go."""
    whole: float
    """First whole picture in full resolution after letting go."""
    final: float


@dataclass
class EditorLatency:
    """Measure the first drags of a fresh editor."""

    scenes: tyro.conf.Positional[list[Path]]
    """Scene folders; they are copied, not changed."""
    repeats: int = 5
    moves: int = 10
    """Moves of the mouse in a drag; 90 are those of a mouse that is read 60 times a second."""
    kinds: tuple[Kind, ...] = ("continuous", "discrete")
    empty_cache: bool = False
    """Start each repetition without compiled kernels."""
    unlit: bool = False
    """Start each repetition without the field's light."""
    pause: float = 0.0
    """Seconds between the cage and the first drag, in which a user looks at it."""
    gpu: bool = False
    """The page draws with the GPU by Vulkan, in place of software."""
    source: Path | None = None
    """Folder `src` of another version of cagefield, to compare with."""
    out: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """File to write the table to, as well."""
    pictures: Path | None = None
    """Folder for screenshots of each whole and final picture of the last repetition."""

    def run(self) -> None:
        """Prints the table.

        Raises:
            CagefieldError: there is no Chromium.
        """
        chromium = shutil.which("chromium") or shutil.which("google-chrome")
        if chromium is None:
            raise CagefieldError("no chromium on this machine; install it to measure the editor")
        lines = [
            "| scene, edit | drag | pictures a second | their width | first picture, ms | whole picture, ms |"
            " final picture, ms |",
            "| --- | --- |" + " --: |" * 5,
        ]
        print("\n".join(lines), flush=True)
        for scene in self.scenes:
            for kind in self.kinds:
                with tempfile.TemporaryDirectory() as cache:
                    runs = [self.once(scene, kind, Path(cache), chromium) for _ in range(self.repeats + 1)][
                        1:
                    ]
                for number in range(DRAGS):
                    lines.append(row(f"{scene.name}, {kind}", number, [drags[number] for drags in runs]))
                    print(lines[-1], flush=True)
        drawn = "by the GPU" if self.gpu else "in software"
        machine = f"{cpu_model()}, {devices.threads()} cores; page drawn {drawn}, 1058x782"
        command = (
            "python -m benchmarks.editor_latency SCENE..."
            + (" --empty-cache" if self.empty_cache else "")
            + (" --unlit" if self.unlit else "")
            + (f" --pause {self.pause:g}" if self.pause else "")
            + (f" --moves {self.moves}" if self.moves != EditorLatency.moves else "")
        )
        notes = f"Medians of {self.repeats} fresh editors; longest in brackets. {machine}. `{command}`"
        text = "\n".join(["# Latency of the first drags", "", *lines, "", notes, ""])
        print(notes)
        if self.out is not None:
            self.out.write_text(text)

    def once(self, scene: Path, kind: Kind, cache: Path, chromium: str) -> list[Drag]:
        """The drags of one fresh editor; kernels stay in the `cache`, patches do not."""
        for folder in cache.glob("cagefield" if self.empty_cache else "cagefield/patches"):
            shutil.rmtree(folder)
        environment = os.environ | {"XDG_CACHE_HOME": str(cache), "PYTHONUNBUFFERED": "1"}
        if self.source is not None:
            if not (self.source / "cagefield").is_dir():
                raise CagefieldError(
                    f"{self.source} holds no package cagefield; give the src folder of a version"
                )
            environment["PYTHONPATH"] = str(self.source)
        with tempfile.TemporaryDirectory() as scratch, sync_playwright() as playwright:
            copy = Path(scratch) / "scene"
            shutil.copytree(scene, copy)
            if not self.unlit:
                subprocess.run([sys.executable, "-c", PREPARATION, str(copy)], check=True, env=environment)
            (copy / "edits.yaml").write_text("version: 1\nedits: []\n")
            server = subprocess.Popen(
                [sys.executable, "-m", "cagefield", "view", str(copy), "--port", "0", "--no-browser"],
                stdout=subprocess.PIPE,
                text=True,
                env=environment,
            )
            flags = GPU_FLAGS if self.gpu else SOFTWARE_FLAGS
            browser = playwright.chromium.launch(executable_path=chromium, args=flags)
            try:
                assert server.stdout is not None
                link = re.search(r"http://\S+", server.stdout.readline())
                if link is None:
                    raise CagefieldError(f"cagefield view {scene} did not start")
                page = browser.new_page(viewport={"width": WINDOW[0], "height": WINDOW[1]})
                page.goto(link.group(0), wait_until="commit")
                open_cage(page, cage_file(copy, kind))
                time.sleep(self.pause)
                return [self.measure(page, f"{scene.name}_{kind}_{n}", n) for n in range(DRAGS)]
            finally:
                browser.close()
                server.terminate()
                server.wait(60)

    def measure(self, page: Page, name: str, number: int) -> Drag:
        """One drag with the gizmo's z handle, up and down in turn, until its final picture is shown."""
        direction = 1 - 2 * (number % 2)
        grip = page.evaluate("cagefield.grip('Z')")
        if grip is None:
            raise CagefieldError("the gizmo's handle is out of view")
        before = page.evaluate("cagefield.latency.presented.length")
        began = page.evaluate("cagefield.latency.moves.length")
        page.mouse.move(grip["x"], grip["y"])
        page.evaluate(SHOWN)
        page.mouse.down()
        for n in range(1, self.moves + 1):
            page.mouse.move(grip["x"], grip["y"] - direction * DRAG_PX * n / self.moves)
            time.sleep(DRAG_SECONDS / self.moves)
        let_go = float(page.evaluate("performance.now()"))
        page.mouse.up()
        if self.pictures is not None:
            self.pictures.mkdir(parents=True, exist_ok=True)
            until(page, f"({WHOLE})({let_go}) !== undefined")
            page.screenshot(path=self.pictures / f"{name}_whole.png")
        finals = f"cagefield.latency.presented.filter(p => p.final && p.drag === 0 && p.time > {let_go})"
        until(page, f"cagefield.settled && {finals}.at(-1)?.revision === cagefield.now.state.revision")
        final = page.evaluate(f"{finals}.at(-1)")
        whole = page.evaluate(f"({WHOLE})({let_go})")
        if self.pictures is not None:
            page.screenshot(path=self.pictures / f"{name}_final.png")
        shown = page.evaluate(f"cagefield.latency.presented.slice({before})")
        moving = [p for p in shown if p["drag"] > 0 and p["seq"] > 0 and p["time"] < let_go]
        moved = page.evaluate(f"cagefield.latency.moves.slice({began}).map(m => m.moved)")
        return Drag(
            len(moving),
            int(np.median([p["fullWidth"] for p in moving])) if moving else 0,
            moving[0]["time"] - moved[0] if moving else float("nan"),
            (whole or final)["time"] - let_go,
            final["time"] - let_go,
        )


WHOLE = (
    "t => cagefield.latency.presented.find(p => (p.whole ?? p.final) && p.drag === 0 && p.time > t"
    " && p.revision === cagefield.now.state.revision)"
)
"""First whole picture after a time, whatever it lacks: a function of the page."""

SHOWN = "() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
"""Waits until the next frame is on the screen: a handle is seen, and highlighted, before it is pressed."""


def open_cage(page: Page, edits: str) -> None:
    """Adds the cage in an editor that has just shown its first whole picture, ready to be dragged."""
    until(page, "Boolean(window.cagefield?.now?.state)")
    page.keyboard.press("n")
    until(page, "cagefield.settled")
    content = {"name": "cage.json", "mimeType": "application/json", "buffer": edits.encode()}
    page.set_input_files("input[type=file]", content)
    until(page, "cagefield.now.state.edits.length === 1 && cagefield.now.state.selected !== null")
    page.click(".tools .mode-edit")
    until(page, "cagefield.grip('Z') !== null")
    page.evaluate(SHOWN)


def cage_file(folder: Path, kind: Kind) -> str:
    """An edit file: a cage that holds the middle of the content, half as large as half of the content."""
    middle, extent = content_extent(folder)
    edit: dict[str, Any] = {
        "name": "cage",
        "inner": {"center": middle.tolist(), "size": (0.5 * extent).tolist()},
        "adjustment": kind,
    }
    if kind == "continuous":
        edit |= {"outer": {"margin": (0.25 * extent).tolist()}, "lattice": LATTICE}
    return json.dumps({"version": 1, "edits": [edit]})


def content_extent(folder: Path) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """(median [3], interquartile range [3]) of the positions of a scene's content, world units.

    Raises:
        CagefieldError: the scene's field is neither splats nor voxels.
    """
    content = Scene.open(folder).field
    if isinstance(content, SplatField):
        points = content.means[content.opacities > 0.5]
    elif isinstance(content, VoxelField):
        lower, upper = content.bounds
        points = np.random.default_rng(0).uniform(lower, upper, (200_000, 3)).astype(np.float32)
        sigma, _ = content(points, np.broadcast_to(np.float32([1, 0, 0]), points.shape))
        points = points[sigma * content.sample_spacing > 0.5]
    else:
        raise CagefieldError(f"{folder}: the editor's latency is measured on splats and voxels")
    low, middle, high = np.quantile(points.astype(np.float64), [0.25, 0.5, 0.75], axis=0)
    return middle, high - low


def row(name: str, number: int, drags: list[Drag]) -> str:
    """One drag's line of the table."""

    def cell(values: list[float]) -> str:
        if np.isnan(values).any():
            return f"none in {int(np.isnan(values).sum())} of {len(values)}"
        return f"{np.median(values):.0f} ({max(values):.0f})"

    rate = np.median([drag.pictures for drag in drags]) / DRAG_SECONDS
    width = np.median([drag.width for drag in drags])
    cells = [f"{rate:.1f}", f"{width:.0f}"]
    cells += [cell([getattr(drag, stage) for drag in drags]) for stage in ("first", "whole", "final")]
    return f"| {name} | {('first', 'second', 'third')[number]} | {' | '.join(cells)} |"


def until(page: Page, condition: str) -> None:
    """Waits for a condition of the page."""
    end = time.monotonic() + PATIENCE
    while not page.evaluate(condition):
        if time.monotonic() > end:
            raise CagefieldError(f"the page never came to: {condition}")
        time.sleep(0.01)


if __name__ == "__main__":
    print(f"cagefield {cagefield.__version__}")
    tyro.cli(EditorLatency).run()
