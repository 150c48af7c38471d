"""`cagefield train`: posed photos to a scene folder."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cagefield.cli.options import (
    BakingOptions,
    Device,
    Flag,
    Output,
    Photos,
    Training,
    TrainingOptions,
    progress_bar,
)
from cagefield.errors import CagefieldError

if TYPE_CHECKING:
    from cagefield.datasets import Dataset
    from cagefield.scene import Scene
    from cagefield.training.voxel import TrainResult, VoxelConfig


@dataclass(frozen=True)
class Train:
    """Train a field on posed photos and write a scene; Ctrl-C ends earlier and writes what there is."""

    photos: Photos
    out: Output
    """Scene folder."""
    field: Literal["voxel", "nerf"] = "voxel"
    """voxel is what the editor shows; nerf is the original NeRF, needs PyTorch, and is baked at the end."""
    preset: Literal["auto", "paper", "small"] = "auto"
    """Networks of --field nerf: the paper's 8 x 256, or 4 x 128 for a CPU; auto takes the paper's on CUDA."""
    ndc: Literal["auto", "on", "off"] = "auto"
    """--field nerf in normalised device coordinates: auto where an LLFF or COLMAP capture looks one way."""
    training: Training = dataclasses.field(default_factory=TrainingOptions)
    device: Device = "auto"
    resume: Flag = False
    """Go on with an interrupted training of this scene, and replace what it wrote."""
    overwrite: Flag = False
    """Replace the scene that is there."""

    def run(self) -> None:
        """Trains, writes the scene, prints the test PSNR."""
        from cagefield import devices
        from cagefield.scene import check_destination

        target = check_destination(self.out, self.overwrite or self.resume)
        checkpoint = target.with_name(target.name + ".training")
        if checkpoint.exists() and not (self.resume or self.overwrite):
            raise CagefieldError(
                f"{checkpoint} is an interrupted training; give --resume to go on, or --overwrite"
            )
        config = self.training.config()
        dataset = self.photos.load()
        devices.start(self.device)
        target.parent.mkdir(parents=True, exist_ok=True)
        if self.field == "nerf":
            scene, figures, finished = self._train_nerf(dataset, checkpoint)
        else:
            scene, result = train_scene(dataset, config, checkpoint, resume=self.resume)
            figures, finished = summary(result), result.finished
        scene.save(self.out, overwrite=self.overwrite or self.resume)
        print(f"{figures}\nscene written to {self.out}")
        if not finished:
            print("stopped early; the same command with --resume goes on")
            raise KeyboardInterrupt
        checkpoint.unlink(missing_ok=True)

    def _train_nerf(self, dataset: Dataset, checkpoint: Path) -> tuple[Scene, str, bool]:
        """(scene, lines of figures, whether the training got to its end) of the original NeRF, baked."""
        from cagefield import devices
        from cagefield.cli.bake import bake_scene

        try:
            from cagefield.training.nerf import NerfConfig, train_nerf
        except ImportError as error:
            raise CagefieldError(
                "--field nerf needs PyTorch, which is not installed; pip install 'cagefield[nerf]'"
            ) from error
        small = self.preset == "small" or (self.preset == "auto" and not devices.is_gpu())
        steps, minutes = self.training.steps, self.training.minutes
        config = (NerfConfig.small if small else NerfConfig)(
            steps=NerfConfig.steps if steps is None else steps,
            minutes=minutes if steps is None else None,
            ndc={"auto": None, "on": True, "off": False}[self.ndc],
            seed=self.training.seed,
        )
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
        scene, baked = bake_scene(
            result.field,
            cameras,
            (1.0, 1.0, 1.0) if dataset.white_background else (0.0, 0.0, 0.0),
            BakingOptions(self.training.resolution),
            unbounded=dataset.unbounded,
        )
        line = (
            f"trained {result.seconds:.0f} s, {result.steps} steps, networks of {result.field.coarse}, "
            f"{result.space}; train PSNR {result.train_psnr:.2f} dB"
        )
        if result.test_psnr == result.test_psnr:
            line += f"; test PSNR {result.test_psnr:.2f} dB"
        return scene, f"{line}\n{baked}", result.finished


def train_scene(
    dataset: Dataset, config: VoxelConfig, checkpoint: Path | None = None, *, resume: bool = False
) -> tuple[Scene, TrainResult]:
    """The trained scene, with a progress bar on stderr, and the figures of the training."""
    from cagefield.scene import Scene
    from cagefield.training.voxel import train_voxel

    with progress_bar("Training") as move:
        result = train_voxel(
            dataset,
            config,
            checkpoint=checkpoint,
            resume=resume,
            on_progress=lambda progress: move(progress.done, 1.0, str(progress)),
        )
    return Scene.trained(result, dataset), result


def summary(result: TrainResult) -> str:
    """One line of figures: time, steps, voxels, PSNR and SSIM."""
    parts = [
        f"trained {result.seconds:.0f} s, {result.steps} steps, {len(result.field.vertices)} voxels",
        f"train PSNR {result.train_psnr:.2f} dB",
    ]
    if result.test_psnr == result.test_psnr:
        parts.append(f"test PSNR {result.test_psnr:.2f} dB, SSIM {result.test_ssim:.4f}")
    return "; ".join(parts)
