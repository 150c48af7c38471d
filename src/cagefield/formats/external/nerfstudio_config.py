"""Values of nerfstudio's config.yml, a YAML of Python objects, read as plain mappings.

nerfstudio dumps dataclasses with tags such as `!!python/object:` and `!!python/name:`; a YAML loader that
follows them runs any code. Here a tag says nothing: a tagged mapping is a dict, a tagged sequence a list, a
scalar its text or plain value. Cycles, and aliases that expand to too many values, are refused.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from cagefield.datasets.nerf_normalization import Similarity
from cagefield.errors import FieldError
from cagefield.fields.external.external_field import frozen_array, number, whole_number
from cagefield.files import json_text, yaml_text
from cagefield.files.safe_open import read_text

CONFIG, TRANSFORMS = "config.yml", "dataparser_transforms.json"

_CURE = "give the config.yml that the training wrote (--config)"


def find_config(checkpoint: Path) -> Path | None:
    """Path of config.yml in the checkpoint's folder or the one above, or None."""
    folders = (checkpoint.parent, checkpoint.absolute().parent.parent)
    return next((folder / CONFIG for folder in folders if (folder / CONFIG).is_file()), None)


def read_config(path: Path) -> dict[str, Any]:
    """Plain values of a config.yml.

    Raises:
        FieldError: missing file, invalid YAML, or a content that is no mapping.
    """
    try:
        root = yaml_text.compose(read_text(path))
    except (OSError, UnicodeDecodeError, yaml_text.YamlError) as error:
        reason = " ".join(str(getattr(error, "strerror", None) or error).split())[:120]
        raise FieldError(f"{path}: not a readable config ({reason}); {_CURE}") from None
    if not isinstance(root, yaml.MappingNode):
        raise FieldError(f"{path}: no config of nerfstudio, its content is no mapping; {_CURE}")
    found = _plain(root)
    assert isinstance(found, dict)
    return found


def read_transforms(path: Path) -> Similarity:
    """Map from the reconstruction's coordinates to nerfstudio's world, p -> scale (R p + t).

    Raises:
        FieldError: missing or damaged file, a matrix that is no rigid motion.
    """
    try:
        values = json_text.loads(read_text(path))
        matrix = frozen_array("transform", values["transform"], np.float64, (3, 4))
        scale = number("scale", values["scale"], 1e-12, 1e12)
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, KeyError, TypeError, ValueError) as error:
        reason = f"{error!s:.40} is missing" if isinstance(error, KeyError) else f"{error!s:.120}"
        raise FieldError(f"{path}: not readable ({reason}); copy it from the training's folder") from None
    rotation = matrix[:, :3]
    if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-3 or np.linalg.det(rotation) < 0:
        raise FieldError(f"{path}: its transform is no rotation; copy it from the training's folder")
    rigid = np.eye(4)
    rigid[:3, :3] = rotation
    rigid[:3, 3] = scale * matrix[:, 3]
    return Similarity(rigid, scale)


@dataclass(frozen=True)
class GridSettings:
    """Options of a hash grid: levels, coarsest and finest resolution, log2 size, features of a level."""

    levels: int
    base: int
    finest: int
    log2_size: int
    features: int

    @property
    def growth(self) -> float:
        """Factor between the resolutions of levels."""
        if self.levels == 1:
            return 1.0
        return float(np.exp((np.log(self.finest) - np.log(self.base)) / (self.levels - 1)))

    @classmethod
    def from_options(cls, values: Any, levels: int, finest: int, log2_size: int) -> GridSettings:
        """Settings of a mapping of the config, with nerfstudio's defaults for missing keys."""
        if not isinstance(values, dict):
            raise FieldError(f"options of a network must be a mapping, got {type(values).__name__}")

        def whole(name: str, default: int, high: int) -> int:
            return whole_number(name, values.get(name, default), 1, high)

        return cls(
            whole("num_levels", levels, 128),
            whole("base_res", 16, 1 << 16),
            whole("max_res", finest, 1 << 24),
            whole("log2_hashmap_size", log2_size, 30),
            whole("features_per_level", 2, 64),
        )


@dataclass(frozen=True)
class NerfactoSettings:
    """Options of a nerfacto model that its checkpoint does not hold.

    grid, proposal_grids: of the field and of each proposal network. hidden, hidden_color, proposal_hidden:
    widths. contracted: space is contracted. density_scale: average_init_density. far: far_plane. samples: of
    each round. spacing: "piecewise" or "uniform". background: nerfstudio's name of it. average_appearance:
    pictures take the mean embedding, else zeros.
    """

    grid: GridSettings
    proposal_grids: tuple[GridSettings, ...]
    hidden: int
    hidden_color: int
    proposal_hidden: tuple[int, ...]
    contracted: bool
    density_scale: float
    far: float
    samples: tuple[int, ...]
    spacing: str
    background: str
    average_appearance: bool


_PROPOSALS = (
    {"hidden_dim": 16, "log2_hashmap_size": 17, "num_levels": 5, "max_res": 128},
    {"hidden_dim": 16, "log2_hashmap_size": 17, "num_levels": 5, "max_res": 256},
)


def nerfacto_settings(config: dict[str, Any]) -> NerfactoSettings:
    """Options of the model in a config, nerfstudio's defaults for missing keys.

    Raises:
        FieldError: a config without a model, options of the wrong type or out of range.
    """
    model = config.get("pipeline", {}).get("model") if isinstance(config.get("pipeline"), dict) else None
    if not isinstance(model, dict) or "proposal_net_args_list" not in model:
        raise FieldError(f"no config of nerfacto: it has no pipeline.model with proposal networks; {_CURE}")

    def flag(name: str, default: bool) -> bool:
        value = model.get(name, default)
        if not isinstance(value, bool):
            raise FieldError(f"{name} must be true or false, got {value!r:.40}")
        return value

    rounds = whole_number("num_proposal_iterations", model.get("num_proposal_iterations", 2), 1, 15)
    counts = model.get("num_proposal_samples_per_ray", [256, 96])
    if not isinstance(counts, list) or len(counts) < rounds:
        raise FieldError(f"num_proposal_samples_per_ray must be {rounds} numbers, got {counts!r:.60}")
    samples = [*counts[:rounds], model.get("num_nerf_samples_per_ray", 48)]
    listed = model.get("proposal_net_args_list") or list(_PROPOSALS)
    if not isinstance(listed, list) or not all(isinstance(entry, dict) for entry in listed):
        raise FieldError(f"proposal_net_args_list must be mappings, got {listed!r:.60}")
    networks = 1 if flag("use_same_proposal_network", False) else rounds
    chosen = [listed[min(index, len(listed) - 1)] for index in range(networks)]
    return NerfactoSettings(
        grid=GridSettings.from_options(model, 16, 2048, 19),
        proposal_grids=tuple(GridSettings.from_options(entry, 8, 1024, 18) for entry in chosen),
        hidden=whole_number("hidden_dim", model.get("hidden_dim", 64), 1, 1 << 12),
        hidden_color=whole_number("hidden_dim_color", model.get("hidden_dim_color", 64), 1, 1 << 12),
        proposal_hidden=tuple(
            whole_number("hidden_dim", entry.get("hidden_dim", 64), 1, 1 << 12) for entry in chosen
        ),
        contracted=not flag("disable_scene_contraction", False),
        density_scale=number("average_init_density", model.get("average_init_density", 1.0), 1e-12, 1e12),
        far=number("far_plane", model.get("far_plane", 1000.0), 1e-6, 1e12),
        samples=tuple(whole_number("number of samples", count, 1, 1 << 14) for count in samples),
        spacing=str(model.get("proposal_initial_sampler", "piecewise")),
        background=str(model.get("background_color", "last_sample")),
        average_appearance=flag("use_average_appearance_embedding", True),
    )


def _plain(node: yaml.Node) -> Any:
    if isinstance(node, yaml.MappingNode):
        return {
            key.value if isinstance(key, yaml.ScalarNode) else "?": _plain(value) for key, value in node.value
        }
    if isinstance(node, yaml.SequenceNode):
        return [_plain(item) for item in node.value]
    if not node.tag.startswith("tag:yaml.org,2002:") or "python" in node.tag:
        return str(node.value)
    try:
        return yaml_text.scalar(node)
    except yaml_text.YamlError:
        return str(node.value)
