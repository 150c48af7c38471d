"""`cagefield train`: posed photos to a scene folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from cagefield.cli.options import Device, Flag, Output, progress_bar
from cagefield.errors import CagefieldError


@dataclass(frozen=True)
class Train:
    """Train a field on posed photos and write a scene."""

    data: tyro.conf.Positional[Path]
    """Folder of a data set, or its transforms.json, poses_bounds.npy or COLMAP model."""
    out: Output
    """Scene folder."""
    minutes: float = 5.0
    """Time to train; Ctrl-C stops earlier and still writes the scene."""
    downscale: int | None = None
    """Shrink the photos by this factor; left out, until their longer side is 800 pixels or less."""
    holdout: int = 8
    """Keep every so-many-th photo for testing where the data set has no test views; 0 for none."""
    device: Device = "auto"
    """Where kernels run."""
    overwrite: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Replace the scene that is there."""

    def run(self) -> None:
        """Trains, writes the scene, prints the test PSNR."""
