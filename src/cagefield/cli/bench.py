"""`cagefield bench`: the benchmarks of a source checkout; the installed package holds none."""

from __future__ import annotations

import importlib
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cagefield
from cagefield.errors import CagefieldError


@dataclass(frozen=True)
class Bench:
    """Measurements: edits against ground truth, frame times, training curves, captures of real places.

    Part of the source checkout.
    """

    def run(self) -> None:
        """Raises CagefieldError: benchmarks are not installed."""
        raise CagefieldError(
            "the benchmarks are part of the source checkout, not of the installed package; in the checkout "
            "run `pip install -e '.[dev]'`, then this command, or `python -m benchmarks`"
        )


def bench_command() -> Any:
    """The class of the `bench` command: the checkout's, or `Bench` where there is none."""
    checkout = Path(cagefield.__file__).resolve().parents[2]
    if "benchmarks" not in sys.modules:
        if not (checkout / "benchmarks" / "commands" / "bench.py").is_file():
            return Bench
        sys.path.append(str(checkout))
    return importlib.import_module("benchmarks.commands.bench").Bench
