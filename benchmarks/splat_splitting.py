"""Draws edits that bend splats, whole and split, and says how far both are from finer ones.

    python benchmarks/splat_splitting.py [-o docs/edits/splat_splitting.png]

A rod of 9 long splats stretched by 4 and bent by 60 degrees, a sheet of 40 wide ones twisted by 150 degrees.
A row is: at rest, whole, split. The measure is splats split three times as finely (BEND = 0.04).
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from cagefield import Cage, Camera, Edit, EditStack, SplatField
from cagefield.rendering import splat_splitting
from cagefield.rendering.deformed_splats import deformed_splats
from cagefield.rendering.images import side_by_side, write_png
from cagefield.rendering.metrics import psnr
from cagefield.rendering.splat_renderer import SplatRenderer

CAMERA = Camera.look_at((0, -4.5, 0.6), (0.1, 0, 0.1), width=300, height=360, fov_x=0.6)
BOUNDS = np.array([[-2.5] * 3, [2.5] * 3])
C0 = 0.28209479177387814


def splats(means: np.ndarray, scales: tuple[float, float, float], colours: np.ndarray) -> SplatField:
    """Splats of one shape, axes along x, y and z."""
    count = len(means)
    return SplatField(
        means,
        np.log(np.tile(scales, (count, 1))),
        np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
        np.full(count, 0.95),
        ((colours - 0.5) / C0)[:, None],
        bounds=BOUNDS,
    )


def rod() -> SplatField:
    """A thin part along z."""
    z = np.linspace(-1.0, 1.0, 9)
    colours = np.stack([0.5 + 0.5 * np.sin(6 * z), np.full(9, 0.3), 0.5 - 0.5 * np.sin(6 * z)], axis=1)
    return splats(np.stack([0 * z, 0 * z, z], axis=1), (0.03, 0.03, 0.15), colours)


def sheet() -> SplatField:
    """A flat part across y."""
    z, x = (grid.ravel() for grid in np.meshgrid(np.linspace(-1, 1, 10), np.linspace(-0.35, 0.35, 4)))
    colours = np.stack([0.5 + 0.5 * np.sin(9 * z), 0.5 + 0.5 * np.sin(9 * x), np.full(40, 0.4)], axis=1)
    return splats(np.stack([x, 0 * x, z], axis=1), (0.14, 0.01, 0.133), colours)


CASES = {
    "stretched by 4": (
        rod(),
        Edit(Cage.box((0, 0, 0.3), (0.6, 0.6, 0.5)), Cage.box((0, 0, 0.3), (2, 2, 3.6))).scale((1, 1, 4)),
    ),
    "twisted by 150 degrees": (
        sheet(),
        Edit(Cage.box((0, 0, 0.9), (0.8, 0.8, 0.4)), Cage.box((0, 0, 0.2), (1.8, 1.8, 2.2))).rotate(
            (0, 0, np.radians(150))
        ),
    ),
    "bent by 60 degrees": (
        rod(),
        Edit(Cage.box((0, 0, 0.8), 0.5), Cage.box((0.3, 0, 0.2), (2.4, 2.4, 2.6)))
        .translate((0.55, 0, -0.1))
        .rotate((0, np.radians(60), 0)),
    ),
}


def main(
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"])] = Path("docs/edits/splat_splitting.png"),
) -> None:
    print("| edit | splats | split | whole, dB | split, dB | at rest, split against whole, dB |")
    print("| --- | --: | --: | --: | --: | --: |")
    rows = []
    for name, (field, edit) in CASES.items():
        edits = EditStack([edit])
        split = splat_splitting.split_for_edits(field, edits)
        bend, rounds = splat_splitting.BEND, splat_splitting.ROUNDS
        splat_splitting.BEND, splat_splitting.ROUNDS = 0.04, 6
        fine = shown(splat_splitting.split_for_edits(dataclasses.replace(field), edits), edits)
        splat_splitting.BEND, splat_splitting.ROUNDS = bend, rounds
        rest, parts = shown(field, EditStack()), shown(split, edits)
        whole = shown(field, edits)
        same = psnr(shown(split, EditStack()), rest)
        print(
            f"| {name} | {len(field)} | {len(split)} | {psnr(whole, fine):.1f} | {psnr(parts, fine):.1f} "
            f"| {same:.1f} |",
            flush=True,
        )
        rows.append(side_by_side(rest, whole, parts))
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
