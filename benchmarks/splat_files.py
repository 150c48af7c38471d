"""Attacks the readers of splat files with damage, and converts a large file.

    python -m benchmarks.splat_files damage [--count 1000]
    python -m benchmarks.splat_files large [--splats 10000000] [--sh-degree 0]

Damage: files of each format with some bytes changed, or cut off; each must be read, or refused in one line.
Large: each conversion runs in a process of its own; its largest resident memory, seconds and size.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from cagefield.formats.splats.splat_ply import write_splat_ply
from cagefield.formats.splats.splat_table import BATCH_SPLATS, SplatBatch

PAIRS = (
    (".ply", ".spz"),
    (".spz", ".ply"),
    (".ply", ".compressed.ply"),
    (".ply", ".sog"),
    (".sog", ".ply"),
    (".ply", ".splat"),
    (".ply", ".glb"),
)


@dataclass
class Damage:
    """Damaged files."""

    count: int = 1000
    """Files of each format."""

    def run(self) -> None:
        from splat_damage import SLACK, attack, sample_files
        from splat_scenes import random_splats

        print("| format | files | read all the same | refused in a line | most memory / honest memory |")
        print("| --- | --: | --: | --: | --: |")
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            for ending, content in sample_files(random_splats(2000, degree=1), folder).items():
                refused, most, honest = attack(folder / f"a{ending}", content, self.count)
                assert most <= 2.0 * honest + SLACK, f"{ending}: {most / 1e6:.2f} MB, {honest / 1e6:.2f}"
                read = self.count - refused
                ratio = f"{most / 1e6:.2f} / {honest / 1e6:.2f} MB"
                print(f"| {ending} | {self.count} | {read} | {refused} | {ratio} |", flush=True)


@dataclass
class Large:
    """Conversions of a large file."""

    splats: int = 10_000_000
    sh_degree: int = 0

    def run(self) -> None:
        print("| from | to | seconds | largest memory, MiB | MB written |\n| --- | --- | --: | --: | --: |")
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            write_splat_ply(folder / "a.ply", _Made(self.splats, self.sh_degree))
            for source, target in PAIRS:
                out = folder / (f"b{target}" if source != ".ply" else f"a{target}")
                begin = time.perf_counter()
                done = subprocess.run(
                    [sys.executable, "-c", _CONVERT, str(folder / f"a{source}"), str(out)],
                    capture_output=True,
                    text=True,
                    check=True,
                )
                seconds = time.perf_counter() - begin
                size = out.stat().st_size / 1e6
                print(
                    f"| {source} | {target} | {seconds:.0f} | {done.stdout.strip()} | {size:.0f} |",
                    flush=True,
                )
                if source != ".ply" or target in (".splat", ".glb", ".compressed.ply"):
                    out.unlink()


_CONVERT = """
import resource, sys
from cagefield.formats.splats.splat_files import convert_splats
convert_splats(sys.argv[1], sys.argv[2])
print(round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024))
"""


@dataclass(frozen=True)
class _Made:
    """Splats on a wavy ground of 100 x 100 units, made as they are asked for."""

    count: int
    sh_degree: int
    antialiased: bool = False

    def batches(self) -> Iterator[SplatBatch]:
        chance = np.random.default_rng(0)
        for first in range(0, self.count, BATCH_SPLATS):
            n = min(BATCH_SPLATS, self.count - first)
            x, y = chance.uniform(-50.0, 50.0, (2, n))
            z = np.sin(x) * np.cos(0.7 * y) + 0.02 * chance.normal(size=n)
            sh = 0.2 * chance.normal(size=(n, (self.sh_degree + 1) ** 2, 3))
            yield SplatBatch(
                np.stack([x, y, z], axis=1),
                np.log(chance.uniform(0.005, 0.05, (n, 3))),
                _unit(chance.normal(size=(n, 4))),
                chance.uniform(0.1, 1.0, n),
                sh,
            )

    def sorted_batches(self) -> Iterator[SplatBatch]:
        raise NotImplementedError


def _unit(q: np.ndarray) -> np.ndarray:
    return np.asarray(q / np.linalg.norm(q, axis=1, keepdims=True))


Commands = Annotated[Damage, tyro.conf.subcommand("damage")] | Annotated[Large, tyro.conf.subcommand("large")]

if __name__ == "__main__":
    tyro.cli(Commands, description=__doc__).run()  # type: ignore[arg-type]
