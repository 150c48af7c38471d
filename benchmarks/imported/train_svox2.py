"""A small svox2 grid: rendered and saved on the CPU by the authors' own code, with pictures that it renders.

    git clone https://github.com/sxyu/svox2 SOURCES
    cagefield make-scene chair -o DATA --size 128 --views 60 --test-views 8
    python -m benchmarks.imported.train_svox2 SOURCES DATA -o OUT/chair.npz

Their training kernels need CUDA; here Adam optimizes their differentiable `volume_render(use_kernel=False)`.
Beside OUT/chair.npz, OUT/chair_pictures.npz has the test views as their code renders them: rgb [V,H,W,3].
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import torch

from benchmarks.imported.train_tensorf import over_white, rays_of
from cagefield.cameras.camera import Camera
from cagefield.datasets import load_dataset
from cagefield.formats.external.svox2 import SCENE_SCALE

BATCH = 256


def main() -> None:
    """Trains, empties what is transparent, saves, renders."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("sources", type=Path)
    parser.add_argument("data", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--iterations", type=int, default=30)
    parser.add_argument("--views", type=int, default=2)
    parser.add_argument("--cells", type=int, nargs=3, default=[36, 32, 44])
    options = parser.parse_args()
    torch.manual_seed(0)
    sys.path.insert(0, str(options.sources))
    import svox2  # type: ignore[import-not-found]

    dataset = load_dataset(options.data)
    rays = torch.cat([_scaled_rays(view.camera) for view in dataset.train])
    colors = torch.cat([torch.from_numpy(over_white(view.load())) for view in dataset.train])
    grid = svox2.SparseGrid(
        options.cells, radius=[0.6, 0.5, 0.8], center=[0.0, 0.0, 0.05], basis_dim=9, device="cpu"
    )
    grid.density_data.data[:] = 0.5
    optimizer = torch.optim.Adam(
        [{"params": grid.density_data, "lr": 3.0}, {"params": grid.sh_data, "lr": 0.1}]
    )
    for iteration in range(options.iterations):
        rows = torch.randint(0, len(rays), (BATCH,))
        picture = _render(grid, rays[rows], svox2)
        loss = torch.mean((picture - colors[rows]) ** 2)
        optimizer.zero_grad()
        (loss + 1e-5 * torch.relu(grid.density_data).mean()).backward()
        optimizer.step()
        if iteration % 10 == 0:
            print(iteration, f"{-10 * math.log10(loss.item()):.2f} dB", flush=True)
    _prune(grid)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    grid.save(str(options.out), compress=True)
    # its file has float16 colors
    grid = svox2.SparseGrid.load(str(options.out))
    cameras = [view.camera for view in dataset.test[: options.views]]
    pictures = []
    with torch.no_grad():
        for camera in cameras:
            parts = [_render(grid, part, svox2) for part in _scaled_rays(camera).split(4096)]
            pictures.append(torch.cat(parts).reshape(camera.height, camera.width, 3).numpy())
    np.savez(options.out.with_name(options.out.stem + "_pictures.npz"), rgb=np.stack(pictures))
    print(f"{options.out}: {options.out.stat().st_size} bytes; {len(pictures)} pictures")


def _scaled_rays(camera: Camera) -> torch.Tensor:
    """Rays [H*W,6] of the camera as svox2 scales it."""
    rays = rays_of(camera)
    return torch.cat([rays[:, :3] * SCENE_SCALE, rays[:, 3:]], dim=1)


def _render(grid: Any, rays: torch.Tensor, svox2: Any) -> torch.Tensor:
    """rgb [N,3] over svox2's default background, white."""
    picture: torch.Tensor = grid.volume_render(
        svox2.Rays(rays[:, :3].contiguous(), rays[:, 3:].contiguous()), use_kernel=False
    )
    return picture


def _prune(grid: Any) -> None:
    """Empties the cells that none of their neighbours' density needs, as `resample` does."""
    sigma = grid.density_data.data.reshape(1, 1, *grid.links.shape)
    kept = (torch.nn.functional.max_pool3d(sigma, 3, padding=1, stride=1) > 0.1).reshape(-1)
    links = torch.full((len(kept),), -1, dtype=torch.int32)
    links[kept] = torch.arange(int(kept.sum()), dtype=torch.int32)
    grid.links = links.reshape(grid.links.shape)
    grid.density_data = torch.nn.Parameter(grid.density_data.data[kept])
    grid.sh_data = torch.nn.Parameter(grid.sh_data.data[kept])
    grid.capacity = len(grid.sh_data)


if __name__ == "__main__":
    main()
