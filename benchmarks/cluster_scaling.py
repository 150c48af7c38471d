"""Frames on 1 and 2 local workers, and estimates for farms from these figures.

    python -m benchmarks.cluster_scaling SCENE -o benchmarks/results/cluster_scaling.md \\
        [--frames 60] [--size 400] [--block-seconds S --block-photos P]

Wall-clock time: the machine has nothing else to do. Every number of workers renders the frames of one orbit
twice, and the faster run counts; pictures are compared byte for byte with those of one process. With F
frames on W workers, a run takes about a + F b / W: a, the workers' start, and b, a frame's time on a worker,
are solved from two runs of different length on one worker.

Estimates, on paper: a video of 10,000 frames on 50 machines of one worker each takes a + 200 b, and its
encoding; a city of 200 blocks, with `--block-seconds` of a measured block of `--block-photos` photos, takes
four rounds of blocks on 50 machines, and the merge. Machines are taken to be like this one, the network not
to be a limit: a frame and a block are read and written by the workers themselves.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

from benchmarks.common.machine import cpu_model
from cagefield.cli import main as cagefield

VIDEO_FRAMES, CITY_BLOCKS, MACHINES = 10_000, 200, 50
RUNS = 2


def main() -> None:
    """Prints and writes the table and the estimates."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("scene", type=Path)
    parser.add_argument("-o", "--out", type=Path)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--size", default="400")
    parser.add_argument("--block-seconds", type=float)
    parser.add_argument("--block-photos", type=int)
    options = parser.parse_args()
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
    lines = [
        "# Frames on local workers",
        "",
        f"{cpu_model()}; {options.frames} frames of {options.size} pixels; bytes of one process: "
        f"{'the same' if same else 'NOT THE SAME'}",
        "",
        "| workers | all, s | without the start, s | speed-up |",
        "| --- | --- | --- | --- |",
        f"| none, one process | {alone:.1f} | | |",
        *(
            f"| {workers} | {total:.1f} | {working[workers]:.1f} | {working[1] / working[workers]:.2f} |"
            for workers, total in seconds.items()
        ),
        "",
        "## Estimates",
        "",
        f"Start {start:.1f} s, a frame {frame:.2f} s on one worker. {VIDEO_FRAMES} frames on {MACHINES} "
        f"machines: {(start + VIDEO_FRAMES / MACHINES * frame) / 60:.1f} minutes, the encoding aside.",
    ]
    if options.block_seconds is not None:
        rounds = -(-CITY_BLOCKS // MACHINES)
        photos = f" of {options.block_photos} photos" if options.block_photos else ""
        lines.append(
            f"A block{photos} takes {options.block_seconds:.0f} s: {CITY_BLOCKS} on {MACHINES} machines take "
            f"{rounds} rounds, {rounds * options.block_seconds / 60:.0f} minutes, the merge aside."
        )
    text = "\n".join(lines) + "\n"
    print(text)
    if options.out is not None:
        options.out.write_text(text, encoding="utf-8")


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
