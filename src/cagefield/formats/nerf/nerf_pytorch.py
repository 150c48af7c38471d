"""Networks of a `NerfField` from checkpoints of the two nerf-pytorch projects.

yenchenlin/nerf-pytorch, `.tar`: "network_fn_state_dict" and "network_fine_state_dict" with pts_linears.N,
views_linears.N, feature_linear, alpha_linear, rgb_linear, or pts_linears.N and output_linear for a network
without view directions (which keeps an unused views_linears.0).

krrish94/nerf-pytorch, `.ckpt`: "model_coarse_state_dict" and "model_fine_state_dict" with layer1,
layers_xyz.N, fc_feat, fc_alpha, layers_dir.N, fc_rgb. Its forward pass has no ReLU after layer1, so layer1
and layers_xyz.0 merge into one affine layer; it has a ReLU after fc_feat, and skips that append the encoding.

Depth, width, skips and octaves follow from the tensors' shapes; the config's values are ignored.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields.mlp import Linear, Mlp
from cagefield.formats.torch_files import read_torch_tensors

YENCHENLIN = ("network_fn_state_dict", "network_fine_state_dict")
_KRRISH94 = "krrish94/nerf-pytorch"
KRRISH94 = ("model_coarse_state_dict", "model_fine_state_dict")

_MAX_NAMED_TENSORS = 6
"""Maximum number of tensors named in a message."""


@dataclass(frozen=True)
class Checkpoint:
    """Networks of a checkpoint, the project that wrote it, and its training step (None if unknown)."""

    coarse: Mlp
    fine: Mlp | None
    project: str
    step: int | None

    def __str__(self) -> str:
        step = "" if self.step is None else f", step {self.step}"
        folded = " (layer1 is folded into layers_xyz.0)" if self.project == _KRRISH94 else ""
        return f"{self.project}{step}: coarse {self.coarse}; fine {self.fine or 'none'}{folded}"


def read_checkpoint(path: Path | str) -> Checkpoint:
    """Networks of a checkpoint of either nerf-pytorch.

    Raises:
        FieldError: missing file, missing PyTorch, a file that is no checkpoint or has objects beside tensors
            and plain values (which are not unpickled), missing, unknown or misshapen tensors.
    """
    path = Path(path)
    content = read_torch_tensors(path)
    for project, names, read in (
        ("yenchenlin/nerf-pytorch", YENCHENLIN, _yenchenlin),
        (_KRRISH94, KRRISH94, _krrish94),
    ):
        if names[0] not in content:
            continue
        try:
            coarse = read(_State(content[names[0]], names[0]))
            second = content.get(names[1])
            fine = None if second is None else read(_State(second, names[1]))
        except FieldError as error:
            raise FieldError(f"{path}: {error}") from None
        step = content.get("global_step", content.get("iter"))
        return Checkpoint(coarse, fine, project, int(step) if isinstance(step, (int, float)) else None)
    raise FieldError(
        f"{path}: no nerf-pytorch checkpoint: it holds {_format_names(content)}; expected "
        f"{YENCHENLIN[0]!r} or {KRRISH94[0]!r}"
    )


class _State:
    """State dict whose tensors are taken by name, with a check for unused tensors at the end."""

    def __init__(self, tensors: Any, where: str) -> None:
        if not isinstance(tensors, Mapping) or not all(hasattr(v, "shape") for v in tensors.values()):
            raise FieldError(f"{where} must be a dict of tensors, got {type(tensors).__name__}")
        self.where = where
        # DataParallel prefixes every name
        self.unused = {str(name).removeprefix("module."): tensor for name, tensor in tensors.items()}
        self.missing: list[str] = []

    def count(self, prefix: str) -> int:
        """Number of layers prefix.0, prefix.1, ...: the largest index plus 1."""
        found = [re.match(re.escape(prefix) + r"\.(\d+)\.", name) for name in self.unused]
        highest = max((int(match.group(1)) for match in found if match), default=-1)
        if highest >= len(self.unused):
            raise FieldError(f"{self.where}: {prefix}.{highest} is beyond its {len(self.unused)} tensors")
        return highest + 1

    def take(self, name: str) -> Linear | None:
        """Layer of a name; None where one of its tensors is missing."""
        pair = []
        for kind in ("weight", "bias"):
            tensor = self.unused.pop(f"{name}.{kind}", None)
            if tensor is None:
                self.missing.append(f"{name}.{kind}")
            else:
                pair.append(tensor.detach().float().cpu().numpy())
        return Linear(pair[0], pair[1], f"{self.where}: {name}") if len(pair) == 2 else None

    def layers(self, prefix: str) -> list[Linear | None]:
        """Layers prefix.0, prefix.1, ..."""
        return [self.take(f"{prefix}.{index}") for index in range(max(1, self.count(prefix)))]

    def finish(self, *layers: Linear | None) -> list[Linear]:
        """Layers of the network, after a check for missing and unused tensors.

        Raises:
            FieldError: missing or unused tensors.
        """
        if self.missing:
            raise FieldError(f"{self.where}: tensors missing: {_format_names(self.missing)}")
        if self.unused:
            raise FieldError(
                f"{self.where}: tensors that this network does not have: {_format_names(self.unused)}"
            )
        return [layer for layer in layers if layer is not None]


def _yenchenlin(state: _State) -> Mlp:
    trunk = state.layers("pts_linears")
    if any(name.startswith("output_linear.") for name in state.unused):
        if state.count("views_linears"):
            state.layers("views_linears")
        *trunk_layers, output = state.finish(*trunk, state.take("output_linear"))
        if output.outputs not in (4, 5):
            raise FieldError(
                f"{output.name}.weight is {list(output.weight.shape)}, "
                f"expected [4, {output.inputs}] or [5, {output.inputs}]"
            )
        return Mlp(tuple(trunk_layers), density=_rows(output, 3, 4), rgb=_rows(output, 0, 3))
    view = state.layers("views_linears")
    heads = [state.take(name) for name in ("feature_linear", "alpha_linear", "rgb_linear")]
    layers = state.finish(*trunk, *view, *heads)
    feature, density, rgb = layers[-3:]
    return Mlp(tuple(layers[: len(trunk)]), density, rgb, feature, tuple(layers[len(trunk) : -3]))


def _krrish94(state: _State) -> Mlp:
    trunk = [state.take("layer1"), *state.layers("layers_xyz")]
    plain = any(name.startswith("fc_out.") for name in state.unused)
    view = [] if plain else state.layers("layers_dir")
    names = ("fc_out",) if plain else ("fc_feat", "fc_alpha", "fc_rgb")
    layers = state.finish(*trunk, *view, *(state.take(name) for name in names))
    first, second, *rest = layers[: len(trunk)]
    encoded = first.inputs
    before = [second, *rest]
    own = (
        _merge_layers(first, second),
        *(_encoding_first(layer, b.outputs, encoded) for b, layer in zip(before, rest, strict=False)),
    )
    if plain:
        output = layers[-1]
        if output.outputs != 4:
            raise FieldError(
                f"{output.name}.weight is {list(output.weight.shape)}, expected [4, {output.inputs}]"
            )
        return Mlp(own, density=_rows(output, 3, 4), rgb=_rows(output, 0, 3))
    feature, density, rgb = layers[-3:]
    return Mlp(own, density, rgb, feature, tuple(layers[len(trunk) : -3]), rectified_feature=True)


def _merge_layers(first: Linear, second: Linear) -> Linear:
    """Affine layer second(first(x))."""
    if second.inputs != first.outputs:
        raise FieldError(
            f"{second.name}.weight is {list(second.weight.shape)}, "
            f"expected [{second.outputs}, {first.outputs}]"
        )
    weight, bias = second.weight.astype(np.float64), second.bias.astype(np.float64)
    return Linear(
        (weight @ first.weight).astype(np.float32),
        (weight @ first.bias + bias).astype(np.float32),
        first.name,
    )


def _encoding_first(layer: Linear, hidden: int, encoded: int) -> Linear:
    """Layer with input (h, encoding) reordered to input (encoding, h); other layers unchanged."""
    if layer.inputs != hidden + encoded:
        return layer
    weight: NDArray[np.float32] = np.roll(layer.weight, encoded, axis=1)
    return Linear(weight, layer.bias, layer.name)


def _rows(layer: Linear, start: int, stop: int) -> Linear:
    return Linear(layer.weight[start:stop], layer.bias[start:stop], layer.name)


def _format_names(names: Any) -> str:
    found = sorted(str(name) for name in names)
    more = f" and {len(found) - _MAX_NAMED_TENSORS} more" if len(found) > _MAX_NAMED_TENSORS else ""
    return ", ".join(found[:_MAX_NAMED_TENSORS]) + more if found else "nothing"
