"""Checkpoints that trainings go on from: honest seeds, and runs that take them and make a step."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from reader_seeds import Reader

STATE = "x.training"


@cache
def _run(kind: str, size: int, photos: Path) -> Any:
    """A training of three tiny photos that has made two steps.

    `size` is a grid's resolution, a number of splats, or the width of networks.
    """
    from cagefield.compute import devices
    from cagefield.datasets import load_dataset

    devices.start()
    dataset = load_dataset(photos)
    if kind == "voxel":
        from cagefield.training.voxels.voxel_config import VoxelConfig
        from cagefield.training.voxels.voxel_run import VoxelRun

        run: Any = VoxelRun(dataset, VoxelConfig(steps=4, resolution=size))
    elif kind == "splat":
        from cagefield.training.splats.splat_config import SplatConfig
        from cagefield.training.splats.splat_run import SplatRun

        run = SplatRun(dataset, SplatConfig(steps=4, splats=size))
        if size > len(run.state):
            run.state.take(np.resize(np.arange(len(run.state)), size))
    else:
        from cagefield.training.nerf.nerf_config import NerfConfig
        from cagefield.training.nerf.nerf_run import NerfRun

        run = NerfRun(dataset, NerfConfig(steps=4, width=size, depth=2, samples=(4, 4), batch_rays=16))
    for _ in range(2):
        run.advance()
    return run


def _training(kind: str, size: int) -> Reader:
    def make(folder: Path) -> None:
        from cagefield.procedural import make_scene

        make_scene("chair", folder / "photos", views=3, size=12, test_views=1, depth="none")
        _run(kind, size, folder / "photos").store(folder / STATE)

    def read(folder: Path) -> None:
        run = _run(kind, size, folder / "photos")
        run.restore(folder / STATE)
        run.progress()
        if run.done < 1.0:
            run.advance()
        run.store(folder / "again.training")

    return Reader(make, read, {STATE: "zip"})


def _block(splats: int) -> Reader:
    """A finished block of a training in blocks: its splats, and its photos' gains."""

    def make(folder: Path) -> None:
        from splat_scenes import ball_of_splats

        ball_of_splats(splats).save(folder / "block-0001.safetensors")
        record = {"key": "known", "steps": 9, "seconds": 1.5, "gains": [[1.0, 0.9, 1.1]] * 40}
        (folder / "block-0001.json").write_text(json.dumps(record), encoding="utf-8")

    def read(folder: Path) -> None:
        from cagefield.training.splats.block_jobs import BlockJob, read_block
        from cagefield.training.splats.splat_config import SplatConfig

        dataset: Any = SimpleNamespace(train=(None,) * 40)
        read_block(BlockJob(0, dataset, SplatConfig(), folder, "known"))

    return Reader(make, read, {"block-0001.json": "json", "block-0001.safetensors": "safetensors"})


def _copies(splats: int) -> Reader:
    """A refinement's copies of splats: owner, row and steps of each."""

    def make(folder: Path) -> None:
        from cagefield.training.splats.refinement import Copies
        from splat_scenes import ball_of_splats

        field = ball_of_splats(splats)
        rows = np.arange(len(field), dtype=np.int32)
        Copies(field, rows % 3 - 1, rows, rows).save(folder / "refined-0001.copies")

    def read(folder: Path) -> None:
        from cagefield.training.splats.refinement import Copies, consensus
        from splat_scenes import ball_of_splats

        field = ball_of_splats(splats)
        consensus(0, field, [Copies.load(folder / "refined-0001.copies", field)])

    return Reader(make, read, {"refined-0001.copies": "safetensors"})


def training_readers(resolution: int = 16, splats: int = 100, width: int = 8) -> dict[str, Reader]:
    """Of trainings of fields of some size."""
    return {
        "training, voxels": _training("voxel", resolution),
        "training, splats": _training("splat", splats),
        "training, nerf": _training("nerf", width),
        "training, block": _block(splats),
        "training, refinement": _copies(splats),
    }


TRAINING_READERS = training_readers()
