"""Opens and closes pages again and again, and measures what stays: heap, GPU's objects, processes' memory.

python -m benchmarks.page_cycles [--cycles 100] [-o benchmarks/results/page_cycles.md]

On tiny scenes with an edit, of voxels and of splats: the editor (voxels) with `?render=page`, whose view is
turned until the page has drawn it, and the pages of `cagefield export`. One tab goes there and back to an
empty page; memory is read after garbage was collected. Then one renderer after the other in a page that
stays, each disposed of.
"""

from __future__ import annotations

import dataclasses
import math
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from playwright.sync_api import Page, sync_playwright

from benchmarks.common.chromium_flags import SOFTWARE_FLAGS
from benchmarks.common.machine import cpu_model
from cagefield.fields.splat_field import SplatField
from cagefield.pages.scene_page import ScenePage
from cagefield.scene.scene import Scene
from chromium import CHROMIUM
from editor_page import asking
from field_page import FieldPage, field_page
from gpu_objects import COUNT
from page_fields import lumps_scene
from splat_scenes import random_splats

PATIENCE = 180.0
Row = dict[str, float]


@dataclass
class PageCycles:
    """Measure what stays of pages that were closed."""

    cycles: int = 100
    out: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """File to write the table to, as well."""

    def run(self) -> None:
        """Prints the tables."""
        scene, splats = lumps_scene(), splats_scene()
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch) / "lumps"
            scene.save(folder)
            file = Path(scratch) / "lumps.html"
            file.write_text(ScenePage.build(scene, "lumps").one_file(), encoding="utf-8")
            editor, exported = self._editor(folder), self._pages(file.as_uri(), exported_page, ())
            file.write_text(ScenePage.build(splats, "splats").one_file(), encoding="utf-8")
            exported_splats = self._pages(file.as_uri(), exported_page, ())
        parts = [
            "# Pages that are opened and closed",
            f"## The editor, drawn by the page, {self.cycles} times\n\n{table(editor)}",
            f"## An exported page, {self.cycles} times\n\n{table(exported)}",
            f"## An exported page of splats, {self.cycles} times\n\n{table(exported_splats)}",
            f"## A renderer in a page that stays, {self.cycles} times\n\n{table(self._renderers(scene))}",
            f"## One of splats, {self.cycles} times\n\n{table(self._renderers(splats))}",
            "- Heap: of the tab, after garbage was collected. MB: resident (shared pages in parts), of all "
            "processes of the browser; of the server and its rendering process.\n"
            "- Slope: of the last three quarters, a hundred times.\n"
            f"- {cpu_model()}, Chromium drawing in software. `python -m benchmarks.page_cycles`",
        ]
        text = "\n\n".join(parts) + "\n"
        print(text)
        if self.out is not None:
            self.out.write_text(text)

    def _editor(self, scene: Path) -> list[Row]:
        server = subprocess.Popen(
            [sys.executable, "-m", "cagefield", "view", str(scene), "--port", "0", "--no-browser"],
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            assert server.stdout is not None
            link = re.search(r"http://\S+", server.stdout.readline())
            assert link is not None
            return self._pages(asking(link.group(0), "page"), editor, (server.pid,))
        finally:
            server.terminate()
            server.wait(30)

    def _pages(self, link: str, used: Callable[[Page], None], servers: tuple[int, ...]) -> list[Row]:
        """A row for each tenth of the cycles."""
        rows = []
        with sync_playwright() as playwright:
            running = playwright.chromium.launch(executable_path=CHROMIUM, args=SOFTWARE_FLAGS)
            page = running.new_page(viewport={"width": 500, "height": 420})
            page.add_init_script(f"({COUNT})()")
            session = page.context.new_cdp_session(page)
            for cycle in range(1, self.cycles + 1):
                page.goto(link)
                used(page)
                objects = sum(page.evaluate("({...gpuObjects})").values())
                page.evaluate("try { sessionStorage.clear() } catch {}")
                page.goto("about:blank")
                if cycle % max(1, self.cycles // 10) == 0 or cycle == 1:
                    session.send("HeapProfiler.collectGarbage")
                    rows.append(
                        {
                            "cycle": cycle,
                            "heap, MB": heap(session),
                            "objects while open": objects,
                            "browser, MB": memory(browsers()),
                        }
                    )
                    if servers:
                        rows[-1]["server, MB"] = memory(processes_of(servers[0]))
                        rows[-1]["threads"] = sum(threads(pid) for pid in processes_of(servers[0]))
                    print(rows[-1], file=sys.stderr, flush=True)
            running.close()
        return rows

    def _renderers(self, scene: Scene) -> list[Row]:
        camera = scene.cameras["test"][0].resized(60, 60)
        rows = []
        made = ScenePage.build(scene, "scene").files
        field, edits = made["field"], made["edits"]
        with field_page(splats=isinstance(scene.field, SplatField)) as page:
            page.page.evaluate(COUNT)
            session = page.page.context.new_cdp_session(page.page)
            for cycle in range(1, self.cycles + 1):
                renderer_cycle(page, field, edits, camera)
                if cycle % max(1, self.cycles // 10) == 0 or cycle == 1:
                    session.send("HeapProfiler.collectGarbage")
                    rows.append(
                        {
                            "cycle": cycle,
                            "heap, MB": heap(session),
                            "objects": sum(page.page.evaluate("({...gpuObjects})").values()),
                            "browser, MB": memory(browsers()),
                        }
                    )
        return rows


def splats_scene() -> Scene:
    """Random splats, enough that a worker sorts them, some of them moved."""
    scene, field = lumps_scene(), random_splats(40_000, degree=1)
    return dataclasses.replace(scene, field=dataclasses.replace(field, log_scales=field.log_scales - 2.5))


def renderer_cycle(page: FieldPage, field: bytes, edits: bytes, camera: Any) -> None:
    """A renderer that loads, draws with edits and is disposed of."""
    page.page.evaluate("() => { window.r = new r.constructor(gl); }")
    page.load(field)
    page.edit(edits)
    page.draw(camera)
    page.page.evaluate("r.dispose()")


def editor(page: Page) -> None:
    """Waits until the page has drawn the view that is turned."""
    until(page, "Boolean(window.cagefield && cagefield.now.state) && cagefield.page.draws")
    page.keyboard.press("n")
    page.keyboard.press("Shift+O")
    until(page, "cagefield.settled")
    page.mouse.move(120, 330)
    page.mouse.down()
    end = time.monotonic() + PATIENCE
    while page.evaluate("cagefield.page.drawn") < 2:
        page.mouse.move(150 + 30 * math.sin(3.0 * time.monotonic()), 335)
        assert time.monotonic() < end, page.evaluate("cagefield.page.why")
    page.mouse.up()
    until(page, "cagefield.settled")


def exported_page(page: Page) -> None:
    """Waits for the whole picture."""
    until(
        page, "Boolean(window.cagefieldViewer?.viewer?.renderer?.level?.last && cagefieldViewer.viewer.whole)"
    )


def until(page: Page, condition: str) -> None:
    end = time.monotonic() + PATIENCE
    while not page.evaluate(condition):
        assert time.monotonic() < end, condition
        time.sleep(0.02)


def heap(session: Any) -> float:
    return float(session.send("Runtime.getHeapUsage")["usedSize"]) / 1e6


def browsers() -> list[int]:
    """The processes of the browser that this one has started."""
    return [
        pid
        for pid in processes_of(os.getpid())
        if Path(f"/proc/{pid}/comm").read_text().startswith(("chrom", "google-chrom"))
    ]


def processes_of(pid: int) -> list[int]:
    """A process and all that it has started."""
    found = [pid]
    for path in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in path.read_text().split():
            found += processes_of(int(child))
    return found


def memory(pids: Iterable[int]) -> float:
    """Megabytes of their own, shared ones in parts."""
    total = 0
    for pid in pids:
        try:
            text = Path(f"/proc/{pid}/smaps_rollup").read_text()
        except OSError:
            continue
        total += int(re.search(r"^Pss:\s+(\d+)", text, re.M).group(1))  # type: ignore[union-attr]
    return total * 1024 / 1e6


def threads(pid: int) -> int:
    return len(list(Path(f"/proc/{pid}/task").iterdir()))


def table(rows: list[Row]) -> str:
    """Rows, and by how much each column grows."""
    names = list(rows[0])
    late = rows[len(rows) // 4 :]
    slopes = [
        100 * np.polyfit([row["cycle"] for row in late], [row[name] for row in late], 1)[0]
        if len(late) > 1
        else 0.0
        for name in names[1:]
    ]
    lines = [f"| {' | '.join(names)} |", "| ---: " * len(names) + "|"]
    lines += [f"| {' | '.join(f'{row[name]:.4g}' for name in names)} |" for row in rows]
    lines.append(f"| slope | {' | '.join(f'{slope:+.2g}' for slope in slopes)} |")
    return "\n".join(lines)


if __name__ == "__main__":
    tyro.cli(PageCycles).run()
