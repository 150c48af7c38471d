"""`cagefield train`: posed photos to a scene folder."""

from __future__ import annotations

import dataclasses
import shutil
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from cagefield.cli.edit_preparation import prepare_edits
from cagefield.cli.options import (
    BakingOptions,
    Device,
    Flag,
    Output,
    Training,
    TrainingOptions,
    progress_bar,
    stages,
)
from cagefield.cli.photo_options import Captures
from cagefield.errors import CagefieldError, line_of
from cagefield.files.safe_open import real_path

if TYPE_CHECKING:
    from cagefield.datasets import Dataset
    from cagefield.fields.splat_field import SplatField
    from cagefield.fields.voxel_field import VoxelField
    from cagefield.scene.scene import Scene
    from cagefield.training.nerf.nerf_config import NerfConfig
    from cagefield.training.result import TrainResult
    from cagefield.training.splats.splat_config import SplatConfig
    from cagefield.training.voxels.voxel_config import VoxelConfig

FieldKind = Literal["auto", "splat", "voxel", "nerf"]
Preset = Literal["auto", "paper", "small"]
Ndc = Literal["auto", "on", "off"]

VOXEL_FOG_WARNING = (
    "voxels explain what has no texture in a capture (walls, floors, tables) by fog in front of the cameras; "
    "--field splat is made for it"
)
"""Warning before voxels are trained on an unbounded capture."""


@dataclass(frozen=True)
class Train:
    """Train a field on posed photos and write a scene; Ctrl-C ends earlier and writes what there is."""

    photos: Captures
    out: Output
    """Scene folder; of several captures a folder for their scenes, named as the captures."""
    field: FieldKind = "auto"
    """splat are 3D Gaussians, made for captures of real places; voxel is a grid, made for things on a plain
    background; both are trained on the GPU where there is one. auto takes splats where a capture is
    unbounded, else voxels. nerf is the original NeRF, needs PyTorch, and is baked into voxels at the end."""
    splats: int | None = None
    """Most splats at the end; left out, as many as the photos and the time allow."""
    blocks: int | None = None
    """Train splats in so many blocks of space, one after another, each on the photos that see it, and merge
    them: for captures larger than the memory. A block has its photos' share of --splats and of the time."""
    cluster: str | None = None
    """Train the blocks, or several captures, on a cluster of dask.distributed, as `cagefield render`; photos
    and the scene's folder are on a disk that its machines share."""
    cluster_tls: tuple[Path, Path, Path] | None = None
    """CA CERT KEY: PEM files for the connections to and in the cluster."""
    robust: Flag = False
    """Give less weight to regions of photos that contradict the others: people who walk through, a backdrop
    that moves; for splats."""
    refine_poses: Flag = False
    """Also move the photos' cameras to where the splats agree best with them; for poses that are rough."""
    keep_poses: Flag = False
    """Train on the poses that come with the photos, as they are; else wrong ones are corrected first."""
    preset: Preset = "auto"
    """Networks of --field nerf: the paper's 8 x 256, or 4 x 128 for a CPU; auto takes the paper's on CUDA."""
    ndc: Ndc = "auto"
    """--field nerf in normalized device coordinates: auto where an LLFF or COLMAP capture looks one way."""
    training: Training = dataclasses.field(default_factory=TrainingOptions)
    device: Device = "auto"
    resume: Flag = False
    """Go on with an interrupted training of this scene, and replace what it wrote."""
    overwrite: Flag = False
    """Replace the scene that is there."""

    def run(self) -> None:
        """Trains, writes the scene, prints the test PSNR."""
        from cagefield.compute import devices

        if self.field != "nerf" and (self.preset != "auto" or self.ndc != "auto"):
            raise CagefieldError("--preset and --ndc are for the original NeRF; give --field nerf too")
        for option, given in self._splat_options():
            if given and self.field not in ("splat", "auto"):
                raise CagefieldError(f"{option} is for splats; give --field splat too")
        if self.photos.more:
            from cagefield.cli.train_captures import train_captures

            self._check_options()
            train_captures(self)
            return
        target, checkpoint = self.check_target(), self.checkpoint()
        self._check_options()
        dataset = self.photos.load(target.with_name(target.name + ".poses"), self.training.minutes)
        kind = self._kind(dataset)
        devices.start(self.device)
        networks = nerf_config(self.training, self.preset, self.ndc) if kind == "nerf" else None
        dataset = self.photos.verified(dataset, self.keep_poses)
        target.parent.mkdir(parents=True, exist_ok=True)
        if networks is not None:
            scene, figures, finished = self._train_nerf(dataset, networks, checkpoint)
        elif self.blocks is not None:
            from cagefield.cli.train_blocks import train_in_blocks

            options = self.training.splat_config(self.splats, self.refine_poses, self.robust)
            scene, splats = train_in_blocks(
                dataset,
                options,
                self.blocks,
                checkpoint,
                anew=not self.resume,
                cluster=self.cluster,
                cluster_tls=self.cluster_tls,
                device=self.device,
            )
            figures, finished = summary(splats), splats.finished
        elif kind == "splat":
            options = self.training.splat_config(self.splats, self.refine_poses, self.robust)
            scene, splats = train_splats(dataset, options, checkpoint, resume=self.resume)
            figures, finished = summary(splats), splats.finished
        else:
            if dataset.unbounded:
                warnings.warn(VOXEL_FOG_WARNING, stacklevel=2)
            scene, voxels = train_scene(dataset, self.training.config(), checkpoint, resume=self.resume)
            figures, finished = summary(voxels), voxels.finished
        with self._kept(checkpoint, finished):
            scene.save(self.out, overwrite=self.overwrite or self.resume)
        print(f"{figures}\nscene written to {self.out}", flush=True)
        if not finished:
            print("stopped early; the same command with --resume continues")
            raise KeyboardInterrupt
        if self.blocks is None:
            checkpoint.unlink(missing_ok=True)
        else:
            shutil.rmtree(checkpoint, ignore_errors=True)
        prepare_edits(self.out)

    def checkpoint(self) -> Path:
        """File of the interrupted training, or the folder of its blocks."""
        target = real_path(self.out)
        return target.with_name(target.name + (".training" if self.blocks is None else ".blocks"))

    def check_target(self) -> Path:
        """The resolved scene folder.

        Raises:
            CagefieldError: something is there that may not be replaced, an interrupted training, or none to
                resume.
        """
        from cagefield.scene.scene_files import check_destination

        target, checkpoint = check_destination(self.out, self.overwrite or self.resume), self.checkpoint()
        if checkpoint.exists() and not (self.resume or self.overwrite):
            raise CagefieldError(
                f"{checkpoint} is an interrupted training; give --resume to go on, or --overwrite"
            )
        if self.resume and not checkpoint.exists():
            raise CagefieldError(f"no checkpoint at {checkpoint} to resume from; start anew")
        return target

    def _splat_options(self) -> tuple[tuple[str, bool], ...]:
        """Options that splats alone take, and whether they are given."""
        return (
            ("--blocks", self.blocks is not None),
            ("--refine-poses", self.refine_poses),
            ("--robust", self.robust),
            ("--splats", self.splats is not None),
        )

    def _check_options(self) -> None:
        """Refuses, before photos are read, options that no trainer in question takes."""
        if self.blocks is not None:
            from cagefield.training.splats.blocks import check_count
            from cagefield.training.splats.train_blocks import check_shared_poses

            check_count(self.blocks)
            check_shared_poses(self.blocks, self.refine_poses)
        if self.cluster is not None:
            from cagefield.cluster.connection import check_installed, parse_cluster

            if self.blocks is None and not self.photos.more:
                raise CagefieldError("--cluster trains blocks or several captures; give --blocks too")
            parse_cluster(self.cluster)
            check_installed()
        if self.cluster_tls and self.cluster is None:
            raise CagefieldError("--cluster-tls belongs to --cluster; give both or neither")
        if self.photos.more and self.photos.masks is not None:
            raise CagefieldError("--masks is of one capture; train the captures one by one")
        if self.field in ("auto", "splat"):
            self.training.splat_config(self.splats, self.refine_poses, self.robust)
        # Splats take harmonics of degree 3, voxels do not: with "auto" the photos decide.
        if self.field != "splat" and (self.field != "auto" or self.training.sh_degree != 3):
            self.training.config()

    def _kind(self, dataset: Dataset) -> FieldKind:
        """Kind of field to train; an automatic choice is reported on stderr."""
        if self.field != "auto":
            return self.field
        kind: FieldKind = "splat" if dataset.unbounded else "voxel"
        option = next((option for option, given in self._splat_options() if given), None)
        if kind == "voxel" and option is not None:
            raise CagefieldError(f"{option} is for splats, these photos get voxels; give --field splat too")
        if kind == "voxel":
            self.training.config()
        what = (
            "splats, the capture is unbounded (--field voxel trains voxels)"
            if dataset.unbounded
            else "voxels, the scene is bounded (--field splat trains splats)"
        )
        if not self.resume:
            print(f"Training {what}", file=sys.stderr)
        return kind

    def _train_nerf(self, dataset: Dataset, config: NerfConfig, checkpoint: Path) -> tuple[Scene, str, bool]:
        """(scene, lines of figures, whether the training got to its end) of the original NeRF, baked."""
        from cagefield.cli.bake import bake_scene
        from cagefield.training.nerf.train_nerf import train_nerf

        with progress_bar("Training") as move:
            result = train_nerf(
                dataset,
                config,
                checkpoint=checkpoint,
                resume=self.resume,
                on_progress=lambda progress: move(progress.done, 1.0, str(progress)),
            )
        moved = result.space.dataset
        splits = {"train": moved.train, "test": moved.test, "val": moved.val}
        cameras = {name: tuple(view.camera for view in views) for name, views in splits.items() if views}
        with self._kept(checkpoint, result.finished):
            scene, baked = bake_scene(
                result.field,
                cameras,
                (1.0, 1.0, 1.0) if dataset.white_background else (0.0, 0.0, 0.0),
                BakingOptions(
                    BakingOptions.resolution
                    if self.training.resolution is None
                    else self.training.resolution,
                    BakingOptions.sh_degree if self.training.sh_degree is None else self.training.sh_degree,
                ),
                unbounded=dataset.unbounded,
            )
        scene = dataclasses.replace(scene, source_to_world=moved.source_to_world)
        line = (
            f"trained {result.seconds:.0f} s, {result.steps} steps, networks of {result.field.coarse}, "
            f"{result.space}; train PSNR {result.train_psnr:.2f} dB"
        )
        if result.test_psnr == result.test_psnr:
            line += f"; test PSNR {result.test_psnr:.2f} dB"
        return scene, f"{line}\n{baked}", result.finished

    @contextmanager
    def _kept(self, checkpoint: Path, finished: bool) -> Iterator[None]:
        """Context that adds to an error after the training that the training itself is kept.

        Raises:
            CagefieldError: the one that was raised within, with that added.
        """
        rest = "goes straight to " + ("baking" if self.field == "nerf" else "writing the scene")
        note = f"the training is kept: the same command with --resume {rest if finished else 'continues'}"
        try:
            yield
        except CagefieldError as error:
            raise CagefieldError(f"{error}; {note}") from error
        except OSError as error:
            kept = (
                f"the training is kept in {checkpoint}: the same command with --resume goes on from there"
                if checkpoint.exists()
                else "the training is lost, there was no room for its checkpoint either"
            )
            raise CagefieldError(f"{line_of(error)}; {kept}") from error
        except BaseException:
            print(note)
            raise


def nerf_config(training: TrainingOptions, preset: Preset, ndc: Ndc = "auto") -> NerfConfig:
    """The configuration of a NeRF's trainer. Raises CagefieldError where PyTorch is missing."""
    from cagefield.compute import devices
    from cagefield.training.nerf.nerf_config import NerfConfig

    try:
        import torch  # noqa: F401
    except ImportError as error:
        raise CagefieldError(
            "--field nerf needs PyTorch, which is not installed; pip install 'cagefield[nerf]'"
        ) from error
    small = preset == "small" or (preset == "auto" and not devices.is_gpu())
    return (NerfConfig.small if small else NerfConfig)(
        steps=NerfConfig.steps if training.steps is None else training.steps,
        minutes=training.minutes if training.steps is None else None,
        ndc={"auto": None, "on": True, "off": False}[ndc],
        seed=training.seed,
    )


def train_scene(
    dataset: Dataset, config: VoxelConfig, checkpoint: Path | None = None, *, resume: bool = False
) -> tuple[Scene, TrainResult[VoxelField]]:
    """The trained scene, with a progress bar on stderr, and the figures of the training."""
    from cagefield.scene.scene import Scene
    from cagefield.training.voxels.train_voxels import train_voxel

    with progress_bar("Training") as move:
        result = train_voxel(
            dataset,
            config,
            checkpoint=checkpoint,
            resume=resume,
            on_progress=lambda progress: move(progress.done, 1.0, str(progress)),
        )
    return Scene.trained(result, dataset), result


def train_splats(
    dataset: Dataset, config: SplatConfig, checkpoint: Path | None = None, *, resume: bool = False
) -> tuple[Scene, TrainResult[SplatField]]:
    """The trained scene of splats, with progress bars on stderr, and the figures of the training."""
    from cagefield.scene.scene import Scene
    from cagefield.training.splats.train_splats import train_splat

    with stages() as move:

        def on_progress(progress: Any) -> None:
            move("Training", progress.done, str(progress))

        result = train_splat(
            dataset,
            config,
            checkpoint=checkpoint,
            resume=resume,
            on_progress=on_progress,
            on_stage=move,
        )
    return Scene.trained(result, dataset), result


def summary(result: TrainResult[VoxelField | SplatField]) -> str:
    """One line of figures: time, steps, voxels or splats, PSNR raw and color-corrected, SSIM, worst view."""
    from cagefield.fields.voxel_field import VoxelField

    field = result.field
    size = f"{len(field.vertices)} voxels" if isinstance(field, VoxelField) else f"{len(field)} splats"
    parts = [
        f"trained {result.seconds:.0f} s, {result.steps} steps, {size}",
        f"train PSNR {result.train_psnr:.2f} dB",
    ]
    if result.test.views:
        parts.append(f"test PSNR {result.test}")
    return "; ".join(parts)
