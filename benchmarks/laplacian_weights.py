"""Test PSNR of voxel trainings with several weights of the Laplacian regularization.

python -m benchmarks.laplacian_weights DATA... [--weights 4e-5 2e-5 1e-5] [--steps 800] [--resolution 112]

Steps are counted, not timed: other work on the machine changes nothing. Ten test views at most.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

from cagefield import load_dataset
from cagefield.images.metrics import psnr, ssim
from cagefield.rendering.renderers import renderer_of
from cagefield.training.evaluation import composite_on_white
from cagefield.training.voxels.train_voxels import train_voxel
from cagefield.training.voxels.voxel_config import VoxelConfig

MAX_VIEWS = 10


@dataclass
class LaplacianWeights:
    """Compare weights of the Laplacian regularization."""

    data: tyro.conf.Positional[list[Path]]
    """Data sets with test views."""
    weights: tuple[float, ...] = (4e-5, 2e-5, 1e-5)
    steps: int = 800
    resolution: int = 112
    downscale: int | None = None

    def run(self) -> None:
        """Prints the table."""
        print("| data | weight | PSNR | worst view | SSIM |\n| --- | --: | --: | --: | --: |", flush=True)
        for path in self.data:
            data = load_dataset(path, downscale=self.downscale)
            for weight in self.weights:
                config = VoxelConfig(steps=self.steps, resolution=self.resolution, laplacian_reg=weight)
                renderer = renderer_of(train_voxel(data, config).field)
                figures = []
                for view in data.test[:MAX_VIEWS]:
                    photo = composite_on_white(view.load())
                    image = renderer.render(view.camera).rgb
                    figures.append((psnr(image, photo), ssim(image, photo)))
                values = np.array(figures)
                print(
                    f"| {path.name} | {weight:g} | {values[:, 0].mean():.2f} | {values[:, 0].min():.2f}"
                    f" | {values[:, 1].mean():.4f} |",
                    flush=True,
                )


if __name__ == "__main__":
    tyro.cli(LaplacianWeights).run()
