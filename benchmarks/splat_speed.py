"""How long frames and training steps of splats take, and how that grows with splats and pixels.

    python -m benchmarks.splat_speed [--ply FILE] [--out benchmarks/results/splat_speed.md]
    python -m benchmarks.splat_speed --landscape 10000000 [--out benchmarks/results/splat_millions.md]
    python -m benchmarks.splat_speed --edits 1000000 [--out benchmarks/results/splat_edits_speed.md]

Frames are color, opacity and depth of a PLY file's splats seen from its turntable, or, without one, of
random
splats. A training step is everything that a photo costs: splats drawn, gradients and curvatures, the step.
Times are the least of the rounds, by the wall; kernels are compiled before.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.common.machine import Machine
from benchmarks.common.tables import Table, number, write_text
from cagefield.cameras.camera import Camera
from cagefield.datasets.views import Dataset, SparsePoints, View
from cagefield.edits import Edit, EditStack
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.splat_files import read_splats
from cagefield.geometry.cage import Cage
from cagefield.images.image_files import write_png
from cagefield.rendering.splats.splat_renderer import MOVING_DETAIL, SplatRenderer
from cagefield.rendering.splats.splitting import split_of
from splat_landscape import landscape

ROUNDS = 7


def random_splats(count: int, seed: int = 0) -> SplatField:
    """Splats on and around a sphere, as large as its surface needs them to be."""
    rng = np.random.default_rng(seed)
    means = rng.normal(size=(count, 3))
    means /= np.linalg.norm(means, axis=1, keepdims=True)
    scales = np.log(1.8 / np.sqrt(count)) + rng.normal(0.0, 0.3, (count, 3))
    return SplatField(
        means * rng.uniform(0.9, 1.0, (count, 1)),
        scales,
        rng.normal(size=(count, 4)),
        rng.uniform(0.1, 0.95, count),
        0.3 * rng.normal(size=(count, 9, 3)),
        bounds=np.array([[-1.2] * 3, [1.2] * 3]),
    )


def camera_of(field: SplatField, width: int, height: int) -> Camera:
    """A camera that has the field's box in its picture."""
    middle = field.bounds.mean(axis=0)
    size = float(np.linalg.norm(field.bounds[1] - field.bounds[0]))
    eye = middle + 1.3 * size * np.array([0.8, 0.5, 0.33])
    return Camera.look_at(eye, middle, width=width, height=height, fov_x=0.8 * min(1.0, width / height))


def least(work: Callable[[], object]) -> float:
    """Milliseconds of the quickest of some rounds."""
    work()
    times = []
    for _ in range(ROUNDS):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return 1e3 * min(times)


def frame_row(name: str, field: SplatField, width: int, height: int) -> tuple[str, ...]:
    """A row of the frames' table."""
    renderer, camera = SplatRenderer(field), camera_of(field, width, height)
    pairs = renderer.project(camera).pairs
    milliseconds = least(lambda: renderer.render(camera))
    return name, f"{width}x{height}", str(len(field)), str(pairs), number(milliseconds, 1)


def training_row(count: int, width: int, height: int, folder: Path) -> tuple[str, ...]:
    """A row of the steps' table: a run on one photo, with as many splats from its first step on."""
    from cagefield.training.splats.splat_config import SplatConfig
    from cagefield.training.splats.splat_run import SplatRun

    field = random_splats(count)
    camera = camera_of(field, width, height)
    frame = SplatRenderer(random_splats(5000, seed=1)).render(camera)
    assert frame is not None
    photo = folder / f"{width}x{height}.png"
    write_png(photo, frame.rgb8())
    views = tuple(View(f"{n}.png", camera, photo) for n in range(2))
    points = SparsePoints(field.means, np.full((count, 3), 128, np.uint8))
    dataset = Dataset("random", folder, views, (), (), False, field.bounds, False, points=points)
    run = SplatRun(dataset, SplatConfig(steps=10**6, splats=count))
    run.step_photo(0, 0.5)
    milliseconds = least(lambda: run.step_photo(0, 0.5))
    return f"{width}x{height}", str(len(run.state)), number(milliseconds, 1)


def landscape_table(count: int) -> Table:
    """Frames of a landscape of `count` splats: all of it, a part, next to nothing; at rest and in motion."""
    import resource

    def peak() -> float:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20

    field = landscape(count)
    size = sum(
        v.nbytes for v in (field.means, field.log_scales, field.quaternions, field.opacities, field.sh)
    )
    renderer = SplatRenderer(field)
    views = {
        "all": camera_of(field, 400, 400),
        "a tenth": Camera.look_at((0, 0, 3), (5, 3, 0.6), width=400, height=400, fov_x=0.9),
        "a hundredth": Camera.look_at((0, 0, 1.9), (1, 0.6, 0.6), width=400, height=400, fov_x=0.5),
    }
    rows = []
    for name, camera in views.items():
        rest, moving = renderer.render(camera), renderer.render(camera, step=1.0)
        assert rest is not None and moving is not None
        shown = len(renderer.project(camera).order)
        for way, frame, step in (("at rest", rest, None), ("moving", moving, 1.0)):
            drawn = len(renderer.project(camera, detail=0.0 if step is None else MOVING_DETAIL).order)
            times = []
            for _ in range(3):
                began = time.process_time()
                renderer.render(camera, step=step)
                times.append(time.process_time() - began)
            error = float(np.mean(np.square(frame.rgb - rest.rgb)))
            agrees = number(-10.0 * np.log10(error), 1) if error > 0.0 else "the same"
            rows.append((name, way, str(shown), str(drawn), number(1e3 * min(times), 0), agrees))
    notes = (
        f"{count} splats, {size / 2**30:.2f} GiB; most memory of the process: {peak():.2f} GiB.",
        "CPU time of both cores, the least of three. dB: against the picture at rest.",
        f"Machine: {Machine.here()}",
    )
    columns = ("in view", "picture", "splats seen", "drawn", "CPU ms", "dB")
    return Table("Frames of a landscape", columns, tuple(rows), notes, names=2)


def edits_table(count: int) -> Table:
    """How long `count` splats take through a turn, a move and a discrete move, nothing known of them."""
    from cagefield.rendering.splats.raster_splats import deformed_splats
    from cagefield.rendering.splats.splat_motion import moved_splats
    from cagefield.rendering.splats.splat_provenance import SplatSet

    a, b, c = (
        Cage.box(middle, half)
        for middle, half in (((0, 0, 0.5), 0.4), ((0.5, -0.3, -0.2), 0.35), ((-0.5, 0.4, -0.1), 0.3))
    )
    edits = EditStack(
        [
            Edit.continuous(a, a.grown(0.35)).rotate((0, 0, 0.7)).scale((1.2, 1, 1)),
            Edit.continuous(b, b.grown(0.35)).translate((0.1, -0.05, 0.05)),
            Edit.move(c).translate((-0.2, 0.3, 0.4)),
        ]
    )
    field = random_splats(count)
    SplatRenderer(field).render(camera_of(field, 64, 64))

    def fresh(split: bool) -> int:
        splats = SplatSet.from_field(field)
        return len(deformed_splats(splats, edits, split=split_of(splats, edits) if split else None))

    rows = []
    for name, split in (("no", False), ("yes", True)):
        milliseconds = least(lambda split=split: fresh(split))
        moved = len(moved_splats(field, edits).source)
        rows.append((name, str(count), str(moved), str(fresh(split)), number(milliseconds, 0)))
    notes = (
        "Three edits, one after the other: a turn and stretch, a move, both continuous; a discrete move.",
        f"The least of {ROUNDS} rounds, by the wall, each from nothing.",
        f"Machine: {Machine.here()}",
    )
    return Table(
        "Splats through three edits", ("split", "splats", "moved", "drawn", "ms"), tuple(rows), notes, names=1
    )


def main() -> None:
    """Measures and writes the tables."""
    import tempfile

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ply", type=Path)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--landscape", type=int)
    parser.add_argument("--edits", type=int)
    options = parser.parse_args()
    if options.landscape or options.edits:
        table = landscape_table(options.landscape) if options.landscape else edits_table(options.edits)
        text = table.markdown()
        print(text)
        if options.out:
            write_text(options.out, text)
        return
    machine = f"Machine: {Machine.here()}"
    rows = []
    if options.ply:
        field = read_splats(options.ply)
        rows += [frame_row(options.ply.name, field, size, size) for size in (200, 400, 800)]
    for count in (10_000, 50_000, 200_000, 800_000):
        rows.append(frame_row("random", random_splats(count), 400, 400))
    frames = Table(
        "Frames of splats", ("splats of", "picture", "splats", "pairs", "ms"), tuple(rows), (machine,)
    )
    with tempfile.TemporaryDirectory() as folder:
        steps = Table(
            "Training steps of splats",
            ("photo", "splats", "ms"),
            tuple(
                training_row(count, *size, Path(folder))
                for size in ((180, 320), (360, 640))
                for count in (5_000, 50_000, 200_000)
            ),
            (machine,),
            names=1,
        )
    text = f"{frames.markdown()}\n{steps.markdown()}"
    print(text)
    if options.out:
        write_text(options.out, text)


if __name__ == "__main__":
    main()
