"""Measures the first picture of a page of millions of splats over a slow line, with and without levels.

python -m benchmarks.page_levels [--splats 5000000] [--mbit 10] [-o benchmarks/results/page_levels.md]

The scene is `splat_landscape`, or a scene folder of splats. Chromium's own throttle slows all it loads from a
server on this machine. "Received" are the bytes of all answers that the browser had when it showed the first
picture; PSNR is that of the level that it shows against the whole scene, both rendered by cagefield.
"""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import tyro

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from PIL import Image

from benchmarks.common.machine import cpu_model
from benchmarks.slow_line import served
from benchmarks.splat_landscape import landscape
from benchmarks.throttled_page import throttled_page
from cagefield.cameras.camera import Camera
from cagefield.fields.splat_field import SplatField
from cagefield.images.metrics import psnr
from cagefield.pages.page_splats import FIRST, decode_page_splats, page_order
from cagefield.pages.scene_page import INDEX, ScenePage, write_folder
from cagefield.scene.scene import Scene

PATIENCE = 600.0
FIRST_AT = """
window.firstAt = null;
const timer = setInterval(() => {
  if (!(window.cagefieldViewer?.viewer?.pictures > 0)) return;
  window.firstAt = performance.now();
  clearInterval(timer);
}, 5);
"""
"""Script that notes when the page has shown its first picture, milliseconds."""

SIZE = (500, 420)


@dataclass
class PageLevels:
    """Measure the first picture of a large page over a slow line."""

    scene: Path | None = None
    """Scene folder of splats; a landscape if left out."""
    splats: int = 5_000_000
    """Splats of the landscape."""
    degree: int = 0
    """Degree of its harmonics."""
    mbit: float = 10.0
    latency: float = 40.0
    """Megabits a second, and milliseconds from a request to its answer."""
    pictures: Path | None = None
    """Folder for the first pictures."""
    out: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """File to write the table to, as well."""

    def run(self) -> None:
        """Prints the table."""
        scene = Scene.open(self.scene) if self.scene else self._landscape()
        camera = scene.first_camera.resized(*SIZE)
        whole = scene.render(camera, background=scene.background).rgb8()
        rows = []
        for name, levels in (("with levels of detail", True), ("without", False)):
            began = time.process_time()
            page = ScenePage.build(scene, "scene", levels=levels)
            built = time.process_time() - began
            with tempfile.TemporaryDirectory() as scratch, served(Path(scratch)) as link:
                write_folder(Path(scratch) / "page", page.folder())
                size = sum(file.stat().st_size for file in (Path(scratch) / "page").iterdir())
                received, seconds = self._first(f"{link}/page/{INDEX}")
            field = decode_page_splats(page.files["field"]).field if levels else coarsest(scene.field)
            picture = Scene(field, background=scene.background).render(camera).rgb8()
            if self.pictures is not None:
                self.pictures.mkdir(exist_ok=True, parents=True)
                Image.fromarray(picture).save(self.pictures / f"levels_{levels}.png")
            rows.append(
                f"| {name} | {size / 1e6:.1f} | {received / 1e6:.2f} | {received * 8e-6 / self.mbit:.1f} "
                f"| {seconds:.1f} | {psnr(picture, whole):.1f} | {built:.0f} |"
            )
            print(rows[-1], flush=True)
        if self.pictures is not None:
            Image.fromarray(whole).save(self.pictures / "whole.png")
        text = "\n".join(
            [
                f"# First picture of {len(scene.field):,} splats at {self.mbit:g} Mbit/s",
                "",
                "| page | MB | received, MB | line alone, s | first picture, s | PSNR, dB | CPU s to write |",
                "| --- |" + " ---: |" * 6,
                *rows,
                "",
                f"- {cpu_model()}, drawn in software at {SIZE[0]}x{SIZE[1]}, measured beside other "
                "work: times are upper bounds, bytes are not. `python -m benchmarks.page_levels`",
                "",
            ]
        )
        print(text)
        if self.out is not None:
            self.out.write_text(text)

    def _landscape(self) -> Scene:
        camera = Camera.look_at((7, -12, 6), (0, 0, 0), (0, 0, 1), width=500, height=420, fov_x=0.9)
        return Scene(landscape(self.splats, self.degree), cameras={"test": (camera,)})

    def _first(self, link: str) -> tuple[int, float]:
        """(bytes received, seconds) until the first picture."""
        with throttled_page(self.mbit, self.latency, SIZE) as (page, session):
            page.add_init_script(FIRST_AT)
            times: list[tuple[float, int]] = []
            begun: list[float] = []
            session.on("Network.requestWillBeSent", lambda data: begun.append(data["timestamp"]))
            session.on(
                "Network.dataReceived", lambda data: times.append((data["timestamp"], data["dataLength"]))
            )
            began = time.monotonic()
            page.goto(link, wait_until="commit")
            while (first := page.evaluate("window.firstAt")) is None:
                if time.monotonic() - began > PATIENCE:
                    raise SystemExit("no first picture")
                time.sleep(0.2)
            page.evaluate("0")  # the events until now have arrived
        seconds = first / 1e3
        return sum(size for at, size in times if at - begun[0] <= seconds), seconds


def coarsest(field: Any) -> SplatField:
    """The splats of the first level of a page without levels of detail: those of the largest area."""
    rows = page_order(field)[:FIRST]
    names = ("means", "log_scales", "quaternions", "opacities", "sh")
    return replace(field, **{name: getattr(field, name)[rows] for name in names})


if __name__ == "__main__":
    tyro.cli(PageLevels).run()
