"""Pictures of splat files by this rasteriser, by its oracle, and by Spark in a browser.

    mkdir spark && cd spark && npm install @sparkjsdev/spark@2.2.0 three@0.180
    python benchmarks/splat_spark.py FILE... --modules spark/node_modules [--pictures DIR] [--out TABLE.md]

Each file's splats are written as one PLY that Spark reads, and are seen by three cameras around their middle,
on white and on black. Needs the test extra (Playwright) and Chromium, which draws in software. PSNR is over
the whole picture, in 8 bits for Spark; `--pictures` writes ours, Spark's and four times their difference.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import threading
from base64 import b64decode
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from cagefield.benchmarking.tables import Table, number, write_text
from cagefield.cameras import Camera
from cagefield.fields.splat import SplatField
from cagefield.formats.splat_ply import read_splat_ply, write_splat_ply
from cagefield.rendering import splat_reference
from cagefield.rendering.images import write_png
from cagefield.rendering.kernels.splat_projection import BLUR
from cagefield.rendering.splat_rasterizer import intrinsics, near_depth
from cagefield.rendering.splat_renderer import SplatRenderer
from cagefield.typing import Float32

SIZE = 400
FLAGS = [
    "--headless",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--hide-scrollbars",
]


def alike(field: SplatField) -> dict[str, float | bool]:
    """Spark's options with which it draws what we do.

    Its own are the antialiased filter whatever the file says, splats that end at sqrt(8) sigmas, and an order
    by distance; 3DGS' renderer, and ours, have the filter that the file was trained with, splats that end
    where alpha is 1/255, and an order by depth.
    """
    return {
        "preBlurAmount": 0.0 if field.antialiased else BLUR,
        "blurAmount": BLUR if field.antialiased else 0.0,
        "maxStdDev": float(np.sqrt(2.0 * np.log(255.0))),
        "minAlpha": 1.0 / 255.0,
        "clipXY": 10.0,
        "sortRadial": False,
    }


def cameras(field: SplatField) -> list[Camera]:
    """Three cameras around the middle of a field's box; y is down in files of splats."""
    middle = field.bounds.mean(axis=0)
    size = float(np.linalg.norm(field.bounds[1] - field.bounds[0]))
    ways = np.array([[0.2, -0.25, -1.0], [-0.9, -0.5, -0.6], [0.5, 0.3, 0.9]])
    return [
        Camera.look_at(
            middle + far * size * way / np.linalg.norm(way),
            middle,
            width=SIZE,
            height=SIZE,
            fov_x=0.8,
            up=(0, -1, 0),
        )
        for way, far in zip(ways, (1.3, 1.0, 0.8), strict=True)
    ]


def psnr(a: Float32, b: Float32) -> float:
    """Peak signal-to-noise ratio in dB; 99 where nothing differs."""
    return float(min(99.0, -10.0 * np.log10(max(np.mean(np.square(np.asarray(a, float) - b)), 1e-30))))


class Quiet(SimpleHTTPRequestHandler):
    """Serves files without a word."""

    def log_message(self, *_: Any) -> None:
        """Says nothing."""


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """The address at which a folder's files are served."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()


def by_spark(
    field: SplatField,
    views: list[Camera],
    backgrounds: list[int],
    modules: Path,
    options: dict[str, float | bool],
) -> list[list[Float32]]:
    """Spark's pictures [H,W,3] of each view on each background."""
    from playwright.sync_api import sync_playwright

    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        raise SystemExit("no chromium on this machine; install it")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        root = Path(folder)
        shutil.copy(Path(__file__).parent / "spark" / "page.html", root / "page.html")
        (root / "node_modules").symlink_to(modules.resolve())
        write_splat_ply(root / "splats.ply", field)
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        page = browser.new_page(viewport={"width": SIZE, "height": SIZE})
        page.on("pageerror", lambda error: print(f"page: {error}"))
        with served(root) as address:
            pictures: list[list[Float32]] = []
            for camera in views:
                # Anew for each view: on a busy machine Spark kept the order of the last one.
                page.goto(f"{address}/page.html")
                page.wait_for_function("window.ready === true", timeout=60_000)
                pictures.append([])
                for background in backgrounds:
                    wish = {
                        "width": SIZE, "height": SIZE, "c2w": camera.c2w.tolist(), "background": background,
                        "fovY": float(np.degrees(2.0 * np.arctan(0.5 * SIZE / camera.fy))),
                        "options": options,
                    }  # fmt: skip
                    url = page.evaluate("wish => window.show(wish)", wish)
                    image = Image.open(BytesIO(b64decode(url.split(",")[1]))).convert("RGB")
                    pictures[-1].append(np.asarray(image, np.float32) / 255.0)
        browser.close()
    return pictures


def rows(path: Path, modules: Path, pictures: Path | None) -> Iterator[tuple[str, ...]]:
    """The rows of one file."""
    field = read_splat_ply(path)
    views, names = cameras(field), {"white": 0xFFFFFF, "black": 0}
    renderer = SplatRenderer(field)
    plain = by_spark(field, views, list(names.values()), modules, {})
    same = by_spark(field, views, list(names.values()), modules, alike(field))
    for place, camera in enumerate(views):
        near = near_depth(field.bounds)
        limits = intrinsics(camera).limits
        for turn, background in enumerate(("white", "black")):
            frame = renderer.render(camera, background=background)
            oracle = splat_reference.render(
                renderer.splats, camera, near=near, background=background, limits=limits
            )
            assert frame is not None
            ours = frame.rgb8().astype(np.float32) / 255.0
            yield (
                path.name.split(".")[0], str(place + 1), background, number(psnr(frame.rgb, oracle.rgb), 1),
                number(psnr(ours, plain[place][turn]), 1), number(psnr(ours, same[place][turn]), 1),
            )  # fmt: skip
            if pictures is not None:
                theirs = same[place][turn]
                both = np.concatenate([ours, theirs, np.clip(4.0 * np.abs(ours - theirs), 0.0, 1.0)], axis=1)
                pictures.mkdir(parents=True, exist_ok=True)
                write_png(
                    pictures / f"{path.stem}_{place + 1}_{background}.png", np.uint8(255.0 * both + 0.5)
                )


def main() -> None:
    """Draws, compares and writes the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", type=Path, nargs="+")
    parser.add_argument("--modules", type=Path, required=True)
    parser.add_argument("--pictures", type=Path)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    lines = [row for path in options.files for row in rows(path, options.modules, options.pictures)]
    notes = (
        f"PSNR in dB of our pictures of {SIZE}x{SIZE}: against our oracle, Spark 2.2.0 as it is, and",
        "Spark with the file's filter, our end of splats and our order (`alike` in the script).",
    )
    columns = ("file", "view", "on", "oracle", "Spark", "Spark, alike")
    text = Table("Splat files, by us and by Spark", columns, tuple(lines), notes, names=3).markdown()
    print(text)
    if options.out:
        write_text(options.out, text)


if __name__ == "__main__":
    main()
