"""Test PSNR against training time."""

from __future__ import annotations

import csv
import dataclasses
import io
import signal
import tempfile
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from cagefield.benchmarking.tables import Table, number
from cagefield.datasets import Dataset
from cagefield.errors import CagefieldError
from cagefield.fields.voxel import VoxelField
from cagefield.training.voxel import Progress, TrainResult, VoxelConfig, evaluate_views, train_voxel

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
    result: TrainResult

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

    The training is interrupted as by Ctrl-C at each share and resumed from its checkpoint, so it must run in
    the main thread.

    Raises:
        CagefieldError: no test views, another thread, shares that do not grow from 0 to 1.
        KeyboardInterrupt: Ctrl-C.
    """
    if not dataset.test:
        raise CagefieldError(f"data set {dataset.name} has no test views; choose another --holdout")
    if views < 1:
        raise CagefieldError(f"views is {views}; it must be at least 1")
    if any(a >= b for a, b in zip((0.0, *shares), (*shares, 1.0), strict=True)):
        raise CagefieldError(f"shares must grow and lie between 0 and 1, got {list(shares)}")
    if threading.current_thread() is not threading.main_thread():
        raise CagefieldError("a training curve must be measured in the main thread")
    some = dataset.test[:: -(-len(dataset.test) // views)]
    last: list[Progress] = []
    points: list[Point] = []

    def add(field: VoxelField, chosen: Sequence[object]) -> None:
        psnr, ssim = evaluate_views(field, tuple(chosen))  # type: ignore[arg-type]
        now = last[-1]
        points.append(
            Point(now.seconds, now.step, now.resolution, now.voxels, now.psnr, psnr, ssim, len(chosen))
        )
        if on_point is not None:
            on_point(points[-1])

    with tempfile.TemporaryDirectory(prefix="cagefield-") as folder:
        checkpoint = Path(folder) / "training.npz"
        for share in (*shares, 2.0):
            stopped: list[bool] = []

            def watch(progress: Progress, share: float = share, stopped: list[bool] = stopped) -> None:
                last[:] = [progress]
                if on_progress is not None:
                    on_progress(progress)
                if share <= progress.done < 1.0 and not stopped:
                    stopped.append(True)
                    signal.raise_signal(signal.SIGINT)

            result = train_voxel(
                dataset,
                config,
                checkpoint=checkpoint,
                resume=checkpoint.is_file(),
                on_progress=watch,
                evaluate=False,
            )
            if result.finished:
                break
            if not stopped:
                raise KeyboardInterrupt
            add(result.field, some)
    add(result.field, dataset.test)
    return Curve(tuple(points), result)


def _plain(value: float) -> str:
    return f"{value:.4f}" if isinstance(value, float) else str(value)
