"""A svox2 grid of random values: saved and rendered by the authors' code, read and rendered by ours.

    git clone https://github.com/sxyu/svox2 SOURCES; pip install tqdm
    python -m benchmarks.imported.compare_svox2 SOURCES -o grid.npz

Their training needs CUDA; their `save` and `volume_render(use_kernel=False)` run on the CPU. Both pictures
take fine steps: theirs .04 of a cell, ours 600 on a ray.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import torch

from cagefield.cameras.camera import Camera
from cagefield.fields.voxel_field import VoxelField
from cagefield.formats.external.read_external import read_external
from cagefield.images.metrics import psnr
from cagefield.rendering.reference_renderer import render_sampled


def main() -> None:
    """Prints the PSNR between the two pictures over white."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("sources", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    options = parser.parse_args()
    sys.path.insert(0, str(options.sources))
    import svox2  # type: ignore[import-not-found]

    torch.manual_seed(0)
    shape, center = [14, 12, 16], [0.05, 0.0, -0.1]
    grid = svox2.SparseGrid(shape, radius=[0.6, 0.5, 0.8], center=center, basis_dim=9, device="cpu")
    count = len(grid.density_data)
    density = (6.0 * torch.randn(count, 1) + 1.0).reshape(shape)
    for axis in range(3):
        density.index_fill_(axis, torch.tensor([0, shape[axis] - 1]), 0.0)
    kept = torch.rand(count) < 0.7
    links = torch.full((count,), -1, dtype=torch.int32)
    links[kept] = torch.arange(int(kept.sum()), dtype=torch.int32)
    grid.links = links.reshape(shape)
    grid.density_data = torch.nn.Parameter(density.reshape(-1, 1)[kept])
    grid.sh_data = torch.nn.Parameter(0.12 * torch.randn(int(kept.sum()), 27))
    grid.save(str(options.out), compress=True)
    grid = svox2.SparseGrid.load(str(options.out))  # the file has float16 colors
    grid.opt.step_size = 0.04
    camera = Camera.look_at((1.2, -1.0, 0.9), center, width=12, height=12, fov_x=0.9)
    origins, directions = (torch.from_numpy(np.array(values, np.float32)) for values in camera.rays())
    with torch.no_grad():
        theirs = grid.volume_render(svox2.Rays(origins, directions), use_kernel=False).numpy()
    found = read_external(options.out)
    if found is None or not isinstance(found.field, VoxelField):
        raise SystemExit(f"{options.out} was not read as voxels")
    ours = render_sampled(found.field, camera, samples=600, background="white").rgb
    pair = (np.clip(ours, 0, 1), np.clip(theirs.reshape(ours.shape), 0, 1))
    print(f"{found.description}: {psnr(*pair):.1f} dB, at most {np.abs(pair[0] - pair[1]).max():.1e}")


if __name__ == "__main__":
    main()
