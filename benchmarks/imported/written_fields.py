"""The built-in chair in layouts of which no authors' code runs on a CPU, by independent writers.

    python -m benchmarks.imported.written_fields -o FOLDER [--svox2 SOURCES]

instant_ngp.ingp, nerfacto_tcnn/ (nerfacto in tiny-cuda-nn's layout), plenoctree.npz (svox), svraster.pt and
svox2.npz (Plenoxels). With SOURCES, a clone of github.com/sxyu/svox2 (`pip install tqdm`), the authors'
`SparseGrid.save` writes the last one, and svox2_pictures.npz has a view by their renderer: rgb [1,H,W,3],
c2w [1,4,4] and lens [1,6] (fx, fy, cx, cy, width, height).

Values are those of the chair's solid field, blurred to the grid (`WIDTH`), seen from above: no trained
field, but one whose edits show.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.cameras.camera import Camera
from cagefield.procedural import procedural_scene
from cagefield.typing import Array

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))

from nerfacto_files import flat, write_checkpoint
from ngp_files import snapshot, write
from svraster_files import svraster_content, write_svraster

LEVELS = 6
CELLS = 1 << LEVELS
HALF, CENTER = 1.25, np.array([0.0, 0.0, 0.0])
"""Half edge and center of the cube."""
WIDTH = 0.02
"""Width of surfaces, world units: half a cell of the cube."""
MAX_DENSITY = 60.0


def main() -> None:
    """Writes the files and prints their names."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--svox2", type=Path)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    write_instant_ngp(options.out / "instant_ngp.ingp")
    write_nerfacto(options.out / "nerfacto_tcnn")
    write_plenoctree(options.out / "plenoctree.npz")
    write_voxels(options.out / "svraster.pt")
    write_svox2(options.out / "svox2.npz", options.svox2)
    for path in sorted(options.out.rglob("*")):
        if path.is_file():
            print(f"{path}: {path.stat().st_size} bytes")


def solid(points: Array) -> tuple[Array, Array]:
    """(sigma, rgb [...,3]) of the chair at points [...,3]; colors of empty points are gray."""
    field = procedural_scene("chair").field(eps=WIDTH)
    flat = np.ascontiguousarray(points.reshape(-1, 3), np.float32)
    below = np.tile(np.array([0.0, 0.0, -1.0], np.float32), (len(flat), 1))
    sigma, rgb = field(flat, below)
    rgb[sigma <= 1e-3] = 0.5
    density = np.minimum(sigma, MAX_DENSITY).astype(np.float64)
    return density.reshape(points.shape[:-1]), rgb.reshape(points.shape).astype(np.float64)


def cell_centers(cells: int = CELLS) -> Array:
    """Centers [n,n,n,3] of the cube's cells."""
    axis = (np.arange(cells) + 0.5) * (2.0 * HALF / cells) - HALF
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1) + CENTER


def vertices() -> Array:
    """Vertices [n,n,n,3] of a dense level of CELLS in tiny-cuda-nn's grid, in the grid's unit cube."""
    axis = (np.arange(CELLS) - 0.5) / (CELLS - 1)
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)


def dense_level(points: Array, unit: float) -> Array:
    """Table [n^3,4] of a dense level whose vertices are at `points` [n,n,n,3] of the world.

    Features: logarithm of the density per field's unit, `unit` world units, and logits of the color.
    """
    sigma, rgb = solid(points)
    features = np.empty((*sigma.shape, 4))
    features[..., 0] = np.log(np.maximum(sigma, 1e-3) * unit)
    colors = np.clip(rgb, 0.02, 0.98)
    features[..., 1:] = np.log(colors / (1.0 - colors))
    return features.transpose(2, 1, 0, 3).reshape(-1, 4)  # x is fastest


def passing(inputs: int, first: int, count: int, outputs: int, hidden: int = 1) -> list[Array]:
    """Matrices [out,in] of a perceptron of width 16 that passes `count` inputs on: relu(h) - relu(-h)."""
    mirrored, joined = np.zeros((16, inputs)), np.zeros((outputs, 16))
    mirrored[:count, first : first + count] = np.eye(count)
    mirrored[count : 2 * count, first : first + count] = -np.eye(count)
    joined[:count, :count], joined[:count, count : 2 * count] = np.eye(count), -np.eye(count)
    return [mirrored, *[np.eye(16)] * (hidden - 1), joined]


def write_instant_ngp(path: Path) -> None:
    """A snapshot with one dense level, and perceptrons that pass its four features on."""
    scale, offset = 0.5 / HALF, np.full(3, 0.5)
    table = dense_level(((vertices() - offset) / scale)[..., [2, 0, 1]], 1.0 / scale)
    matrices = [passing(4, 0, 4, 16), passing(32, 1, 3, 3, hidden=2)]
    params = np.concatenate([*(flat(part, 0.0) for part in matrices), table.reshape(-1)]).astype("<f2")
    content: dict[str, Any] = snapshot()
    content["encoding"] |= {
        "n_levels": 1,
        "base_resolution": CELLS,
        "log2_hashmap_size": 3 * LEVELS,
        "per_level_scale": 2.0,
    }
    content["snapshot"] |= {
        "params_binary": params.tobytes(),
        "n_params": len(params),
        "background_color": [1.0, 1.0, 1.0, 1.0],
    }
    content["snapshot"]["nerf"]["dataset"] |= {
        "scale": scale,
        "offset": offset.tolist(),
        "xforms": [],
        "metadata": [],
    }
    write(path, content)


NERFACTO = f"""!!python/object:nerfstudio.engine.trainer.TrainerConfig
method_name: nerfacto
pipeline: !!python/object:nerfstudio.pipelines.base_pipeline.VanillaPipelineConfig
  model: !!python/object:nerfstudio.models.nerfacto.NerfactoModelConfig
    average_init_density: 1.0
    background_color: white
    disable_scene_contraction: true
    far_plane: 8.0
    hidden_dim: 16
    hidden_dim_color: 16
    num_levels: 1
    base_res: {CELLS}
    max_res: {CELLS}
    log2_hashmap_size: {3 * LEVELS}
    features_per_level: 4
    num_nerf_samples_per_ray: 96
    num_proposal_iterations: 2
    num_proposal_samples_per_ray: !!python/tuple
    - 128
    - 64
    proposal_initial_sampler: uniform
    proposal_net_args_list:
    - &id001
      hidden_dim: 16
      num_levels: 1
      base_res: {CELLS}
      max_res: {CELLS}
      log2_hashmap_size: {3 * LEVELS}
    - *id001
"""
"""A config.yml with nerfstudio's tags."""


def write_nerfacto(folder: Path) -> None:
    """A training's folder in tiny-cuda-nn's layout: grids of one dense level, not contracted."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "config.yml").write_text(NERFACTO, encoding="utf-8")
    same = {"transform": np.eye(4)[:3].tolist(), "scale": 1.0}
    (folder / "dataparser_transforms.json").write_text(json.dumps(same), encoding="utf-8")
    table = dense_level((vertices() - 0.5) * (2.0 * HALF) + CENTER, 1.0).astype(np.float32)
    values = {
        "box": np.stack([CENTER - HALF, CENTER + HALF]).astype(np.float32),
        "base": (passing(4, 0, 4, 16), ()),
        "head": (passing(31, 16, 3, 3, hidden=2), ()),  # behind 16 terms of the direction
        "proposals": [(passing(2, 0, 1, 1), ())] * 2,
        "table": table,
        "tables": [np.ascontiguousarray(table[:, :2])] * 2,
        "appearance": None,
    }
    path = folder / "nerfstudio_models" / "step-000000000.ckpt"
    write_checkpoint(path, values, "tcnn", garbage=0.0)


def write_plenoctree(path: Path) -> None:
    """An octree whose occupied cells are divided down to LEVELS, SH of degree 0."""
    sigma, rgb = solid(cell_centers())
    values = np.zeros((CELLS, CELLS, CELLS, 4))
    colors = np.clip(rgb, 0.02, 0.98)
    values[..., :3] = np.log(colors / (1.0 - colors)) * np.sqrt(4.0 * np.pi)
    values[..., 3] = sigma
    child, data = [np.zeros(8, np.int64)], [np.zeros((8, 4))]
    level = [(0, np.zeros(3, int), CELLS)]
    while level:
        following = []
        for node, corner, size in level:
            half = size // 2
            for slot, step in enumerate(np.ndindex(2, 2, 2)):
                at = corner + half * np.array(step)
                part = tuple(slice(a, a + half) for a in at)
                if half == 1:
                    data[node][slot] = values[tuple(at)]
                elif sigma[part].max() > 0.01:
                    child[node][slot] = len(child) - node
                    following.append((len(child), at, half))
                    child.append(np.zeros(8, np.int64))
                    data.append(np.zeros((8, 4)))
        level = following
    np.savez_compressed(
        path,
        data_dim=4,
        child=np.stack(child).reshape(-1, 2, 2, 2).astype(np.int32),
        parent_depth=np.zeros((len(child), 2), np.int32),
        n_internal=len(child),
        n_free=0,
        invradius3=np.full(3, 0.5 / HALF, np.float32),
        offset=(0.5 - 0.5 * CENTER / HALF).astype(np.float32),
        depth_limit=LEVELS,
        geom_resize_fact=1.0,
        data=np.stack(data).reshape(-1, 2, 2, 2, 4).astype(np.float16),
        data_format="SH1",
    )


def write_voxels(path: Path) -> None:
    """Voxels of level LEVELS whose corners have density, SH of degree 0."""
    axis = np.linspace(-HALF, HALF, CELLS + 1)
    vertices = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1) + CENTER
    dense = solid(vertices)[0]
    corners = [dense[i : i + CELLS, j : j + CELLS, k : k + CELLS] for i, j, k in np.ndindex(2, 2, 2)]
    full = np.argwhere(np.max(corners, axis=0) > 0.01)
    colors = solid(cell_centers())[1][tuple(full.T)]
    sh = np.zeros((len(full), 1, 3))
    sh[:, 0] = (colors - 0.5) * np.sqrt(4.0 * np.pi)

    def values(points: Array) -> Array:
        """Inverse of the program's activation, below its linear part."""
        return 1.1 * (np.log(np.maximum(solid(points)[0], 1e-3) / 110.0) + 1.0)

    octs = [((int(i), int(j), int(k)), LEVELS) for i, j, k in full]
    content = svraster_content(
        octs, values=values, sh=sh, center=CENTER, inside=2.0 * HALF, outside=0, degree=0
    )
    write_svraster(path, content)


def write_svox2(path: Path, sources: Path | None) -> None:
    """A grid with SH of degree 0 whose empty cells are not stored; by the authors' `save` with `sources`."""
    sigma, rgb = solid(cell_centers())
    sh = (rgb - 0.5) * np.sqrt(4.0 * np.pi)
    stored = sigma > 0.01
    links = np.full(sigma.shape, -1, np.int32)
    links[stored] = np.arange(int(stored.sum()))
    if sources is None:
        np.savez_compressed(
            path,
            radius=np.full(3, HALF, np.float32),
            center=CENTER.astype(np.float32),
            links=links,
            density_data=sigma[stored][:, None].astype(np.float32),
            sh_data=sh[stored].astype(np.float16),
            basis_type=1,
        )
        return
    import torch

    sys.path.insert(0, str(sources))
    import svox2  # type: ignore[import-not-found]

    grid = svox2.SparseGrid([CELLS] * 3, radius=HALF, center=CENTER.tolist(), basis_dim=1, device="cpu")
    grid.links = torch.from_numpy(links)
    grid.density_data = torch.nn.Parameter(torch.from_numpy(sigma[stored][:, None].astype(np.float32)))
    grid.sh_data = torch.nn.Parameter(torch.from_numpy(sh[stored].astype(np.float32)))
    grid.save(str(path), compress=True)
    grid = svox2.SparseGrid.load(str(path))
    grid.opt.step_size = 0.25
    camera = Camera.look_at((2.0, -1.6, 1.4), CENTER, width=48, height=48, fov_x=0.9)
    origins, directions = (torch.from_numpy(np.array(values, np.float32)) for values in camera.rays())
    with torch.no_grad():
        rgb = grid.volume_render(svox2.Rays(origins, directions), use_kernel=False).numpy()
    np.savez(
        path.with_name(f"{path.stem}_pictures.npz"),
        rgb=np.clip(rgb.reshape(1, camera.height, camera.width, 3), 0.0, 1.0),
        c2w=camera.c2w[None],
        untrained=True,
        lens=np.array([[camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height]]),
    )


if __name__ == "__main__":
    main()
