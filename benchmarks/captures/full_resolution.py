"""Renderings at the full size of a capture's photos, of a scene that was trained on reduced ones.

python -m benchmarks.captures.full_resolution SCENE DATA [--holdout 8] [-o results/full_resolution.md]

SCENE is a scene folder, DATA the data set that it was trained on. PSNR raw and color-corrected, SSIM,
sharpness, and LPIPS where it is installed with its weights; each view, mean and worst.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Annotated

import numpy as np
import tyro

from benchmarks.common.machine import Machine
from benchmarks.common.perceptual import Distance, lpips
from benchmarks.common.tables import Table, number, write_text
from cagefield.cameras.camera import Camera
from cagefield.datasets import View, load_dataset
from cagefield.errors import CagefieldError
from cagefield.images.metrics import correct_colors, gradient_ratio
from cagefield.scene.scene import Scene
from cagefield.training.evaluation import Evaluation, ViewMetrics, composite_on_white, evaluate_image
from cagefield.typing import Float32

Show = Callable[[Camera], Float32]
"""Picture [H,W,3] of a camera."""

_COLUMNS = ("view", "size", "trained at", "PSNR", "corrected", "SSIM", "sharpness", "LPIPS")


@dataclass(frozen=True)
class FullSizeFigures:
    """Figures of a rendering at a photo's full size.

    sharpness  mean gradient of the color-corrected rendering over that of the photo; 1 is as sharp
    lpips      of the color-corrected rendering; NaN where LPIPS is not installed
    """

    figures: ViewMetrics
    size: tuple[int, int]
    trained_size: tuple[int, int]
    sharpness: float
    lpips: float = float("nan")


def full_camera(trained: Camera, view: View) -> Camera:
    """The camera of a scene's test view at the size of its photo; `view` is the photo, not shrunk.

    The pose and the lens are the scene's; intrinsics in pixels grow by the whole factor by which the photo
    was shrunk, whose left-over columns and rows come back.

    Raises CagefieldError where no whole factor takes the photo's size to that of the scene's camera.
    """
    width, height = view.camera.width, view.camera.height
    small = (trained.width, trained.height)
    factors = range(1, width // trained.width + 1)
    factor = next((f for f in factors if (width // f, height // f) == small), None)
    if factor is None:
        raise CagefieldError(
            f"photo {view.name} is {width}x{height}, the scene's camera {trained.width}x{trained.height}: no "
            "whole factor; give the data set that the scene was trained on"
        )
    return replace(
        trained,
        width=width,
        height=height,
        fx=factor * trained.fx,
        fy=factor * trained.fy,
        cx=factor * trained.cx,
        cy=factor * trained.cy,
    )


def measure(
    show: Show, cameras: Sequence[Camera], views: Sequence[View], distance: Distance | None = None
) -> Iterator[FullSizeFigures]:
    """Figures of each test view: its camera in the scene, and its photo at full size.

    Raises CagefieldError where there are not as many cameras as photos, or none.
    """
    if not views or len(cameras) != len(views):
        raise CagefieldError(
            f"the scene has {len(cameras)} test cameras, the data set {len(views)} test photos; give the "
            "data set and the --holdout that the scene was trained with"
        )
    for trained, view in zip(cameras, views, strict=True):
        photo, valid = composite_on_white(view.load()), view.valid_pixels()
        picture = np.clip(show(full_camera(trained, view)), 0, 1)
        figures = evaluate_image(view.name, picture, photo, valid)
        if figures is None:
            continue
        fitted = correct_colors(picture, photo, valid)
        if valid is not None:
            photo = np.where(valid[..., None], photo, fitted)
        yield FullSizeFigures(
            figures,
            (photo.shape[1], photo.shape[0]),
            (trained.width, trained.height),
            gradient_ratio(fitted, photo, valid),
            float("nan") if distance is None else distance(fitted[None], photo[None]),
        )


def table(scores: Sequence[FullSizeFigures], notes: Sequence[str] = ()) -> Table:
    """Each view, their mean, and the worst of each column."""
    total = Evaluation(tuple(score.figures for score in scores))
    rows: list[tuple[str, ...]] = [
        (
            PurePosixPath(score.figures.name).name,
            "x".join(map(str, score.size)),
            "x".join(map(str, score.trained_size)),
            number(score.figures.psnr),
            number(score.figures.corrected),
            number(score.figures.ssim, 4),
            number(score.sharpness, 3),
            number(score.lpips, 4),
        )
        for score in scores
    ]
    sharpness, perceptual = [s.sharpness for s in scores], [s.lpips for s in scores]
    rows.append(
        ("mean", "", "", number(total.psnr), number(total.corrected), number(total.ssim, 4),
         number(float(np.mean(sharpness)), 3), number(float(np.mean(perceptual)), 4))
    )  # fmt: skip
    rows.append(
        ("worst", "", "", *(number(min(getattr(v, name) for v in total.views), digits)
                            for name, digits in (("psnr", 2), ("corrected", 2), ("ssim", 4))),
         number(min(sharpness), 3), number(max(perceptual), 4))
    )  # fmt: skip
    explained = (
        "Renderings at the full size of test photos against those. Corrected: after the affine map of each "
        "color channel that is fitted to the photo. Sharpness: mean gradient of the corrected rendering over "
        "that of the photo, whose noise counts as sharpness. Worst: of each column by itself.",
    )
    return Table("Renderings at full resolution", _COLUMNS, tuple(rows), (*explained, *notes))


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
