"""Frame times of the page's own renderers in headless Chromium, unedited and with three edits.

    python -m benchmarks.page_frames SCENE... [--gpu] [-o benchmarks/results/page_frames.md]

Scenes of voxels and of splats, with the edits of `benchmarks.frame_sizes`. A frame is drawn from a turning
camera, and ends when one of its pixels has been read back, so that frames do not overlap. A drag's frame has
its edits encoded by the kernels, sent and uploaded before it is drawn. Chromium draws in software, or with
`--gpu` by Vulkan.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from benchmarks.common.chromium_flags import GPU_FLAGS
from benchmarks.common.machine import Machine
from benchmarks.common.tables import Table, number, write_text
from benchmarks.frame_sizes import SIZES, three_edits, views
from cagefield.cameras.camera import Camera
from cagefield.compute import devices
from cagefield.edits import EditStack, PreparedStack
from cagefield.fields.splat_field import SplatField
from cagefield.pages.page_edits import encode_page_edits, for_pages
from cagefield.pages.page_field import encode_page_field
from cagefield.pages.page_splat_edits import encode_page_splat_edits
from cagefield.pages.page_splats import encode_page_splats
from cagefield.rendering.renderers import renderer_of
from cagefield.rendering.splats.raster_splats import changed_splats
from cagefield.rendering.splats.splitting import split_of
from cagefield.scene.scene import Scene
from field_page import FieldPage, field_page

TURN_DEGREES = 0.5
DRAWN = """([cameras]) => {
    const pixel = new Uint8Array(4);
    const done = () => gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    const times = [];
    for (const camera of cameras) {
        r.setSize(camera.width, camera.height);
        r.setCamera(camera);
        const began = performance.now();
        r.render({});
        done();
        times.push(performance.now() - began);
    }
    return times;
}"""
GPU_NAME = """() => {
    const names = gl.getExtension("WEBGL_debug_renderer_info");
    return gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
}"""


def turned(camera: Camera, frames: int) -> list[dict[str, Any]]:
    """Cameras that turn about their own up axis by TURN_DEGREES a frame, as the page takes them."""
    found = []
    for n in range(frames):
        angle = np.radians(TURN_DEGREES * n)
        turn = np.array(
            [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]], np.float64
        )
        c2w = camera.c2w.copy()
        c2w[:3, :3] = c2w[:3, :3] @ turn
        found.append({**camera.to_dict(), "c2w": c2w.ravel().tolist()})
    return found


def frame_ms(page: FieldPage, camera: Camera, frames: int) -> float:
    """Median milliseconds of a frame; the first, which compiles and allocates, is left out."""
    return float(np.median(page.page.evaluate(DRAWN, [turned(camera, frames + 1)])[1:]))


def drag_ms(page: FieldPage, scene: Scene, camera: Camera, moves: int = 5) -> float:
    """Median milliseconds from an edit's change to the picture of it; the first move is left out."""
    stack = list(three_edits(scene, 64))
    renderer = renderer_of(scene.rendered_field, for_pages(scene.with_edits(EditStack(stack)).prepared_edits))
    times = []
    for n in range(moves + 1):
        began = time.perf_counter()
        stack[0] = stack[0].rotate((0.0, 0.0, 0.01 * (n + 1)))
        renderer = renderer.with_edits(for_pages(PreparedStack(stack)), coarse=True)
        page.edit(encoded(renderer, scene), changes=n > 0)
        page.page.evaluate(DRAWN, [turned(camera, 1)])
        times.append(1e3 * (time.perf_counter() - began))
    return float(np.median(times[1:]))


def encoded(renderer: Any, scene: Scene) -> bytes:
    """The edits of a renderer as pages read them."""
    if isinstance(scene.field, SplatField):
        edits = renderer.edits
        changed = changed_splats(scene.field, edits, split=split_of(scene.field, edits))
        return encode_page_splat_edits(scene.field, changed)
    return encode_page_edits(renderer)


def rows_of(path: Path, frames: int, flags: Sequence[str] | None) -> tuple[list[tuple[str, ...]], str]:
    """Rows of one scene, and the name of the GPU."""
    scene = Scene.open(path)
    splats = isinstance(scene.field, SplatField)
    edits = for_pages(scene.with_edits(three_edits(scene, 64)).prepared_edits)
    edited = encoded(renderer_of(scene.rendered_field, edits), scene)
    rows = []
    with field_page(splats, flags) as page:
        gpu = str(page.page.evaluate(GPU_NAME))
        field = scene.field
        page.load(encode_page_splats(field) if splats else encode_page_field(field))
        for width, height in SIZES:
            camera = views(scene, width, height)[0]
            page.edit(None)
            plain = frame_ms(page, camera, frames)
            page.edit(edited)
            changed = frame_ms(page, camera, frames)
            drag = number(drag_ms(page, scene, camera), 0)
            rows.append(
                (
                    path.name,
                    f"{width}x{height}",
                    number(plain, 1),
                    number(changed, 1),
                    f"x{changed / plain:.2f}",
                    drag,
                )
            )
            print(rows[-1], flush=True)
    return rows, gpu


def main() -> None:
    """Measures and writes the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--gpu", action="store_true")
    parser.add_argument("--frames", type=int, default=20)
    parser.add_argument("-o", "--out", type=Path)
    options = parser.parse_args()
    devices.start()
    flags = GPU_FLAGS if options.gpu else None
    rows, gpus = [], set()
    for path in options.scenes:
        found, gpu = rows_of(path, options.frames, flags)
        rows += found
        gpus.add(gpu)
    names = " ".join(path.name for path in options.scenes)
    table = Table(
        "Frames of the page's own renderers",
        ("scene", "picture", "unedited ms", "three edits ms", "ratio", "drag to picture ms"),
        tuple(rows),
        (
            f"Medians of {options.frames} frames of a turning camera.",
            f"Page drawn by: {', '.join(sorted(gpus))}.",
            "Drag to picture: one edit changed, its maps sampled, encoded, sent, uploaded and drawn.",
            f"Machine: {Machine.here()}",
            f"Command: `python -m benchmarks.page_frames {names}{' --gpu' if options.gpu else ''}`",
        ),
        names=2,
    )
    table.show()
    if options.out:
        write_text(options.out, table.markdown())


if __name__ == "__main__":
    main()
