"""Small TensoRF checkpoints, trained on the CPU by the authors' own code, with pictures that it renders.

    git clone https://github.com/apchenstu/TensoRF SOURCES
    cagefield make-scene chair -o DATA --size 128 --views 60 --test-views 8
    python -m benchmarks.imported.train_tensorf SOURCES DATA -o OUT/chair.th

Model, rendering, alpha mask, shrinking, upsampling and `save` are the authors'; the loop below only feeds
them rays and steps their optimizer. Beside OUT/chair.th, OUT/chair.npz has the test views as their code
renders them: rgb [V,H,W,3].
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import torch

from cagefield.cameras.camera import Camera
from cagefield.datasets import load_dataset

BATCH = 1024


def main() -> None:
    """Trains, saves, renders."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("sources", type=Path)
    parser.add_argument("data", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--model", default="TensorVMSplit")
    parser.add_argument("--shading", default="MLP_Fea")
    parser.add_argument("--act", default="softplus")
    parser.add_argument("--density-shift", type=float, default=-10.0)
    parser.add_argument("--density", type=int, nargs="+", default=[4, 4, 4])
    parser.add_argument("--appearance", type=int, nargs="+", default=[8, 8, 8])
    parser.add_argument("--iterations", type=int, default=300)
    parser.add_argument("--voxels", type=int, default=64**3)
    options = parser.parse_args()
    torch.manual_seed(20211202)
    np.random.seed(20211202)
    sys.path.insert(0, str(options.sources))
    model = _train(options)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    model.save(str(options.out))
    cameras = [view.camera for view in load_dataset(options.data).test]
    pictures = np.stack([render(model, camera) for camera in cameras])
    np.savez(options.out.with_suffix(".npz"), rgb=pictures)
    print(f"{options.out}: {options.out.stat().st_size} bytes; {len(pictures)} pictures")


def rays_of(camera: Camera) -> torch.Tensor:
    """Origins and unit directions [H*W,6]."""
    return torch.from_numpy(np.concatenate(camera.rays(), axis=1).astype(np.float32))


def render(model: Any, camera: Camera) -> np.ndarray:
    """rgb [H,W,3] over white by the authors' forward pass."""
    with torch.no_grad():
        parts = [model(rays, white_bg=True, is_train=False)[0] for rays in rays_of(camera).split(4096)]
    return torch.cat(parts).reshape(camera.height, camera.width, 3).numpy()


def _train(options: argparse.Namespace) -> Any:
    from models import tensoRF  # type: ignore[import-not-found]

    dataset = load_dataset(options.data)
    rays = torch.cat([rays_of(view.camera) for view in dataset.train])
    colors = torch.cat([torch.from_numpy(over_white(view.load())) for view in dataset.train])
    box = torch.tensor([[-1.5] * 3, [1.5] * 3])
    start = 32**3
    model = getattr(tensoRF, options.model)(
        box,
        _resolution(start, box),
        torch.device("cpu"),
        density_n_comp=options.density if options.model != "TensorVM" else options.density[0],
        appearance_n_comp=options.appearance if options.model != "TensorVM" else options.appearance[0],
        app_dim={"RGB": 3}.get(options.shading, 27),
        near_far=[2.0, 6.0],
        shadingMode=options.shading,
        fea2denseAct=options.act,
        alphaMask_thres=1e-4,
        density_shift=options.density_shift if options.act == "softplus" else 0.0,
        distance_scale=25.0,
        pos_pe=6,
        view_pe=2,
        fea_pe=2,
        featureC=64,
        step_ratio=1.0,
    )
    upsampling = {int(options.iterations * share): size for share, size in ((0.3, 0.5), (0.5, 1.0))}
    masking = [int(options.iterations * share) for share in (0.25, 0.6)]
    optimizer = torch.optim.Adam(model.get_optparam_groups(0.02, 0.001), betas=(0.9, 0.99))
    sparsity = 8e-5
    for iteration in range(options.iterations):
        rows = torch.randint(0, len(rays), (BATCH,))
        picture, _depth = model(rays[rows], white_bg=True, is_train=True)
        loss = torch.mean((picture - colors[rows]) ** 2)
        total = loss + sparsity * model.density_L1() if hasattr(model, "density_L1") else loss
        optimizer.zero_grad()
        total.backward()
        optimizer.step()
        if iteration % 50 == 0:
            print(iteration, f"{-10 * math.log10(loss.item()):.2f} dB", flush=True)
        if iteration in masking and options.model != "TensorVM" and _opaque(model):
            found = model.updateAlphaMask(tuple(model.gridSize.tolist()))
            if iteration == masking[0]:
                model.shrink(found)
                sparsity = 4e-5
        if iteration in upsampling and options.model != "TensorVM":
            model.upsample_volume_grid(_resolution(int(options.voxels * upsampling[iteration]), model.aabb))
            optimizer = torch.optim.Adam(model.get_optparam_groups(0.02, 0.001), betas=(0.9, 0.99))
    return model


def _opaque(model: Any) -> bool:
    """Whether anything is opaque enough for the alpha mask; it must not be empty."""
    return bool((model.getDenseAlpha()[0] > model.alphaMask_thres).any())


def _resolution(voxels: int, box: torch.Tensor) -> list[int]:
    """Vertices along each axis of about so many cubic voxels in a box [2,3]."""
    size = (box[1] - box[0]).tolist()
    edge = (math.prod(size) / voxels) ** (1 / 3)
    return [int(length / edge) for length in size]


def over_white(image: np.ndarray) -> np.ndarray:
    """Colors [H*W,3] in [0,1] over white of a photo of 3 or 4 channels."""
    values = image.astype(np.float32) / (255.0 if image.dtype == np.uint8 else 1.0)
    if values.shape[-1] == 4:
        values = values[..., :3] * values[..., 3:] + 1.0 - values[..., 3:]
    return values.reshape(-1, 3)


if __name__ == "__main__":
    main()
