"""`cagefield bench`: what is measured, one command each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import tyro

from benchmarks.commands.bench_captures import BenchCaptures
from benchmarks.commands.bench_edits import BenchEdits
from benchmarks.commands.bench_maps import BenchAblation, BenchGrids
from benchmarks.commands.bench_publish import BenchPublish
from benchmarks.commands.bench_training import BenchSpeed, BenchTraining


@dataclass(frozen=True)
class Bench:
    """Measurements: edits against ground truth, frame times, training curves, captures of real places."""

    what: tyro.conf.OmitSubcommandPrefixes[
        tyro.conf.OmitArgPrefixes[
            Annotated[BenchEdits, tyro.conf.subcommand("edits")]
            | Annotated[BenchPublish, tyro.conf.subcommand("publish")]
            | Annotated[BenchGrids, tyro.conf.subcommand("grids")]
            | Annotated[BenchAblation, tyro.conf.subcommand("ablation")]
            | Annotated[BenchSpeed, tyro.conf.subcommand("speed")]
            | Annotated[BenchTraining, tyro.conf.subcommand("training")]
            | Annotated[BenchCaptures, tyro.conf.subcommand("captures")]
        ]
    ]

    def run(self) -> None:
        """Runs the chosen benchmark."""
        self.what.run()
