"""A made-up landscape of any number of splats: what a large capture asks of a renderer, in no file."""

from __future__ import annotations

import numpy as np

from cagefield.fields.sh import C0
from cagefield.fields.splat_field import SplatField
from cagefield.typing import Float32

BLOCK = 1_000_000
BOULDERS = 400
FLAT = 0.1
"""Third scale of the splats, against the others."""


def landscape(count: int, degree: int = 0, seed: int = 0) -> SplatField:
    """Flat splats on hills of 20 x 20 with boulders on them, each about as wide as its share of the surface.

    Colors vary smoothly, with a tenth of noise; where `degree` is above 0, a little with the direction.
    """
    chance = np.random.default_rng(seed)
    rocks = np.column_stack([chance.uniform(-9.5, 9.5, (BOULDERS, 2)), chance.uniform(0.1, 0.5, BOULDERS)])
    on_rocks = 4.0 * np.pi * np.square(rocks[:, 2]).sum()
    share = on_rocks / (on_rocks + 400.0)
    width = np.sqrt((on_rocks + 400.0) / count)
    out = {
        "means": np.empty((count, 3), np.float32),
        "log_scales": np.empty((count, 3), np.float32),
        "quaternions": np.empty((count, 4), np.float32),
        "opacities": np.empty(count, np.float32),
        "sh": np.zeros((count, (degree + 1) ** 2, 3), np.float32),
    }
    for start in range(0, count, BLOCK):
        rows = slice(start, min(start + BLOCK, count))
        number = rows.stop - rows.start
        xy = chance.uniform(-10.0, 10.0, (number, 2))
        slope = np.stack([0.35 * np.cos(0.7 * xy[:, 0]), -0.3 * np.sin(0.5 * xy[:, 1])], axis=1)
        means = np.column_stack([xy, _height(xy)])
        normals = np.column_stack([-slope, np.ones(number)])
        rock = np.flatnonzero(chance.random(number) < share)
        which = chance.choice(BOULDERS, len(rock), p=np.square(rocks[:, 2]) / np.square(rocks[:, 2]).sum())
        out_of = chance.normal(size=(len(rock), 3))
        out_of /= np.linalg.norm(out_of, axis=1, keepdims=True)
        foot = np.column_stack([rocks[which, :2], _height(rocks[which, :2])])
        means[rock] = foot + rocks[which, 2:] * out_of
        normals[rock] = out_of
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        out["means"][rows] = means
        out["log_scales"][rows] = np.log(0.7 * width) + chance.normal(0.0, 0.3, (number, 3))
        out["log_scales"][rows, 2] += np.log(FLAT)
        # The rotation that takes +z to the normal: (1 + n_z, -n_y, n_x, 0), of any length.
        out["quaternions"][rows] = np.column_stack(
            [1.0 + normals[:, 2], -normals[:, 1], normals[:, 0], np.full(number, 1e-6)]
        )
        out["opacities"][rows] = chance.uniform(0.3, 1.0, number)
        shade = 0.35 + 0.25 * np.sin(means @ np.array([[3.0, 1.0, 7.0], [2.0, -4.0, 1.0], [1.0, 5.0, -3.0]]))
        out["sh"][rows, 0] = (shade + 0.1 * chance.normal(size=(number, 3)) * shade) / C0 - 0.3
        if degree:
            out["sh"][rows, 1:] = 0.03 * chance.standard_normal(
                (number, out["sh"].shape[1] - 1, 3), np.float32
            )
    for values in out.values():
        values.setflags(write=False)
    return SplatField(**out, bounds=np.array([[-10.0, -10.0, -1.5], [10.0, 10.0, 1.5]]))


def _height(xy: Float32) -> Float32:
    return 0.5 * np.sin(0.7 * xy[:, 0]) + 0.6 * np.cos(0.5 * xy[:, 1])
