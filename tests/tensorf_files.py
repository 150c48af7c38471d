"""TensoRF checkpoints by their published layout, and their values by NumPy alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import map_coordinates

PLANES, LINES = ((0, 1), (0, 2), (1, 2)), (2, 1, 0)
BOX = np.array([[-1.0, -0.8, -0.6], [0.9, 1.0, 1.2]])
GRID = (6, 5, 7)


def tensorf_content(
    model: str = "TensorVMSplit",
    shading: str = "MLP_Fea",
    *,
    mask: bool = True,
    seed: int = 0,
    **options: Any,
) -> dict[str, Any]:
    """Dictionary of a small model as `TensorBase.save` writes it, of NumPy arrays."""
    rng = np.random.default_rng(seed)
    density, appearance, features = 3, 4, {"SH": 27, "RGB": 3}.get(shading, 5)
    state: dict[str, np.ndarray] = {}
    if model == "TensorVM":
        side = 6
        state["plane_coef"] = rng.normal(size=(3, appearance + density, side, side))
        state["line_coef"] = rng.normal(size=(3, appearance + density, side, 1))
    else:
        for name, count in (("density", density), ("app", appearance)):
            for i in range(3):
                if model == "TensorVMSplit":
                    a, b = PLANES[i]
                    state[f"{name}_plane.{i}"] = rng.normal(size=(1, count, GRID[b], GRID[a]))
                state[f"{name}_line.{i}"] = rng.normal(size=(1, count, GRID[LINES[i]], 1))
    columns = appearance if model == "TensorCP" else 3 * appearance
    state["basis_mat.weight"] = rng.normal(size=(features, columns)) / 2
    if shading.startswith("MLP"):
        inputs = features + 3 + 6 * 2
        inputs += {"MLP_Fea": 2 * 3 * features, "MLP_PE": 6 * 4, "MLP": 0}[shading]
        for index, (rows, width) in zip((0, 2, 4), ((8, inputs), (8, 8), (3, 8)), strict=True):
            state[f"renderModule.mlp.{index}.weight"] = rng.normal(size=(rows, width)) / np.sqrt(width)
            state[f"renderModule.mlp.{index}.bias"] = rng.normal(size=rows) / 4
    kwargs = {
        "aabb": BOX.astype(np.float32), "gridSize": list(GRID), "density_n_comp": density,
        "appearance_n_comp": appearance, "app_dim": features, "density_shift": -2.0,
        "alphaMask_thres": 1e-4, "distance_scale": 25.0, "rayMarch_weight_thres": 1e-4,
        "fea2denseAct": "softplus", "near_far": [0.5, 6.0], "step_ratio": 0.5, "shadingMode": shading,
        "pos_pe": 4, "view_pe": 2, "fea_pe": 3, "featureC": 8,
    }  # fmt: skip
    content: dict[str, Any] = {
        "kwargs": {**kwargs, **options},
        "state_dict": {name: value.astype(np.float32) for name, value in state.items()},
    }
    if mask:
        bits = rng.uniform(size=(1, 1, 8, 9, 10)) < 0.4
        content["alphaMask.shape"] = bits.shape
        content["alphaMask.mask"] = np.packbits(bits.reshape(-1))
        content["alphaMask.aabb"] = (BOX * 0.9).astype(np.float32)
    return content


def write_tensorf(path: Path, content: dict[str, Any]) -> Path:
    """The dictionary by torch.save; the mask's bytes stay a NumPy array, as the authors leave it."""
    import torch

    def tensors(value: Any, name: str = "") -> Any:
        if isinstance(value, dict):
            return {key: tensors(part, key) for key, part in value.items()}
        if isinstance(value, np.ndarray) and name != "alphaMask.mask":
            return torch.from_numpy(value.copy())
        return value

    torch.save(tensors(content), path)
    return path


def known(content: dict[str, Any], points: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(sigma [N] per world unit, rgb [N,3]) at points [N,3] inside the box along unit d [N,3], in float64."""
    kwargs, state = content["kwargs"], content["state_dict"]
    box = np.asarray(kwargs["aabb"], np.float64)
    u = (points - box[0]) / (box[1] - box[0])
    raw = _products(state, "density", u, kwargs).sum(axis=0)
    if kwargs["fea2denseAct"] == "softplus":
        sigma = np.logaddexp(0.0, raw + kwargs["density_shift"])
    else:
        sigma = np.maximum(raw, 0.0)
    sigma = sigma * kwargs["distance_scale"]
    if "alphaMask.mask" in content:
        shape = content["alphaMask.shape"]
        bits = np.unpackbits(content["alphaMask.mask"])[: np.prod(shape)].reshape(shape[-3:])
        low, high = np.asarray(content["alphaMask.aabb"], np.float64)
        at = (points - low) / (high - low) * (np.array(bits.shape[::-1]) - 1)
        alpha = map_coordinates(bits.astype(float), at[:, ::-1].T, order=1, cval=0.0, mode="grid-constant")
        sigma = np.where(alpha > 0, sigma, 0.0)
    features = _products(state, "app", u, kwargs).T @ state["basis_mat.weight"].T.astype(np.float64)
    return sigma, _shade(content, features, 2.0 * u - 1.0, d)


def _products(state: dict[str, np.ndarray], name: str, u: np.ndarray, kwargs: dict[str, Any]) -> np.ndarray:
    """Products [C,N] of the components."""
    planes, lines = [], []
    for i in range(3):
        if "plane_coef" in state:
            n = kwargs["density_n_comp"]
            rows = slice(-n, None) if name == "density" else slice(None, -n)
            plane, line = state["plane_coef"][i, rows], state["line_coef"][i, rows, :, 0]
        else:
            plane = state[f"{name}_plane.{i}"][0] if f"{name}_plane.{i}" in state else None
            line = state[f"{name}_line.{i}"][0, :, :, 0]
        at = u[:, LINES[i]] * (line.shape[1] - 1)
        lines.append(np.stack([np.interp(at, np.arange(line.shape[1]), row) for row in line]))
        if plane is not None:
            a, b = PLANES[i]
            where = np.stack([u[:, b] * (plane.shape[1] - 1), u[:, a] * (plane.shape[2] - 1)])
            planes.append(np.stack([map_coordinates(c.astype(float), where, order=1) for c in plane]))
    if not planes:
        return lines[0] * lines[1] * lines[2]
    return np.concatenate(planes) * np.concatenate(lines)


def _shade(content: dict[str, Any], k: np.ndarray, u: np.ndarray, d: np.ndarray) -> np.ndarray:
    kwargs, state = content["kwargs"], content["state_dict"]
    if kwargs["shadingMode"] == "RGB":
        return k
    if kwargs["shadingMode"] == "SH":
        from cagefield.fields.sh import sh_basis

        return np.maximum(np.einsum("nl,ncl->nc", sh_basis(d, 2), k.reshape(-1, 3, 9)) + 0.5, 0.0)

    def encode(x: np.ndarray, octaves: int) -> np.ndarray:
        scaled = [x[:, c] * 2.0**o for c in range(x.shape[1]) for o in range(octaves)]
        return np.stack([*map(np.sin, scaled), *map(np.cos, scaled)], axis=1)

    parts = [k, d]
    if kwargs["shadingMode"] == "MLP_Fea":
        parts.append(encode(k, kwargs["fea_pe"]))
    if kwargs["shadingMode"] == "MLP_PE":
        parts.append(encode(u, kwargs["pos_pe"]))
    hidden = np.concatenate([*parts, encode(d, kwargs["view_pe"])], axis=1)
    for index in (0, 2, 4):
        hidden = (
            hidden @ state[f"renderModule.mlp.{index}.weight"].T + state[f"renderModule.mlp.{index}.bias"]
        )
        hidden = np.maximum(hidden, 0.0) if index < 4 else 1.0 / (1.0 + np.exp(-hidden))
    return hidden
