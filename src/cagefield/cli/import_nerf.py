"""`cagefield import`: a NeRF that another program trained, as a scene."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import tyro

from cagefield.cli.options import Baking, BakingOptions, Device, Flag, Output
from cagefield.errors import CagefieldError


@dataclass(frozen=True)
class ImportNerf:
    """Read a nerf-pytorch checkpoint (.tar or .ckpt) and bake it, so that it can be edited: a scene."""

    checkpoint: tyro.conf.Positional[Path]
    """Checkpoint of yenchenlin/nerf-pytorch or krrish94/nerf-pytorch."""
    out: Output
    """Scene folder."""
    data: Path | None = None
    """Data set it was trained on: its cameras become the scene's; an orbit if left out."""
    config: Path | None = None
    """Config of its training; args.txt, config.txt or config.yml beside the checkpoint if left out."""
    fov_deg: float | None = None
    """Horizontal field of view of a forward-facing capture's photos, where --data is left out."""
    downscale: int | None = None
    """Shrink the data set's photos by this factor; left out, until their longer side is 800 or less."""
    baking: Baking = field(default_factory=BakingOptions)
    device: Device = "auto"
    overwrite: Flag = False
    """Replace the scene that is there."""

    def run(self) -> None:
        """Reads, bakes and writes; prints what it found."""
        from cagefield import devices
        from cagefield.cli.bake import bake_scene
        from cagefield.datasets import load_dataset
        from cagefield.formats.nerf_pytorch import read_checkpoint
        from cagefield.formats.nerf_pytorch_config import Settings, find_config, read_config
        from cagefield.formats.nerf_pytorch_import import import_nerf
        from cagefield.scene_files import check_destination

        check_destination(self.out, self.overwrite)
        if self.fov_deg is not None and not 1.0 <= self.fov_deg <= 170.0:
            raise CagefieldError(f"--fov-deg is {self.fov_deg}; it must be from 1 to 170")
        found = read_checkpoint(self.checkpoint)
        config = self.config or find_config(self.checkpoint)
        settings = Settings() if config is None else read_config(config)
        dataset = None if self.data is None else load_dataset(self.data, downscale=self.downscale)
        fov = None if self.fov_deg is None else math.radians(self.fov_deg)
        imported = import_nerf(found, settings, dataset, fov)
        devices.start(self.device)
        scene, figures = bake_scene(
            imported.field,
            imported.cameras,
            imported.background,
            self.baking,
            unbounded=imported.field.ndc is not None,
        )
        scene.save(self.out, overwrite=self.overwrite)
        print(found)
        print(f"sampling: {config if config else 'no config found, as for Blender scenes'}")
        print(f"{figures}\nscene written to {self.out}")
