"""Files of the trainings of a capture's blocks: splats, gains of the photos, and copies of a refinement.

The record, which is written last, names the training by its key: without it, the training is not finished.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cagefield.errors import CagefieldError
from cagefield.fields.splat_field import SplatField
from cagefield.files import json_text
from cagefield.files.atomic import replaced_file
from cagefield.files.safe_open import UnreadableError, open_regular
from cagefield.training.splats.refinement import Copies
from cagefield.typing import Float32

if TYPE_CHECKING:
    from cagefield.training.splats.train_blocks import BlockJob

_MAX_RECORD_BYTES = 1 << 22


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
