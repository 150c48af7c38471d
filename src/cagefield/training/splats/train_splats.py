"""Training of a SplatField: from surface points, coarse to fine, by damped Gauss-Newton steps.

A run starts with splats at the data set's points and at points from plane sweeping (`initialization`,
`plane_sweep`). Each step renders one photo's view, propagates the error to every visible splat, and takes a
Gauss-Newton step of each splat: in `cpu_optimizer` on the CPU, in `device_optimizer` on a GPU, with equal
mathematics (`kernels.splat_backward`, `kernels.gauss_newton_splats`). The photos' resolution and the SH
degree grow during the run. Between steps, splats with a large error are split and splats without effect are
removed (`densification`).

On a CPU a run of given `steps` gives equal fields for equal seeds.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from cagefield.datasets.sfm.sparse_points import points_cache_folder, starting_points
from cagefield.datasets.views import Dataset
from cagefield.fields.splat_field import SplatField
from cagefield.training.evaluation import Evaluation, evaluate_views
from cagefield.training.loop import run_to_end
from cagefield.training.result import TrainResult
from cagefield.training.splats.splat_config import SplatConfig

if TYPE_CHECKING:
    from cagefield.training.splats.initialization import InitialSplats
    from cagefield.training.splats.scaffold import Context


def train_splat(
    dataset: Dataset,
    config: SplatConfig | None = None,
    *,
    seeds: InitialSplats | None = None,
    context: Context | None = None,
    checkpoint: Path | str | None = None,
    resume: bool = False,
    on_progress: Callable[[object], None] | None = None,
    on_stage: Callable[[str, float, str], None] | None = None,
    evaluate: bool = True,
) -> TrainResult[SplatField]:
    """SplatField trained on the data set's photos, with PSNR and SSIM on its test views.

    A capture without points first gets points from its poses (`starting_points`), which are cached; then the
    photos' surfaces are swept. `seeds` replace both. `context` surrounds a block of a capture. `on_stage`
    gets a stage's name, its progress, and a note. With `checkpoint`, the state of the run is written every
    minute and at the end, which Ctrl-C brings early (`finished` is then False); `resume` continues the
    checkpoint, on the same device or another. On a CPU a resumed run of given `steps` ends in the field of an
    uninterrupted one.

    Raises:
        DatasetError: no photos, or unreadable photos.
        CagefieldError: a checkpoint that is unreadable or of another configuration.
    """
    from cagefield.training.splats.splat_run import SplatRun

    config = config or SplatConfig()
    report = on_stage or (lambda stage, done, note: None)
    points = None
    if seeds is None and (dataset.unbounded or dataset.points is not None):
        points = starting_points(
            dataset, points_cache_folder(), on_progress=partial(report, "Finding points"), seed=config.seed
        )
    if seeds is None:
        report("Finding surfaces", 0.0, "")
    run = SplatRun(dataclasses.replace(dataset, points=points), config, seeds, context)
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
    return TrainResult(field, run.step, run.seconds, train.psnr, test, finished, run.cameras(), run.gains)
