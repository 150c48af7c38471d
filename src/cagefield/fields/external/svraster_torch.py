"""SVRaster models in PyTorch; notation and source as in `svraster`."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from cagefield.fields.external.torch_field import DensityAt, RaySamples, TorchField, box_crossing
from cagefield.fields.sh import sh_basis

MAX_LEVEL = 16
MAX_RAY_PLANES = 1 << 10
"""Maximum number of planes along each axis in the cube of interest, and in each shell around it."""
DENSITY_SCALE = 100.0
LINEAR_START = 1.1


class TorchSvraster(TorchField):
    """Tensors of an SvrasterField: `corners` [N,8] are the values at its voxels' corners, `spans` [N] the
    numbers of paths of level 16 in them."""

    def __init__(
        self,
        paths: NDArray[np.int64],
        spans: NDArray[np.int64],
        levels: NDArray[np.int8],
        corners: NDArray[np.float32],
        sh: NDArray[np.float32],
        center: NDArray[np.float64],
        edges: tuple[float, float],
        device: torch.device | None = None,
    ) -> None:
        """`edges` are those of the root and of the cube of interest."""
        self.extent, inside = edges
        super().__init__(np.stack([center - 0.5 * inside, center + 0.5 * inside]), device)
        self.degree = round(sh.shape[1] ** 0.5) - 1
        self.finest = int(levels.max())
        self._low = self.tensor(center - 0.5 * self.extent)
        self._paths, self._spans, self._levels = (
            self._whole_numbers(values) for values in (paths, spans, levels)
        )
        self._corners, self._sh = self.tensor(corners), self.tensor(sh)

    def occupied(self, positions: Tensor) -> Tensor:
        """Mask [N] of positions [N,3] in a voxel."""
        return self._voxels(positions)[1]

    def density_inside(self, positions: Tensor) -> Tensor:
        """Density [N] per world unit at positions [N,3] in voxels."""
        rows, inside = self._voxels(positions)
        u = self._unit(positions) * (2.0 ** self._levels[rows].float())[:, None]
        # The voxel's own corner, so that a position on a face stays in its voxel.
        x, y, z = (u - self._lowest(rows)).clamp(0.0, 1.0).unbind(1)
        total = torch.zeros_like(x)
        for octant in range(8):
            weight = x if octant & 4 else 1.0 - x
            weight = weight * (y if octant & 2 else 1.0 - y) * (z if octant & 1 else 1.0 - z)
            total = total + weight * self._corners[rows, octant]
        value = torch.where(
            total > LINEAR_START,
            total,
            LINEAR_START * torch.exp(total.clamp_max(LINEAR_START) / LINEAR_START - 1.0),
        )
        return torch.where(inside, DENSITY_SCALE * value, torch.zeros_like(value))

    def color(self, positions: Tensor, viewdirs: Tensor) -> Tensor:
        """rgb [N,3] at positions [N,3] along unit viewdirs [N,3]: the preceding voxel's in empty space."""
        rows, _ = self._voxels(positions)
        basis = torch.from_numpy(np.asarray(sh_basis(viewdirs.cpu().numpy(), self.degree), np.float32))
        return torch.relu(0.5 + (self._sh[rows] * basis.to(self.device)[..., None]).sum(dim=1))

    def ray_samples(
        self, origins: Tensor, directions: Tensor, reach: Tensor | None, density_at: DensityAt
    ) -> RaySamples:
        """Middles and lengths of the segments between planes of the finest level.

        Around the cube of interest, shells of twice its size have planes at twice the distance; the box
        `reach` of an edit's content counts as the cube of interest.
        """
        inner = self.box if reach is None else reach
        whole = torch.stack([self._low, self._low + self.extent])
        outer = torch.stack([torch.minimum(whole[0], inner[0]), torch.maximum(whole[1], inner[1])])
        enter, leave = box_crossing(origins, directions, outer)
        enter = enter.clamp_min(0.0)
        leave = torch.maximum(leave, enter)
        crossings = [enter[:, None], leave[:, None]]
        for axis in range(3):
            along = directions[:, axis : axis + 1]
            safe = torch.where(along == 0, torch.full_like(along, 1e-9), along)
            crossings.append((self._planes(axis, inner, outer) - origins[:, axis : axis + 1]) / safe)
        t = torch.cat(crossings, dim=1)
        t = torch.sort(torch.minimum(torch.maximum(t, enter[:, None]), leave[:, None]), dim=1).values
        return RaySamples(0.5 * (t[:, 1:] + t[:, :-1]), t[:, 1:] - t[:, :-1])

    def _planes(self, axis: int, inner: Tensor, outer: Tensor) -> Tensor:
        """Coordinates of the planes across an axis: the finest level's in `inner`, doubled around it."""
        start = float(self._low[axis])
        edge = self.extent * 0.5**self.finest
        low, high = (float(value) for value in inner[:, axis])
        edge *= 2.0 ** max(0, np.ceil(np.log2((high - low) / edge / MAX_RAY_PLANES)))
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        bottom, top = (float(value) for value in outer[:, axis])
        found: list[np.ndarray[tuple[int], np.dtype[np.float64]]] = []
        covered: tuple[float, float] | None = None
        while covered is None or covered[0] > bottom or covered[1] < top:
            reach = max(bottom, middle - half), min(top, middle + half)
            steps = np.arange(np.floor((reach[0] - start) / edge), np.ceil((reach[1] - start) / edge) + 1)
            planes = start + edge * steps
            if covered is not None:
                planes = planes[(planes < covered[0]) | (planes > covered[1])]
            found.append(planes)
            covered, edge, half = reach, 2.0 * edge, 2.0 * half
        return self.tensor(np.sort(np.concatenate(found)))

    def _whole_numbers(self, values: NDArray[Any]) -> Tensor:
        return torch.from_numpy(values.astype(np.int64)).to(self.device)

    def _unit(self, positions: Tensor) -> Tensor:
        """Positions [N,3] in the root's unit cube."""
        return (positions - self._low) / self.extent

    def _lowest(self, rows: Tensor) -> Tensor:
        """Lowest corners [N,3] of voxels, in units of their own edge."""
        paths = self._paths[rows] >> (3 * (MAX_LEVEL - self._levels[rows]))
        low = torch.zeros((len(rows), 3), dtype=torch.long, device=self.device)
        for bit in range(MAX_LEVEL):
            for axis in range(3):
                low[:, axis] |= (paths >> (3 * bit + 2 - axis) & 1) << bit
        return low.float()

    def _voxels(self, positions: Tensor) -> tuple[Tensor, Tensor]:
        """(row [N] of the last voxel that begins at or before the position's path, whether it holds it)."""
        u = self._unit(positions)
        within = ((u >= 0.0) & (u < 1.0)).all(dim=1)
        cells = (u.clamp(0.0, 1.0 - 2.0**-24) * 2**MAX_LEVEL).long()
        paths = torch.zeros(len(u), dtype=torch.long, device=self.device)
        for bit in range(MAX_LEVEL):
            for axis in range(3):
                paths |= (cells[:, axis] >> bit & 1) << (3 * bit + 2 - axis)
        rows = (torch.searchsorted(self._paths, paths, right=True) - 1).clamp_min(0)
        ahead = paths - self._paths[rows]
        return rows, within & (ahead >= 0) & (ahead < self._spans[rows])
