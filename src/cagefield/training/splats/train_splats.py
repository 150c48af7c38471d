"""Training of a SplatField: from points on surfaces, coarse to fine, by damped Gauss-Newton steps.

A run begins with splats at the data set's points and at points that the photos agree on (`splat_seeds`,
`plane_sweep`). Each step takes one photo: the splats are drawn (`rendering.splats.rasterizer`), its error
goes
back to every splat that it shows (`kernels.splat_chain`), and each takes a Gauss-Newton step of its own
(`kernels.gauss_newton_splats`). Photos are small at first and grow, and so do the harmonics. Between steps,
splats with much error are split and those that show nothing are taken out (`splat_growth`).

On a CPU a run of given `steps` gives the same field for the same seed.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.datasets.sfm.sparse_points import points_cache, points_of
from cagefield.datasets.views import Dataset
from cagefield.fields.splat_field import SplatField
from cagefield.training.evaluation import Evaluation, evaluate_views
from cagefield.training.loop import run_to_end
from cagefield.training.splats.splat_config import SplatConfig

if TYPE_CHECKING:
    from cagefield.training.splats.initialization import Seeds


@dataclass(frozen=True, eq=False)
class SplatTrainResult:
    """A trained field and its figures: those of the test views, and the mean PSNR of ten training views, NaN
    where there are none.

    `cameras` are those of the training photos, in their order: not the data set's where poses were refined.
    """

    field: SplatField
    steps: int
    seconds: float
    train_psnr: float
    test: Evaluation
    gains: NDArray[np.float32]
    cameras: tuple[Camera, ...]
    finished: bool

    @property
    def test_psnr(self) -> float:
        """Mean raw PSNR of the test views in dB, NaN where there are none."""
        return self.test.psnr

    @property
    def test_ssim(self) -> float:
        """Mean SSIM of the test views, NaN where there are none."""
        return self.test.ssim


def train_splat(
    dataset: Dataset,
    config: SplatConfig | None = None,
    *,
    seeds: Seeds | None = None,
    checkpoint: Path | str | None = None,
    resume: bool = False,
    on_progress: Callable[[object], None] | None = None,
    on_stage: Callable[[str, float, str], None] | None = None,
    evaluate: bool = True,
) -> SplatTrainResult:
    """The splats trained on the data set's photos, with PSNR and SSIM on its test views.

    A capture without points gets them from its poses first (`points_of`), and keeps them in the user's cache;
    then the photos' surfaces are found. `seeds` take the place of both. `on_stage` is
    told what is being found, how far that is, and a note.
    With `checkpoint`, the state of the run is written there every minute and at its end, which may be early
    (Ctrl-C; `finished` is then False); `resume` continues it. On a CPU a resumed run of given `steps` ends
    in the same field as an uninterrupted one.

    Raises:
        DatasetError: no photos, or photos that cannot be read.
        CagefieldError: a checkpoint that cannot be read or was written with another configuration.
    """
    from cagefield.training.splats.splat_run import SplatRun

    config = config or SplatConfig()
    report = on_stage or (lambda stage, done, note: None)
    points = None
    if seeds is None and (dataset.unbounded or dataset.points is not None):
        points = points_of(
            dataset, points_cache(), on_progress=partial(report, "Finding points"), seed=config.seed
        )
    if seeds is None:
        report("Finding surfaces", 0.0, "")
    run = SplatRun(dataclasses.replace(dataset, points=points), config, seeds)
    finished = run_to_end(run, checkpoint=checkpoint, resume=resume, on_progress=on_progress)
    field = run.field()
    train, test = Evaluation(), Evaluation()
    if evaluate and len(field):
        moved = [
            dataclasses.replace(view, camera=camera)
            for view, camera in zip(dataset.train, run.cameras(), strict=True)
        ]
        some = moved[:: max(1, len(moved) // 10)]
        train, test = evaluate_views(field, some), evaluate_views(field, dataset.test)
    return SplatTrainResult(
        field, run.step, run.seconds, train.psnr, test, run.gains, run.cameras(), finished
    )
