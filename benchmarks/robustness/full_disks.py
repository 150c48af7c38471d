"""Runs every command that writes on disks that are too small for what it writes; as root, on Linux.

python -m benchmarks.robustness.full_disks [--short KIND] [--levels 6] [--only NAME ...] [--out FILE.md]

Each command (`tests/robustness/disk_commands.py`) is run with no room at all, with a page of 4 kB, and with
shares of the room that its result takes, so that it fails early and late: with nothing at its place, and
with an old result there that it is to replace. An editor is told to save, to keep its changes and to render
there, to export, and to open a file that a page sends. Minutes of one processor.

With --short disks lack something else than bytes (`tests/robustness/shortages.py`): names, a quota of bytes
or of names, or room that is missed only when files are closed; the last three are made by a library that is
loaded before the C library, which needs a C compiler. The exit status is 1 after a fault.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.common.machine import cpu_model
from cagefield.compute import devices

TESTS = Path(__file__).resolve().parents[2] / "tests"
sys.path[:0] = [str(TESTS / "robustness"), str(TESTS)]

import disk_commands  # noqa: E402
import disk_editors  # noqa: E402
import disks  # noqa: E402
import shortages  # noqa: E402
import write_limits  # noqa: E402


def main() -> None:
    """See the module."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--short", choices=tuple(shortages.SHORTAGES), default="bytes")
    parser.add_argument("--levels", type=int, default=6)
    parser.add_argument("--only", nargs="*", default=None)
    parser.add_argument("--out", type=Path, default=None)
    options = parser.parse_args()
    short = shortages.SHORTAGES[options.short]
    if short.needs_library and not write_limits.is_loaded():
        if reason := write_limits.why_not():
            parser.error(reason)
        command = [sys.executable, "-m", "benchmarks.robustness.full_disks", *sys.argv[1:]]
        sys.exit(subprocess.run(command, env=os.environ | write_limits.preloading()).returncode)
    rows, everything = [], []
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder)
        disk_commands.sources(source)
        for name in (*disk_commands.DISK_COMMANDS, *disk_editors.EDITORS):
            if options.only is not None and name not in options.only:
                continue
            found = disks.Filled()
            if name in disk_commands.DISK_COMMANDS:
                need = _fill(name, source, found, options.levels, short)
            else:
                need = disk_editors.fill(name, source, found, options.levels, short)
            everything.append(found)
            rows.append(_row(name, str(need) if "names" in options.short else f"{need / 1000:.0f}", found))
            print(rows[-1], *found.faults, sep="\n    ", flush=True)
    total = disks.Filled()
    for counted in ("runs", "fitted", "code", "line", "changed", "left"):
        setattr(total, counted, sum(getattr(found, counted) for found in everything))
    rows.append(_row("**all**", "", total))
    if options.out is not None:
        options.out.write_text(_table(rows, options))
    sys.exit(any(found.faults for found in everything))


def _fill(name: str, source: Path, found: disks.Filled, levels: int, short: shortages.Shortage) -> int:
    """Runs a command on all disks; what its result takes of what they lack."""
    command = disk_commands.DISK_COMMANDS[name]
    need = disks.room_for(command, source, short)
    for again in (True,) if command.on_disk else (False, True):
        for left in short.levels(round(need * command.on_the_way), levels):
            disks.fill(name, command, source, left, again, found, short)
    return need


def _row(name: str, need: str, found: disks.Filled) -> str:
    counts = (found.runs, found.fitted, found.code, found.line, found.changed, found.left)
    return f"| {name} | {need} | {' | '.join(map(str, counts))} |"


def _table(rows: list[str], options: argparse.Namespace) -> str:
    unit = "names" if "names" in options.short else "kB"
    short = f' --short "{options.short}"' * (options.short != "bytes")
    return f"""# Full disks

Every command that writes, on a file system (tmpfs) with less room than its result takes, with and without an
old result at its place. Fitted: runs that ended well. Code: those that failed otherwise than with exit code 2
(an editor: without an error on the page). Line: those that said anything but one line that names the place.
Changed: those after which what had been there was not bit by bit what it was. Left: those that left something
of their own of which they did not tell.

{cpu_model()}, {devices.threads()} cores.

    python -m benchmarks.robustness.full_disks{short} --levels {options.levels}

| command | result, {unit} | runs | fitted | code | line | changed | left |
| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
{chr(10).join(rows)}
"""


if __name__ == "__main__":
    main()
