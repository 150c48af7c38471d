"""Checkpoints of networks and of trainings: honest seeds, and how they are read."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from reader_seeds import Reader, written

from cagefield.formats.nerf.nerf_pytorch_config import read_config
from cagefield.training.checkpoint import read_checkpoint, write_checkpoint
from nerf_networks import krrish94_state, yenchenlin_state


def _torch_file(content: Callable[[], dict[str, Any]], old: bool) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        import torch

        def tensors(value: Any) -> Any:
            if isinstance(value, dict):
                return {name: tensors(part) for name, part in value.items()}
            return torch.from_numpy(np.array(value)) if isinstance(value, np.ndarray) else value

        torch.save(tensors(content()), folder / "a.tar", _use_new_zipfile_serialization=not old)

    return make


def _read_networks(folder: Path) -> None:
    from cagefield.formats.nerf.nerf_pytorch import read_checkpoint as read

    read(folder / "a.tar")


def _yenchenlin(width: int, depth: int) -> dict[str, Any]:
    return {"global_step": 5, "network_fn_state_dict": yenchenlin_state(0, width=width, depth=depth)}


def _krrish94(width: int) -> dict[str, Any]:
    return {
        "iter": 9,
        "model_coarse_state_dict": krrish94_state(0, width=width),
        "loss": 0.1,
        "psnr": 21.0,
    }


_CONFIG = """expname = x
dataset_type = blender
datadir = ./data
N_samples = 64
N_importance = 128
use_viewdirs = True
white_bkgd = True
"""
_CONFIG_YML = """dataset: {type: blender, basedir: x, near: 2.0, far: 6.0, no_ndc: true}
models:
  coarse: {log_sampling_xyz: true, log_sampling_dir: true, num_encoding_fn_xyz: 6}
nerf:
  validation: {num_coarse: 64, num_fine: 128, lindisp: false, white_background: true}
"""


def _import_networks(folder: Path) -> None:
    """Field that `cagefield import` makes of a checkpoint, before the baking."""
    from cagefield.formats.nerf.nerf_pytorch import read_checkpoint as read
    from cagefield.formats.nerf.nerf_pytorch_config import SamplingSettings
    from cagefield.scene.import_nerf_pytorch import import_nerf

    import_nerf(read(folder / "a.tar"), SamplingSettings(), None, None)


def _make_training(rows: int, folder: Path) -> None:
    noise = np.arange(30.0 * rows).reshape(rows, 30)
    write_checkpoint(folder / "a.training", "x", {"step": 3}, {"noise": noise})


def network_readers(width: int = 8, depth: int = 4, own: int = 16) -> dict[str, Reader]:
    """Of networks of yenchenlin's of a width and depth, and of krrish94's of a width `own`."""
    theirs, ours = partial(_yenchenlin, width, depth), partial(_krrish94, own)
    return {
        "nerf .tar, new": Reader(_torch_file(theirs, False), _read_networks, {"a.tar": "zip"}),
        "nerf .tar, old": Reader(_torch_file(theirs, True), _read_networks, {"a.tar": "bytes"}),
        "nerf .tar, imported": Reader(_torch_file(theirs, False), _import_networks, {"a.tar": "zip"}),
        "nerf .ckpt, new": Reader(_torch_file(ours, False), _read_networks, {"a.tar": "zip"}),
        "nerf .ckpt, old": Reader(_torch_file(ours, True), _read_networks, {"a.tar": "bytes"}),
    }


def training_reader(rows: int = 20) -> Reader:
    """Of a training's arrays, of 30 numbers a row."""
    return Reader(
        partial(_make_training, rows),
        lambda folder: read_checkpoint(folder / "a.training", "x"),
        {"a.training": "zip"},
    )


NETWORK_READERS: dict[str, Reader] = {
    **network_readers(),
    "nerf config": Reader(
        written("args.txt", lambda file: file.write_text(_CONFIG)),
        lambda folder: read_config(folder / "args.txt"),
        {"args.txt": "text"},
    ),
    "nerf config.yml": Reader(
        written("config.yml", lambda file: file.write_text(_CONFIG_YML)),
        lambda folder: read_config(folder / "config.yml"),
        {"config.yml": "yaml"},
    ),
    "training": training_reader(),
}
