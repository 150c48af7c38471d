"""Training of a capture in blocks, one after another or on a cluster, into one SplatField.

First the scaffold is trained (`scaffold`), on all photos at a reduced size, then each block with the
scaffold's splats around it. At last the blocks are refined (`refinement`): each takes the last part of its
steps with copies of all splats that its photos show, its own, those of its neighbors, and the far ones; the
merged field has the means of the copies. Blocks are neighbors where they share photos. A folder keeps the
finished ones, `block-0001.safetensors` with `block-0001.json`, `refined-0001.safetensors` and so on, and the
checkpoint of the block in training, so that a training goes on where it stopped. One block is in memory at a
time, a refinement with the splats of its neighbors, whose number does not grow with the capture. Each block
gets as many steps and splats for each of its photos as a training of the whole capture would.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from cagefield.datasets.sfm.sparse_points import points_cache_folder, starting_points
from cagefield.datasets.views import Dataset, SparsePoints
from cagefield.errors import CagefieldError
from cagefield.fields.splat_field import SplatField
from cagefield.training.evaluation import evaluate_views
from cagefield.training.result import TrainResult
from cagefield.training.splats.block_jobs import (
    BlockJob,
    TrainedBlock,
    read_block,
    read_copies,
    read_finished,
    write_block,
)
from cagefield.training.splats.blocks import Block, block_dataset, concatenate, divide, merge
from cagefield.training.splats.refinement import FAR_OWNER, consensus, train_copies
from cagefield.training.splats.scaffold import (
    MIN_SPLATS,
    scaffold_config,
    scaffold_dataset,
)
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.splats.train_splats import train_splat

REFINEMENT_STEPS_SHARE = 0.25
"""Steps of a block's refinement, as a share of the block's."""

OnStage = Callable[[str, float, str], None]


Trainer = Callable[[Sequence[BlockJob]], Iterable[BlockJob]]
"""Trains blocks into their files; yields each one that is finished."""


def check_shared_poses(count: int, refine_poses: bool) -> None:
    """Raises CagefieldError where several blocks would refine the poses of photos that they share."""
    if refine_poses and count > 1:
        raise CagefieldError(
            "blocks would move a shared photo's camera to different places; leave out --refine-poses"
        )


def plan_blocks(
    dataset: Dataset, config: SplatConfig, count: int, folder: Path, on_stage: OnStage | None = None
) -> tuple[tuple[Block, ...], tuple[BlockJob, ...]]:
    """The blocks of a capture, and their trainings.

    Raises:
        CagefieldError: too few points or photos for so many blocks, options that blocks cannot share.
    """
    check_shared_poses(count, config.refine_poses)
    points = starting_points(
        dataset,
        points_cache_folder(),
        on_progress=None if on_stage is None else partial(on_stage, "Finding points"),
        seed=config.seed,
    )
    if points is None:
        if count > 1:
            raise CagefieldError(f"{dataset.path}: without points there are no blocks; leave out --blocks")
        points = SparsePoints(np.zeros((0, 3)), np.zeros((0, 3), np.uint8))
    blocks = divide(dataset, points, count)
    jobs: list[BlockJob] = []
    refinements: list[SplatConfig] = []
    scaffold = None
    if count > 1:
        whole = replace(scaffold_dataset(dataset), points=points)
        coarse = scaffold_config(config)
        scaffold = BlockJob(-1, whole, coarse, folder, _key(None, coarse, whole))
        config = replace(config, background_share=0.0)
    for number, block in enumerate(blocks):
        share = len(block.photos) / len(dataset.train)
        part = replace(
            config,
            steps=max(1, round(config.steps * share)),
            minutes=None if config.minutes is None else config.minutes * share,
            splats=None if config.splats is None else max(MIN_SPLATS, round(config.splats * share)),
        )
        photos = block_dataset(dataset, points, block)
        if scaffold is not None:
            part, last = _divided(part)
            refinements.append(last)
        key = _key(block, part, dataset, "" if scaffold is None else scaffold.key)
        jobs.append(BlockJob(number, photos, part, folder, key, block, scaffold))
    return blocks, tuple(jobs) if scaffold is None else _refinements(jobs, refinements)


def _refinements(jobs: Sequence[BlockJob], configs: Sequence[SplatConfig]) -> tuple[BlockJob, ...]:
    """The refinements of the blocks' first trainings, with their options."""
    photos = [set() if job.block is None else set(job.block.photos) for job in jobs]
    # Only their files are read: with one photo and no points a job is small when it is sent to a worker.
    light = [
        replace(job, dataset=replace(job.dataset, train=job.dataset.train[:1], points=None)) for job in jobs
    ]
    found = []
    for job, config in zip(jobs, configs, strict=True):
        near = tuple(light[n] for n in range(len(jobs)) if n != job.number and photos[n] & photos[job.number])
        content = json.dumps(["copies", job.key, [other.key for other in near], dataclasses.asdict(config)])
        key = hashlib.sha256(content.encode()).hexdigest()
        found.append(replace(job, config=config, key=key, first=light[job.number], neighbors=near))
    return tuple(found)


def _divided(config: SplatConfig) -> tuple[SplatConfig, SplatConfig]:
    """Options of a block's first training and of its refinement, which share its steps or minutes."""
    first = max(1, round(config.steps * (1.0 - REFINEMENT_STEPS_SHARE)))
    minutes = None if config.minutes is None else config.minutes * (1.0 - REFINEMENT_STEPS_SHARE)
    rest = None if config.minutes is None else config.minutes * REFINEMENT_STEPS_SHARE
    return (
        replace(config, steps=first, minutes=minutes),
        replace(config, steps=max(1, config.steps - first), minutes=rest),
    )


def training_stages(jobs: Sequence[BlockJob]) -> tuple[tuple[BlockJob, ...], ...]:
    """Trainings whose end are `jobs`, the last of each block, in groups that follow one another."""
    if jobs[0].scaffold is None:
        return (tuple(jobs),)
    first = (
        replace(job, config=job.first.config, key=job.first.key, first=None, neighbors=())
        for job in jobs
        if job.first is not None
    )
    return (jobs[0].scaffold,), tuple(first), tuple(jobs)


def train_blocks(
    dataset: Dataset,
    blocks: Sequence[Block],
    jobs: Sequence[BlockJob],
    *,
    trainer: Trainer | None = None,
    on_stage: OnStage | None = None,
    evaluate: bool = True,
) -> TrainResult[SplatField]:
    """The merged field of all blocks, with PSNR and SSIM on the test views.

    Finished blocks in the jobs' folder are taken from there. `trainer` trains the others, None one after
    another. `finished` is False where Ctrl-C ended it early; the scaffold's splats then stand for the blocks
    that are not finished.

    Raises:
        CagefieldError: no block is finished; files in the folder of another training.
    """
    run = trainer or (lambda jobs: _one_by_one(jobs, on_stage))
    found: list[dict[int, TrainedBlock]] = []
    for stage in training_stages(jobs):
        found.append(_finished(stage, run))
        if len(found[-1]) < len(stage):
            break
    coarse = found.pop(0)[-1] if jobs[0].scaffold is not None and found[0] else None
    if not found or not found[0]:
        raise CagefieldError("no block is finished; the same command with --resume continues")
    first, refined = found[0], found[1] if len(found) > 1 else {}
    results = [result for stage in found for result in stage.values()]
    if coarse is None:
        only = first[0]
        field, gains = only.field, only.gains
    else:
        ended = [job for job in jobs if job.number in refined]
        field, gains = _merged(blocks, first, coarse.field, ended), coarse.gains
        results.append(coarse)
    some = dataset.train[:: max(1, len(dataset.train) // 10)] if evaluate else ()
    return TrainResult(
        field,
        sum(result.steps for result in results),
        sum(result.seconds for result in results),
        evaluate_views(field, some).psnr,
        evaluate_views(field, dataset.test if evaluate else ()),
        coarse is None or len(refined) == len(jobs),
        tuple(view.camera for view in dataset.train),
        gains,
    )


def _merged(
    blocks: Sequence[Block],
    first: Mapping[int, TrainedBlock],
    coarse: SplatField,
    refined: Sequence[BlockJob],
) -> SplatField:
    """The field of the blocks, with the means of the copies of the finished refinements."""
    there, far = sorted(first), blocks[0].is_far(coarse.means)
    fields = []
    for number in there:
        sharing = [job for job in refined if number in {job.number, *(near.number for near in job.neighbors)}]
        fields.append(consensus(number, blocks[number].own(first[number].field), map(read_copies, sharing)))
    backdrop = consensus(FAR_OWNER, coarse.take(far), map(read_copies, refined))
    near = merge([blocks[n] for n in there], fields, coarse.take(~far))
    return concatenate([near, backdrop])


def _finished(
    jobs: Sequence[BlockJob], run: Callable[[Sequence[BlockJob]], Iterable[BlockJob]]
) -> dict[int, TrainedBlock]:
    """Finished blocks by number, after `run` has trained those that are not there.

    Refinements have no splats here, of which there are several copies; `_merged` reads them.
    """
    found = {job.number: _lightened(job, done) for job in jobs if (done := read_block(job)) is not None}
    missing = [job for job in jobs if job.number not in found]
    for job in run(missing) if missing else ():
        found[job.number] = _lightened(job, read_finished(job))
    return found


def _lightened(job: BlockJob, done: TrainedBlock) -> TrainedBlock:
    return done if job.first is None else replace(done, field=done.field.take(np.arange(0)))


def train_block(job: BlockJob, on_stage: OnStage | None = None) -> bool:
    """Trains a block into its files, from its checkpoint if there is one; False where Ctrl-C ended it."""
    job.folder.mkdir(parents=True, exist_ok=True)
    checkpoint = job.path(".training")
    move = on_stage or (lambda stage, done, note: None)
    stage = f"Training {job.name}"

    def report(progress: object) -> None:
        move(stage, getattr(progress, "done", 0.0), str(progress))

    context, copies, resume = job.context(), job.copies(), checkpoint.is_file()
    if context is not None and copies is not None:
        move(stage, 0.0, "")
        trained = train_copies(
            copies, job.dataset, job.config, context, checkpoint=checkpoint, resume=resume, on_progress=report
        )
        if trained is None:
            return False
        copies, steps, seconds = trained
        write_block(job, copies.field, context.gains, steps, seconds, copies)
    else:
        result = train_splat(
            job.dataset,
            job.config,
            context=context,
            checkpoint=checkpoint,
            resume=resume,
            on_progress=report,
            on_stage=move,
            evaluate=False,
        )
        if not result.finished:
            return False
        gains = np.ones((len(job.dataset.train), 3), np.float32) if result.gains is None else result.gains
        write_block(job, result.field, gains, result.steps, result.seconds)
    checkpoint.unlink(missing_ok=True)
    return True


def _one_by_one(jobs: Sequence[BlockJob], on_stage: OnStage | None) -> Iterator[BlockJob]:
    for job in jobs:
        if not train_block(job, on_stage):
            return
        yield job


def _key(block: Block | None, config: SplatConfig, dataset: Dataset, scaffold: str = "") -> str:
    views = dataset.train if block is None else [dataset.train[n] for n in block.photos]
    names = [[view.name, view.camera.to_dict()] for view in views]
    core = None if block is None else block.core.tolist()
    content = json.dumps([core, dataclasses.asdict(config), names, scaffold], default=str)
    return hashlib.sha256(content.encode()).hexdigest()
