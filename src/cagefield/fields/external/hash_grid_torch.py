"""Hash grids and small networks in PyTorch; notation and source as in `hash_grid`."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import linear

from cagefield.fields.external.hash_grid import HASH_PRIMES, MAX_DENSE_RESOLUTION, HashGrid
from cagefield.fields.external.hash_network import HashNetwork, Layers

_MODULUS = (1 << 32) - 1


class TorchHashGrid:
    """Tensors of a `HashGrid` on a device."""

    def __init__(self, grid: HashGrid, device: torch.device) -> None:
        self.grid = grid
        self.table = torch.from_numpy(np.array(grid.table)).to(device)
        if grid.layout == "torch":
            # float32, as nerfstudio: the floor of a product that is nearly whole depends on it
            powers = torch.pow(grid.growth, torch.arange(grid.levels))
            self._scales = tuple(torch.floor(grid.base * powers).tolist())
        else:
            self._scales = grid.scales

    def __call__(self, x: Tensor) -> Tensor:
        """Features [N, levels F] at x [N,3] in [0,1]."""
        return torch.cat([self._level(x, level) for level in range(self.grid.levels)], dim=1)

    def _level(self, x: Tensor, level: int) -> Tensor:
        """Features [N,F] of a level."""
        scaled = x * self._scales[level]
        if self.grid.layout == "tcnn":
            scaled = scaled + 0.5
        lower = torch.floor(scaled)
        fraction = scaled - lower
        corners = torch.stack(
            [lower, torch.ceil(scaled) if self.grid.layout == "torch" else lower + 1.0]
        ).long()
        total = torch.zeros((len(x), self.table.shape[1]), device=x.device)
        for corner in range(8):
            bits = [corner >> axis & 1 for axis in range(3)]
            weight = torch.ones_like(x[:, 0])
            for axis, bit in enumerate(bits):
                weight = weight * (fraction[:, axis] if bit else 1.0 - fraction[:, axis])
            index = self._index(level, *(corners[bit, :, axis] for axis, bit in enumerate(bits)))
            total = total + weight[:, None] * self.table[index]
        return total

    def _index(self, level: int, i: Tensor, j: Tensor, k: Tensor) -> Tensor:
        """Rows [N] of the table for corners (i, j, k) of a level."""
        first, last = self.grid.offsets[level : level + 2]
        entries, resolution = last - first, self.grid.resolutions[level]
        if self.grid.layout == "tcnn" and resolution <= MAX_DENSE_RESOLUTION and resolution**3 <= entries:
            return first + (i + j * resolution + k * resolution**2) % entries
        hashed = (i * HASH_PRIMES[0]) ^ (j * HASH_PRIMES[1]) ^ (k * HASH_PRIMES[2])
        return first + (hashed & _MODULUS) % entries


class TorchLayers:
    """Tensors of a perceptron's layers, with ReLU between them."""

    def __init__(self, layers: Layers, device: torch.device) -> None:
        self.layers = [
            (torch.from_numpy(np.array(weight)).to(device), torch.from_numpy(np.array(bias)).to(device))
            for weight, bias in layers
        ]

    def __call__(self, x: Tensor) -> Tensor:
        """Outputs [N,O] of inputs [N,I]."""
        for weight, bias in self.layers[:-1]:
            x = torch.relu(linear(x, weight, bias))
        return linear(x, *self.layers[-1])


class TorchHashNetwork:
    """Tensors of a `HashNetwork`."""

    def __init__(self, network: HashNetwork, device: torch.device) -> None:
        self.grid = TorchHashGrid(network.grid, device)
        self.layers = TorchLayers(network.layers, device)

    def __call__(self, x: Tensor) -> Tensor:
        """Outputs [N,O] at x [N,3] in [0,1]."""
        return self.layers(self.grid(x))


def sh_values(d: Tensor, phase: bool) -> Tensor:
    """Values [N,16] of the polynomials of real spherical harmonics of degree 3 at vectors d [N,3].

    With `phase` odd orders have the sign of tiny-cuda-nn (Condon-Shortley), else that of nerfstudio. Degree 2
    and 3 are written with z^2, which differs from homogeneous polynomials where d is not of unit length.
    """
    x, y, z = d.unbind(1)
    xx, yy, zz = x * x, y * y, z * z
    sign = -1.0 if phase else 1.0
    return torch.stack(
        [
            torch.full_like(x, 0.28209479177387814),
            sign * 0.4886025119029199 * y,
            0.4886025119029199 * z,
            sign * 0.4886025119029199 * x,
            1.0925484305920792 * x * y,
            sign * 1.0925484305920792 * y * z,
            0.9461746957575601 * zz - 0.31539156525252,
            sign * 1.0925484305920792 * x * z,
            0.5462742152960396 * (xx - yy),
            sign * 0.5900435899266435 * y * (3.0 * xx - yy),
            2.890611442640554 * x * y * z,
            sign * 0.4570457994644658 * y * (5.0 * zz - 1.0),
            0.3731763325901154 * z * (5.0 * zz - 3.0),
            sign * 0.4570457994644658 * x * (5.0 * zz - 1.0),
            1.445305721320277 * z * (xx - yy),
            sign * 0.5900435899266435 * x * (xx - 3.0 * yy),
        ],
        dim=1,
    )
