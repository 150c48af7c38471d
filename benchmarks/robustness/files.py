"""Damages files of every format that is read, and pages' messages, and counts what came of them.

python -m benchmarks.robustness.files [--inputs 10000] [--readers NAME ...] [--out FILE.md] [--large]

Each reader has a process of its own that tells of every input (`tests/robustness`), so that an input that
ends it, or that it never ends, is counted and the next one tried. Inputs with faults are kept in --kept.
About an hour of one processor for 10,000 of each. With --large the honest files are large, and memory is
judged without slack: some hours for 300 of each. The exit status is 1 after a fault.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import fields
from pathlib import Path

from benchmarks.common.machine import cpu_model
from cagefield.compute import devices

TESTS = Path(__file__).resolve().parents[2] / "tests"
sys.path[:0] = [str(TESTS / "robustness"), str(TESTS)]

from attack import HANG, LARGE_SLACK, SLACK, Outcome, attack  # noqa: E402
from large_readers import READERS as LARGE  # noqa: E402
from readers import READERS  # noqa: E402

_COLUMNS = ("tried", "refused", "read", "crashed", "hung", "over_memory")

assert set(_COLUMNS) < {field.name for field in fields(Outcome)}


def main() -> None:
    """See the module."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", default="")
    parser.add_argument("--large", action="store_true")
    parser.add_argument("--readers", nargs="*", default=None)
    parser.add_argument("--kept", type=Path, default=None)
    parser.add_argument("--out", type=Path, default=None)
    options = parser.parse_args()
    found: dict[str, Outcome] = {}
    known, row = (LARGE, _large_row) if options.large else (READERS, _row)
    for name in options.readers or known:
        last = options.first + options.inputs
        found |= attack([name], options.first, last, options.seed, options.kept, large=options.large)
        print(row(name, found[name]), flush=True)
        for fault in found[name].faults[:20]:
            print(f"    {fault}", flush=True)
    if options.out is not None:
        options.out.write_text((_large_table if options.large else _table)(found, options.inputs))
    sys.exit(any(one.faults for one in found.values()))


def _table(found: dict[str, Outcome], inputs: int) -> str:
    whole = Outcome()
    for one in found.values():
        whole.add(one)
    head = [
        *(name.replace("_", " ") for name in _COLUMNS),
        "honest file, MiB",
        "most memory, MiB",
        "slowest, s",
    ]
    return f"""# Damaged files and messages

{inputs} inputs for each reader, damaged as `tests/robustness/mutators.py` does it. Refused: one line that
says what is wrong. Read: what is left makes sense. Crashed: any other exception, or the end of the process.
Hung: over {HANG:g} s of a processor, or a minute without an answer. Over memory: above twice what the honest
file takes and {SLACK >> 20} MiB; memory is what the process grows by, after it has given back what it kept of
the inputs before.

{cpu_model()}, {devices.threads()} cores, other work beside.

    python -m benchmarks.robustness.files --inputs {inputs} --out benchmarks/results/robustness_files.md

| reader | {" | ".join(head)} |
| --- |{" ---: |" * len(head)}
{chr(10).join(_row(name, one) for name, one in found.items())}
{_row("**all**", whole)}
"""


def _large_table(found: dict[str, Outcome], inputs: int) -> str:
    whole = Outcome()
    for one in found.values():
        whole.add(one)
    counts = ["tried", "refused", "read", "crashed", "hung", "over twice"]
    head = [*counts, "honest, MiB", "most, MiB", "ratio", "slowest, s"]
    return f"""## Large files, judged without slack

{inputs} inputs for each reader of `tests/robustness/large_readers.py`. Over twice: more than twice what the
honest file takes{f" and {LARGE_SLACK >> 20} MiB" if LARGE_SLACK else ""}.

{cpu_model()}, {devices.threads()} cores, other work beside.

    python -m benchmarks.robustness.files --large --inputs {inputs} --out FILE.md

| reader | {" | ".join(head)} |
| --- |{" ---: |" * len(head)}
{chr(10).join(_large_row(name, one) for name, one in found.items())}
{_large_row("**all**", whole)}
"""


def _large_row(name: str, one: Outcome) -> str:
    counts = " | ".join(str(getattr(one, column)) for column in _COLUMNS)
    memory = (
        f"{one.honest / (1 << 20):.1f} | {one.most / (1 << 20):.1f} | {one.most / max(one.honest, 1):.2f}"
    )
    return f"| {name} | {counts} | {memory} | {one.slowest:.2f} |"


def _row(name: str, one: Outcome) -> str:
    counts = " | ".join(str(getattr(one, column)) for column in _COLUMNS)
    memory = f"{one.honest / (1 << 20):.1f} | {one.most / (1 << 20):.1f}"
    return f"| {name} | {counts} | {memory} | {one.slowest:.2f} |"


if __name__ == "__main__":
    main()
