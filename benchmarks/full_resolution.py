"""Measures renderings at the full size of a capture's photos, of a scene trained on reduced ones.

python benchmarks/full_resolution.py SCENE DATA [--holdout 8] [-o benchmarks/results/full_resolution.md]

SCENE is a scene folder, DATA the data set that it was trained on. PSNR raw and color-corrected, SSIM,
sharpness, and LPIPS where it is installed with its weights; each view, mean and worst.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from cagefield.benchmarking.full_resolution import measure, table
from cagefield.benchmarking.machine import Machine
from cagefield.benchmarking.perceptual import lpips
from cagefield.benchmarking.tables import write_text
from cagefield.cameras.camera import Camera
from cagefield.datasets import load_dataset
from cagefield.errors import CagefieldError
from cagefield.scene.scene import Scene
from cagefield.typing import Float32


@dataclass
class FullResolution:
    """Measure renderings at the full size of test photos."""

    scene: tyro.conf.Positional[Path]
    data: tyro.conf.Positional[Path]
    holdout: int = 8
    """As the scene was trained."""
    out: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """File to write the table to, as well."""

    def run(self) -> None:
        """Prints the table."""
        scene, dataset = Scene.open(self.scene), load_dataset(self.data, downscale=1, holdout=self.holdout)
        distance, missing = lpips()

        def show(camera: Camera) -> Float32:
            return scene.render(camera).rgb

        scores = []
        for score in measure(show, scene.cameras.get("test", ()), dataset.test, distance):
            scores.append(score)
            print(
                f"{score.figures.name}: PSNR {score.figures.psnr:.2f} dB, SSIM {score.figures.ssim:.4f}, "
                f"sharpness {score.sharpness:.3f}",
                flush=True,
            )
        notes = [f"Machine: {Machine.here()}", f"{self.scene.name}, photos of {dataset.name}"]
        result = table(scores, [*notes, *([missing] if missing else [])])
        result.show()
        if self.out is not None:
            write_text(self.out, result.markdown())


if __name__ == "__main__":
    try:
        tyro.cli(FullResolution).run()
    except CagefieldError as error:
        sys.exit(f"error: {error}")
