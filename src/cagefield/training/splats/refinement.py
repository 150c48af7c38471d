"""Refinement of a capture's blocks: copies of the same splats, trained in several blocks, and their means.

A block is refined with all splats that its photos show: its own, its neighbors', and the scaffold's far
ones, of which each block trains copies. The merged field has the mean of a splat's copies, weighted by the
number of steps that each has taken: blocks whose photos show a splat often count more, and those that do not
show it leave it as it is. Blocks meet in no other way, so that many machines refine them, in any order.

Where the surroundings of a block are frozen instead, several blocks correct one error of a photo at once, as
if each were alone, and far content, which no block may move, keeps the detail of the scaffold.

Notation: owner of a splat, the block whose core contained it after the first trainings, or FAR_OWNER; row,
its number among the owner's splats.

Source: one round of federated averaging (McMahan et al. 2017), with splats as in the consensus of blocks of
DOGS (Chen and Lee 2024).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.datasets.views import Dataset
from cagefield.errors import FieldError
from cagefield.fields.field_files import read_tensors, write_tensors
from cagefield.fields.splat_field import SplatField
from cagefield.training.loop import run_to_end
from cagefield.training.splats.blocks import concatenate
from cagefield.training.splats.densification import needle_mask
from cagefield.training.splats.initialization import InitialSplats
from cagefield.training.splats.scaffold import Context, visible_mask
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.splats.splat_state import SplatState

if TYPE_CHECKING:
    from cagefield.typing import Array

FAR_OWNER = -1
"""Owner of the scaffold's far splats."""

REFINEMENT_START_PROGRESS = 0.6
"""Progress of a training, in its learning rate and resolution, at which a refinement begins."""

_KIND, _VERSION = "SplatCopies", "1"
_NUMBERS = ("owners", "rows", "visits")


@dataclass(frozen=True, eq=False)
class Copies:
    """Splats trained in one block.

    Attributes:
        field: N splats.
        owners: [N] number of the block of each, or FAR_OWNER.
        rows: [N] row of each among its owner's splats.
        visits: [N] steps that each has taken.
    """

    field: SplatField
    owners: NDArray[np.int32]
    rows: NDArray[np.int32]
    visits: NDArray[np.int32]

    def save(self, path: Path) -> None:
        """Write the numbers to a safetensors file; the splats are saved by themselves."""
        write_tensors(
            path, {name: getattr(self, name) for name in _NUMBERS}, {"kind": _KIND, "version": _VERSION}
        )

    @classmethod
    def load(cls, path: Path, field: SplatField) -> Copies:
        """Copies of a field's splats, with the numbers of a file written by `save`.

        Raises:
            FieldError: the file is missing, damaged, or of another number of splats.
        """
        _, found = read_tensors(path, _KIND, _VERSION, "train the block again")
        whole = all(
            name in found and found[name].shape == (len(field),) and found[name].dtype == np.int32
            for name in _NUMBERS
        )
        if not whole or (found["rows"] < 0).any() or (found["visits"] < 0).any():
            raise FieldError(
                f"{path} is damaged (its numbers of splats); remove it to refine the block again"
            )
        return cls(field, *(found[name] for name in _NUMBERS))


def shared_copies(fields: Mapping[int, SplatField], own: int, cameras: Sequence[Camera]) -> Copies:
    """Copies of all splats of the owner `own`, and of the other owners' that the cameras show."""
    parts, owners, rows = [], [], []
    for owner, field in fields.items():
        shown = np.ones(len(field), bool) if owner == own else visible_mask(field, cameras)
        parts.append(field.take(shown))
        rows.append(np.flatnonzero(shown).astype(np.int32))
        owners.append(np.full(len(rows[-1]), owner, np.int32))
    together = concatenate(parts)
    return Copies(together, np.concatenate(owners), np.concatenate(rows), np.zeros(len(together), np.int32))


def train_copies(
    copies: Copies,
    dataset: Dataset,
    config: SplatConfig,
    context: Context,
    *,
    checkpoint: Path,
    resume: bool,
    on_progress: Callable[[object], None] | None = None,
) -> tuple[Copies, int, float] | None:
    """The copies after a training on a block's photos, with its steps and seconds; None after Ctrl-C.

    Nothing is known of the photos' free space.

    Raises:
        DatasetError: unreadable photos.
        CagefieldError: a checkpoint that is unreadable or of another configuration.
    """
    from cagefield.training.splats.splat_run import SplatRun

    cameras = [view.camera for view in dataset.train]
    seeds = InitialSplats(
        SplatState.from_field(copies.field, (config.sh_degree + 1) ** 2),
        [np.zeros((2, camera.height, camera.width), np.float32) for camera in cameras],
    )
    run = SplatRun(replace(dataset, points=None), config, seeds, replace(context, keeps_splats=True))
    if not run_to_end(run, checkpoint=checkpoint, resume=resume, on_progress=on_progress):
        return None
    state = run.state
    state.take(np.flatnonzero(~state.frozen))
    field = state.to_field(config.antialiased, dataset.bounds, dataset.unbounded)
    return replace(copies, field=field, visits=state.hits), run.step, run.seconds


def consensus(owner: int, start: SplatField, trained: Iterable[Copies]) -> SplatField:
    """An owner's splats, each the mean of its copies weighted by their visits, without needles.

    Opacities are averaged as log odds, sigmas as logarithms. Splats that no step has changed are those of
    `start`.

    Raises:
        FieldError: copies of splats that the owner does not have.
    """
    terms = start.sh.shape[1]
    origin = SplatState.from_field(start, terms)
    names = ("means", "log_scales", "quaternions", "logits", "sh")
    sums = {name: np.zeros(getattr(origin, name).shape) for name in names}
    weights = np.zeros(len(start))
    for copies in trained:
        mine = np.flatnonzero((copies.owners == owner) & (copies.visits > 0))
        rows, visits = copies.rows[mine], copies.visits[mine].astype(np.float64)
        if len(rows) and rows.max() >= len(start):
            raise FieldError("copies of splats that are not there; remove the refinements and go on")
        state = SplatState.from_field(copies.field.take(mine), terms)
        # q and -q are one rotation.
        signs = np.sign((state.quaternions * origin.quaternions[rows]).sum(axis=1, keepdims=True))
        state.quaternions *= np.where(signs < 0, -1.0, 1.0)
        np.add.at(weights, rows, visits)
        for name, total in sums.items():
            np.add.at(total, rows, _over(visits, total) * getattr(state, name))
    moved = np.flatnonzero(weights > 0)
    for name, total in sums.items():
        getattr(origin, name)[moved] = total[moved] / _over(weights[moved], total)
    field = origin.to_field(start.antialiased, start.bounds, start.unbounded)
    return field.take(~needle_mask(field.log_scales))


def _over(weights: Array, values: Array) -> Array:
    """Weights [N] with as many axes as the values have."""
    return weights.reshape(-1, *[1] * (values.ndim - 1))
