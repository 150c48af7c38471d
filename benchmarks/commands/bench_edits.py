"""`cagefield bench edits`: edits against ground truth."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from benchmarks.commands.command_lines import command_line, work_folder
from cagefield.cli.options import (
    Device,
    Flag,
    Output,
    Training,
    TrainingOptions,
    check_file,
    progress_bar,
)
from cagefield.cli.train import Preset, nerf_config
from cagefield.errors import CagefieldError

if TYPE_CHECKING:
    from benchmarks.common.cases import Case
    from benchmarks.common.workbench import Workbench
    from cagefield.training.nerf.nerf_config import NerfConfig
    from cagefield.training.splats.splat_config import SplatConfig
    from cagefield.training.voxels.voxel_config import VoxelConfig


@dataclass(frozen=True)
class BenchEdits:
    """Edits of the built-in scenes against scenes whose parts are really moved; writes Markdown tables."""

    out: Output = Path("benchmarks/results/edits.md")
    """Markdown file for the table; that of the methods goes beside it, its name ending _methods.md."""
    scenes: tuple[str, ...] = ()
    """Only these scenes: digger, chair, microphone, plant."""
    edits: tuple[str, ...] = ()
    """Only the edits of these names, such as move_cone."""
    views: int = 100
    """Number of training photos of each scene."""
    size: int = 400
    """Width and height of the photos in pixels."""
    test_views: int = 20
    """Number of test photos."""
    field: Literal["voxel", "nerf", "splat"] = "voxel"
    """nerf is the original NeRF, rendered exactly: needs PyTorch. nerf and splat need --no-methods."""
    preset: Preset = "auto"
    """Networks of --field nerf: the paper's 8 x 256, or 4 x 128 for a CPU; auto takes the paper's on CUDA."""
    training: Training = dataclasses.field(default_factory=TrainingOptions)
    exact_size: int = 200
    """Width and height of the pictures of continuous edits, whose truth takes seconds to make."""
    exact_views: int = 6
    """Number of pictures of continuous edits."""
    discrete_views: int | None = None
    """Number of test photos that discrete edits are measured on; left out, all."""
    taught: Flag = False
    """Also train a field on photos of the truth of each discrete edit, which shows what could be known of
    uncovered and unseen pixels; as long again for each."""
    methods: tuple[str, ...] = ()
    """Compare only these ways to fill the shell: flow, "flow 64", trilinear, "trilinear 64", "trilinear 128",
    "trilinear 256", "mean value", harmonic; left out, all."""
    no_methods: Flag = False
    """Compare no methods."""
    compared_size: int = 64
    """Width and height of the pictures of that comparison."""
    compared_views: int = 3
    """Number of its pictures for each edit and method."""
    workdir: Path | None = None
    """Folder that keeps photos, fields and truths, so that a second call only evaluates."""
    retrain: Flag = False
    """Train the fields anew where the work folder has them."""
    pictures: Path | None = None
    """Folder for pictures of each edit: before, edited, truth."""
    picture_size: int = 320
    """Width and height of each of them in pixels."""
    error_panel: Flag = False
    """A fourth picture: the difference from the truth."""
    only_pictures: Flag = False
    """Write the pictures and no table."""
    device: Device = "auto"
    cluster: str | None = None
    """Train and measure on a cluster of dask.distributed, as `cagefield render`; the work folder is shared by
    its machines. Frame times are then those of several processes at once."""
    cluster_tls: tuple[Path, Path, Path] | None = None
    """CA CERT KEY: PEM files for the connections to and in the cluster."""
    overwrite: Flag = False
    """Replace files that are there."""

    def run(self) -> None:
        """Trains what is missing, measures, shows the table, says where the files are."""
        from benchmarks.common.cases import chosen
        from benchmarks.common.workbench import Settings, Workbench
        from benchmarks.edits.edit_quality import picture_path
        from benchmarks.edits.methods import check_known
        from cagefield.compute import devices

        cases = chosen(self.scenes, self.edits)
        check_known(self.methods)
        if self.field != "nerf" and self.preset != "auto":
            raise CagefieldError("--preset is for the original NeRF; give --field nerf too")
        self._check_cluster()
        if self.field != "voxel" and not self.no_methods:
            raise CagefieldError(
                f"methods are compared on voxels only; give --no-methods with --field {self.field}"
            )
        if self.only_pictures and self.pictures is None:
            raise CagefieldError("--only-pictures needs a folder for them; give --pictures FOLDER")
        if self.picture_size < 1:
            raise CagefieldError(f"--picture-size is {self.picture_size}; it must be at least 1")
        if not self.only_pictures:
            check_file(self.out, self.overwrite)
            if not self.no_methods:
                check_file(self._beside(), self.overwrite)
        if self.pictures is not None:
            for case in cases:
                check_file(picture_path(self.pictures, case), self.overwrite)
        devices.start(self.device)
        settings = Settings(
            self.views,
            self.size,
            self.test_views,
            self._config(),
            self.exact_size,
            self.exact_views,
            self.compared_size,
            self.compared_views,
            self.discrete_views,
        )
        with work_folder(self.workdir) as folder:
            bench = Workbench(settings, folder, progress_bar, self.retrain)
            if not self.only_pictures:
                self._measure(cases, bench)
                if not self.no_methods:
                    self._compare(cases, bench)
            if self.pictures is not None:
                self._draw(cases, bench, self.pictures)

    def _check_cluster(self) -> None:
        if self.cluster is None:
            if self.cluster_tls is not None:
                raise CagefieldError("--cluster-tls belongs to --cluster; give both or neither")
            return
        from cagefield.cluster.connection import check_installed, parse_cluster

        if not self.no_methods:
            raise CagefieldError("methods are compared on one machine; give --no-methods with --cluster")
        if self.only_pictures:
            raise CagefieldError("--only-pictures draws on one machine; leave out --cluster")
        parse_cluster(self.cluster)
        check_installed()

    def _config(self) -> VoxelConfig | NerfConfig | SplatConfig:
        """The trainer's configuration."""
        if self.field == "nerf":
            return nerf_config(self.training, self.preset)
        if self.field == "voxel":
            return self.training.config()
        from benchmarks.captures.train_captures import Budget, splat_config

        chosen = self.training
        return splat_config(
            Budget(chosen.minutes, chosen.steps, sh_degree=chosen.sh_degree, seed=chosen.seed)
        )

    def _measure(self, cases: tuple[Case, ...], bench: Workbench) -> None:
        from benchmarks.common.machine import Machine
        from benchmarks.common.tables import write_text
        from benchmarks.edits.edit_quality import measure
        from benchmarks.edits.edits_table import table

        scores, measured = [], measure(cases, bench, taught=self.taught)
        if self.cluster is not None:
            from benchmarks.edits.edits_cluster import measure_on
            from cagefield.cluster.connection import TlsFiles, parse_cluster

            tls = None if self.cluster_tls is None else TlsFiles(*self.cluster_tls)
            measured = measure_on(
                parse_cluster(self.cluster), cases, bench, taught=self.taught, device=self.device, tls=tls
            )
        for score in measured:
            scores.append(score)
            figures = score.figures
            print(
                f"{score.case.scene}, {score.case.name}: PSNR {figures.unedited:.2f} dB unedited, "
                f"{figures.edited:.2f} dB edited, {figures.lost:.2f} dB lost, "
                f"{figures.there_lost:.2f} dB where it changes pixels",
                flush=True,
            )
        machine, command = Machine.here(), command_line("bench edits", self)
        result = table(scores, bench.settings, (f"Machine: {machine}", f"Command: `{command}`"))
        result.show()
        write_text(self.out, result.markdown())
        print(f"table written to {self.out}")

    def _beside(self) -> Path:
        return self.out.with_name(f"{self.out.stem}_methods{self.out.suffix}")

    def _compare(self, cases: tuple[Case, ...], bench: Workbench) -> None:
        from benchmarks.common.machine import Machine
        from benchmarks.common.tables import write_text
        from benchmarks.edits.compare_shells import measure, table
        from benchmarks.edits.methods import METHODS

        rows = []
        for row in measure(cases, self.methods or tuple(METHODS), bench):
            rows.append(row)
            folds = "folds" if row.distortion.folds else f"min det J {row.distortion.least_det:.2f}"
            print(
                f"{row.case.scene}, {row.case.name}, {row.method}: {folds}, {row.figures.lost:.2f} dB lost",
                flush=True,
            )
        if not rows:
            return
        notes = (f"Machine: {Machine.here()}", f"Command: `{command_line('bench edits', self)}`")
        result = table(rows, bench, notes)
        result.show()
        write_text(self._beside(), result.markdown())
        print(f"table written to {self._beside()}")

    def _draw(self, cases: tuple[Case, ...], bench: Workbench, folder: Path) -> None:
        from benchmarks.edits.edit_quality import write_picture

        for case in cases:
            path = write_picture(case, bench, folder, self.picture_size, error=self.error_panel)
            print(f"picture written to {path}", flush=True)
