"""PlenOctrees in PyTorch; notation and source as in `plenoctree`."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from cagefield.fields.external.torch_field import DensityAt, RaySamples, TorchField, box_crossing
from cagefield.fields.sh import sh_basis


class TorchPlenOctree(TorchField):
    """Tensors of a PlenOctree with the `depth` of its finest level."""

    def __init__(
        self,
        child: NDArray[np.int32],
        data: NDArray[np.float16],
        scale: NDArray[np.float64],
        offset: NDArray[np.float64],
        terms: int,
        depth: int,
        device: torch.device | None = None,
    ) -> None:
        super().__init__(np.stack([-offset / scale, (1.0 - offset) / scale]), device)
        self.depth, self.terms = depth, terms
        self._child = torch.from_numpy(child.reshape(-1).astype(np.int64)).to(self.device)
        self._data = torch.from_numpy(data.reshape(-1, data.shape[-1]).copy()).to(self.device)
        self._scale, self._offset = self.tensor(scale), self.tensor(offset)

    def density_inside(self, positions: Tensor) -> Tensor:
        """Density [N] per world unit at positions [N,3] in the box."""
        return torch.relu(self._data[self._leaves(positions), -1].float())

    def density_gradient(self, positions: Tensor) -> Tensor:
        """Central differences [N,3] over a finest leaf's edge: the density is constant in each leaf."""
        columns = []
        for axis, edge in enumerate((self.box[1] - self.box[0]) * 0.5**self.depth):
            step = torch.zeros(3, device=self.device)
            step[axis] = edge
            columns.append((self.density(positions + step) - self.density(positions - step)) / (2.0 * edge))
        return torch.stack(columns, dim=1)

    def color(self, positions: Tensor, viewdirs: Tensor) -> Tensor:
        """rgb [N,3] at positions [N,3], those outside moved to the box, along unit viewdirs [N,3]."""
        values = self._data[self._leaves(positions), :-1].float()
        if self.terms == 0:
            return torch.sigmoid(values)
        basis = sh_basis(viewdirs.cpu().numpy(), round(self.terms**0.5) - 1)
        weights = torch.from_numpy(np.asarray(basis, np.float32)).to(self.device)
        return torch.sigmoid((values.reshape(len(values), 3, self.terms) * weights[:, None]).sum(dim=2))

    def ray_samples(
        self, origins: Tensor, directions: Tensor, reach: Tensor | None, density_at: DensityAt
    ) -> RaySamples:
        """Middles and lengths of the segments between the planes of the finest level."""
        box = self.box if reach is None else reach
        enter, leave = box_crossing(origins, directions, box)
        enter = enter.clamp_min(0.0)
        leave = torch.maximum(leave, enter)
        edges = (self.box[1] - self.box[0]) * 0.5**self.depth
        first = torch.floor((box[0] - self.box[0]) / edges).long().tolist()
        last = torch.ceil((box[1] - self.box[0]) / edges).long().tolist()
        crossings: list[Any] = [enter[:, None], leave[:, None]]
        for axis in range(3):
            steps = torch.arange(first[axis], last[axis] + 1, device=self.device)
            planes = self.box[0, axis] + edges[axis] * steps
            along = directions[:, axis : axis + 1]
            safe = torch.where(along == 0, torch.full_like(along, 1e-9), along)
            crossings.append((planes - origins[:, axis : axis + 1]) / safe)
        t = torch.cat(crossings, dim=1)
        t = torch.sort(torch.minimum(torch.maximum(t, enter[:, None]), leave[:, None]), dim=1).values
        return RaySamples(0.5 * (t[:, 1:] + t[:, :-1]), t[:, 1:] - t[:, :-1])

    def _leaves(self, positions: Tensor) -> Tensor:
        """Row [N] of the leaf's values at positions [N,3]."""
        u = (self._offset + positions * self._scale).clamp(0.0, 1.0 - 1e-6)
        node = torch.zeros(len(u), dtype=torch.long, device=self.device)
        row, found = node.clone(), torch.zeros_like(node, dtype=torch.bool)
        for _ in range(self.depth):
            u = 2.0 * u
            corner = torch.floor(u).clamp(0.0, 1.0)
            u = u - corner
            i, j, k = corner.long().unbind(1)
            slot = 8 * node + 4 * i + 2 * j + k
            row = torch.where(found, row, slot)
            step = self._child[row]
            found = found | (step == 0)
            node = torch.where(found, node, node + step)
        return row
