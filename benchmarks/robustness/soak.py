"""Eight pages edit, play, have jobs rendered and reconnect for two hours; what that takes up.

python -m benchmarks.robustness.soak [--hours 2] [--warm 15] [--pages 8] [--out FILE.md]

A real editor (`cagefield view`) of a small scene; the pages are programs that talk to it as a browser's do
(`tests/robustness/soak.py`). All of them are there for `--warm` minutes first, until the history has as many
entries as it may and all that is made once has been made; what is measured begins after that. The slopes are
of the whole of it, by least squares. The exit status is 1 after a fault.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.common.machine import cpu_model
from cagefield.compute import devices

TESTS = Path(__file__).resolve().parents[2] / "tests"
sys.path[:0] = [str(TESTS / "robustness"), str(TESTS)]

from soak import Sample, Soak, sample  # noqa: E402

from editor_server import EditorServer, editor_server, page  # noqa: E402
from scenes import ball_scene  # noqa: E402

MIB = 1 << 20


def main() -> None:
    """See the module."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=2.0)
    parser.add_argument("--warm", type=float, default=15.0, help="minutes before it is measured")
    parser.add_argument("--pages", type=int, default=8)
    parser.add_argument("--pause", type=float, default=0.5)
    parser.add_argument("--every", type=float, default=30.0)
    parser.add_argument("--out", type=Path, default=None)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        ball_scene().save(Path(folder) / "scene")
        with editor_server(Path(folder) / "scene") as server:
            _run(server, Path(folder), 60.0 * options.warm, options)
            entries = _entries(server)
            before = sample(server, time.monotonic())
            soak, samples = _run(server, Path(folder), 3600.0 * options.hours, options)
            after = sample(server, time.monotonic())
    text = _table(soak, samples, before, after, entries, options)
    print(text)
    if options.out is not None:
        options.out.write_text(text)
    sys.exit(bool(soak.faults))


def _run(
    server: EditorServer, folder: Path, seconds: float, options: argparse.Namespace
) -> tuple[Soak, list[Sample]]:
    """All pages for so long, and 20 s of rest."""
    soak = Soak(server, folder, options.pause)
    samples: list[Sample] = []

    def watch(found: Sample) -> None:
        samples.append(found)
        print(
            f"{found.seconds:.0f} s: server {found.server / MIB:.1f} MiB, rendering "
            f"{found.rendering / MIB:.1f} MiB, {found.threads} threads, {found.files} files, "
            f"{soak.done.total()} actions, {len(soak.faults)} faults",
            flush=True,
        )

    soak.run(options.pages, seconds, options.every, watch)
    time.sleep(20.0)
    return soak, samples


def _entries(server: EditorServer) -> int:
    """Of the history."""
    with page(server) as (client, _):
        return len(client.joined["history"])


def _slope(samples: list[Sample], of: str) -> tuple[float, float]:
    """MiB an hour, and its standard error."""
    hours = np.array([one.seconds for one in samples]) / 3600.0
    sizes = np.array([getattr(one, of) for one in samples]) / MIB
    if len(samples) < 4:
        return float("nan"), float("nan")
    (slope, _), covariance = np.polyfit(hours, sizes, 1, cov=True)
    return float(slope), float(np.sqrt(covariance[0, 0]))


def _table(
    soak: Soak,
    samples: list[Sample],
    before: Sample,
    after: Sample,
    entries: int,
    options: argparse.Namespace,
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
    command = (
        f"--hours {options.hours:g} --warm {options.warm:g} --pages {options.pages} --pause {options.pause:g}"
    )
    return f"""# Hours of editing

{options.pages} pages that edit, play, have jobs rendered, hang up and come back for {options.hours:g} hours,
after {options.warm:g} minutes of the same that are not counted (the history has {entries} entries then; 500
is the most). Memory in MiB: 20 s after that, in the four quarters, and 20 s after the last page left;
the slope is in MiB an hour.

{cpu_model()}, {devices.threads()} cores, other work beside.

    python -m benchmarks.robustness.soak {command}

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
