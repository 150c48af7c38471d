"""Small nerfacto checkpoints by an independent writer of the published layout, in both layouts."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from hash_oracle import tcnn_levels

GRID = {"num_levels": 4, "base_res": 4, "max_res": 32, "log2_hashmap_size": 9, "features_per_level": 2}
PROPOSAL = {"num_levels": 2, "base_res": 4, "max_res": 8, "log2_hashmap_size": 8, "features_per_level": 2}
HIDDEN, HIDDEN_COLOR, HIDDEN_PROPOSAL, APPEARANCE, PHOTOS = 16, 32, 16, 5, 3

CONFIG = """!!python/object:nerfstudio.engine.trainer.TrainerConfig
_target: !!python/name:nerfstudio.engine.trainer.Trainer ''
data: &id001 !!python/object/apply:pathlib.PosixPath
- data
- chair
method_name: nerfacto
optimizers:
  fields:
    optimizer: !!python/object:nerfstudio.engine.optimizers.AdamOptimizerConfig
      _target: &id003 !!python/name:torch.optim.adam.Adam ''
      lr: 0.01
pipeline: !!python/object:nerfstudio.pipelines.base_pipeline.VanillaPipelineConfig
  datamanager: !!python/object:nerfstudio.data.datamanagers.base_datamanager.VanillaDataManagerConfig
    data: *id001
  model: !!python/object:nerfstudio.models.nerfacto.NerfactoModelConfig
    _target: !!python/name:nerfstudio.models.nerfacto.NerfactoModel ''
    average_init_density: 0.5
    background_color: {background}
    disable_scene_contraction: {box}
    far_plane: {far}
    hidden_dim: 16
    hidden_dim_color: 32
    num_levels: 4
    base_res: 4
    max_res: 32
    log2_hashmap_size: 9
    features_per_level: 2
    num_nerf_samples_per_ray: 24
    num_proposal_iterations: 2
    num_proposal_samples_per_ray: !!python/tuple
    - 32
    - 16
    proposal_initial_sampler: {spacing}
    proposal_net_args_list:
    - &id002
      hidden_dim: 16
      log2_hashmap_size: 8
      max_res: 8
      num_levels: 2
      base_res: 4
      use_linear: false
    - *id002
    use_average_appearance_embedding: {mean}
"""


def growth(grid: dict[str, int]) -> float:
    return float((grid["max_res"] / grid["base_res"]) ** (1.0 / (grid["num_levels"] - 1)))


def write_config(
    folder: Path,
    *,
    background: str = "last_sample",
    box: bool = False,
    far: float = 20.0,
    spacing: str = "piecewise",
    mean: bool = True,
) -> Path:
    """config.yml with nerfstudio's tags, and dataparser_transforms.json."""
    folder.mkdir(parents=True, exist_ok=True)
    words = {"box": str(box).lower(), "mean": str(mean).lower()}
    text = CONFIG.format(background=background, far=far, spacing=spacing, **words)
    (folder / "config.yml").write_text(text)
    matrix = [[0.0, -1.0, 0.0, 0.5], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, -0.25]]
    (folder / "dataparser_transforms.json").write_text(json.dumps({"transform": matrix, "scale": 0.5}))
    return folder / "config.yml"


def arrays(seed: int = 0, layout: str = "torch") -> dict[str, Any]:
    """Matrices, biases and tables, by names of this module."""
    rng = np.random.default_rng(seed)

    def dense(*shape: int) -> np.ndarray[Any, Any]:
        return (rng.normal(size=shape) / np.sqrt(shape[-1])).astype(np.float32)

    def table(grid: dict[str, int]) -> np.ndarray[Any, Any]:
        levels, size = grid["num_levels"], 2 ** grid["log2_hashmap_size"]
        count = levels * size
        if layout == "tcnn":
            count = sum(
                level[2]
                for level in tcnn_levels(levels, grid["base_res"], growth(grid), grid["log2_hashmap_size"])
            )
        return rng.normal(size=(count, grid["features_per_level"])).astype(np.float32)

    inputs = 16 + 15 + APPEARANCE
    return {
        "base": ([dense(HIDDEN, 8), dense(16, HIDDEN)], [dense(HIDDEN), dense(16)]),
        "head": (
            [dense(HIDDEN_COLOR, inputs), dense(HIDDEN_COLOR, HIDDEN_COLOR), dense(3, HIDDEN_COLOR)],
            [dense(HIDDEN_COLOR), dense(HIDDEN_COLOR), dense(3)],
        ),
        "proposals": [([dense(HIDDEN_PROPOSAL, 4), dense(1, HIDDEN_PROPOSAL)], [dense(16), dense(1)])] * 2,
        "table": table(GRID),
        "tables": [table(PROPOSAL), table(PROPOSAL)],
        "appearance": rng.normal(size=(PHOTOS, APPEARANCE)).astype(np.float32),
    }


def flat(matrices: list[np.ndarray[Any, Any]], garbage: float) -> np.ndarray[Any, Any]:
    """Matrices padded to multiples of 16, one after another; padding holds `garbage`."""
    parts = []
    for index, matrix in enumerate(matrices):
        rows = -(-matrix.shape[0] // 16) * 16
        columns = -(-matrix.shape[1] // 16) * 16 if index == 0 else matrix.shape[1]
        wide = np.full((rows, columns), garbage, np.float32)
        wide[: matrix.shape[0], : matrix.shape[1]] = matrix
        parts.append(wide.reshape(-1))
    return np.concatenate(parts)


def write_checkpoint(
    path: Path, values: dict[str, Any], layout: str = "torch", garbage: float = 0.25
) -> Path:
    """step-*.ckpt of `arrays`; without biases where the layout is tiny-cuda-nn's.

    `values` may have its own "box" [2,3], and no embedding ("appearance": None).
    """
    field, nets = "_model.field", "_model.proposal_networks"
    box = values.get("box", np.array([[-1.5] * 3, [1.5] * 3], np.float32))
    state: dict[str, Any] = {f"{field}.aabb": box}
    if values["appearance"] is not None:
        state[f"{field}.embedding_appearance.embedding.weight"] = values["appearance"]

    def layers(prefix: str, pair: Any) -> None:
        for index, (weight, bias) in enumerate(zip(*pair, strict=True)):
            state[f"{prefix}.layers.{index}.weight"], state[f"{prefix}.layers.{index}.bias"] = weight, bias

    if layout == "torch":
        state[f"{field}.mlp_base.model.0.hash_table"] = values["table"]
        layers(f"{field}.mlp_base.model.1", values["base"])
        layers(f"{field}.mlp_head", values["head"])
    else:
        state[f"{field}.mlp_base.model.params"] = np.concatenate(
            [flat(values["base"][0], garbage), values["table"].reshape(-1)]
        )
        state[f"{field}.mlp_head.tcnn_encoding.params"] = flat(values["head"][0], garbage)
    for index, (pair, table) in enumerate(zip(values["proposals"], values["tables"], strict=True)):
        if layout == "torch":
            state[f"{nets}.{index}.mlp_base.0.hash_table"] = table
            layers(f"{nets}.{index}.mlp_base.1", pair)
        else:
            state[f"{nets}.{index}.mlp_base.0.tcnn_encoding.params"] = table.reshape(-1)
            state[f"{nets}.{index}.mlp_base.1.tcnn_encoding.params"] = flat(pair[0], garbage)
    path.parent.mkdir(parents=True, exist_ok=True)
    import torch

    pipeline = {name: torch.from_numpy(value.copy()) for name, value in state.items()}
    torch.save({"step": 9, "pipeline": pipeline, "optimizers": {}, "schedulers": {}, "scalers": {}}, path)
    return path


def write_run(folder: Path, layout: str = "torch", seed: int = 0, **options: Any) -> Path:
    """A training's folder; returns the checkpoint."""
    write_config(folder, **options)
    return write_checkpoint(
        folder / "nerfstudio_models" / "step-000000009.ckpt", arrays(seed, layout), layout
    )
