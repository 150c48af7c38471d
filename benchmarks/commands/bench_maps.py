"""`cagefield bench grids` and `bench ablation`: pictures of shell maps, and what an edit's choices do."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from cagefield.cli.options import Device, Flag, Output, Training, TrainingOptions, check_file, progress_bar
from cagefield.errors import CagefieldError
from cagefield.files.safe_open import real_path

if TYPE_CHECKING:
    from benchmarks.common.cases import Case
    from benchmarks.common.workbench import Workbench
    from benchmarks.edits.ablations import Ablation


@dataclass(frozen=True)
class BenchGrids:
    """A lattice under each shell map when the inner cage is turned; writes a PNG."""

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
        from benchmarks.edits.methods import MAPS, check_known
        from benchmarks.edits.warp_grids import Style, grids
        from cagefield.images.image_files import write_png

        check_known(self.methods, MAPS)
        if self.out.suffix.lower() != ".png":
            raise CagefieldError(f"{self.out} must end in .png")
        check_file(self.out, self.overwrite)
        style = Style(self.panel)
        write_png(self.out, grids(self.methods or MAPS, self.degrees, style, print))
        print(f"picture written to {self.out}")


@dataclass(frozen=True)
class BenchAblation:
    """Effect of one option of an edit, on a trained built-in scene; writes a picture and a Markdown table."""

    what: tyro.conf.Positional[Literal["outer-size", "resolution", "discrete-continuous", "limits"]]
    """The size of the outer cage; nodes of the lattice; discrete or continuous; what editing cannot do."""
    out: Output = Path("docs/ablations")
    """Folder for both, named after the ablation."""
    scene: str = ""
    """Scene of the edit; left out: microphone, for the limits plant."""
    edit: str = ""
    """Edit of that scene, discrete for the limits; left out: push_head, for the limits move_pinecone."""
    workdir: Path = Path("runs/bench")
    """Folder with the photos and fields of `bench edits` with the same options; what is missing is made."""
    views: int = 100
    """Number of training photos of the scene."""
    size: int = 400
    """Width and height of the photos in pixels."""
    test_views: int = 20
    """Number of test photos."""
    training: Training = field(default_factory=TrainingOptions)
    compared_size: int = 128
    """Width and height of the pictures that figures are taken from, whose truth is slow to render."""
    compared_views: int = 3
    """Number of them."""
    picture_size: int = 320
    """Width and height of each panel of the picture in pixels."""
    device: Device = "auto"
    """Where kernels run."""
    overwrite: Flag = False
    """Replace files that are there."""

    def run(self) -> None:
        """Trains what is missing, measures, writes both files."""
        from benchmarks.commands.command_lines import command_line
        from benchmarks.common.cases import chosen
        from benchmarks.common.machine import Machine
        from benchmarks.common.tables import write_text
        from benchmarks.common.workbench import Settings, Workbench
        from benchmarks.edits.ablations import with_notes
        from cagefield.compute import devices
        from cagefield.files.atomic import replaced_file
        from cagefield.images.image_files import write_png

        usual = ("plant", "move_pinecone") if self.what == "limits" else ("microphone", "push_head")
        if bool(self.scene) != bool(self.edit):
            raise CagefieldError("--scene and --edit go together; give both or none")
        scene, edit = (self.scene, self.edit) if self.scene else usual
        (case,) = chosen([scene], [edit])
        if (case.kind == "continuous") == (self.what == "limits"):
            kind = "discrete" if self.what == "limits" else "continuous"
            raise CagefieldError(f"{scene} {edit} is a {case.kind} edit; {self.what} needs a {kind} one")
        picture, text = (self.out / f"{self.what}{end}" for end in (".png", ".md"))
        for path in (picture, text):
            check_file(path, self.overwrite)
        if self.picture_size < 16:
            raise CagefieldError(f"--picture-size is {self.picture_size}; it must be at least 16")
        settings = Settings(
            self.views,
            self.size,
            self.test_views,
            self.training.config(),
            compared_size=self.compared_size,
            compared_views=self.compared_views,
        )
        devices.start(self.device)
        result = self._measure(case, Workbench(settings, real_path(self.workdir), progress_bar))
        notes = (f"Machine: {Machine.here()}", f"Command: `{command_line('bench ablation', self)}`")
        result = with_notes(result, notes)
        result.table.show()
        with replaced_file(picture) as draft:
            write_png(draft, result.picture)
            write_text(text, result.table.markdown())
        print(f"written to {picture} and {text}")

    def _measure(self, case: Case, bench: Workbench) -> Ablation:
        from benchmarks.edits import ablations
        from benchmarks.edits.failure_modes import limits

        if self.what == "limits":
            return limits(case, bench, self.picture_size)
        measures = {
            "outer-size": ablations.outer_size,
            "resolution": ablations.resolution,
            "discrete-continuous": ablations.discrete_continuous,
        }
        return measures[self.what](ablations.Subject(case, bench, self.picture_size))
