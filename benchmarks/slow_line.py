"""Measures when a scene shows over a slow line: first its coarse level, then all of it.

python -m benchmarks.slow_line SCENE [--mbit 10] [--latency 40] [-o benchmarks/results/slow_line.md]

SCENE is a scene folder of voxels. Chromium's own throttle slows what it loads from a server on this machine:
the folder of `cagefield export --embed`, the one file of `cagefield export`, and the editor, whose kernels an
earlier page has made ready: its server's pictures, and when the page has the coarse field and all of it.
Bytes divided by the line's rate are what no machine can beat.
"""

from __future__ import annotations

import functools
import http.server
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))


from benchmarks.common.machine import cpu_model
from benchmarks.throttled_page import throttled_page
from cagefield.pages.page_file import bytes_until
from cagefield.pages.scene_page import INDEX, NAMES, SCRIPT, ScenePage, write_folder
from cagefield.scene.scene import Scene
from editor_page import asking

PATIENCE = 300.0
LEVEL = "window.cagefieldViewer?.viewer?.renderer?.level"
DRAWN = "cagefieldViewer.viewer.whole"
FIRST = "window.cagefieldViewer?.viewer?.pictures > 0"


@dataclass
class SlowLine:
    """Measure the first pictures over a slow line."""

    scene: tyro.conf.Positional[Path]
    """Scene folder of voxels."""
    mbit: float = 10.0
    """Megabits a second."""
    latency: float = 40.0
    """Milliseconds from a request to its answer."""
    out: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """File to write the table to, as well."""

    def run(self) -> None:
        """Prints the table."""
        page = ScenePage.build(Scene.open(self.scene), "scene")
        field = page.files["field"]
        coarse = bytes_until(field, "1.")
        rows = []
        with tempfile.TemporaryDirectory() as scratch, served(Path(scratch)) as link:
            write_folder(Path(scratch) / "scene", page.folder())
            text = page.one_file()
            (Path(scratch) / "one.html").write_text(text, encoding="utf-8")
            fixed = sum((Path(scratch) / "scene" / name).stat().st_size for name in (INDEX, SCRIPT))
            rest = sum(len(data) for data in page.files.values())
            begin = (
                text.index('take("edits"')
                if "edits" in page.files
                else text.index('take("field"', text.index('take("field"') + coarse * 4 // 3 - 1000)
            )
            for name, address, first, all_ in (
                ("folder (`--embed`)", f"scene/{INDEX}", fixed + coarse, fixed + rest),
                ("one file", "one.html", begin, len(text)),
            ):
                shown = self._shown(
                    f"{link}/{address}",
                    (FIRST, f"{LEVEL}?.last && {DRAWN}"),
                )
                rows.append((name, first, shown[0], all_, shown[1]))
        with editor(self.scene) as link:
            self._shown(link, ("window.cagefield?.settled === true",))
            shown = self._shown(link, ("Boolean(window.cagefield?.picture)", "window.cagefield.settled"))
            rows.append(("editor, by the server", None, shown[0], None, shown[1]))
            shown = self._shown(
                asking(link, "page"),
                (
                    "window.cagefield?.page.why === null",
                    "window.cagefield.page.loads === 1 && window.cagefield.now.loading === null",
                ),
            )
            rows.append(("editor, drawn by the page", None, shown[0], None, shown[1]))
        table = [
            "| page | MB to the first picture | line alone, s | first, s | MB | line alone, s | whole, s |"
        ]
        table.append("| --- |" + " ---: |" * 6)
        for name, first, soon, all_, late in rows:
            cells = [self._line(first), f"{soon:.1f}", self._line(all_), f"{late:.1f}"]
            table.append(f"| {name} | {' | '.join(cells)} |")
        text = "\n".join(
            [
                f"# First pictures at {self.mbit:g} Mbit/s, {self.latency:g} ms",
                "",
                *table,
                "",
                f"- The field: {len(field) / 1e6:.2f} MB, of it the coarse level {coarse / 1e6:.2f}; "
                f"{', '.join(f'{NAMES[name]} {len(data) / 1e6:.2f}' for name, data in page.files.items())}.",
                f"- {cpu_model()}, drawn in software at 500x420. `python -m benchmarks.slow_line SCENE`",
                "",
            ]
        )
        print(text)
        if self.out is not None:
            self.out.write_text(text)

    def _line(self, size: int | None) -> str:
        return (
            " | "
            if size is None
            else f"{size / 1e6:.2f} | {size * 8 / self.mbit / 1e6 + self.latency / 1e3:.1f}"
        )

    def _shown(self, link: str, conditions: tuple[str, ...]) -> list[float]:
        """Seconds from the address to each of these conditions of the page."""
        with throttled_page(self.mbit, self.latency, (500, 420)) as (page, _):
            began, found = time.monotonic(), []
            page.goto(link, wait_until="commit")
            for condition in conditions:
                while not page.evaluate(condition):
                    if time.monotonic() - began > PATIENCE:
                        raise SystemExit(f"never came: {condition}")
                    time.sleep(0.02)
                found.append(time.monotonic() - began)
        return found


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """A web server of a folder."""

    class Handler(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *words: object) -> None:
            """Says nothing."""

    handler = functools.partial(Handler, directory=str(folder))
    server = http.server.ThreadingHTTPServer(("localhost", 0), handler)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield f"http://localhost:{server.server_address[1]}"
    server.shutdown()
    server.server_close()
    thread.join()


@contextmanager
def editor(scene: Path) -> Iterator[str]:
    """The link of an editor of a scene."""
    server = subprocess.Popen(
        [sys.executable, "-m", "cagefield", "view", str(scene), "--port", "0", "--no-browser"],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert server.stdout is not None
        found = re.search(r"http://\S+", server.stdout.readline())
        assert found is not None
        yield found.group(0)
    finally:
        server.terminate()
        server.wait(30)


if __name__ == "__main__":
    tyro.cli(SlowLine).run()
