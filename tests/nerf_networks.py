"""Small NeRFs for tests: both nerf-pytorch layouts, and their forward passes in plain numpy."""

from __future__ import annotations

from typing import Any

import numpy as np

from cagefield.fields.mlp import Linear, Mlp
from cagefield.fields.nerf_field import NerfField

State = dict[str, np.ndarray]


def layer(rng: np.random.Generator, outputs: int, inputs: int, scale: float = 1.0) -> tuple[Any, Any]:
    """Weight and bias of about unit gain."""
    weight = rng.normal(size=(outputs, inputs)) * scale * np.sqrt(2.0 / inputs)
    return weight.astype(np.float32), (0.1 * rng.normal(size=outputs)).astype(np.float32)


def state(layers: dict[str, tuple[Any, Any]]) -> State:
    """name -> (weight, bias) as a flat state dict."""
    return {
        f"{name}.{kind}": value
        for name, pair in layers.items()
        for kind, value in zip(("weight", "bias"), pair, strict=True)
    }


def yenchenlin_state(seed: int = 0, depth: int = 8, width: int = 24, octaves: int = 3) -> State:
    """A network of yenchenlin/nerf-pytorch with its skip after layer 4 and directions of 2 octaves."""
    rng = np.random.default_rng(seed)
    encoded, directions = 3 + 6 * octaves, 15
    layers = {}
    for index in range(depth):
        inputs = encoded if index == 0 else width + (encoded if index == 5 else 0)
        layers[f"pts_linears.{index}"] = layer(rng, width, inputs)
    layers["views_linears.0"] = layer(rng, width // 2, width + directions)
    layers["feature_linear"] = layer(rng, width, width)
    layers["alpha_linear"] = layer(rng, 1, width)
    layers["rgb_linear"] = layer(rng, 3, width // 2)
    return state(layers)


def krrish94_state(seed: int = 0, depth: int = 4, width: int = 16, skip: int | None = None) -> State:
    """A network of krrish94/nerf-pytorch: 2 octaves each, a skip into layers_xyz.N."""
    rng = np.random.default_rng(seed)
    layers = {"layer1": layer(rng, width, 15)}
    for index in range(depth - 1):
        layers[f"layers_xyz.{index}"] = layer(rng, width, width + (15 if index == skip else 0))
    layers["layers_dir.0"] = layer(rng, width // 2, width + 15)
    layers["fc_alpha"] = layer(rng, 1, width)
    layers["fc_rgb"] = layer(rng, 3, width // 2)
    layers["fc_feat"] = layer(rng, width, width)
    return state(layers)


def gamma(x: np.ndarray, octaves: int) -> np.ndarray:
    """The positional encoding in float64, written out."""
    parts = [x]
    for k in range(octaves):
        parts += [np.sin(2.0**k * x), np.cos(2.0**k * x)]
    return np.concatenate(parts, axis=1)


def relu(x: np.ndarray) -> np.ndarray:
    return np.maximum(x, 0.0)


def apply(tensors: State, name: str, x: np.ndarray) -> np.ndarray:
    return x @ tensors[f"{name}.weight"].astype(np.float64).T + tensors[f"{name}.bias"]


def forward_yenchenlin(s: State, p: np.ndarray, d: np.ndarray, octaves: int = 3) -> tuple[Any, Any]:
    """(sigma, rgb) as yenchenlin/nerf-pytorch's NeRF.forward and raw2outputs compute them."""
    encoded = gamma(p, octaves)
    h = encoded
    for index in range(8):
        h = relu(apply(s, f"pts_linears.{index}", h))
        if index == 4:
            h = np.concatenate([encoded, h], axis=1)
    alpha = apply(s, "alpha_linear", h)
    view = np.concatenate([apply(s, "feature_linear", h), gamma(d, 2)], axis=1)
    rgb = apply(s, "rgb_linear", relu(apply(s, "views_linears.0", view)))
    return relu(alpha[:, 0]), 1.0 / (1.0 + np.exp(-rgb))


def forward_krrish94(s: State, p: np.ndarray, d: np.ndarray, skip: int | None = None) -> tuple[Any, Any]:
    """(sigma, rgb) as krrish94/nerf-pytorch's FlexibleNeRFModel.forward computes them."""
    encoded = gamma(p, 2)
    h = apply(s, "layer1", encoded)
    for index in range(3):
        if index == skip:
            h = np.concatenate([h, encoded], axis=1)
        h = relu(apply(s, f"layers_xyz.{index}", h))
    view = np.concatenate([relu(apply(s, "fc_feat", h)), gamma(d, 2)], axis=1)
    rgb = apply(s, "fc_rgb", relu(apply(s, "layers_dir.0", view)))
    return relu(apply(s, "fc_alpha", h)[:, 0]), 1.0 / (1.0 + np.exp(-rgb))


def affine(part: Linear, x: np.ndarray) -> np.ndarray:
    """The layer in float64."""
    return x @ part.weight.astype(np.float64).T + part.bias


def hidden_of(trunk: tuple[Linear, ...], encoded: np.ndarray) -> np.ndarray:
    """Activations in float64 that the trunk of `small_mlp` hands to its heads."""
    h = relu(affine(trunk[1], relu(affine(trunk[0], encoded))))
    return relu(affine(trunk[2], np.concatenate([encoded, h], axis=1)))


def small_mlp(seed: int = 0, width: int = 16, octaves: int = 2) -> Mlp:
    """Three trunk layers with a skip into the last, a view branch of one octave; dense in half of space."""
    rng = np.random.default_rng(seed)
    encoded = 3 + 6 * octaves

    def linear(outputs: int, inputs: int) -> Linear:
        return Linear(*layer(rng, outputs, inputs))

    trunk = (linear(width, encoded), linear(width, width), linear(width, width + encoded))
    hidden = hidden_of(trunk, gamma(rng.uniform(-1.5, 1.5, (500, 3)), octaves))
    weight = layer(rng, 1, width)[0]
    return Mlp(
        trunk=trunk,
        density=Linear(weight, -np.median(hidden @ weight.T, axis=0)),
        rgb=linear(3, width // 2),
        feature=linear(width, width),
        view=(linear(width // 2, width + 9),),
    )


def small_field(seed: int = 0, width: int = 16, **options: Any) -> NerfField:
    """A NeRF of two random small networks around the origin, for cameras at distance 4."""
    options = {"near": 2.0, "far": 6.0, "samples": (12, 16), **options}
    return NerfField(small_mlp(seed, width), small_mlp(seed + 1, width), [[-1.5] * 3, [1.5] * 3], **options)
