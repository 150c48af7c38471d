"""Signatures of checkpoints: the JSON keys that earlier versions wrote stay readable."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cagefield.compute import devices
from cagefield.datasets import load_dataset
from cagefield.datasets.views import Dataset
from cagefield.procedural import make_scene
from cagefield.training.checkpoint import read_checkpoint, signature_options, write_checkpoint
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.splats.splat_run import SplatRun
from cagefield.training.voxels.voxel_config import VoxelConfig
from cagefield.training.voxels.voxel_run import VoxelRun

# Written by the version whose options had these names.
VOXELS = (
    '{"steps": 4, "minutes": null, "resolution": 16, "sh_degree": null, "seed": 0, "batch_rays": 4096, '
    '"patch": 4, "rate": null, "decay": 0.95, "damping": 0.05, "largest_step": 0.3, "smooth": null, '
    '"plain": null, "prune": 0.01, "step": 0.7, "exposure": null, "distortion": 0.0, "near": 0.15}'
)
SPLATS = (
    '{"steps": 4, "minutes": null, "splats": 100, "sh_degree": 2, "seed": 0, "antialiased": true, '
    '"exposure": null, "robust": false, "refine_poses": false, "background": 0.05, "rate": [1.8, 0.1], '
    '"damping": [0.1, 0.01], "cap": 0.15, "memory": [0.5, 0.98], "opaque": 0.003, "veil": 0.1, '
    '"structure": 0.02, "prune": 0.01, "dropout": 0.1}'
)
NERF = (
    '{"depth": 8, "width": 256, "octaves": [10, 4], "samples": [64, 128], "batch_rays": 1024, '
    '"rate": 0.0005, "precrop": 500, "noise": null, "ndc": null, "seed": 0, "half": null}'
)


@pytest.fixture(scope="module")
def photos(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return load_dataset(
        make_scene("plant", tmp_path_factory.mktemp("photos"), views=3, size=24, test_views=1)
    )


def views_and_sizes(photos: Dataset) -> str:
    return json.dumps([[view.name for view in photos.train], [[24, 24]] * len(photos.train)])[1:]


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["voxels", "splats"])
def test_a_checkpoint_of_earlier_option_names_is_continued(
    kind: str, photos: Dataset, tmp_path: Path
) -> None:
    def start() -> Any:
        if kind == "voxels":
            return VoxelRun(photos, VoxelConfig(steps=4, resolution=16, distortion_reg=0.0))
        return SplatRun(photos, SplatConfig(steps=4, splats=100))

    devices.start()
    run, path = start(), tmp_path / "checkpoint.npz"
    run.advance()
    run.store(path)
    signature = (
        ("[" + VOXELS if kind == "voxels" else '["splats", ' + SPLATS) + ", " + views_and_sizes(photos)
    )
    scalars, arrays = read_checkpoint(path, signature)
    write_checkpoint(path, signature, scalars, arrays)
    later = start()
    later.restore(path)
    assert later.step == 1


def test_signatures_of_a_nerf_have_the_earlier_option_names() -> None:
    from cagefield.training.nerf.nerf_config import CHECKPOINT_KEYS, NerfConfig

    options = signature_options(NerfConfig(), CHECKPOINT_KEYS)
    for name in ("steps", "minutes", "decay", "shown_samples"):
        del options[name]
    assert json.dumps(options) == NERF
