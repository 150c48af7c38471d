"""nerfacto checkpoints, step-*.ckpt, with their config.yml and dataparser_transforms.json.

    {"step": ..., "pipeline": {"_model.field.*": tensors, "_model.proposal_networks.N.*": ...}, ...}

PyTorch layout: tables and weights by name (`mlp_base.model.0.hash_table`, `mlp_head.layers.0.weight`).
tiny-cuda-nn layout: one flat vector of parameters for each module, networks before grids, matrices [out, in]
row by row without biases, inputs and outputs padded to multiples of 16 (8 for widths that are not fused).
Padded inputs are 1 for a network alone, 0 behind a grid; here they become biases, or are dropped.

Source: github.com/nerfstudio-project/nerfstudio, nerfstudio/fields/nerfacto_field.py and
field_components/mlp.py; github.com/NVlabs/tiny-cuda-nn, src/fully_fused_mlp.cu.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.datasets.nerf_normalization import Similarity
from cagefield.errors import FieldError
from cagefield.fields.external.hash_grid import HashGrid, expected_entries
from cagefield.fields.external.hash_network import HashNetwork, Layers
from cagefield.fields.external.nerfacto import NerfactoField
from cagefield.fields.external.nerfacto_parameters import DIRECTION_TERMS
from cagefield.formats.external.checkpoint import ExternalCheckpoint, StateDict
from cagefield.formats.external.nerfstudio_config import (
    TRANSFORMS,
    GridSettings,
    NerfactoSettings,
    find_config,
    nerfacto_settings,
    read_config,
    read_transforms,
)
from cagefield.formats.external.tcnn_parameters import FlatParameters, padded

FIELD, PROPOSALS = "_model.field", "_model.proposal_networks"

GEOMETRY_FEATURES = 15
_COLORS = {"white": (1.0, 1.0, 1.0), "black": (0.0, 0.0, 0.0), "random": (0.0, 0.0, 0.0)}


def is_nerfacto(content: Mapping[str, Any]) -> bool:
    """Whether a checkpoint's dictionary is a nerfacto's."""
    pipeline = content.get("pipeline")
    if not isinstance(pipeline, Mapping):
        return False
    return any(str(name).startswith(f"{FIELD}.mlp_head") for name in pipeline) and any(
        str(name).startswith(PROPOSALS) for name in pipeline
    )


def read_nerfacto(content: Mapping[str, Any], path: Path, config: Path | None) -> ExternalCheckpoint:
    """Field of a nerfacto checkpoint's dictionary; `path` is its file, `config` its config.yml.

    Raises:
        FieldError: a missing config, missing or misshapen tensors, options that are not read.
    """
    config = config or find_config(path)
    if config is None:
        raise FieldError(
            "a nerfacto checkpoint is read with its config.yml, which is not beside it; give it (--config)"
        )
    options = read_config(config)
    try:
        settings = nerfacto_settings(options)
    except FieldError as error:
        raise FieldError(f"{config}: {error}") from None
    tensors = {
        name: value
        for name, value in content["pipeline"].items()
        if str(name).startswith((f"{FIELD}.", f"{PROPOSALS}.", "_model.camera_optimizer."))
    }
    state = StateDict(tensors, "pipeline")
    endless = settings.background == "last_sample"
    if not endless and settings.background not in _COLORS:
        raise FieldError(
            f"background_color is {settings.background!r:.40}; last_sample, white, black and random are read"
        )
    field = NerfactoField(
        state.take(f"{FIELD}.aabb", 2).astype(np.float64),
        _base(state, settings),
        _head(state, settings),
        tuple(_proposal(state, settings, index) for index in range(len(settings.proposal_grids))),
        contracted=settings.contracted,
        density_scale=settings.density_scale,
        far=settings.far,
        samples=settings.samples,
        spacing=settings.spacing,
        endless=endless,
    )
    transforms = config.parent / TRANSFORMS
    notes = _notes(state, settings)
    if transforms.is_file():
        world = read_transforms(transforms)
    else:
        world = Similarity(np.eye(4), 1.0)
        notes.append(
            f"{TRANSFORMS} is not beside the config: the data set's coordinates are taken as the field's"
        )
    return ExternalCheckpoint(
        field,
        field.describe(),
        notes=tuple(notes),
        background=(0.0, 0.0, 0.0) if endless else _COLORS[settings.background],
        world=world,
        distance=0.8 if settings.contracted else None,
        from_source=True,
    )


def _notes(state: StateDict, settings: NerfactoSettings) -> list[str]:
    notes = []
    if f"{FIELD}.embedding_appearance.embedding.weight" in state:
        notes.append(
            "appearance: the mean embedding of the training photos, as nerfstudio renders"
            if settings.average_appearance
            else "appearance: zeros, as nerfstudio renders with this config"
        )
    poses = "_model.camera_optimizer.pose_adjustment"
    if poses in state and np.any(state.take(poses)):
        notes.append("left out: the training's refinement of camera poses; cameras are the data set's")
    for part in ("mlp_transient", "mlp_semantics", "mlp_pred_normals"):
        if any(name.startswith(f"{FIELD}.{part}") for name in state.names):
            notes.append(f"left out: {part}, which does not change color or density")
    return notes


def _layers(state: StateDict, name: str) -> Layers | None:
    """Layers of a PyTorch MLP, or None where there is none."""
    found: list[tuple[Any, Any]] = []
    while any(f"{name}.layers.{len(found)}.{part}" in state for part in ("weight", "bias")):
        prefix = f"{name}.layers.{len(found)}"
        found.append((state.take(f"{prefix}.weight", 2), state.take(f"{prefix}.bias", 1)))
    return tuple(found) or None


def _first(state: StateDict, *names: str) -> str | None:
    return next((name for name in names if name in state), None)


def _base(state: StateDict, settings: NerfactoSettings) -> HashNetwork:
    base, grid = f"{FIELD}.mlp_base", settings.grid
    table = _first(
        state, f"{base}.model.0.hash_table", f"{base}.0.hash_table", f"{FIELD}.mlp_base_grid.hash_table"
    )
    if table is not None:
        for name in (f"{base}.model.1", f"{base}.1", f"{FIELD}.mlp_base_mlp"):
            if (layers := _layers(state, name)) is not None:
                return HashNetwork(_torch_grid(state, table, grid), layers)
        raise FieldError("pipeline: the layers behind the hash grid are missing; save the checkpoint again")
    joint = _first(state, f"{base}.model.params", f"{base}.params")
    if joint is not None:
        flat = FlatParameters(state.take(joint, 1), joint)
        layers = _flat_layers(
            flat, grid.levels * grid.features, settings.hidden, 1, 1 + GEOMETRY_FEATURES, 0.0
        )
        return HashNetwork(_flat_grid(flat, grid), layers)
    return _two_modules(
        state,
        (f"{base}.0", f"{FIELD}.mlp_base_grid"),
        (f"{base}.1", f"{FIELD}.mlp_base_mlp"),
        grid,
        settings.hidden,
        1 + GEOMETRY_FEATURES,
    )


def _proposal(state: StateDict, settings: NerfactoSettings, index: int) -> HashNetwork:
    prefix, grid = f"{PROPOSALS}.{index}", settings.proposal_grids[index]
    hidden = settings.proposal_hidden[index]
    if f"{prefix}.linear.weight" in state:
        layers: Layers | None = (
            (state.take(f"{prefix}.linear.weight", 2), state.take(f"{prefix}.linear.bias", 1)),
        )
        table = f"{prefix}.encoding.hash_table"
        if table in state:
            return HashNetwork(_torch_grid(state, table, grid), layers)  # type: ignore[arg-type]
        name = f"{prefix}.encoding.tcnn_encoding.params"
        flat = FlatParameters(state.take(name, 1), name)
        return HashNetwork(_flat_grid(flat, grid), layers)  # type: ignore[arg-type]
    table = f"{prefix}.mlp_base.0.hash_table"
    if table in state:
        layers = _layers(state, f"{prefix}.mlp_base.1")
        if layers is None:
            raise FieldError(f"pipeline: tensor missing: {prefix}.mlp_base.1.layers.0.weight")
        return HashNetwork(_torch_grid(state, table, grid), layers)
    joint = f"{prefix}.mlp_base.params"
    if joint in state:
        flat = FlatParameters(state.take(joint, 1), joint)
        layers = _flat_layers(flat, grid.levels * grid.features, hidden, 1, 1, 0.0)
        return HashNetwork(_flat_grid(flat, grid), layers)
    return _two_modules(state, (f"{prefix}.mlp_base.0",), (f"{prefix}.mlp_base.1",), grid, hidden, 1)


def _head(state: StateDict, settings: NerfactoSettings) -> Layers:
    """Layers of the color network, the appearance embedding added to the first bias."""
    embedding = f"{FIELD}.embedding_appearance.embedding.weight"
    appearance = np.zeros(0, np.float32)
    if embedding in state:
        table = state.take(embedding, 2)
        if not table.size:
            raise FieldError(f"{embedding} is empty")
        appearance = table.mean(axis=0) if settings.average_appearance else np.zeros_like(table[0])
    inputs = DIRECTION_TERMS + GEOMETRY_FEATURES
    layers = _layers(state, f"{FIELD}.mlp_head")
    if layers is None:
        name = _first(state, f"{FIELD}.mlp_head.tcnn_encoding.params", f"{FIELD}.mlp_head.params")
        if name is None:
            raise FieldError(f"pipeline: tensor missing: {FIELD}.mlp_head.layers.0.weight")
        flat = FlatParameters(state.take(name, 1), name)
        layers = _flat_layers(flat, inputs + len(appearance), settings.hidden_color, 2, 3, 1.0)
        flat.check_end()
    (weight, bias), *more = layers
    if weight.shape[1] != inputs + len(appearance):
        raise FieldError(
            f"{FIELD}.mlp_head takes {weight.shape[1]} inputs, expected {inputs} and {len(appearance)} of "
            "the appearance embedding"
        )
    folded = (bias + weight[:, inputs:] @ appearance).astype(np.float32)
    return ((np.ascontiguousarray(weight[:, :inputs]), folded), *more)


def _two_modules(
    state: StateDict,
    grids: tuple[str, ...],
    networks: tuple[str, ...],
    grid: GridSettings,
    hidden: int,
    outputs: int,
) -> HashNetwork:
    """Network of tiny-cuda-nn whose grid and perceptron are modules of their own."""
    name = _first(state, *(f"{module}.tcnn_encoding.params" for module in grids))
    network = _first(state, *(f"{module}.tcnn_encoding.params" for module in networks))
    if name is None or network is None:
        raise FieldError(
            f"pipeline: neither {grids[0]}.hash_table nor {grids[0]}.tcnn_encoding.params is there"
        )
    flat = FlatParameters(state.take(network, 1), network)
    layers = _flat_layers(flat, grid.levels * grid.features, hidden, 1, outputs, 1.0)
    flat.check_end()
    return HashNetwork(_flat_grid(FlatParameters(state.take(name, 1), name), grid), layers)


def _torch_grid(state: StateDict, name: str, grid: GridSettings) -> HashGrid:
    return HashGrid(state.take(name, 2), "torch", grid.levels, grid.base, grid.growth, grid.log2_size)


def _flat_grid(flat: FlatParameters, grid: GridSettings) -> HashGrid:
    """The grid of the rest of a vector."""
    entries = expected_entries("tcnn", grid.levels, grid.base, grid.growth, grid.log2_size)
    table = flat.matrix(entries, grid.features)
    flat.check_end()
    return HashGrid(table, "tcnn", grid.levels, grid.base, grid.growth, grid.log2_size)


def _flat_layers(
    flat: FlatParameters, inputs: int, width: int, hidden: int, outputs: int, padding: float
) -> Layers:
    alignment = 16 if width in (16, 32, 64, 128) else 8
    return flat.layers(padded(inputs, alignment), inputs, width, hidden, outputs, alignment, padding)
