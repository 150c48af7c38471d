"""Draws edits that bend splats, whole and split, and says how far both are from what they should show.

    python -m benchmarks.splat_splitting [-o docs/edits/splat_splitting.png]

Rods of 9 long splats, a sheet of 40 wide ones, a ball of 90 flat ones. A row is: at rest, whole, split, and
the truth: the splats as a volume that is bent point by point (`splat_volume`). Figures are PSNR, dB, to it.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from cagefield import Cage, Camera, Edit, EditStack, SplatField
from cagefield.images.image_files import side_by_side, write_png
from cagefield.images.metrics import psnr
from cagefield.rendering.splats.raster_splats import deformed_splats
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.rendering.splats.splitting import split_for_edits
from splat_volume import volume_picture

CAMERA = Camera.look_at((0, -4.5, 0.6), (0.1, 0, 0.1), width=300, height=360, fov_x=0.6)
BOUNDS = np.array([[-2.5] * 3, [2.5] * 3])
C0 = 0.28209479177387814


def splats(means: np.ndarray, scales: tuple[float, float, float], colors: np.ndarray) -> SplatField:
    """Splats of one shape, axes along x, y and z."""
    count = len(means)
    return SplatField(
        means,
        np.log(np.tile(scales, (count, 1))),
        np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
        np.full(count, 0.95),
        ((colors - 0.5) / C0)[:, None],
        bounds=BOUNDS,
    )


def rod() -> SplatField:
    """A thin part along z."""
    z = np.linspace(-1.0, 1.0, 9)
    colors = np.stack([0.5 + 0.5 * np.sin(6 * z), np.full(9, 0.3), 0.5 - 0.5 * np.sin(6 * z)], axis=1)
    return splats(np.stack([0 * z, 0 * z, z], axis=1), (0.03, 0.03, 0.15), colors)


def leaning_rod() -> SplatField:
    """A thin part that leans by 35 degrees."""
    upright, lean = rod(), np.radians(35.0)
    means = upright.means[:, 2:] * [np.sin(lean), 0.0, np.cos(lean)]
    turned = np.tile([np.cos(lean / 2), 0.0, np.sin(lean / 2), 0.0], (len(means), 1))
    return dataclasses.replace(upright, means=means.astype(np.float32), quaternions=turned.astype(np.float32))


def sheet() -> SplatField:
    """A flat part across y."""
    z, x = (grid.ravel() for grid in np.meshgrid(np.linspace(-1, 1, 10), np.linspace(-0.35, 0.35, 4)))
    colors = np.stack([0.5 + 0.5 * np.sin(9 * z), 0.5 + 0.5 * np.sin(9 * x), np.full(40, 0.4)], axis=1)
    return splats(np.stack([x, 0 * x, z], axis=1), (0.11, 0.01, 0.105), colors)


def ball() -> SplatField:
    """Flat splats all over a ball, of stripes."""
    count, turn = 90, np.pi * (3.0 - np.sqrt(5.0))
    n = np.arange(count)
    z = 1.0 - (2.0 * n + 1.0) / count
    normals = np.stack(
        [np.sqrt(1 - z * z) * np.cos(turn * n), np.sqrt(1 - z * z) * np.sin(turn * n), z], axis=1
    )
    half = normals + np.array([0.0, 0.0, 1.0])
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    quaternions = np.stack([half[:, 2], -half[:, 1], half[:, 0], 0 * z], axis=1)
    colors = np.stack([0.5 + 0.5 * np.sin(9 * z), 0.5 + 0.5 * normals[:, 0], np.full(count, 0.4)], axis=1)
    flat = splats(0.7 * normals, (0.09, 0.09, 0.01), colors)
    return dataclasses.replace(flat, quaternions=quaternions.astype(np.float32))


LONG = Cage.box((0, 0, 1.0), (0.5, 0.5, 0.9)), Cage.box((0.3, 0, 0.35), (2.4, 2.4, 2.9))
CASES = {
    "stretched by 4": (
        rod(),
        Edit.continuous(Cage.box((0, 0, 0.3), (0.6, 0.6, 0.5)), Cage.box((0, 0, 0.3), (2, 2, 3.6))).scale(
            (1, 1, 4)
        ),
    ),
    "twisted by 150 degrees": (
        sheet(),
        Edit.continuous(Cage.box((0, 0, 1.1), (1.6, 0.8, 0.8)), Cage.box((0, 0, 0.25), (3, 3, 3))).rotate(
            (0, 0, np.radians(150))
        ),
    ),
    "bent by 60 degrees": (
        rod(),
        Edit.continuous(*LONG).translate((0.4, 0, -0.1)).rotate((0, np.radians(60), 0)),
    ),
    "a ball, its top turned by 90 degrees and lifted": (
        ball(),
        Edit.continuous(Cage.box((0, 0, 0.7), (1.2, 1.2, 0.5)), Cage.box((0, 0, 0.4), (2.4, 2.4, 2.2)))
        .translate((0, 0, 0.2))
        .rotate((0, 0, np.radians(90))),
    ),
    "a leaning rod, a part of it pushed across": (
        leaning_rod(),
        Edit.continuous(Cage.box((0, 0, 0), 0.5), Cage.box((0, 0, 0), 2.0)).translate((-0.35, 0, 0.1)),
    ),
    "bent, its end outside the cage": (
        rod(),
        Edit.continuous(Cage.box((0, 0, 0.8), 0.5), Cage.box((0.3, 0, 0.2), (2.4, 2.4, 2.6)))
        .translate((0.55, 0, -0.1))
        .rotate((0, np.radians(60), 0)),
    ),
}


def main(
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"])] = Path("docs/edits/splat_splitting.png"),
) -> None:
    print("| edit | splats | split | at rest, whole | at rest, split | edited, whole | edited, split |")
    print("| --- | --: | --: | --: | --: | --: | --: |")
    rows = []
    for name, (field, edit) in CASES.items():
        rest, edits = EditStack(), EditStack([edit])
        parts = split_for_edits(field, edits).field
        truths = [volume_picture(field, each, CAMERA) for each in (None, edit)]
        pictures = [shown(splats, stack) for stack in (rest, edits) for splats in (field, parts)]
        figures = [psnr(picture, truths[n // 2]) for n, picture in enumerate(pictures)]
        print(
            f"| {name} | {len(field)} | {len(parts)} | {' | '.join(f'{f:.1f}' for f in figures)} |",
            flush=True,
        )
        rows.append(side_by_side(pictures[0], pictures[2], pictures[3], truths[1].astype(np.float32)))
    write_png(out, np.concatenate(rows))


def shown(field: SplatField, edits: EditStack) -> np.ndarray:
    """The picture of splats as they are, none split."""
    renderer = SplatRenderer(field)
    renderer.splats = deformed_splats(field, edits)
    frame = renderer.render(CAMERA)
    assert frame is not None
    return frame.rgb


if __name__ == "__main__":
    tyro.cli(main)
