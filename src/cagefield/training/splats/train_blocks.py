"""Training of a capture in blocks, one after another or on a cluster, into one SplatField.

First the scaffold is trained (`scaffold`), on all photos at a reduced size, then each block with the
scaffold's splats around it. A folder keeps the finished ones, `block-0001.safetensors` with
`block-0001.json`, and the checkpoint of the block in training, so that a training goes on where it stopped.
One block is in memory at a time. Each gets as many steps and splats for each of its photos as a training of
the whole capture would.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.datasets.sfm.sparse_points import points_cache_folder, starting_points
from cagefield.datasets.views import Dataset, SparsePoints
from cagefield.errors import CagefieldError
from cagefield.fields.splat_field import SplatField
from cagefield.files import json_text
from cagefield.files.atomic import replaced_file
from cagefield.files.safe_open import UnreadableError, open_regular
from cagefield.training.evaluation import evaluate_views
from cagefield.training.result import TrainResult
from cagefield.training.splats.blocks import Block, block_dataset, divide, merge
from cagefield.training.splats.scaffold import MIN_SPLATS, Context, scaffold_config, scaffold_dataset
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.splats.train_splats import train_splat

OnStage = Callable[[str, float, str], None]
_MAX_RECORD_BYTES = 1 << 22


@dataclass(frozen=True)
class BlockJob:
    """One block's training: photos and points, options with its own steps, and the files it writes.

    `key` is a digest of everything that the result depends on. The training of the scaffold has number -1
    and no `block`; without a `scaffold` the block is the whole capture.
    """

    number: int
    dataset: Dataset
    config: SplatConfig
    folder: Path
    key: str
    block: Block | None = None
    scaffold: BlockJob | None = None

    @property
    def name(self) -> str:
        """Name of the block in messages, from 1."""
        return "scaffold" if self.number < 0 else f"block {self.number + 1}"

    def path(self, suffix: str) -> Path:
        """A file of the block in the folder."""
        stem = "scaffold" if self.number < 0 else f"block-{self.number + 1:04d}"
        return self.folder / f"{stem}{suffix}"

    def context(self) -> Context | None:
        """Surroundings from the finished scaffold; None without one.

        Raises:
            CagefieldError: the scaffold is not finished, damaged, or of another training.
        """
        if self.scaffold is None or self.block is None:
            return None
        coarse = read_block(self.scaffold)
        if coarse is None:
            raise CagefieldError(
                f"{self.scaffold.path('.safetensors')} is not there; the folder must be shared"
            )
        cameras = [view.camera for view in self.dataset.train]
        return Context.around(self.block, coarse.field, coarse.gains[list(self.block.photos)], cameras)


@dataclass(frozen=True)
class TrainedBlock:
    """A finished block's field with its photos' gains, steps and seconds."""

    field: SplatField
    gains: np.ndarray[Any, np.dtype[np.float32]]
    steps: int
    seconds: float


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
    jobs, scaffold = [], None
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
        key = _key(block, part, dataset, "" if scaffold is None else scaffold.key)
        jobs.append(BlockJob(number, photos, part, folder, key, block, scaffold))
    return blocks, tuple(jobs)


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
    scaffold = jobs[0].scaffold
    coarse = None if scaffold is None else _finished([scaffold], run).get(-1)
    found = _finished(jobs, run) if scaffold is None or coarse is not None else {}
    if not found:
        raise CagefieldError("no block is finished; the same command with --resume continues")
    there = [blocks[number] for number in sorted(found)]
    results = [found[number] for number in sorted(found)]
    field = merge(there, [result.field for result in results], None if coarse is None else coarse.field)
    if coarse is None:
        gains = np.ones((len(dataset.train), 3), np.float32)
        gains[list(there[0].photos)] = results[0].gains
    else:
        gains = coarse.gains
        results.append(coarse)
    some = dataset.train[:: max(1, len(dataset.train) // 10)] if evaluate else ()
    return TrainResult(
        field,
        sum(result.steps for result in results),
        sum(result.seconds for result in results),
        evaluate_views(field, some).psnr,
        evaluate_views(field, dataset.test if evaluate else ()),
        len(found) == len(jobs),
        tuple(view.camera for view in dataset.train),
        gains,
    )


def _finished(
    jobs: Sequence[BlockJob], run: Callable[[Sequence[BlockJob]], Iterable[BlockJob]]
) -> dict[int, TrainedBlock]:
    """Finished blocks by number, after `run` has trained those that are not there."""
    found = {job.number: done for job in jobs if (done := read_block(job)) is not None}
    missing = [job for job in jobs if job.number not in found]
    for job in run(missing) if missing else ():
        done = read_block(job)
        if done is None:
            raise CagefieldError(f"{job.path('.safetensors')} is not there; the folder must be shared")
        found[job.number] = done
    return found


def train_block(job: BlockJob, on_stage: OnStage | None = None) -> bool:
    """Trains a block into its files, from its checkpoint if there is one; False where Ctrl-C ended it."""
    job.folder.mkdir(parents=True, exist_ok=True)
    checkpoint = job.path(".training")
    move = on_stage or (lambda stage, done, note: None)
    stage = f"Training {job.name}"
    result = train_splat(
        job.dataset,
        job.config,
        context=job.context(),
        checkpoint=checkpoint,
        resume=checkpoint.is_file(),
        on_progress=lambda progress: move(stage, getattr(progress, "done", 0.0), str(progress)),
        on_stage=move,
        evaluate=False,
    )
    if not result.finished:
        return False
    gains = np.ones((len(job.dataset.train), 3), np.float32) if result.gains is None else result.gains
    result.field.save(job.path(".safetensors"))
    record = {"key": job.key, "steps": result.steps, "seconds": result.seconds, "gains": gains.tolist()}
    with replaced_file(job.path(".json")) as draft:
        draft.write_text(json.dumps(record), encoding="utf-8")
    checkpoint.unlink(missing_ok=True)
    return True


def read_block(job: BlockJob) -> TrainedBlock | None:
    """A finished block from its files, None where it is not finished.

    Raises:
        CagefieldError: damaged files, and those of another training.
    """
    path = job.path(".json")
    if not path.exists():
        return None
    try:
        with open_regular(path) as file:
            record = json_text.loads(file.read(_MAX_RECORD_BYTES).decode("utf-8"))
        key, steps, seconds = str(record["key"]), int(record["steps"]), float(record["seconds"])
        gains = np.array(record["gains"], np.float32)
    except (
        OSError,
        UnreadableError,
        ValueError,
        TypeError,
        LookupError,
        AttributeError,
        OverflowError,
    ) as error:
        raise CagefieldError(
            f"{path} is damaged ({error!s:.80}); remove it to train {job.name} again"
        ) from None
    if key != job.key:
        raise CagefieldError(
            f"{path} is of other photos or options; give those of the first run, or --overwrite"
        )
    if gains.shape != (len(job.dataset.train), 3) or not np.isfinite(gains).all() or not (gains > 0).all():
        raise CagefieldError(f"{path} is damaged (its gains); remove it to train {job.name} again")
    return TrainedBlock(SplatField.load(job.path(".safetensors")), gains, steps, seconds)


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
