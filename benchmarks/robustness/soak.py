"""Eight pages edit, play, have jobs rendered and reconnect for two hours; what that takes up.

python benchmarks/robustness/soak.py [--hours 2] [--pages 8] [--out FILE.md]

A real editor (`cagefield view`) of a small scene; the pages are programs that talk to it as a browser's do
(`tests/robustness/soak.py`). The slopes are of the last three quarters, by least squares.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from cagefield import devices
from cagefield.benchmarking.machine import cpu_model

TESTS = Path(__file__).resolve().parents[2] / "tests"
sys.path[:0] = [str(TESTS / "robustness"), str(TESTS)]

from soak import Sample, Soak, sample  # noqa: E402

from editor_server import editor_server  # noqa: E402
from scenes import ball_scene  # noqa: E402

MIB = 1 << 20


def main() -> None:
    """See the module."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=2.0)
    parser.add_argument("--pages", type=int, default=8)
    parser.add_argument("--pause", type=float, default=0.5)
    parser.add_argument("--every", type=float, default=30.0)
    parser.add_argument("--out", type=Path, default=None)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        ball_scene().save(Path(folder) / "scene")
        with editor_server(Path(folder) / "scene") as server:
            # What is made once, on first use: a minute or a tenth of the whole, whichever is shorter.
            first = Soak(server, Path(folder), options.pause)
            first.run(2, min(60.0, 360.0 * options.hours), 10.0, lambda found: None)
            time.sleep(10.0)
            before = sample(server, time.monotonic())
            soak = Soak(server, Path(folder), options.pause)
            samples: list[Sample] = []

            def watch(found: Sample) -> None:
                samples.append(found)
                print(
                    f"{found.seconds:.0f} s: server {found.server / MIB:.1f} MiB, rendering "
                    f"{found.rendering / MIB:.1f} MiB, {found.threads} threads, {found.files} files, "
                    f"{soak.done.total()} actions, {len(soak.faults)} faults",
                    flush=True,
                )

            soak.run(options.pages, 3600.0 * options.hours, options.every, watch)
            time.sleep(20.0)
            after = sample(server, time.monotonic())
    text = _table(soak, samples, before, after, options)
    print(text)
    if options.out is not None:
        options.out.write_text(text)


def _slope(samples: list[Sample], of: str) -> tuple[float, float]:
    """MiB an hour, and its standard error."""
    late = samples[len(samples) // 4 :]
    hours = np.array([one.seconds for one in late]) / 3600.0
    sizes = np.array([getattr(one, of) for one in late]) / MIB
    if len(late) < 4:
        return float("nan"), float("nan")
    (slope, _), covariance = np.polyfit(hours, sizes, 1, cov=True)
    return float(slope), float(np.sqrt(covariance[0, 0]))


def _table(
    soak: Soak, samples: list[Sample], before: Sample, after: Sample, options: argparse.Namespace
) -> str:
    rows = []
    for name, of in (("server", "server"), ("rendering", "rendering")):
        sizes = np.array([getattr(one, of) for one in samples]) / MIB
        quarters = " | ".join(f"{part.mean():.1f}" for part in np.array_split(sizes, 4))
        slope, error = _slope(samples, of)
        ends = f"{getattr(before, of) / MIB:.1f} | {quarters} | {getattr(after, of) / MIB:.1f}"
        rows.append(f"| {name} | {ends} | {slope:+.2f} ± {error:.2f} |")
    done = ", ".join(f"{name} {count}" for name, count in soak.done.most_common())
    told = "; ".join(f"“{name} …” {count}" for name, count in soak.refused.most_common(12))
    faults = "\n".join(f"- {fault}" for fault in soak.faults[:20]) or "None."
    command = f"--hours {options.hours:g} --pages {options.pages} --pause {options.pause:g}"
    return f"""# Hours of editing

{options.pages} pages that edit, play, have jobs rendered, hang up and come back for {options.hours:g} hours.
Memory in MiB: before any of the pages, in the four quarters, and 20 s after the last page left; the slope, in
MiB an hour, is that of the last three quarters.

{cpu_model()}, {devices.threads()} cores, other work beside.

    python benchmarks/robustness/soak.py {command}

| process | before | 1 | 2 | 3 | 4 | after | slope |
| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
{chr(10).join(rows)}

| | before | after |
| --- | ---: | ---: |
| threads | {before.threads} | {after.threads} |
| file handles | {before.files} | {after.files} |
| processes | {before.processes} | {after.processes} |

What the pages did: {done}.

What they were told: {told}.

Pages that the editor closed, and answers that did not come: {len(soak.faults)}.

{faults}
"""


if __name__ == "__main__":
    main()
