"""The built-in chair in layouts of which no authors' code runs on a CPU, by independent writers.

    python -m benchmarks.imported.written_fields -o FOLDER [--svox2 SOURCES]

instant_ngp.ingp, plenoctree.npz (svox), svraster.pt and svox2.npz (Plenoxels). With SOURCES, a clone of
github.com/sxyu/svox2, the authors' `SparseGrid.save` writes the last one, and svox2_pictures.npz has a view
by their renderer: rgb [1,H,W,3], c2w [1,4,4] and lens [1,6] (fx, fy, cx, cy, width, height).

Values are those of the chair's solid field, blurred to the grid (`WIDTH`), seen from above: no trained
field, but one whose edits show.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.cameras.camera import Camera
from cagefield.procedural import procedural_scene
from cagefield.typing import Array

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))

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
    write_plenoctree(options.out / "plenoctree.npz")
    write_voxels(options.out / "svraster.pt")
    write_svox2(options.out / "svox2.npz", options.svox2)
    for path in sorted(options.out.iterdir()):
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


def write_instant_ngp(path: Path) -> None:
    """A snapshot with one dense level, and perceptrons that pass its four features on: relu(h) - relu(-h)."""
    base = CELLS
    resolution = base  # scale base - 1, vertices at (i - 1/2) / (base - 1)
    scale, offset = 0.5 / HALF, np.full(3, 0.5)
    axis = (np.arange(resolution) - 0.5) / (base - 1)
    x = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    sigma, rgb = solid(((x - offset) / scale)[..., [2, 0, 1]])
    features = np.empty((*sigma.shape, 4))
    features[..., 0] = np.log(np.maximum(sigma, 1e-3) / scale)  # density per unit of NGP's space
    logits = np.clip(rgb, 0.02, 0.98)
    features[..., 1:] = np.log(logits / (1.0 - logits))
    table = np.zeros((-(-(resolution**3) // 8) * 8, 4))
    table[: resolution**3] = features.transpose(2, 1, 0, 3).reshape(-1, 4)  # x is fastest
    mirrored = np.zeros((16, 16))
    mirrored[range(4), range(4)], mirrored[range(4, 8), range(4)] = 1.0, -1.0
    joined = np.zeros((16, 16))
    joined[range(4), range(4)], joined[range(4), range(4, 8)] = 1.0, -1.0
    first = np.zeros((16, 32))
    first[:3, 1:4], first[3:6, 1:4] = np.eye(3), -np.eye(3)
    last = np.zeros((16, 16))
    last[:3, :3], last[:3, 3:6] = np.eye(3), -np.eye(3)
    parts = [mirrored, joined, first, np.eye(16), last, table]
    params = np.concatenate([part.reshape(-1) for part in parts]).astype("<f2")
    content: dict[str, Any] = snapshot()
    content["encoding"] |= {
        "n_levels": 1,
        "base_resolution": base,
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
