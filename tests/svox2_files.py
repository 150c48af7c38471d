"""Grids of svox2 by their published layout, and their values by SciPy alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import map_coordinates

from cagefield.fields.sh import sh_basis

SHAPE = (7, 5, 6)
RADIUS, CENTER = np.array([1.2, 0.8, 1.0], np.float32), np.array([0.1, -0.2, 0.3], np.float32)


def svox2_arrays(degree: int = 2, seed: int = 0, **changes: Any) -> dict[str, Any]:
    """Arrays as `SparseGrid.save` names them: a third of the inner cells stored, in shuffled rows."""
    rng = np.random.default_rng(seed)
    stored = rng.uniform(size=SHAPE) < 0.5
    for axis in range(3):
        stored[tuple(slice(None) if a != axis else [0, -1] for a in range(3))] = False
    count, terms = int(stored.sum()), (degree + 1) ** 2
    links = np.full(SHAPE, -1, np.int32)
    links[stored] = rng.permutation(count)
    arrays: dict[str, Any] = {
        "radius": RADIUS,
        "center": CENTER,
        "links": links,
        "density_data": rng.normal(4.0, 6.0, (count, 1)).astype(np.float32),
        "sh_data": rng.normal(0.0, 0.12, (count, 3 * terms)).astype(np.float16),
        "basis_type": 1,
    }
    arrays |= changes
    return {name: value for name, value in arrays.items() if value is not None}


def write_svox2(path: Path, arrays: dict[str, Any], compress: bool = False) -> Path:
    """The file by numpy.savez or numpy.savez_compressed, as the authors write it."""
    (np.savez_compressed if compress else np.savez)(path, **arrays)
    return path


def known(arrays: dict[str, Any], points: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(sigma [N], rgb [N,3]) at points [N,3] along unit d [N,3]: cells' centers, trilinear between them."""
    links = arrays["links"]
    gsz = np.array(links.shape)
    at = ((points - arrays["center"]) / (2.0 * arrays["radius"]) + 0.5) * gsz - 0.5
    dense = np.zeros((*links.shape, 1 + arrays["sh_data"].shape[1]))
    rows = np.concatenate([arrays["density_data"], arrays["sh_data"].astype(np.float64)], axis=1)
    dense[links >= 0] = rows[links[links >= 0]]
    values = np.stack([map_coordinates(dense[..., c], at.T, order=1) for c in range(dense.shape[3])], axis=1)
    terms = values[:, 1:].reshape(len(points), 3, -1)
    degree = round(terms.shape[2] ** 0.5) - 1
    color = np.einsum("nl,ncl->nc", sh_basis(d, degree), terms) + 0.5
    return np.maximum(values[:, 0], 0.0), np.maximum(color, 0.0)
