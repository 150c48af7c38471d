"""Cost of fill, light and feather in each frame: discrete edits with them over the same edits without.

python -m benchmarks.patched_frames WORK [-o FILE.md] [--steps 4000] [--frames 24]

WORK is the work folder of `cagefield bench edits` of as many steps; what it lacks is made. Frames of 400x400
pixels from six test cameras, taken in turn with and without; their medians.
"""

from __future__ import annotations

import argparse
import os
import statistics
import time
from pathlib import Path

from benchmarks.common.cases import CASES
from benchmarks.common.machine import cpu_model
from benchmarks.common.workbench import Settings, Workbench
from cagefield.cli.options import TrainingOptions
from cagefield.compute import devices
from cagefield.edits import EditStack

CAMERAS = 6


def main() -> None:
    """See the module."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("work", type=Path)
    parser.add_argument("-o", "--out", type=Path, default=None)
    parser.add_argument("--steps", type=int, default=4000)
    parser.add_argument("--frames", type=int, default=24)
    options = parser.parse_args()
    devices.start("auto")
    settings = Settings(config=TrainingOptions(steps=options.steps).config(), discrete_views=CAMERAS)
    bench = Workbench(settings, options.work)
    lines = ["| scene | edit | with, ms | without, ms | ratio |", "| --- | --- | ---: | ---: | ---: |"]
    ratios: list[float] = []
    for case in CASES:
        if case.kind == "continuous":
            continue
        scene = bench.scene(case.scene)
        bare = EditStack(edit.replace(fill="none", relight="none", feather=0.0) for edit in case.edits)
        scenes = (scene.with_edits(case.edits), scene.with_edits(bare))
        cameras = scene.cameras["test"][:CAMERAS]
        for each in scenes:
            each.render(cameras[0])
        took: tuple[list[float], list[float]] = ([], [])
        for frame in range(options.frames):
            for each, times in zip(scenes, took, strict=True):
                start = time.perf_counter()
                each.render(cameras[frame % len(cameras)])
                times.append(1e3 * (time.perf_counter() - start))
        first, second = (statistics.median(times) for times in took)
        ratios.append(first / second)
        name = case.name.replace("_", " ")
        lines.append(f"| {case.scene} | {name} | {first:.0f} | {second:.0f} | x{ratios[-1]:.2f} |")
        print(lines[-1], flush=True)
    summary = f"mean x{statistics.mean(ratios):.2f}, at most x{max(ratios):.2f}"
    print(summary)
    if options.out is not None:
        title = "# Frames of discrete edits with fill, light and feather, over the same edits without"
        command = "`python -m benchmarks.patched_frames WORK`"
        machine = f"{cpu_model()}, {os.cpu_count()} cores, device {devices.current()}; {command}: {summary}."
        options.out.write_text("\n".join([title, "", machine, "", *lines, ""]), encoding="utf-8")


if __name__ == "__main__":
    main()
