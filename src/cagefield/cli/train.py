"""`cagefield train`: posed photos to a scene folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from cagefield.cli.options import Device, Flag, Output, progress_bar
from cagefield.errors import CagefieldError

if TYPE_CHECKING:
    from cagefield.datasets import Dataset
    from cagefield.scene import Scene
    from cagefield.training.voxel import TrainResult, VoxelConfig


@dataclass(frozen=True)
class Train:
    """Train a field on posed photos and write a scene; Ctrl-C ends earlier and writes what there is."""

    data: tyro.conf.Positional[Path]
    """Folder of a data set, or its transforms.json, poses_bounds.npy or COLMAP model."""
    out: Output
    """Scene folder."""
    minutes: float = 5.0
    """How long to train."""
    steps: int | None = None
    """Train this many steps instead: on a CPU the same seed then gives the same field."""
    resolution: int = 256
    """Voxels along the longest axis at the end."""
    sh_degree: int = 1
    """Degree of the colour's spherical harmonics, 0 to 2: how much it changes with the view."""
    downscale: int | None = None
    """Shrink the photos by this factor; left out, until their longer side is 800 pixels or less."""
    holdout: int = 8
    """Keep every so-many-th photo for testing where the data set has no test views; 0 keeps none."""
    seed: int = 0
    """Of the order of the photos' pixels and of all other chance."""
    device: Device = "auto"
    """Where kernels run."""
    resume: Flag = False
    """Go on with an interrupted training of this scene, and replace what it wrote."""
    overwrite: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Replace the scene that is there."""

    def run(self) -> None:
        """Trains, writes the scene, prints the test PSNR."""
        from cagefield import devices
        from cagefield.datasets import load_dataset
        from cagefield.scene import check_destination
        from cagefield.training.voxel import VoxelConfig

        target = check_destination(self.out, self.overwrite or self.resume)
        checkpoint = target.with_name(target.name + ".training")
        if checkpoint.exists() and not (self.resume or self.overwrite):
            raise CagefieldError(
                f"{checkpoint} is an interrupted training; give --resume to go on, or --overwrite"
            )
        config = VoxelConfig(
            steps=self.steps if self.steps is not None else VoxelConfig.steps,
            minutes=self.minutes if self.steps is None else None,
            resolution=self.resolution,
            sh_degree=self.sh_degree,
            seed=self.seed,
        )
        dataset = load_dataset(self.data, downscale=self.downscale, holdout=self.holdout)
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
    """The trained scene, with a progress bar on stderr, and the figures of the training.

    Its background is what the photos have: white behind cut-outs, else black.
    """
    from cagefield.scene import Scene
    from cagefield.training.voxel import Progress, train_voxel

    with progress_bar("Training") as move:

        def show(progress: Progress) -> None:
            move(
                progress.done,
                1.0,
                f"loss {progress.loss:.5f}, PSNR {progress.psnr:.1f} dB, "
                f"{progress.rays_per_second / 1e3:.0f} k rays/s, {progress.resolution}^3 grid",
            )

        result = train_voxel(dataset, config, checkpoint=checkpoint, resume=resume, on_progress=show)
    cameras = {"train": dataset.train, "test": dataset.test, "val": dataset.val}
    scene = Scene(
        result.field,
        cameras={split: tuple(view.camera for view in views) for split, views in cameras.items() if views},
        background=(1.0, 1.0, 1.0) if dataset.white_background else (0.0, 0.0, 0.0),
    )
    return scene, result


def summary(result: TrainResult) -> str:
    """One line of figures: time, steps, voxels, PSNR and SSIM."""
    parts = [
        f"trained {result.seconds:.0f} s, {result.steps} steps, {len(result.field.vertices)} voxels",
        f"train PSNR {result.train_psnr:.2f} dB",
    ]
    if result.test_psnr == result.test_psnr:
        parts.append(f"test PSNR {result.test_psnr:.2f} dB, SSIM {result.test_ssim:.4f}")
    return "; ".join(parts)
