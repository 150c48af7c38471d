"""`cagefield bench grids`: pictures of the shell maps themselves, without a scene."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from cagefield.cli.options import Output, check_file
from cagefield.errors import CagefieldError


@dataclass(frozen=True)
class BenchGrids:
    """What each shell map makes of a lattice when the inner cage is turned; writes a PNG."""

    out: Output = Path("docs/grids.png")
    """PNG file for the picture."""
    methods: tuple[str, ...] = ()
    """Only these maps: flow, trilinear, "mean value", harmonic."""
    degrees: tuple[float, ...] = (15.0, 45.0, 90.0, 180.0)
    """Angles by which the inner cage is turned, one row each."""
    panel: int = 300
    """Width and height of each panel in pixels."""
    overwrite: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Replace a file that is there."""

    def run(self) -> None:
        """Draws, says what was measured, writes the file."""
        from cagefield.benchmarking.grids import Style, grids
        from cagefield.benchmarking.methods import MAPS, check_known
        from cagefield.rendering.images import write_png

        check_known(self.methods, MAPS)
        if self.out.suffix.lower() != ".png":
            raise CagefieldError(f"{self.out} must end in .png")
        check_file(self.out, self.overwrite)
        style = Style(self.panel)
        write_png(self.out, grids(self.methods or MAPS, self.degrees, style, print))
        print(f"picture written to {self.out}")
