"""`cagefield train`: posed photos to a scene folder."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from cagefield.cli.options import Device, Flag, Output, Photos, Training, TrainingOptions, progress_bar
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
    training: Training = field(default_factory=TrainingOptions)
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
        scene, result = train_scene(dataset, config, checkpoint, resume=self.resume)
        scene.save(self.out, overwrite=self.overwrite or self.resume)
        print(f"{summary(result)}\nscene written to {self.out}")
        if not result.finished:
            print("stopped early; the same command with --resume goes on")
            raise KeyboardInterrupt
        checkpoint.unlink(missing_ok=True)


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
