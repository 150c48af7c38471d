"""Honest checkpoints of other programs' fields, some megabytes each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from external_readers import EXTERNAL_READERS
from hash_grid_readers import HASH_GRID_READERS
from reader_seeds import Reader

import ngp_files
from plenoctree_files import plenoctree_arrays, write_plenoctree
from svox2_files import svox2_arrays, write_svox2
from svraster_files import svraster_content, write_svraster
from tensorf_files import tensorf_content, write_tensorf


def _tensorf(folder: Path) -> None:
    content = tensorf_content()
    for name, array in content["state_dict"].items():
        if "plane" in name:
            content["state_dict"][name] = np.repeat(np.repeat(array, 64, axis=2), 64, axis=3)
    write_tensorf(folder / "a.th", content)


def _svox2(folder: Path) -> None:
    links = np.arange(60**3, dtype=np.int32).reshape(60, 60, 60)
    chance = np.random.default_rng(0)
    data = {
        "density_data": chance.normal(4, 6, (links.size, 1)).astype(np.float32),
        "sh_data": chance.normal(0, 0.1, (links.size, 27)).astype(np.float16),
    }
    write_svox2(folder / "a.npz", svox2_arrays(links=links, **data))


def _plenoctree(folder: Path) -> None:
    """A full tree of five levels: node n has the children 8 n + 1 to 8 n + 8."""
    count, inner = sum(8**level for level in range(5)), sum(8**level for level in range(4))
    child = np.zeros((count, 8), np.int32)
    child[:inner] = 7 * np.arange(inner)[:, None] + 1 + np.arange(8)
    data = np.random.default_rng(0).normal(size=(count, 2, 2, 2, 76)).astype(np.float16)
    arrays = plenoctree_arrays(25, child=child.reshape(-1, 2, 2, 2), data=data, n_internal=count)
    write_plenoctree(folder / "a.npz", arrays | {"parent_depth": np.zeros((count, 2), np.int32)})


def _svraster(folder: Path) -> None:
    octs = [((i, j, k), 5) for i, j, k in np.ndindex(32, 32, 32)]
    write_svraster(folder / "a.pt", svraster_content(octs, degree=3))


def _nerfacto(folder: Path) -> None:
    import nerfacto_files

    nerfacto_files.write_config(folder)
    arrays = nerfacto_files.arrays()
    arrays["appearance"] = np.repeat(arrays["appearance"], 200_000, axis=0)
    nerfacto_files.write_checkpoint(folder / "a.ckpt", arrays)


def _snapshot(folder: Path) -> None:
    grid = np.random.default_rng(0).uniform(0, 1, (2, 128**3)).astype(np.float32)
    ngp_files.write(folder / "a.msgpack", ngp_files.snapshot(grid=grid, aabb_scale=2))


def _large(known: dict[str, Reader], makers: dict[str, Callable[[Path], Any]]) -> dict[str, Reader]:
    return {name: replace(known[name], make=make) for name, make in makers.items()}


LARGE_EXTERNAL_READERS = {
    **_large(
        EXTERNAL_READERS,
        {
            "TensoRF .th": _tensorf,
            "svox2 .npz": _svox2,
            "PlenOctree .npz": _plenoctree,
            "SVRaster .pt": _svraster,
        },
    ),
    **_large(HASH_GRID_READERS, {"nerfacto .ckpt": _nerfacto, "Instant-NGP .msgpack": _snapshot}),
}
"""The readers, by their names in `readers.py`."""
