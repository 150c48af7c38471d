"""Frame times of scenes by picture size, unedited and with three edits, on any compute device.

    python -m benchmarks.frame_sizes SCENE... [--device cuda] [-o benchmarks/results/frame_sizes_cuda.md]

The edits are a continuous turn, a continuous move, and a discrete move, inpainted and relit; of voxels with
nodes of the maps as the editor has them (`--lattice 64`), or exact (`--lattice 0`). Unedited and
edited frames are timed in turn, by the wall, from the call to the 8-bit picture in main memory; the first
frame of a scene is timed alone, with what it compiles or loads. Kernels are cached on disk, patches are not.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.common.machine import Machine
from benchmarks.common.tables import Table, number, write_text
from benchmarks.common.timing import interleaved
from cagefield.cameras.camera import Camera
from cagefield.compute import devices
from cagefield.edits import Edit, EditStack
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.cage import Cage
from cagefield.images.image_files import write_png
from cagefield.scene.scene import Scene

SIZES = ((400, 400), (800, 800), (1920, 1080))


def content(scene: Scene) -> NDArray[np.float64]:
    """Positions [N,3] of the scene's splats, or of its voxels."""
    field = scene.field
    if isinstance(field, SplatField):
        return field.means.astype(np.float64)
    grid = np.stack(np.unravel_index(field.vertices, field.resolution), axis=1)
    lower, upper = field.bounds
    return lower + grid / (np.array(field.resolution) - 1) * (upper - lower)


def three_edits(scene: Scene, lattice: int | None = None) -> EditStack:
    """A turn in the middle of the content, a move of a second part, and a discrete move of a third.

    Cages are .3 of the content's longest side, which leaves out a twentieth at either end; their middles lie
    at the median and at the quartiles along that side.
    """
    points = content(scene)
    low, high = np.quantile(points, [0.05, 0.95], axis=0)
    axis, size = int(np.argmax(high - low)), 0.3 * float((high - low).max())
    middles = [
        np.median(points[np.abs(points[:, axis] - at) < 0.25 * size], axis=0)
        for at in np.quantile(points[:, axis], [0.5, 0.2, 0.8])
    ]
    first, second, third = (Cage.box(middle, size) for middle in middles)
    aside = np.roll([0.3 * size, 0.0, 0.0], axis + 1)
    return EditStack(
        [
            Edit.continuous(first, first.grown(0.3 * size), lattice=lattice).rotate(
                np.roll([0.26, 0.0, 0.0], axis)
            ),
            Edit.continuous(second, second.grown(0.3 * size), lattice=lattice).translate(0.5 * aside),
            Edit.move(third).translate(aside),
        ]
    )


def views(scene: Scene, width: int, height: int, count: int = 4) -> list[Camera]:
    """Evenly chosen test cameras of a scene at a size, as wide as the scene's own."""
    known = scene.cameras.get("test") or scene.cameras.get("train") or ()
    chosen = known[:: max(1, len(known) // count)][:count]
    return [camera.resized(width, height) for camera in chosen]


def frames(scene: Scene, cameras: Sequence[Camera]) -> None:
    """Render each camera's picture."""
    for camera in cameras:
        scene.render(camera).rgb8()


def rows_of(path: Path, rounds: int, lattice: int | None, pictures: Path | None) -> list[tuple[str, ...]]:
    """Rows of one scene."""
    scene = Scene.open(path)
    edited = scene.with_edits(three_edits(scene, lattice))
    firsts = {}
    for which in (scene, edited):
        began = time.perf_counter()
        which.render(views(scene, *SIZES[0])[0]).rgb8()
        firsts[which is edited] = number(1e3 * (time.perf_counter() - began), 0)
    rows: list[tuple[str, ...]] = []
    for width, height in SIZES:
        cameras = views(scene, width, height)
        actions = [partial(frames, which, cameras) for which in (scene, edited)]
        seconds = interleaved(actions, rounds) / len(cameras)
        plain, changed = np.median(seconds, axis=0)
        ratio = float(np.median(seconds[:, 1] / seconds[:, 0]))
        figures = (number(1e3 * plain, 1), number(1e3 * changed, 1), f"x{ratio:.2f}")
        rows.append((path.name, f"{width}x{height}", *figures, firsts[False], firsts[True]))
        firsts = dict.fromkeys(firsts, "")
        print(rows[-1], flush=True)
        if pictures is not None:
            for name, which in (("plain", scene), ("edited", edited)):
                write_png(pictures / f"{path.name}_{width}_{name}.png", which.render(cameras[0]).rgb8())
    return rows


def main() -> None:
    """Measures and writes the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--device", default="auto")
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--lattice", type=int, default=64)
    parser.add_argument("--pictures", type=Path)
    parser.add_argument("-o", "--out", type=Path)
    options = parser.parse_args()
    devices.start(options.device)
    lattice = options.lattice or None
    with tempfile.TemporaryDirectory() as cache:  # of patches: that of kernels is opened above
        os.environ["XDG_CACHE_HOME"] = cache
        rows = [
            row for path in options.scenes for row in rows_of(path, options.rounds, lattice, options.pictures)
        ]
    names = " ".join(path.name for path in options.scenes)
    table = Table(
        "Frames by size",
        ("scene", "picture", "unedited ms", "three edits ms", "ratio", "first ms", "first edited ms"),
        tuple(rows),
        (
            f"Medians of {options.rounds} rounds over 4 cameras; first edited: with edits prepared, inpainted"
            " and relit anew.",
            f"Machine: {Machine.here()}",
            f"Command: `python -m benchmarks.frame_sizes {names} --device {options.device}"
            f" --lattice {options.lattice}`",
        ),
        names=2,
    )
    table.show()
    if options.out:
        write_text(options.out, table.markdown())


if __name__ == "__main__":
    main()
