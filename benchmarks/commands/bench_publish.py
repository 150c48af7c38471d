"""`cagefield bench publish`: the edit benchmark as a folder of data for others."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import tyro

from benchmarks.commands.command_lines import command_line, work_folder
from cagefield.cli.options import Device, Flag, Training, TrainingOptions, check_folder, progress_bar

if TYPE_CHECKING:
    from cagefield.training.splats.splat_config import SplatConfig
    from cagefield.training.voxels.voxel_config import VoxelConfig


@dataclass(frozen=True)
class BenchPublish:
    """Write the edit benchmark as a folder that others use without cagefield.

    Photos, edits, exact truths, pictures of cagefield, of naive editing and of peers, a table, and a script
    that evaluates pictures with numpy and Pillow alone.
    """

    out: tyro.conf.Positional[Path]
    """New folder."""
    scenes: tuple[str, ...] = ()
    """Only these scenes: digger, chair, microphone, plant."""
    edits: tuple[str, ...] = ()
    """Only the edits of these names, such as move_cone."""
    field: Literal["voxel", "splat"] = "voxel"
    """Field that is trained and edited; of splats naive editing gets rows, of voxels other shells."""
    methods: tuple[str, ...] = ("trilinear", "mean value", "harmonic")
    """Other ways to fill the shell of continuous edits of voxels."""
    views: int = 100
    """Number of training photos of each scene."""
    size: int = 400
    """Width and height of the photos in pixels."""
    test_views: int = 20
    """Number of test photos."""
    exact_size: int = 200
    """Width and height of the pictures of continuous edits."""
    exact_views: int = 6
    """Number of pictures of continuous edits."""
    discrete_views: int | None = None
    """Number of pictures of discrete edits; left out, all test views."""
    training: Training = dataclasses.field(default_factory=TrainingOptions)
    workdir: Path | None = None
    """Folder that keeps photos, fields and truths, so that a second call only evaluates."""
    device: Device = "auto"

    overwrite: Flag = False
    """Replace what an earlier call wrote there."""

    def run(self) -> None:
        """Trains what is missing, writes the folder, prints its table."""
        from benchmarks.common.cases import chosen
        from benchmarks.common.machine import Machine
        from benchmarks.common.workbench import Settings, Workbench
        from benchmarks.edits.methods import check_known
        from benchmarks.edits.publication import CASES, ENTRIES, publish, results_of_others
        from cagefield.compute import devices
        from cagefield.errors import CagefieldError
        from cagefield.files.atomic import replaced_folder
        from cagefield.files.safe_open import real_path

        cases = chosen(self.scenes, self.edits)
        check_known(self.methods)
        check_folder(self.out, self.overwrite, CASES)
        if others := results_of_others(self.out):
            raise CagefieldError(
                f"{self.out / 'results' / others[0]} is not of this command; move it away, or give a new "
                "folder"
            )
        devices.start(self.device)
        settings = Settings(
            self.views,
            self.size,
            self.test_views,
            self._config(),
            self.exact_size,
            self.exact_views,
            discrete_views=self.discrete_views,
        )
        command = command_line("bench publish OUT", self)
        with work_folder(self.workdir) as work, replaced_folder(real_path(self.out), ENTRIES) as folder:
            bench = Workbench(settings, work, progress_bar)
            machine = str(Machine.here())
            for case in publish(folder, cases, bench, self.methods, command, machine):
                print(f"{case.scene}, {case.name} written", flush=True)
        print((self.out / "table.md").read_text(encoding="utf-8"), end="")
        print(f"written to {self.out}")

    def _config(self) -> VoxelConfig | SplatConfig:
        """The trainer's configuration."""
        if self.field == "voxel":
            return self.training.config()
        from benchmarks.captures.train_captures import Budget, splat_config

        chosen = self.training
        return splat_config(
            Budget(chosen.minutes, chosen.steps, sh_degree=chosen.sh_degree, seed=chosen.seed)
        )
