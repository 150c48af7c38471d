"""Measures the first view of `cagefield view`: from the command to a whole picture on the page.

python -m benchmarks.first_view SCENE [--before SOURCE] [-o benchmarks/results/first_view.md]

SCENE is a scene folder; SOURCE the `src` folder of another version, to compare with. Each version is started
with an empty cache of kernels, as on a newcomer's machine, and again with the one that it has made then. CPU
seconds are those of the server with its rendering process, and of the browser: alike on a busy machine.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from playwright.sync_api import sync_playwright

import cagefield
from benchmarks.common.chromium_flags import SOFTWARE_FLAGS
from benchmarks.common.machine import cpu_model
from chromium import CHROMIUM

PATIENCE = 600.0
TICK = os.sysconf("SC_CLK_TCK")


@dataclass
class FirstView:
    """Measure the first view of the editor."""

    scene: tyro.conf.Positional[Path]
    before: Path | None = None
    """The folder `src` of another version of cagefield."""
    out: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """File to write the table to, as well."""

    def run(self) -> None:
        """Prints the table."""
        now = Path(cagefield.__file__).parents[1]
        lines = [
            "| version | kernels | page, s | picture, s | whole 800x600, s | server, CPU s | page, CPU s |",
            "| --- | --- |" + " ---: |" * 5,
        ]
        for name, source in (("before", self.before), ("now", now)):
            if source is None:
                continue
            with tempfile.TemporaryDirectory() as cache:
                for kernels in ("none", "cached"):
                    cells = [f"{value:.1f}" for value in self._once(source, Path(cache))]
                    lines.append(f"| {name} | {kernels} | {' | '.join(cells)} |")
                    print(lines[-1], flush=True)
        text = "\n".join(
            [
                "# From `cagefield view` to the first whole picture",
                "",
                *lines,
                "",
                f"- {cpu_model()}. `{self._command()}`",
                "",
            ]
        )
        print(text)
        if self.out is not None:
            self.out.write_text(text)

    def _command(self) -> str:
        return "python -m benchmarks.first_view SCENE" + (" --before SOURCE" if self.before else "")

    def _once(self, source: Path, cache: Path) -> tuple[float, ...]:
        """Seconds until there is a page, a picture and a whole one; CPU seconds of server and browser."""
        environment = os.environ | {
            "PYTHONPATH": str(source),
            "XDG_CACHE_HOME": str(cache),
            "PYTHONUNBUFFERED": "1",
        }
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=CHROMIUM, args=SOFTWARE_FLAGS)
            page = browser.new_page(viewport={"width": 800, "height": 600})
            idle = cpu(chromium())
            began = time.monotonic()
            server = subprocess.Popen(
                [sys.executable, "-m", "cagefield", "view", str(self.scene), "--port", "0", "--no-browser"],
                stdout=subprocess.PIPE,
                text=True,
                env=environment,
            )
            try:
                assert server.stdout is not None
                link = re.search(r"http://\S+", server.stdout.readline())
                assert link is not None
                page.goto(link.group(0), wait_until="commit")
                found = []
                for condition in (
                    "Boolean(window.cagefield?.now?.state)",
                    "Boolean(window.cagefield?.picture)",
                    "window.cagefield?.settled === true",
                ):
                    while not page.evaluate(condition):
                        if time.monotonic() - began > PATIENCE:
                            raise SystemExit(f"never came: {condition}")
                        time.sleep(0.02)
                    found.append(time.monotonic() - began)
                return (*found, cpu(processes(server.pid)), cpu(chromium()) - idle)
            finally:
                server.terminate()
                server.wait(60)
                browser.close()


def processes(pid: int) -> list[int]:
    """A process and all that it has started."""
    found = [pid]
    for path in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in path.read_text().split():
            found += processes(int(child))
    return found


def chromium() -> list[int]:
    """The browser's processes."""
    mine = processes(os.getpid())
    return [pid for pid in mine if Path(f"/proc/{pid}/comm").read_text().startswith("chrom")]


def cpu(pids: list[int]) -> float:
    """CPU seconds of processes, and of those that they have started and that have ended."""
    total = 0.0
    for pid in pids:
        fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
        total += sum(int(field) for field in fields[11:15]) / TICK
    return total


if __name__ == "__main__":
    tyro.cli(FirstView).run()
