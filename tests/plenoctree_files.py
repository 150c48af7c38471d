"""PlenOctrees by their published layout, and their values by recursion over a dense grid."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cagefield.fields.sh import sh_basis

DEPTH = 3
SCALE, OFFSET = np.array([0.4, 0.5, 0.25], np.float32), np.array([0.45, 0.5, 0.55], np.float32)


def plenoctree_arrays(terms: int = 4, seed: int = 0, **changes: Any) -> dict[str, Any]:
    """Arrays as `N3Tree.save` names them: three levels, some slots divided, a third of the leaves empty."""
    rng = np.random.default_rng(seed)
    child = [np.zeros(8, np.int64)]
    level = [0]
    for _ in range(DEPTH - 1):
        following = []
        for node in level:
            for slot in np.flatnonzero(rng.uniform(size=8) < 0.5):
                child[node][slot] = len(child) - node
                following.append(len(child))
                child.append(np.zeros(8, np.int64))
        level = following
    width = 3 * max(1, terms) + 1
    data = rng.normal(0.0, 1.0, (len(child), 2, 2, 2, width))
    data[..., -1] = rng.uniform(-2.0, 4.0, data.shape[:-1])
    arrays: dict[str, Any] = {
        "data_dim": width,
        "child": np.stack(child).reshape(-1, 2, 2, 2).astype(np.int32),
        "parent_depth": np.zeros((len(child), 2), np.int32),
        "n_internal": len(child),
        "n_free": 0,
        "invradius3": SCALE,
        "offset": OFFSET,
        "depth_limit": 10,
        "geom_resize_fact": 1.0,
        "data": data.astype(np.float16),
        "data_format": f"SH{terms}" if terms else "RGBA",
    }
    arrays |= changes
    return {name: value for name, value in arrays.items() if value is not None}


def write_plenoctree(path: Path, arrays: dict[str, Any]) -> Path:
    """The file by numpy.savez_compressed, as the authors write it."""
    np.savez_compressed(path, **arrays)
    return path


def dense(arrays: dict[str, Any]) -> np.ndarray:
    """Values [8,8,8,K] of the tree on the grid of its finest level."""
    side = 1 << DEPTH
    grid = np.zeros((side, side, side, arrays["data"].shape[-1]))

    def fill(node: int, corner: np.ndarray, size: int) -> None:
        half = size // 2
        for i, j, k in np.ndindex(2, 2, 2):
            at = corner + half * np.array([i, j, k])
            step = int(arrays["child"][node, i, j, k])
            if step:
                fill(node + step, at, half)
            else:
                grid[tuple(slice(a, a + half) for a in at)] = arrays["data"][node, i, j, k]

    fill(0, np.zeros(3, int), side)
    return grid


def known(arrays: dict[str, Any], points: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(sigma [N], rgb [N,3]) at points [N,3], empty outside the box, along unit d [N,3]."""
    grid = dense(arrays)
    cell = np.floor((OFFSET + points * SCALE) * len(grid)).astype(int)
    inside = ((cell >= 0) & (cell < len(grid))).all(axis=1)
    values = grid[tuple(np.clip(cell, 0, len(grid) - 1).T)]
    color = values[:, :-1].reshape(len(points), 3, -1)
    if arrays["data_format"] != "RGBA":
        color = color * sh_basis(d, round(color.shape[2] ** 0.5) - 1)[:, None]
    return np.where(inside, np.maximum(values[:, -1], 0.0), 0.0), 1.0 / (1.0 + np.exp(-color.sum(axis=2)))
