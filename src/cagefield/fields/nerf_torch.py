"""Networks of a NerfField in PyTorch, on the CPU or a GPU.

Import this module only where PyTorch may be loaded; `NerfField.torch` does so on first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor
from torch.nn.functional import linear

from cagefield.compute import devices

if TYPE_CHECKING:
    from cagefield.fields.mlp import Linear, Mlp, NerfParameters
    from cagefield.typing import Float32

BLOCK_POSITIONS = {"cpu": 1 << 12, "cuda": 1 << 19}
"""Number of positions evaluated at a time without gradients; on a CPU limited by its caches."""

NEAR_PLANE_TOLERANCE = 1e-3
"""Tolerance of the near plane of NDC, for the rounding of rays that start on it."""


def torch_device() -> torch.device:
    """Device of tensors: CUDA where kernels run on it and PyTorch supports it, else the CPU."""
    if devices.start() == "cuda" and torch.cuda.is_available():
        return torch.device("cuda")
    return torch.device("cpu")


def encode(x: Tensor, octaves: int, include: bool) -> Tensor:
    """gamma(x) [N, 3 + 6 octaves] of x [N,3], or [N, 6 octaves] without x itself."""
    scaled = x[:, None, :] * (2.0 ** torch.arange(octaves, device=x.device, dtype=x.dtype))[:, None]
    waves = torch.stack([torch.sin(scaled), torch.cos(scaled)], dim=2).reshape(len(x), 6 * octaves)
    return torch.cat([x, waves], dim=1) if include else waves


class TorchMlp:
    """Tensors of an `Mlp`; `parameters` are its weights and biases in the order of `Mlp.layers`."""

    def __init__(self, mlp: Mlp, device: torch.device, trainable: bool = False) -> None:
        self.mlp = mlp
        self.parameters: list[Tensor] = []
        self.layers = {name: self._tensors(layer, device, trainable) for name, layer in mlp.layers()}
        self._skips = mlp.skips

    def _tensors(self, layer: Linear, device: torch.device, trainable: bool) -> tuple[Tensor, Tensor]:
        pair = [torch.from_numpy(values.copy()).to(device) for values in (layer.weight, layer.bias)]
        if trainable:
            pair = [values.requires_grad_() for values in pair]
        self.parameters += pair
        return pair[0], pair[1]

    def trunk(self, positions: Tensor) -> tuple[Tensor, Tensor]:
        """(raw density [N], hidden [N,W]) at positions [N,3] of the network's space."""
        encoded = encode(positions, *self.mlp.position_encoding)
        hidden = encoded
        for index, skip in enumerate(self._skips):
            joined = torch.cat([encoded, hidden], dim=1) if skip else hidden
            hidden = torch.relu(linear(joined, *self.layers[f"trunk.{index}"]))
        return linear(hidden, *self.layers["density"])[:, 0], hidden

    def color(self, hidden: Tensor, viewdirs: Tensor) -> Tensor:
        """rgb [N,3] in [0,1] of hidden [N,W] along unit viewdirs [N,3]."""
        if self.mlp.view_encoding is not None:
            feature = self._feature(hidden)
            hidden = torch.cat([feature, encode(viewdirs, *self.mlp.view_encoding)], dim=1)
            for index in range(len(self.mlp.view)):
                hidden = torch.relu(linear(hidden, *self.layers[f"view.{index}"]))
        return torch.sigmoid(linear(hidden, *self.layers["rgb"]))

    def colors(self, hidden: Tensor, viewdirs: Tensor) -> Tensor:
        """rgb [N,K,3] of hidden [N,W] along K directions each, viewdirs [N,K,3]."""
        n, k, _ = viewdirs.shape
        flat = viewdirs.reshape(n * k, 3)
        encoding = self.mlp.view_encoding
        if self.mlp.feature is None or encoding is None:
            return self.color(hidden, flat)[:, None].expand(n, k, 3)
        weight, bias = self.layers["view.0"]
        width = self.mlp.feature.outputs
        shared = linear(self._feature(hidden), weight[:, :width], bias)
        network_positions = linear(encode(flat, *encoding), weight[:, width:])
        out = torch.relu(shared[:, None] + network_positions.reshape(n, k, -1)).reshape(n * k, -1)
        for index in range(1, len(self.mlp.view)):
            out = torch.relu(linear(out, *self.layers[f"view.{index}"]))
        return torch.sigmoid(linear(out, *self.layers["rgb"])).reshape(n, k, 3)

    def _feature(self, hidden: Tensor) -> Tensor:
        feature = linear(hidden, *self.layers["feature"])
        return torch.relu(feature) if self.mlp.rectified_feature else feature

    def arrays(self) -> dict[str, tuple[Any, Any]]:
        """Layer name -> (weight, bias) as numpy arrays."""
        return {
            name: (weight.detach().float().cpu().numpy(), bias.detach().float().cpu().numpy())
            for name, (weight, bias) in self.layers.items()
        }


class TorchNerf:
    """Tensors of a `NerfField`."""

    def __init__(
        self, field: NerfParameters, device: torch.device | None = None, trainable: bool = False
    ) -> None:
        self.field = field
        self.device = torch_device() if device is None else device
        self.coarse = TorchMlp(field.coarse, self.device, trainable)
        self.fine = None if field.fine is None else TorchMlp(field.fine, self.device, trainable)
        self._bounds = self.tensor(field.bounds)

    @property
    def network(self) -> TorchMlp:
        """Network of the field: the fine one, else the coarse one."""
        return self.coarse if self.fine is None else self.fine

    @property
    def parameters(self) -> list[Tensor]:
        """Weights and biases of both networks."""
        return [*self.coarse.parameters, *([] if self.fine is None else self.fine.parameters)]

    def __call__(
        self, positions: Tensor, viewdirs: Tensor, network: TorchMlp | None = None, noise: float = 0.0
    ) -> tuple[Tensor, Tensor]:
        """(sigma [N] per world unit, rgb [N,3]) at canonical positions [N,3] directions unit viewdirs [N,3].

        `noise` is the standard deviation of the noise added to the raw density in training.
        """
        network = self.network if network is None else network
        if not self.field.bounded:
            return self._inside(positions, viewdirs, network, noise)
        rows = torch.nonzero(self._in_bounds(positions))[:, 0]
        sigma, rgb = self._inside(positions[rows], viewdirs[rows], network, noise)
        return (
            sigma.new_zeros(len(positions)).index_put((rows,), sigma),
            rgb.new_zeros(len(positions), 3).index_put((rows,), rgb),
        )

    def _in_bounds(self, positions: Tensor) -> Tensor:
        """Mask [N] of positions [N,3] within the field's bounds, faces included."""
        return ((positions >= self._bounds[0]) & (positions <= self._bounds[1])).all(dim=1)

    def _inside(
        self, positions: Tensor, viewdirs: Tensor, network: TorchMlp, noise: float
    ) -> tuple[Tensor, Tensor]:
        """(sigma [N], rgb [N,3]) regardless of the bounds."""
        block = BLOCK_POSITIONS.get(self.device.type, 1 << 16)
        if len(positions) > block and not torch.is_grad_enabled():
            parts = [
                self._inside(
                    positions[start : start + block], viewdirs[start : start + block], network, noise
                )
                for start in range(0, len(positions), block)
            ]
            return torch.cat([sigma for sigma, _ in parts]), torch.cat([rgb for _, rgb in parts])
        if self.field.ndc is None:
            raw, hidden = network.trunk(positions)
            if noise > 0.0:
                raw = raw + noise * torch.randn_like(raw)
            return torch.relu(raw), network.color(hidden, viewdirs)
        network_positions, stretch = to_ndc(positions, viewdirs, self.field.ndc)
        raw, hidden = network.trunk(network_positions)
        if noise > 0.0:
            raw = raw + noise * torch.randn_like(raw)
        return torch.relu(raw) * stretch, network.color(hidden, viewdirs)

    def numpy(self, positions: ArrayLike, viewdirs: ArrayLike) -> tuple[Float32, Float32]:
        """(sigma [N], rgb [N,3]) as NumPy arrays, evaluated in chunks."""
        p, d = np.asarray(positions, np.float32), np.asarray(viewdirs, np.float32)
        with torch.no_grad():
            sigma, rgb = self(self.tensor(p), self.tensor(d))
        return sigma.cpu().numpy(), rgb.cpu().numpy()

    def signed(self, positions: Tensor, viewdirs: Tensor) -> Tensor:
        """Density [N] per world unit before its ReLU, at most 0 outside the bounds of a bounded field."""
        if self.field.ndc is None:
            raw = self.network.trunk(positions)[0]
            return torch.where(self._in_bounds(positions), raw, -raw.abs()) if self.field.bounded else raw
        network_positions, stretch = to_ndc(positions, viewdirs, self.field.ndc)
        return self.network.trunk(network_positions)[0] * stretch

    def density_gradient(self, positions: Tensor, viewdirs: Tensor) -> Tensor:
        """Gradient [N,3] of `signed` by canonical position, world units, at fixed viewdirs; in chunks."""
        block, parts = BLOCK_POSITIONS.get(self.device.type, 1 << 16), []
        for start in range(0, len(positions), block):
            rows = slice(start, start + block)
            with torch.enable_grad():
                network_positions = positions[rows].detach().requires_grad_()
                total = self.signed(network_positions, viewdirs[rows]).sum()
                parts.append(torch.autograd.grad(total, network_positions)[0])
        return torch.cat(parts) if parts else torch.zeros_like(positions)

    def numpy_signed(self, positions: ArrayLike, viewdirs: ArrayLike) -> Float32:
        """`signed` as a NumPy array, evaluated in chunks."""
        p, d = self.tensor(positions), self.tensor(viewdirs)
        block = BLOCK_POSITIONS.get(self.device.type, 1 << 16)
        with torch.no_grad():
            parts = [self.signed(p[i : i + block], d[i : i + block]) for i in range(0, len(p), block)]
            return torch.cat(parts).cpu().numpy() if parts else np.zeros(0, np.float32)

    def numpy_views(self, positions: ArrayLike, viewdirs: ArrayLike) -> tuple[Float32, Float32]:
        """(sigma [N], rgb [N,K,3]) of positions [N,3] and viewdirs [N,K,3], in chunks."""
        p, d = np.asarray(positions, np.float32), np.asarray(viewdirs, np.float32)
        views = d.shape[1]
        sigma, rgb = np.zeros(len(p), np.float32), np.zeros((len(p), views, 3), np.float32)
        with torch.no_grad():
            block = max(1, 4 * BLOCK_POSITIONS.get(self.device.type, 1 << 16) // max(views, 1))
            for start in range(0, len(p), block):
                rows = slice(start, start + block)
                network_positions, directions = self.tensor(p[rows]), self.tensor(d[rows])
                scale: Tensor | float = 1.0
                if self.field.ndc is not None:
                    flat = network_positions[:, None].expand(directions.shape).reshape(-1, 3)
                    scale = (
                        to_ndc(flat, directions.reshape(-1, 3), self.field.ndc)[1].reshape(-1, views).mean(1)
                    )
                    network_positions = to_ndc(network_positions, directions[:, 0], self.field.ndc)[0]
                raw, hidden = self.network.trunk(network_positions)
                if self.field.bounded:
                    scale = self._in_bounds(network_positions).to(raw.dtype)
                sigma[rows] = (torch.relu(raw) * scale).cpu().numpy()
                rgb[rows] = self.network.colors(hidden, directions).cpu().numpy()
        return sigma, rgb

    def tensor(self, values: ArrayLike) -> Tensor:
        """float32 tensor on the field's device."""
        return torch.from_numpy(np.array(values, np.float32)).to(self.device)


def to_ndc(positions: Tensor, viewdirs: Tensor, ndc: tuple[float, float]) -> tuple[Tensor, Tensor]:
    """(normalized device coordinates [N,3], |J_ndc d| [N]) of world positions [N,3] and viewdirs d [N,3].

    The stretch |J_ndc d| is 0 in front of the near plane z = -1, where the capture has no content.
    """
    x, y, z = positions.unbind(1)
    behind = z <= -1.0 + NEAR_PLANE_TOLERANCE
    z = torch.where(behind, z, torch.full_like(z, -1.0))
    dx, dy, dz = viewdirs.unbind(1)
    a, b = ndc
    network_positions = torch.stack([-x / (a * z), -y / (b * z), 1.0 + 2.0 / z], dim=1)
    rates = (-(dx - x * dz / z) / (a * z), -(dy - y * dz / z) / (b * z), -2.0 * dz / (z * z))
    stretch = torch.stack(rates, dim=1).norm(dim=1)
    return network_positions, torch.where(behind, stretch, torch.zeros_like(stretch))
