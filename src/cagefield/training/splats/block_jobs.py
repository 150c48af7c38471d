"""Trainings of a capture's blocks, and their files: splats, gains of the photos, copies of a refinement.

The record, which is written last, names the training by its key: without it, the training is not finished.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cagefield.datasets.views import Dataset
from cagefield.errors import CagefieldError
from cagefield.fields.splat_field import SplatField
from cagefield.files import json_text
from cagefield.files.atomic import replaced_file
from cagefield.files.safe_open import UnreadableError, open_regular
from cagefield.training.splats.blocks import Block
from cagefield.training.splats.refinement import (
    FAR_OWNER,
    REFINEMENT_START_PROGRESS,
    Copies,
    shared_copies,
)
from cagefield.training.splats.scaffold import Context, visible_splats
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.typing import Float32

_MAX_RECORD_BYTES = 1 << 22


@dataclass(frozen=True)
class BlockJob:
    """One block's training: photos and points, options with its own steps, and the files it writes.

    `key` is a digest of everything that the result depends on. The training of the scaffold has number -1
    and no `block`; without a `scaffold` the block is the whole capture. A refinement has the `first` training
    of its block, and those of its neighbors, of which only the files are read.
    """

    number: int
    dataset: Dataset
    config: SplatConfig
    folder: Path
    key: str
    block: Block | None = None
    scaffold: BlockJob | None = None
    first: BlockJob | None = None
    neighbors: tuple[BlockJob, ...] = ()

    @property
    def name(self) -> str:
        """Name of the training in messages; blocks count from 1."""
        name = "scaffold" if self.number < 0 else f"block {self.number + 1}"
        return name if self.first is None else f"{name}, refinement"

    @property
    def photo_count(self) -> int:
        """Number of the training's photos."""
        return len(self.dataset.train if self.block is None else self.block.photos)

    def path(self, suffix: str) -> Path:
        """A file of the block in the folder."""
        kind = "block" if self.first is None else "refined"
        stem = "scaffold" if self.number < 0 else f"{kind}-{self.number + 1:04d}"
        return self.folder / f"{stem}{suffix}"

    def context(self) -> Context | None:
        """Surroundings from the finished scaffold, for a refinement also from the neighbors; None without.

        Raises:
            CagefieldError: one of them is not finished, damaged, or of another training.
        """
        if self.scaffold is None or self.block is None:
            return None
        coarse = read_finished(self.scaffold)
        gains = coarse.gains[list(self.block.photos)]
        cameras = [view.camera for view in self.dataset.train]
        if self.first is None:
            outside = coarse.field.take(~self.block.trains(coarse.field.means))
            return Context(visible_splats(outside, cameras), gains, self.block)
        inside = self.block.is_far(coarse.field.means) | self.block.contains(coarse.field.means)
        for job in self.neighbors:
            inside |= job.block is not None and job.block.contains(coarse.field.means)
        frozen = visible_splats(coarse.field.take(~inside), cameras)
        return Context(frozen, gains, start_progress=REFINEMENT_START_PROGRESS)

    def copies(self) -> Copies | None:
        """Splats of a refinement: those of the first trainings and far ones; None of another training.

        Raises:
            CagefieldError: one of them is not finished, damaged, or of another training.
        """
        if self.first is None or self.block is None or self.scaffold is None:
            return None
        coarse = read_finished(self.scaffold).field
        fields = {self.number: self.block.own(read_finished(self.first).field)}
        for job in self.neighbors:
            if job.block is not None:
                fields[job.number] = job.block.own(read_finished(job).field)
        fields[FAR_OWNER] = coarse.take(self.block.is_far(coarse.means))
        return shared_copies(fields, self.number, [view.camera for view in self.dataset.train])


@dataclass(frozen=True)
class TrainedBlock:
    """A finished block's field with its photos' gains, steps and seconds."""

    field: SplatField
    gains: Float32
    steps: int
    seconds: float


def write_block(
    job: BlockJob, field: SplatField, gains: Float32, steps: int, seconds: float, copies: Copies | None = None
) -> None:
    """Write a finished training: its splats, with the `copies` of a refinement, and its record."""
    field.save(job.path(".safetensors"))
    if copies is not None:
        copies.save(job.path(".copies"))
    record = {"key": job.key, "steps": steps, "seconds": seconds, "gains": gains.tolist()}
    with replaced_file(job.path(".json")) as draft:
        draft.write_text(json.dumps(record), encoding="utf-8")


def read_block(job: BlockJob) -> TrainedBlock | None:
    """A finished block from its files, None where it is not finished or one of them is missing.

    Raises:
        CagefieldError: damaged files, and those of another training.
    """
    path = job.path(".json")
    kinds = (".json", ".safetensors") if job.first is None else (".json", ".safetensors", ".copies")
    if not all(job.path(kind).exists() for kind in kinds):
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
    if gains.shape != (job.photo_count, 3) or not np.isfinite(gains).all() or not (gains > 0).all():
        raise CagefieldError(f"{path} is damaged (its gains); remove it to train {job.name} again")
    return TrainedBlock(SplatField.load(job.path(".safetensors")), gains, steps, seconds)


def read_finished(job: BlockJob) -> TrainedBlock:
    """A finished block from its files.

    Raises:
        CagefieldError: it is not finished; damaged files, and those of another training.
    """
    done = read_block(job)
    if done is None:
        raise CagefieldError(f"{job.path('.safetensors')} is not there; the folder must be shared")
    return done


def read_copies(job: BlockJob) -> Copies:
    """Copies of a finished refinement from its files.

    Raises:
        CagefieldError: it is not finished; damaged files, and those of another training.
    """
    return Copies.load(job.path(".copies"), read_finished(job).field)
