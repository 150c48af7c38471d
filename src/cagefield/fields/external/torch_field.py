"""PyTorch side of an `ExternalField`: density, color, and the samples of rays.

Import this module only where PyTorch may be loaded; `ExternalField.torch` does so on first use.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor

from cagefield.fields.nerf_torch import BLOCK_POSITIONS, torch_device
from cagefield.typing import Float32

DensityAt = Callable[[Callable[[Tensor], Tensor], Tensor], Tensor]
"""Function (query, t [N,S]) -> sigma [N,S]: `query` is a density [M] of canonical positions [M,3], evaluated
at the distances t along the chunk's rays, through the edits."""


class RaySamples(NamedTuple):
    """Distances t [N,S] along unit rays, increasing, and lengths delta [N,S] of the samples' segments.

    A segment of length 0 absorbs nothing.
    """

    t: Tensor
    delta: Tensor


class TorchField(ABC):
    """Tensors of an `ExternalField` on a device (canonical space, world units)."""

    color_weight: float = 0.0
    """Samples whose weight is at most this get no color (black), as the program omits them."""

    def __init__(self, bounds: ArrayLike, device: torch.device | None = None) -> None:
        self.device = torch_device() if device is None else device
        self.box = self.tensor(bounds)

    def occupied(self, positions: Tensor) -> Tensor:
        """Mask [N] of positions [N,3] where the density is evaluated; 0 elsewhere. Default: `bounds`."""
        return ((positions >= self.box[0]) & (positions <= self.box[1])).all(dim=1)

    @abstractmethod
    def density_inside(self, positions: Tensor) -> Tensor:
        """Density [N] per world unit at occupied positions [N,3]."""

    def signed_inside(self, positions: Tensor) -> Tensor:
        """Density [N] before a ReLU that would clamp it, for baking; default: `density_inside`."""
        return self.density_inside(positions)

    @abstractmethod
    def color(self, positions: Tensor, viewdirs: Tensor) -> Tensor:
        """rgb [N,3] at any positions [N,3], empty ones included, along unit viewdirs [N,3]."""

    def view_colors(self, positions: Tensor, viewdirs: Tensor) -> Tensor:
        """rgb [N,K,3] at positions [N,3] along K directions each, viewdirs [N,K,3]."""
        n, k, _ = viewdirs.shape
        return self.color(positions.repeat_interleave(k, dim=0), viewdirs.reshape(-1, 3)).reshape(n, k, 3)

    @abstractmethod
    def ray_samples(
        self, origins: Tensor, directions: Tensor, reach: Tensor | None, density_at: DensityAt
    ) -> RaySamples:
        """Samples of rays from origins [N,3] along unit directions [N,3], placed as the program does.

        `reach` [2,3] is the box that the edits' content may fill beside the field's own, None without edits.
        """

    def density(self, positions: Tensor) -> Tensor:
        """Density [N] per world unit at canonical positions [N,3], evaluated in blocks; 0 where empty."""
        return self._masked(self.density_inside, positions)

    def density_gradient(self, positions: Tensor) -> Tensor:
        """Gradient [N,3] of the density by canonical position, in blocks; 0 where empty."""
        parts = []
        for part in positions.split(self.block):
            with torch.enable_grad():
                at = part.detach().requires_grad_()
                rows = torch.nonzero(self.occupied(part))[:, 0]
                sigma = self.density_inside(at[rows])
                found = torch.autograd.grad(sigma.sum(), at)[0] if len(rows) else torch.zeros_like(part)
            parts.append(found)
        return torch.cat(parts) if parts else torch.zeros_like(positions)

    def blocked_color(self, positions: Tensor, viewdirs: Tensor) -> Tensor:
        """`color`, evaluated in blocks."""
        pairs = zip(positions.split(self.block), viewdirs.split(self.block), strict=True)
        parts = [self.color(part, along) for part, along in pairs if len(part)]
        return torch.cat(parts) if parts else positions.new_zeros((0, 3))

    @property
    def block(self) -> int:
        """Number of positions evaluated at a time."""
        return 4 * BLOCK_POSITIONS.get(self.device.type, 1 << 16)

    def numpy(self, positions: ArrayLike, viewdirs: ArrayLike) -> tuple[Float32, Float32]:
        """(sigma [N], rgb [N,3]) as NumPy arrays."""
        p, d = self.tensor(positions), self.tensor(viewdirs)
        with torch.no_grad():
            return self.density(p).cpu().numpy(), self.blocked_color(p, d).cpu().numpy()

    def numpy_density(self, positions: ArrayLike) -> Float32:
        """Density [N] as a NumPy array, before a ReLU that would clamp it."""
        with torch.no_grad():
            values: Float32 = self._masked(self.signed_inside, self.tensor(positions)).cpu().numpy()
        return values

    def numpy_views(self, positions: ArrayLike, viewdirs: ArrayLike) -> tuple[Float32, Float32]:
        """(sigma [N], rgb [N,K,3]) of positions [N,3] and viewdirs [N,K,3] as NumPy arrays."""
        p, d = self.tensor(positions), self.tensor(viewdirs)
        size = max(1, self.block // max(1, d.shape[1]))
        with torch.no_grad():
            parts = [
                self.view_colors(a, b) for a, b in zip(p.split(size), d.split(size), strict=True) if len(a)
            ]
            rgb = torch.cat(parts) if parts else torch.zeros(d.shape, device=self.device)
            return self.density(p).cpu().numpy(), rgb.cpu().numpy()

    def tensor(self, values: ArrayLike) -> Tensor:
        """float32 tensor on the field's device."""
        return torch.from_numpy(np.array(values, np.float32)).to(self.device)

    def _masked(self, query: Callable[[Tensor], Tensor], positions: Tensor) -> Tensor:
        parts = []
        for part in positions.split(self.block):
            rows = torch.nonzero(self.occupied(part))[:, 0]
            sigma = part.new_zeros(len(part))
            parts.append(sigma.index_copy(0, rows, query(part[rows])) if len(rows) else sigma)
        return torch.cat(parts) if parts else positions.new_zeros(0)


def box_crossing(origins: Tensor, directions: Tensor, box: Tensor) -> tuple[Tensor, Tensor]:
    """Distances (enter, leave) [N] at which rays cross a box [2,3]; enter > leave where a ray misses it."""
    safe = torch.where(directions == 0, torch.full_like(directions, 1e-6), directions)
    first, second = (box[1] - origins) / safe, (box[0] - origins) / safe
    return torch.minimum(first, second).amax(dim=1), torch.maximum(first, second).amin(dim=1)
