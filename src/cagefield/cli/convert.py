"""`cagefield convert`: a splat file as one of another format."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro

from cagefield.cli.options import Axes, Flag, SpzVersion, progress_bar
from cagefield.errors import CagefieldError
from cagefield.files.atomic import check_writable


@dataclass(frozen=True)
class Convert:
    """Write a splat file in another format, by its ending: .ply, .compressed.ply, .spz, .sog, .splat, .glb.

    USD too; and FOLDER/lod-meta.json, a streamed SOG: levels of detail, in files that a viewer loads as it
    needs them. Memory does not grow with the number of splats, except with --splats and for levels. .ksplat
    and splatfacto's checkpoints are read, too.
    """

    file: tyro.conf.Positional[Path]
    """Splats."""
    out: tyro.conf.Positional[Path]
    """File to write."""
    axes: Axes | None = None
    """Where x, y and z of the file point: right or left, up or down, front or back; as its format says."""
    out_axes: Axes | None = None
    """Axes to write; left out, those of the format."""
    spz_version: SpzVersion | None = None
    """Version of an .spz file to write; left out, 3, which Spark opens, too."""
    splats: int | None = None
    """Merge splats until so many are left, and print the PSNR that it costs; left out, all are kept."""
    overwrite: Flag = False
    """Replace the file that is there."""

    def run(self) -> None:
        """Convert, and print a summary of the written file."""
        from cagefield.formats.splats.splat_files import convert_splats, find_writer

        if self.splats is not None and self.splats < 1:
            raise CagefieldError(f"--splats must be at least 1, got {self.splats}")
        find_writer(self.out, self.spz_version)
        if self.out.exists() and not self.overwrite:
            raise CagefieldError(f"{self.out} exists; add --overwrite to replace it")
        if self.out.exists() and self.out.samefile(self.file):
            raise CagefieldError(f"{self.out} is the file to be converted; write to another one")
        check_writable(self.out)
        if self.splats is not None:
            self._decimate(self.splats)
            return
        with progress_bar("Converting") as move:
            count, degree = convert_splats(
                self.file,
                self.out,
                axes=self.axes,
                target_axes=self.out_axes,
                spz_version=self.spz_version,
                on_progress=lambda share: move(share, 1.0, ""),
            )
        self._print(count, degree)

    def _decimate(self, count: int) -> None:
        """Write at most `count` splats, and print the loss of their pictures."""
        from cagefield.fields.splat_decimation import decimate_splats
        from cagefield.formats.splats.splat_files import read_splats, write_splats
        from cagefield.rendering.splats.decimation_loss import VIEWS, decimation_loss

        before = read_splats(self.file, self.axes)
        with progress_bar("Decimating") as move:
            after = decimate_splats(before, count, lambda share: move(share, 1.0, ""))
        write_splats(after, self.out, self.out_axes, spz_version=self.spz_version)
        if len(after) < len(before):
            mean, least = decimation_loss(before, after)
            print(
                f"{len(before)} splats merged to {len(after)}: PSNR {mean:.2f} dB against the file, least"
                f" {least:.2f} dB, on {VIEWS} views around it"
            )
        else:
            print(f"{self.file} has {len(before)} splats, no more than {count}: all are kept")
        self._print(len(after), after.sh_degree)

    def _print(self, count: int, degree: int) -> None:
        from cagefield.cli.options import levels_and_bytes

        levels, size = levels_and_bytes(self.out)
        print(f"{count} splats, SH degree {degree}{levels}, {size / 1e6:.3g} MB written to {self.out}")
