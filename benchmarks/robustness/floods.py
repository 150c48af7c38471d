"""Floods an editor in every way, and measures how long another page waits for its answers meanwhile.

python -m benchmarks.robustness.floods [--seconds 20] [--floods 4] [--out FILE.md]

Four pages or programs flood at a time (`tests/robustness/flood_kinds.py`), in a process of their own. The
floods and the editor share this machine's processors, so the first row, of an editor that nobody floods, is
what to compare with.
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

from flood_kinds import FLOODS  # noqa: E402
from floods import during, memory  # noqa: E402

from certificates import certificate_of_localhost  # noqa: E402
from editor_server import editor_server  # noqa: E402
from scenes import ball_scene  # noqa: E402

EVERY = 0.2
"""Seconds between the questions of the page that is not part of the flood."""


def main() -> None:
    """See the module."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--floods", type=int, default=4)
    parser.add_argument("--only", nargs="*", default=None)
    parser.add_argument("--encrypted", action="store_true", help="all of them over TLS")
    parser.add_argument("--out", type=Path, default=None)
    options = parser.parse_args()
    rows = []
    for name in ("none", *FLOODS):
        if options.only and name not in options.only:
            continue
        with tempfile.TemporaryDirectory() as folder:
            ball_scene().save(Path(folder) / "scene")
            secure = []
            if options.encrypted:
                file, key = certificate_of_localhost(Path(folder))
                secure = ["--certificate", str(file), "--certificate-key", str(key)]
            with editor_server(Path(folder) / "scene", *secure) as server:
                before = memory(server.process.pid)
                flood = None if name == "none" else name
                found = during(server, flood, int(options.seconds / EVERY), EVERY, options.floods)
                time.sleep(0.5)
                grown = (found.most - before) >> 20
        waits = np.array(found.seconds)
        counts = f"{len(waits)} | {np.median(waits):.2f} | {np.quantile(waits, 0.95):.2f} | {waits.max():.2f}"
        rows.append(f"| {name} | {counts} | {int((waits > 1.0).sum())} | {grown} |")
        print(rows[-1], flush=True)
    if options.out is not None:
        options.out.write_text(_table(rows, options))


def _table(rows: list[str], options: argparse.Namespace) -> str:
    secure = " --encrypted" * options.encrypted
    return f"""# Floods

{options.floods} pages or programs flood one editor; another page asks a question every {EVERY:g} s. Seconds
from its question to the answer, how many took more than a second, and by how much the editor's process grew.

{cpu_model()}, {devices.threads()} cores, on which the floods and other work ran too.

    python -m benchmarks.robustness.floods --seconds {options.seconds:g} --floods {options.floods}{secure}

| flood | questions | median, s | 95 %, s | longest, s | above 1 s | memory, MiB |
| --- | ---: | ---: | ---: | ---: | ---: | ---: |
{chr(10).join(rows)}
"""


if __name__ == "__main__":
    main()
