"""Pictures of splat files by this rasterizer, by its oracle, and by Spark in a browser.

    mkdir spark && cd spark && npm install @sparkjsdev/spark@2.2.0 three@0.180
    python -m benchmarks.splat_spark FILE_OR_FOLDER... --modules spark/node_modules [--formats FILE]
        [--choices FILE] [--pictures DIR] [--out TABLE.md]

Each file is seen by three cameras around the middle of its splats, on white and on black; a folder gives all
splat files in it. Spark reads the file itself (a SOG folder zipped), or, where it cannot, a PLY of what was
read here. The splats of `--formats` are written in every format, and Spark's pictures of those compared with
ours; those of `--choices` are drawn with one of Spark's own choices after the other. Needs the test extra
(Playwright) and Chromium, which draws in software. `--pictures` writes ours, Spark's, and four times their
difference.
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
from playwright.sync_api import Error as PlaywrightError
from playwright.sync_api import sync_playwright

from benchmarks.common.chromium_flags import SOFTWARE_FLAGS
from benchmarks.common.machine import Machine
from benchmarks.common.tables import Table, number, write_text
from cagefield.cameras.camera import Camera
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.open_splats import READABLE, format_suffix
from cagefield.formats.splats.splat_files import read_splats, write_splats
from cagefield.images.image_files import write_png
from cagefield.images.render_result import RenderResult
from cagefield.rendering.splats import reference_rasterizer
from cagefield.rendering.splats.kernels.projection import BLUR
from cagefield.rendering.splats.rasterizer import intrinsics, near_depth
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.typing import AnyArray, Float32

SIZE = 400
SMALL, MANY = 120, 20_000
"""Side of the oracle's pictures of more than so many splats: it visits every pixel for each of them."""

BACKGROUNDS = {"white": 0xFFFFFF, "black": 0}
NOTES = (
    "PSNR in dB of our pictures, on white or on black, the lower, 99 at most.",
    "`oracle`: against `reference_rasterizer.py` in float64, whole pictures of the same view with `side`"
    f" pixels a side, {SMALL} above {MANY} splats.",
    f"`Spark as it is`: against Spark 2.2.0, pictures of {SIZE}x{SIZE} in 8 bits. `Spark, alike`: with the"
    " file's filter, our end of splats, our order by depth, and its precise storage of splats.",
)
FORMAT_NOTES = (
    "PSNR in dB of Spark's pictures (`alike`) against ours of the same file, read back here.",
    "Spark takes coordinates as they are: those of .spz, y up, are turned by half a turn about x.",
)
CHOICE_NOTES = ("PSNR in dB of Spark's pictures against ours where it makes this choice alone of its own.",)
CHOICES = {
    "none (alike)": (),
    "antialiased filter": ("preBlurAmount", "blurAmount"),
    "splats end at sqrt(8) sigmas, alpha 1/510": ("maxStdDev", "minAlpha"),
    "order by distance": ("sortRadial",),
    "packed splats": ("accumExtSplats",),
    "centers beyond 1.4 of the picture are left out, splats end at 512 pixels": ("clipXY", "maxPixelRadius"),
    "all (as it is)": (),
}
Options = dict[str, float | bool]


def alike(field: SplatField) -> Options:
    """Spark's options with which it draws what we do.

    Its own are the antialiased filter whatever the file says, splats that end at sqrt(8) sigmas, an order by
    distance, and splats packed into 16 bytes (8 bits a scale, colors cut to [0, 1]); 3DGS' renderer, and
    ours, have the filter that the file was trained with, splats that end where alpha is 1/255, an order by
    depth, and floats.
    """
    return {
        "preBlurAmount": 0.0 if field.antialiased else BLUR,
        "blurAmount": BLUR if field.antialiased else 0.0,
        "maxStdDev": float(np.sqrt(2.0 * np.log(255.0))),
        "minAlpha": 1.0 / 255.0,
        "clipXY": 10.0,
        "maxPixelRadius": 1e4,
        "sortRadial": False,
        "accumExtSplats": True,
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


def psnr(a: AnyArray, b: AnyArray) -> float:
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


class Spark:
    """Spark in a browser, for the files of a folder."""

    def __init__(self, root: Path, modules: Path, address: str, page: Any) -> None:
        self.root, self._address, self._page = root, address, page
        shutil.copy(Path(__file__).parent / "spark" / "page.html", root / "page.html")
        (root / "node_modules").symlink_to(modules.resolve())

    def pictures(self, path: Path, views: list[Camera], options: Options) -> list[list[Float32]] | None:
        """Pictures [H,W,3] of each view on each background; None for a file that Spark does not read.

        Spark reads coordinates as they are: those of .spz have y up, and are turned.
        """
        url = "/" + path.relative_to(self.root).as_posix()
        found: list[list[Float32]] = []
        for camera in views:
            # Anew for each view: on a busy machine Spark kept the order of the last one.
            self._page.goto(f"{self._address}/page.html")
            self._page.wait_for_function("window.ready === true", timeout=60_000)
            found.append([])
            for background in BACKGROUNDS.values():
                wish = {
                    "url": url, "half": format_suffix(path) == ".spz", "width": camera.width,
                    "height": camera.height, "c2w": camera.c2w.tolist(), "background": background,
                    "fovY": float(np.degrees(2.0 * np.arctan(0.5 * camera.height / camera.fy))),
                    "options": options,
                }  # fmt: skip
                try:
                    picture = self._page.evaluate("wish => window.show(wish)", wish)
                except PlaywrightError as error:
                    print(f"Spark does not read {path.name}: {str(error).splitlines()[0]}", flush=True)
                    return None
                image = Image.open(BytesIO(b64decode(picture.split(",")[1]))).convert("RGB")
                found[-1].append(np.asarray(image, np.float32) / 255.0)
        return found


@contextmanager
def spark(modules: Path) -> Iterator[Spark]:
    """Spark in a browser, and a folder for its files."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        raise SystemExit("no chromium on this machine; install it")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=chromium, args=[*SOFTWARE_FLAGS, "--hide-scrollbars"]
        )
        page = browser.new_page(viewport={"width": SIZE, "height": SIZE})
        page.on("pageerror", lambda error: print(f"page: {error}"))
        with served(Path(folder)) as address:
            yield Spark(Path(folder), modules, address, page)
        browser.close()


def splat_files(places: list[Path]) -> list[tuple[str, Path]]:
    """(name, file) of the splat files that are named, or lie in folders that are."""
    found: list[tuple[str, Path]] = []
    for place in places:
        if place.is_file() or (place / "meta.json").exists():
            found.append((place.name, place))
            continue
        inside = [path for path in place.rglob("*") if format_suffix(path) in READABLE and not path.is_dir()]
        for path in sorted(inside):
            path = path.parent if path.name == "meta.json" else path
            found.append((path.relative_to(place).as_posix(), path))
    return found


def ours(renderer: SplatRenderer, camera: Camera) -> list[Float32]:
    """Our pictures of a view on each background, rounded to 8 bits as the browser's are."""
    frames = [renderer.render(camera, background=name) for name in BACKGROUNDS]
    return [frame.rgb8().astype(np.float32) / 255.0 for frame in frames if frame is not None]


def least(some: list[Float32], others: list[Float32]) -> str:
    """The lower PSNR of those on white and on black."""
    return number(min(psnr(a, b) for a, b in zip(some, others, strict=True)), 1)


def by_oracle(renderer: SplatRenderer, camera: Camera) -> str:
    """The lower PSNR, on white and on black, of our picture against the oracle's."""
    near, limits = near_depth(renderer.field.bounds), intrinsics(camera).limits
    seen = reference_rasterizer.project(renderer.splats, camera, near, limits)
    color, through, depth = reference_rasterizer.blend(seen, camera.width, camera.height)
    figures = []
    for name in BACKGROUNDS:
        exact = RenderResult.from_premultiplied(color, 1.0 - through, depth, background=name)
        frame = renderer.render(camera, background=name)
        assert frame is not None
        figures.append(psnr(frame.rgb, exact.rgb))
    return number(min(figures), 1)


def rows(name: str, path: Path, browser: Spark, pictures: Path | None) -> Iterator[tuple[str, ...]]:
    """The rows of one file."""
    field = read_splats(path)
    views, renderer = cameras(field), SplatRenderer(field)
    side = SMALL if len(field) > MANY else SIZE
    read, by = browser.root / "files" / name, "the file"
    read.parent.mkdir(parents=True, exist_ok=True)
    if path.is_dir():
        read, by = Path(shutil.make_archive(str(read), "zip", path)).rename(f"{read}.sog"), "it zipped"
    else:
        read.symlink_to(path.resolve())
    plain = browser.pictures(read, views, {})
    if plain is None:
        read, by = read.with_name(read.name + "_.ply"), "a PLY"
        write_splats(field, read)
        plain = browser.pictures(read, views, {})
    same = browser.pictures(read, views, alike(field))
    if plain is None or same is None:
        raise SystemExit(f"Spark shows nothing of {name}")
    for turn, camera in enumerate(views):
        drawn = ours(renderer, camera)
        if pictures is not None:
            for background, a, b in zip(BACKGROUNDS, drawn, same[turn], strict=True):
                shown = np.concatenate([a, b, np.clip(4.0 * np.abs(a - b), 0.0, 1.0)], axis=1)
                pictures.mkdir(parents=True, exist_ok=True)
                file = pictures / f"{name.replace('/', '_')}_{turn + 1}_{background}.png"
                write_png(file, np.uint8(255.0 * shown + 0.5))
        yield (
            name, str(turn + 1), by, str(side), by_oracle(renderer, camera.resized(side, side)),
            least(drawn, same[turn]), least(drawn, plain[turn]),
        )  # fmt: skip


def formats(path: Path, browser: Spark) -> Iterator[tuple[str, ...]]:
    """The rows of formats that one file's splats are written in."""
    field = read_splats(path)
    views = cameras(field)
    for ending in (".ply", ".compressed.ply", ".spz", ".spz, version 4", ".sog", ".splat", ".glb"):
        version = 4 if "4" in ending else None
        file = browser.root / f"written{version or ''}{ending.split(',')[0]}"
        write_splats(field, file, spz_version=version)
        seen = browser.pictures(file, views, alike(field))
        again = SplatRenderer(read_splats(file))
        figures = [] if seen is None else [least(ours(again, c), s) for c, s in zip(views, seen, strict=True)]
        yield (ending, f"{file.stat().st_size / 1e6:.2f}", *(figures or ["not read"] * len(views)))


def choices(path: Path, browser: Spark) -> Iterator[tuple[str, ...]]:
    """The rows of Spark's own choices for one file's splats, one at a time."""
    field = read_splats(path)
    views, renderer = cameras(field), SplatRenderer(field)
    file = browser.root / "choices.ply"
    write_splats(field, file)
    for name, own in CHOICES.items():
        options = {} if name.startswith("all") else {k: v for k, v in alike(field).items() if k not in own}
        seen = browser.pictures(file, views, options)
        assert seen is not None
        yield (name, *(least(ours(renderer, c), s) for c, s in zip(views, seen, strict=True)))


def main() -> None:
    """Draws, compares and writes the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", type=Path, nargs="+")
    parser.add_argument("--modules", type=Path, required=True)
    parser.add_argument("--formats", type=Path)
    parser.add_argument("--choices", type=Path)
    parser.add_argument("--pictures", type=Path)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    text = ""
    with spark(options.modules) as browser:
        lines = []
        for name, path in splat_files(options.files):
            for row in rows(name, path, browser, options.pictures):
                print(*row, flush=True)
                lines.append(row)
        columns = ("file", "view", "Spark reads", "side", "oracle", "Spark, alike", "Spark as it is")
        notes = (*NOTES, f"Machine: {Machine.here()}; Chromium draws in software.")
        text = Table("Splat files, by us and by Spark", columns, tuple(lines), notes, names=3).markdown()
        if options.formats:
            kinds = tuple(formats(options.formats, browser))
            title = f"{options.formats.name}, written here, opened by Spark"
            columns = ("format", "MB", "view 1", "view 2", "view 3")
            text += "\n#" + Table(title, columns, kinds, FORMAT_NOTES).markdown()
        if options.choices:
            made = tuple(choices(options.choices, browser))
            title = f"{options.choices.name}, what Spark's own choices make"
            columns = ("choice", "view 1", "view 2", "view 3")
            text += "\n#" + Table(title, columns, made, CHOICE_NOTES).markdown()
    print(text)
    if options.out:
        write_text(options.out, text)


if __name__ == "__main__":
    main()
