"""`cagefield train --blocks`: the blocks of a capture, one after another or on a cluster."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from cagefield.cli.options import stages
from cagefield.errors import CagefieldError, line_of

if TYPE_CHECKING:
    from cagefield.datasets import Dataset
    from cagefield.fields.splat_field import SplatField
    from cagefield.scene.scene import Scene
    from cagefield.training.result import TrainResult
    from cagefield.training.splats.block_jobs import BlockJob
    from cagefield.training.splats.splat_config import SplatConfig


def train_in_blocks(
    dataset: Dataset,
    config: SplatConfig,
    count: int,
    folder: Path,
    *,
    anew: bool = False,
    cluster: str | None = None,
    cluster_tls: tuple[Path, Path, Path] | None = None,
    device: str = "auto",
) -> tuple[Scene, TrainResult[SplatField]]:
    """The scene of all blocks and the figures of the training; `folder` keeps finished blocks, unless `anew`.

    A line on stderr for each block tells of its photos and points; photos in no block are counted and named.

    Raises:
        CagefieldError: too few points or photos for so many blocks, files of another training.
    """
    from cagefield.datasets.views import join_names
    from cagefield.scene.scene import Scene
    from cagefield.training.splats.blocks import left_out
    from cagefield.training.splats.train_blocks import plan_blocks, train_blocks

    with stages() as move:
        blocks, jobs = plan_blocks(dataset, config, count, folder, move)
    for number, block in enumerate(blocks, start=1):
        print(f"block {number} of {count}: {block.describe()}", file=sys.stderr)
    if names := left_out(dataset, blocks):
        shown = f"{len(names)} of {len(dataset.train)} photos are in no block: {join_names(names)}"
        print(shown, file=sys.stderr)
    if anew:
        shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True, exist_ok=True)
    trainer = None if cluster is None else partial(_on_cluster, cluster, cluster_tls, device=device)
    try:
        with nullcontext() if trainer else stages() as move:
            result = train_blocks(dataset, blocks, jobs, trainer=trainer, on_stage=move)
    except OSError as error:
        kept = f"what is trained is kept in {folder}: the same command with --resume goes on from there"
        raise CagefieldError(f"{line_of(error)}; {kept}") from error
    return Scene.trained(result, dataset), result


def _on_cluster(
    cluster: str, tls: tuple[Path, Path, Path] | None, jobs: Sequence[BlockJob], device: str
) -> Iterator[BlockJob]:
    """The jobs, each once a worker has written its files."""
    from cagefield.cluster.connection import TlsFiles, parse_cluster
    from cagefield.cluster.tasks import Task, run_tasks
    from cagefield.training.splats.train_blocks import train_block

    named = {job.name: job for job in jobs}
    for name, _ in run_tasks(
        parse_cluster(cluster),
        {name: Task(train_block, (job,)) for name, job in named.items()},
        device=device,
        tls=TlsFiles(*tls) if tls else None,
    ):
        print(f"{name}: done", file=sys.stderr)
        yield named[name]
