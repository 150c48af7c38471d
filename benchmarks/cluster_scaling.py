"""Frames on 1 and 2 local workers, and estimates for farms from these figures.

    python -m benchmarks.cluster_scaling SCENE -o benchmarks/results/cluster_scaling.md \\
        [--frames 60] [--size 400] [--blocks FOLDER] [--estimates]

Wall-clock time: the machine has nothing else to do. Every number of workers renders the frames of one orbit
twice, and the faster run counts; pictures are compared byte for byte with those of one process. With F
frames on W workers, a run takes about a + F b / W: a, the workers' start, and b, a frame's time on a worker,
are solved from two runs of different length on one worker. With `--estimates` there are no workers: a and b
are processor time of one process, which other work on the machine changes little.

Estimates, on paper: a video of 10,000 frames on 50 machines of one worker each takes a + 200 b, and its
encoding. A city of 200 blocks takes the scaffold, on one machine, in proportion to its photos, then four
rounds of the longest block and four of the longest refinement on 50 machines, and the merge; FOLDER is one of
`compare_blocks`, `blocks-4`, with the processor time of each. Machines are taken to be like this one, the
network not to be a limit: a frame and a block are read and written by the workers themselves.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.common.machine import cpu_model
from cagefield.cli import main as cagefield

VIDEO_FRAMES, CITY_BLOCKS, MACHINES = 10_000, 200, 50
RUNS = 2
UNSOLVED = (
    "The runs are too short to tell a frame's time from the start's on this machine; give more --frames."
)


def main() -> None:
    """Prints and writes the table and the estimates."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("scene", type=Path)
    parser.add_argument("-o", "--out", type=Path)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--size", default="400")
    parser.add_argument("--blocks", type=Path)
    parser.add_argument("--estimates", action="store_true")
    options = parser.parse_args()
    lines = estimates(options) if options.estimates else scaling(options)
    if options.blocks is not None:
        lines.append(city(options.blocks))
    text = "\n".join(lines) + "\n"
    print(text)
    if options.out is not None:
        options.out.write_text(text, encoding="utf-8")


def scaling(options: argparse.Namespace) -> list[str]:
    """Lines of the frames on workers."""
    with tempfile.TemporaryDirectory() as work:
        folder = Path(work)
        alone = rendered(options, folder / "alone", options.frames)
        few = min(rendered(options, folder / f"few{n}", options.frames // 4, 1) for n in range(RUNS))
        seconds = {
            workers: min(
                rendered(options, folder / f"{workers}-{n}", options.frames, workers) for n in range(RUNS)
            )
            for workers in (1, 2)
        }
        expected = contents(folder / "alone")
        same = all(contents(folder / f"{workers}-0") == expected for workers in seconds)
    frame = (seconds[1] - few) / (options.frames - options.frames // 4)
    start = seconds[1] - options.frames * frame
    working = {workers: total - start for workers, total in seconds.items()}
    solved = frame > 0.0 and min(working.values()) > 0.0
    shown = {
        workers: f"{spent:.1f} | {working[1] / spent:.2f}" if solved else " | "
        for workers, spent in working.items()
    }
    return [
        "# Frames on local workers",
        "",
        f"{cpu_model()}; {options.frames} frames of {options.size} pixels; bytes of one process: "
        f"{'the same' if same else 'NOT THE SAME'}",
        "",
        "| workers | all, s | without the start, s | speed-up |",
        "| --- | --- | --- | --- |",
        f"| none, one process | {alone:.1f} | | |",
        *(f"| {workers} | {total:.1f} | {shown[workers]} |" for workers, total in seconds.items()),
        "",
        "## Estimates",
        "",
        video(max(0.0, start), frame) if solved else UNSOLVED,
    ]


def estimates(options: argparse.Namespace) -> list[str]:
    """Lines of the estimate of a video, from processor time."""
    with tempfile.TemporaryDirectory() as work:
        few, many = options.frames // 4, options.frames
        rendered(options, Path(work) / "compiled", 1)
        seconds = []
        for count in (few, many):
            began = time.process_time()
            rendered(options, Path(work) / f"{count}", count)
            seconds.append(time.process_time() - began)
    frame = (seconds[1] - seconds[0]) / (many - few)
    return [
        "# Estimates for farms",
        "",
        f"{cpu_model()}; processor time of {few} and {many} frames of {options.size} pixels.",
        "",
        video(max(0.0, seconds[1] - many * frame), frame),
    ]


def video(start: float, frame: float) -> str:
    """The estimate of a video from the seconds of the start and of a frame."""
    minutes = (start + VIDEO_FRAMES / MACHINES * frame) / 60
    return (
        f"Start {start:.1f} s, a frame {frame:.3f} s on one worker. {VIDEO_FRAMES} frames on {MACHINES} "
        f"machines: {minutes:.1f} minutes, the encoding aside."
    )


def city(folder: Path) -> str:
    """The estimate of a city, from the processor time and photos of the trainings in a folder."""
    seconds = {
        kind: [float(np.loadtxt(path, ndmin=2)[:, 0].sum()) for path in sorted(folder.glob(f"{kind}*.usage"))]
        for kind in ("scaffold", "block-", "refined-")
    }
    if not all(seconds.values()):
        raise SystemExit(f"{folder} has no finished blocks of compare_blocks")
    photos = len(json.loads((folder / "scaffold.json").read_text(encoding="utf-8"))["gains"])
    blocks = len(seconds["block-"])
    whole, rounds = CITY_BLOCKS * photos // blocks, -(-CITY_BLOCKS // MACHINES)
    coarse, block, refined = (max(values) for values in seconds.values())
    return (
        f"\n{blocks} blocks of {photos} photos: {coarse:.0f} s of processor time for the scaffold, "
        f"{block:.0f} s for the longest block, {refined:.0f} s for the longest refinement. {CITY_BLOCKS} "
        f"such blocks, {whole} photos, on {MACHINES} machines: {coarse / photos * whole / 60:.0f} minutes "
        f"for the scaffold on one, {rounds * (block + refined) / 60:.0f} minutes in {rounds} rounds of "
        "blocks and of refinements, the merge aside."
    )


def rendered(options: argparse.Namespace, out: Path, frames: int, workers: int | None = None) -> float:
    """Seconds of `cagefield render` of an orbit's first frames."""
    words = ["render", str(options.scene), "-o", str(out), "--turntable", str(options.frames)]
    words += ["--size", options.size, "--frames", f"0-{max(frames, 1) - 1}"]
    if workers is not None:
        words += ["--cluster", str(workers)]
    began = time.perf_counter()
    if cagefield(words) != 0:
        raise SystemExit("cagefield render failed")
    return time.perf_counter() - began


def contents(folder: Path) -> dict[str, bytes]:
    """Bytes of a folder's files by name."""
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


if __name__ == "__main__":
    main()
