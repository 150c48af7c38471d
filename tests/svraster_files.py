"""SVRaster checkpoints by their published layout, and their values by loops over voxels."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.fields.sh import sh_basis

Array = np.ndarray[Any, Any]
FINEST = 16
CENTER, INSIDE = np.array([0.3, -0.2, 0.1]), 1.5


def path_of(ijk: tuple[int, int, int], level: int) -> int:
    """Octants from the root down, three bits each, x highest; the rest of 48 bits is 0."""
    path = 0
    for bit in reversed(range(level)):
        for value in ijk:
            path = path << 1 | (value >> bit & 1)
    return path << 3 * (FINEST - level)


def voxels(seed: int = 0, outside: int = 1) -> list[tuple[tuple[int, int, int], int]]:
    """(coordinates, level) of random voxels of several levels, without overlap."""
    rng = np.random.default_rng(seed)
    found = []
    pending = [((0, 0, 0), 0)]
    while pending:
        (i, j, k), level = pending.pop()
        for step in np.ndindex(2, 2, 2):
            child = (2 * i + step[0], 2 * j + step[1], 2 * k + step[2])
            kind = rng.uniform()
            if level < 2 + outside and (kind < 0.45 or level == 0):
                pending.append((child, level + 1))
            elif kind < 0.8:
                found.append((child, level + 1))
    return [found[n] for n in rng.permutation(len(found))]


def svraster_content(
    octs: list[tuple[tuple[int, int, int], int]] | None = None,
    *,
    values: Any = None,
    sh: Array | None = None,
    center: Array = CENTER,
    inside: float = INSIDE,
    outside: int = 1,
    seed: int = 0,
    degree: int = 2,
    quantized: bool = False,
) -> dict[str, Any]:
    """Dictionary as `SVInOut.save` writes it, of NumPy arrays; `values` maps grid points [G,3] to [G]."""
    rng = np.random.default_rng(seed + 1)
    octs = voxels(seed, outside) if octs is None else octs
    extent = inside * 2**outside
    corners = set()
    for ijk, level in octs:
        edge = 1 << (FINEST - level)
        corners |= {
            tuple(edge * (a + s) for a, s in zip(ijk, step, strict=True)) for step in np.ndindex(2, 2, 2)
        }
    points = center - 0.5 * extent + np.array(sorted(corners)) * (extent / 2**FINEST)
    geo = rng.normal(-1.0, 1.5, len(points)) if values is None else values(points)
    sh = rng.normal(0.0, 0.3, (len(octs), 16, 3)) if sh is None else sh
    content: dict[str, Any] = {
        "active_sh_degree": degree,
        "scene_center": center.astype(np.float32),
        "inside_extent": np.array([inside], np.float32),
        "scene_extent": np.array([extent], np.float32),
        "octpath": np.array([[path_of(*voxel)] for voxel in octs], np.int64),
        "octlevel": np.array([[level] for _, level in octs], np.int8),
        "_geo_grid_pts": geo.astype(np.float32)[:, None],
        "_sh0": sh[:, 0].astype(np.float32),
        "_shs": sh[:, 1:].astype(np.float32),
        "quantized": quantized,
    }
    if quantized:
        content["_geo_grid_pts"] = quantize(content["_geo_grid_pts"])
        for name in ("_sh0", "_shs"):
            array = content[name]
            content[name] = [quantize(array[:, n : n + 1]) for n in range(array.shape[1])]
    return content


def quantize(values: Array) -> dict[str, Array]:
    """256 evenly spread values, and the nearest one's index."""
    book = np.quantile(values, np.linspace(0, 1, 256)).astype(np.float32)
    return {"index": np.abs(values[..., None] - book).argmin(axis=-1).astype(np.uint8), "codebook": book}


def write_svraster(path: Path, content: dict[str, Any]) -> Path:
    """The dictionary by torch.save, arrays as tensors."""
    import torch

    def tensors(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: tensors(part) for key, part in value.items()}
        if isinstance(value, list):
            return [tensors(part) for part in value]
        return torch.from_numpy(value.copy()) if isinstance(value, np.ndarray) else value

    torch.save(tensors(content), path)
    return path


def known(
    content: dict[str, Any], octs: list[tuple[tuple[int, int, int], int]], p: Array, d: Array
) -> tuple[Array, Array]:
    """(sigma [N], rgb [N,3]) at points p [N,3] along unit directions d [N,3]; 0 in empty space."""
    extent, degree = float(content["scene_extent"][0]), content["active_sh_degree"]
    corners = [
        [
            tuple((a + s) << (FINEST - level) for a, s in zip(ijk, step, strict=True))
            for step in np.ndindex(2, 2, 2)
        ]
        for ijk, level in octs
    ]
    numbers = {corner: n for n, corner in enumerate(sorted({c for eight in corners for c in eight}))}
    sigma, rgb = np.zeros(len(p)), np.zeros((len(p), 3))
    u = (p - content["scene_center"].astype(np.float64) + 0.5 * extent) / extent
    basis = sh_basis(d, degree)
    for row, (ijk, level) in enumerate(octs):
        w = u * 2**level - np.array(ijk)
        for n in np.flatnonzero(((w >= 0) & (w < 1)).all(axis=1)):
            total = 0.0
            for step, corner in zip(np.ndindex(2, 2, 2), corners[row], strict=True):
                weight = math.prod(x if s else 1 - x for x, s in zip(w[n], step, strict=True))
                total += weight * float(content["_geo_grid_pts"][numbers[corner], 0])
            linear = 0.909090909091 * total - 0.904689820196
            sigma[n] = 100.0 * (total if total > 1.1 else math.exp(linear))
            sh = np.concatenate([content["_sh0"][row][None], content["_shs"][row]])[: (degree + 1) ** 2]
            rgb[n] = np.maximum(0.5 + basis[n] @ sh, 0.0)
    return sigma, rgb
