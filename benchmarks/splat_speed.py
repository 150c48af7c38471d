"""How long frames and training steps of splats take, and how that grows with splats and pixels.

    python benchmarks/splat_speed.py [--ply FILE] [--out benchmarks/results/splat_speed.md]

Frames are colour, opacity and depth of a PLY file's splats seen from its turntable, or, without one, of
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

from cagefield.benchmarking.machine import Machine
from cagefield.benchmarking.tables import Table, number, write_text
from cagefield.cameras import Camera
from cagefield.datasets.views import Dataset, SparsePoints, View
from cagefield.fields.splat import SplatField
from cagefield.formats.splat_files import read_splats
from cagefield.rendering.images import write_png
from cagefield.rendering.splat_renderer import SplatRenderer

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
    from cagefield.training.splat_config import SplatConfig
    from cagefield.training.splat_run import SplatRun

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
    run._photo(0, 0.5)
    milliseconds = least(lambda: run._photo(0, 0.5))
    return f"{width}x{height}", str(len(run.state)), number(milliseconds, 1)


def main() -> None:
    """Measures and writes the tables."""
    import tempfile

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ply", type=Path)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
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
