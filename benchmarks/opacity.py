"""Whether stretched content should keep its opacity: both choices against photos of parts that really moved.

    python benchmarks/opacity.py WORKDIR [-o benchmarks/results/opacity.md]

WORKDIR is the work folder of `cagefield bench edits`; its newest fields are used. Only edits that change
lengths can tell; of those the built-in cases hold copies scaled down, and the parts below are scaled here.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from cagefield import devices
from cagefield.benchmarking.figures import changed_pixels, mean_psnr, pooled_psnr
from cagefield.benchmarking.machine import Machine
from cagefield.benchmarking.tables import Table, number, write_text
from cagefield.cages import Cage
from cagefield.datasets.procedural import procedural_scene
from cagefield.edits import Edit, EditStack
from cagefield.rendering.renderer import Renderer
from cagefield.scene import Scene

SCALED = (
    ("microphone", "weight", 0.6),
    ("microphone", "weight", 1.5),
    ("plant", "pinecone", 0.6),
    ("plant", "pinecone", 1.3),
    ("plant", "flower", 0.5),
    ("plant", "flower", 1.6),
    ("digger", "cone", 0.6),
    ("digger", "cone", 1.3),
)
"""Scene, part, factor."""


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("workdir", type=Path)
    parser.add_argument("-o", "--out", type=Path, default=Path("benchmarks/results/opacity.md"))
    parser.add_argument("--views", type=int, default=6)
    options = parser.parse_args()
    devices.start()
    rows = []
    for name, part, factor in SCALED:
        fields = sorted(options.workdir.glob(f"{name}/field-*"), key=lambda path: path.stat().st_mtime)
        if not fields:
            print(f"{options.workdir} holds no field of {name}; run `cagefield bench edits --workdir` first")
            continue
        scene = Scene.open(fields[-1])
        cameras = scene.cameras["test"][: options.views]
        model = procedural_scene(name)
        center, size = model.part_box(part, 0.015)
        cage = Cage.box(center, size)
        edits = EditStack([Edit(cage, adjustment="discrete").scale(factor)])
        moved = model.move(part, scale=factor, pivot=cage.center)
        truth = np.stack([moved.photograph(camera, background="white").rgb8() for camera in cameras])
        before = np.stack([model.photograph(camera, background="white").rgb8() for camera in cameras])
        there = changed_pixels(before, truth)
        figures = []
        for preserve in (False, True):
            renderer = Renderer(scene.field, edits, preserve_opacity=preserve)
            shown = np.stack([renderer.render(camera, background="white").rgb8() for camera in cameras])
            figures += [mean_psnr(shown, truth), pooled_psnr(shown, truth, there)]
        rows.append((name, part, f"{factor:g}", *map(number, figures), number(figures[2] - figures[0])))
        print(*rows[-1], flush=True)
    gain = np.mean([float(row[-1]) for row in rows]) if rows else float("nan")
    table = Table(
        "Density as it is, or times |J d|",
        ("scene", "part", "scale", "PSNR", "there", "PSNR preserved", "there preserved", "gained"),
        tuple(rows),
        (
            f"PSNR (dB) against photos of the scene whose part was really scaled, mean of {options.views} "
            "test views; there: on the pixels that the edit changes. Preserved: density times |J d|; "
            f"that keeps the optical depth. Gained on the mean: {gain:.2f} dB.",
            f"Machine: {Machine.here()}",
            f"Command: `python benchmarks/opacity.py {options.workdir.name}`",
        ),
        names=2,
    )
    write_text(options.out, table.markdown())


if __name__ == "__main__":
    main()
