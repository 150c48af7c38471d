"""`cagefield bench speed` and `cagefield bench training`: frame times, PSNR against training time."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from benchmarks.commands.command_lines import command_line
from cagefield.cli.options import (
    Device,
    Flag,
    OptionalOutput,
    Output,
    Training,
    TrainingOptions,
    check_file,
    parse_size,
    progress_bar,
)
from cagefield.cli.photo_options import Photos
from cagefield.errors import CagefieldError

if TYPE_CHECKING:
    pass


@dataclass(frozen=True)
class BenchSpeed:
    """Frame times of a scene: unedited, and under an edit, exact, from lattices and discrete; all in turn."""

    scene: tyro.conf.Positional[Path]
    """Scene folder."""
    size: str = "400"
    """WIDTHxHEIGHT, or the longer side alone."""
    edits: Path | None = None
    """Edit file; left out, a continuous edit in the middle that covers a quarter of the picture."""
    cameras: int = 4
    """Number of the scene's test cameras, evenly chosen."""
    rounds: int = 15
    """How often all variants are timed; each time every camera once."""
    out: OptionalOutput = None
    """JSON file for the figures; the same as a Markdown table beside it, ending .md."""
    device: Device = "auto"
    overwrite: Flag = False
    """Replace files that are there."""

    def run(self) -> None:
        """Measures, shows the table, writes the files."""
        import json

        from benchmarks.captures.frame_times import measure
        from benchmarks.common.machine import Machine
        from benchmarks.common.tables import write_texts
        from cagefield.compute import devices
        from cagefield.edits.edit_files import load_edits
        from cagefield.scene.scene import Scene

        if self.out is not None:
            if self.out.suffix.lower() != ".json":
                raise CagefieldError(f"{self.out} must end in .json; the Markdown table goes beside it")
            for path in (self.out, self.out.with_suffix(".md")):
                check_file(path, self.overwrite)
        if self.cameras < 1:
            raise CagefieldError(f"--cameras is {self.cameras}; it must be at least 1")
        scene = Scene.open(self.scene)
        edits = None if self.edits is None else load_edits(self.edits)
        known = scene.cameras.get("test") or scene.cameras.get("train") or ()
        chosen = [known[i] for i in _evenly(len(known), min(self.cameras, len(known)))]
        cameras = [camera.resized(*parse_size(self.size, camera.width, camera.height)) for camera in chosen]
        devices.start(self.device)
        report = measure(scene, cameras, edits, rounds=self.rounds, report=print)
        machine, command = Machine.here(), command_line("bench speed", self)
        result = report.table(machine, command)
        result.show()
        if self.out is not None:
            figures = json.dumps(report.document(machine, command), indent=1) + "\n"
            write_texts({self.out: figures, self.out.with_suffix(".md"): result.markdown()})
            print(f"figures written to {self.out} and {self.out.with_suffix('.md')}")


@dataclass(frozen=True)
class BenchTraining:
    """Test PSNR against training time on a data set; writes the curve as CSV."""

    photos: Photos
    out: Output
    """CSV file for the curve; the same as a Markdown table beside it, ending .md."""
    training: Training = dataclasses.field(default_factory=TrainingOptions)
    curve_views: int = 10
    """Number of test views for the points of the curve; the last point is on all."""
    scene_out: Path | None = None
    """Folder for the trained scene, if it is to be kept."""
    device: Device = "auto"
    overwrite: Flag = False
    """Replace files that are there."""

    def run(self) -> None:
        """Trains, evaluates on the way, shows the table, writes the files."""
        from benchmarks.captures.training_curves import Point, measure
        from benchmarks.common.machine import Machine
        from benchmarks.common.tables import drafted_texts
        from cagefield.compute import devices
        from cagefield.scene.scene import Scene
        from cagefield.scene.scene_files import check_destination

        if self.out.suffix.lower() != ".csv":
            raise CagefieldError(f"{self.out} must end in .csv; the Markdown table goes beside it")
        for path in (self.out, self.out.with_suffix(".md")):
            check_file(path, self.overwrite)
        if self.scene_out is not None:
            check_destination(self.scene_out, self.overwrite)
        config = self.training.config()
        dataset = self.photos.load()
        devices.start(self.device)

        def tell(point: Point) -> None:
            print(
                f"{point.seconds:6.1f} s, {point.step} steps: test PSNR {point.test_psnr:.2f} dB on "
                f"{point.views} views",
                flush=True,
            )

        with progress_bar("Training") as move:
            curve = measure(
                dataset,
                config,
                views=self.curve_views,
                on_progress=lambda progress: move(progress.done, 1.0, str(progress)),
                on_point=tell,
            )
        notes = (f"Machine: {Machine.here()}", f"Command: `{command_line('bench training', self)}`")
        result = curve.table(dataset.name, notes)
        result.show()
        with drafted_texts({self.out: curve.csv(), self.out.with_suffix(".md"): result.markdown()}):
            if self.scene_out is not None:
                Scene.trained(curve.result, dataset).save(self.scene_out, self.overwrite)
        print(f"curve written to {self.out} and {self.out.with_suffix('.md')}")
        if self.scene_out is not None:
            print(f"scene written to {self.scene_out}")


def _evenly(count: int, chosen: int) -> list[int]:
    """`chosen` of the indices 0 to count - 1, evenly spread."""
    return [(2 * i + 1) * count // (2 * chosen) for i in range(chosen)]
