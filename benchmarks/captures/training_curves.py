"""Test PSNR against training time."""

from __future__ import annotations

import csv
import dataclasses
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from benchmarks.common.tables import Table, number
from cagefield.datasets import Dataset, View
from cagefield.errors import CagefieldError
from cagefield.fields.voxel_field import VoxelField
from cagefield.training.evaluation import evaluate_views
from cagefield.training.progress import Progress, Snapshots
from cagefield.training.result import TrainResult
from cagefield.training.voxels.train_voxels import train_voxel
from cagefield.training.voxels.voxel_config import VoxelConfig

SHARES = (0.03, 0.06, 0.12, 0.25, 0.4, 0.55, 0.7, 0.85)
"""Shares of the training at which the curve has a point, before the last at its end."""


@dataclass(frozen=True)
class Point:
    """Where a training stood: seconds of training alone, and mean PSNR and SSIM on `views` test views."""

    seconds: float
    step: int
    resolution: int
    voxels: int
    train_psnr: float
    test_psnr: float
    test_ssim: float
    views: int


@dataclass(frozen=True, eq=False)
class Curve:
    """The points of one training, the last on all test views; `result` is that of the whole training."""

    points: tuple[Point, ...]
    result: TrainResult[VoxelField]

    def csv(self) -> str:
        """The points as comma-separated values with a header."""
        out = io.StringIO()
        names = [column.name for column in dataclasses.fields(Point)]
        writer = csv.DictWriter(out, names, lineterminator="\n")
        writer.writeheader()
        for point in self.points:
            values = dataclasses.asdict(point)
            writer.writerow({name: _plain(values[name]) for name in names})
        return out.getvalue()

    def table(self, name: str, notes: Sequence[str] = ()) -> Table:
        """The points as a table."""
        rows = tuple(
            (
                number(point.seconds, 1),
                str(point.step),
                str(point.resolution),
                str(point.voxels),
                number(point.train_psnr),
                number(point.test_psnr),
                number(point.test_ssim, 4),
                str(point.views),
            )
            for point in self.points
        )
        explained = (
            "Seconds: of training alone, evaluation left out. Train PSNR: running mean over the batches. "
            "Test PSNR and SSIM: mean over so many of the test views, never trained on; the last row: all.",
        )
        return Table(
            f"Test PSNR against training time: {name}",
            ("seconds", "steps", "resolution", "voxels", "train PSNR", "test PSNR", "SSIM", "views"),
            rows,
            (*explained, *notes),
            names=0,
        )


def measure(
    dataset: Dataset,
    config: VoxelConfig,
    *,
    views: int = 10,
    shares: Sequence[float] = SHARES,
    on_progress: Callable[[Progress], None] | None = None,
    on_point: Callable[[Point], None] | None = None,
) -> Curve:
    """The curve of one training; its points are on `views` test views, spread evenly over the split.

    Raises:
        CagefieldError: no test views, shares that do not grow from 0 to 1.
        KeyboardInterrupt: Ctrl-C.
    """
    if not dataset.test:
        raise CagefieldError(f"data set {dataset.name} has no test views; choose another --holdout")
    if views < 1:
        raise CagefieldError(f"views is {views}; it must be at least 1")
    if any(a >= b for a, b in zip((0.0, *shares), (*shares, 1.0), strict=True)):
        raise CagefieldError(f"shares must grow and lie between 0 and 1, got {list(shares)}")
    some = dataset.test[:: -(-len(dataset.test) // views)]
    points: list[Point] = []
    last: list[Progress] = []

    def add(now: Progress, field: VoxelField, chosen: tuple[View, ...] = some) -> None:
        test = evaluate_views(field, chosen)
        points.append(
            Point(
                now.seconds, now.step, now.resolution, now.voxels, now.psnr, test.psnr, test.ssim, len(chosen)
            )
        )
        if on_point is not None:
            on_point(points[-1])

    def watch(progress: Progress) -> None:
        last[:] = [progress]
        if on_progress is not None:
            on_progress(progress)

    result = train_voxel(
        dataset, config, on_progress=watch, snapshots=_snapshots(config, shares, add), evaluate=False
    )
    if not result.finished:
        raise KeyboardInterrupt
    add(last[0], result.field, dataset.test)
    return Curve(tuple(points), result)


def _snapshots(
    config: VoxelConfig, shares: Sequence[float], on_field: Callable[[Progress, VoxelField], None]
) -> Snapshots:
    """Snapshots at shares of a training that `config` limits by the clock or by steps."""
    if config.minutes is not None:
        return Snapshots(on_field, minutes=tuple(share * config.minutes for share in shares))
    steps = [max(1, round(share * config.steps)) for share in shares]
    return Snapshots(on_field, steps=tuple(step for step in steps if step < config.steps))


def _plain(value: float) -> str:
    return f"{value:.4f}" if isinstance(value, float) else str(value)
