"""`cagefield demo`: the whole chain on a built-in scene."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from cagefield.cli.options import Device, OptionalOutput


@dataclass(frozen=True)
class Demo:
    """Photograph the built-in digger, train a field, raise its arm, and write pictures before and after."""

    out: OptionalOutput = None
    """Folder for the results."""
    device: Device = "auto"
    """Where kernels run."""
    overwrite: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Replace the results of an earlier call."""

    def run(self) -> None:
        """Runs the chain and says where the results are."""
