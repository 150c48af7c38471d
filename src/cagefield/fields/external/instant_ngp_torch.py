"""Instant-NGP in PyTorch; notation and source as in `instant_ngp`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import torch
from torch import Tensor

from cagefield.fields.external.hash_grid_torch import TorchHashNetwork, TorchLayers, sh_values
from cagefield.fields.external.instant_ngp_parameters import GRID_CELLS, NEAR, STEP
from cagefield.fields.external.torch_field import DensityAt, RaySamples, TorchField, box_crossing

if TYPE_CHECKING:
    from cagefield.fields.external.instant_ngp_parameters import InstantNgpParameters

CONE = 1.0 / 256.0
"""Growth of the step with the distance, for cubes of an edge above 1."""
LONGEST_STEP = 1024.0 * STEP
MAX_NGP_SAMPLES = 1 << 14
"""Maximum number of samples on a ray; a cube of edge 128 has about 2,500."""
MAX_EXPONENT = 10.0
"""Exponential colors are exp of at most this."""


class TorchInstantNgp(TorchField):
    """Tensors of an `InstantNgpParameters`."""

    def __init__(self, field: InstantNgpParameters, device: torch.device | None = None) -> None:
        super().__init__(field.bounds, device)
        self.field = field
        self._base = TorchHashNetwork(field.base, self.device)
        self._head = TorchLayers(field.head, self.device)
        self._offset = self.tensor(field.offset)
        self._crop, self._axes = self.tensor(field.crop), self.tensor(field.crop_axes)
        self._occupancy = None
        if field.occupancy is not None:
            bits = np.unpackbits(field.occupancy, axis=1, bitorder="little").astype(bool)
            self._occupancy = torch.from_numpy(bits.reshape(-1)).to(self.device)
        self._steps = _Steps(0.0 if field.aabb_scale == 1 else CONE)

    def occupied(self, positions: Tensor) -> Tensor:
        """Mask [N] of positions inside the cube and the crop box, in cells that are not empty."""
        q = self._cycled(self.field.scale * positions + self._offset)
        local = q @ self._axes.T
        inside = ((local >= self._crop[0]) & (local <= self._crop[1])).all(dim=1)
        inside &= ((q - 0.5).abs() <= 0.5 * self.field.aabb_scale).all(dim=1)
        if self._occupancy is None:
            return inside
        return inside & self._occupancy[self._cells(q)]

    def density_inside(self, positions: Tensor) -> Tensor:
        """Density [N] per world unit at positions [N,3]."""
        return self.field.scale * torch.exp(self._base(self._unit(positions))[:, 0])

    def color(self, positions: Tensor, viewdirs: Tensor) -> Tensor:
        """rgb [N,3] at positions [N,3], those outside moved to the cube, along viewdirs [N,3]."""
        return self._shade(self._base(self._unit(positions)), viewdirs)

    def view_colors(self, positions: Tensor, viewdirs: Tensor) -> Tensor:
        """rgb [N,K,3]; the grid is evaluated once per position."""
        n, k, _ = viewdirs.shape
        features = self._base(self._unit(positions)).repeat_interleave(k, dim=0)
        return self._shade(features, viewdirs.reshape(-1, 3)).reshape(n, k, 3)

    def ray_samples(
        self, origins: Tensor, directions: Tensor, reach: Tensor | None, density_at: DensityAt
    ) -> RaySamples:
        """Points of the lattice that begins where the ray enters the box, `near` or later.

        With edits they begin whole steps earlier, and end later, where `reach` goes beyond the box.
        """
        scale = self.field.scale
        enter, leave = box_crossing(origins, directions, self.box)
        start = self._steps.of_distance(scale * enter.clamp_min(NEAR / scale) + 1e-6)
        if reach is not None:
            first, last = box_crossing(origins, directions, reach)
            earlier = self._steps.of_distance(scale * first.clamp_min(NEAR / scale))
            start = start - torch.ceil((start - earlier).clamp_min(0.0))
            enter, leave = torch.minimum(enter, first), torch.maximum(leave, last)
        hit = leave > enter.clamp_min(NEAR / scale)
        end = self._steps.of_distance(scale * torch.where(hit, leave, enter).clamp_min(0.0))
        longest = torch.where(hit, end - start, torch.zeros_like(end)).max()
        count = min(MAX_NGP_SAMPLES, max(1, int(torch.ceil(longest).item()) + 1))
        n = start[:, None] + torch.arange(count + 1, device=self.device, dtype=start.dtype)
        t = self._steps.distance(n) / scale
        return RaySamples(t[:, :-1].float(), (t[:, 1:] - t[:, :-1]).float())

    def _shade(self, features: Tensor, viewdirs: Tensor) -> Tensor:
        harmonics = sh_values(self._cycled(viewdirs), phase=True)
        raw = self._head(torch.cat([features, harmonics], dim=1))
        if not self.field.hdr:
            return torch.sigmoid(raw)
        linear = torch.exp(raw.clamp(-MAX_EXPONENT, MAX_EXPONENT)).clamp_max(1.0)
        curved = 1.055 * linear.clamp_min(1e-9).pow(1.0 / 2.4) - 0.055
        return torch.where(linear < 0.0031308, 12.92 * linear, curved)

    def _cycled(self, vectors: Tensor) -> Tensor:
        return vectors[:, [1, 2, 0]] if self.field.cycled else vectors

    def _unit(self, positions: Tensor) -> Tensor:
        """Grid coordinates [N,3] in [0,1] of positions [N,3]."""
        q = self._cycled(self.field.scale * positions + self._offset)
        return ((q - 0.5) / self.field.aabb_scale + 0.5).clamp(0.0, 1.0)

    def _cells(self, q: Tensor) -> Tensor:
        """Indices [N] of the occupancy cells of positions q [N,3] inside the cube."""
        exponent = torch.frexp((q - 0.5).abs().amax(dim=1)).exponent.long()
        cascade = (exponent + 1).clamp(0, self.field.cascades - 1)
        size = torch.pow(2.0, -cascade.to(q.dtype))[:, None]
        cell = (((q - 0.5) * size + 0.5) * GRID_CELLS).long().clamp(0, GRID_CELLS - 1)
        i, j, k = cell.unbind(1)
        return ((cascade * GRID_CELLS + i) * GRID_CELLS + j) * GRID_CELLS + k


class _Steps:
    """Number of steps n of a distance t along a ray (NGP's space), and its inverse.

    With a cone angle c the step is STEP up to t_a = STEP / log(1 + c), then grows by 1 + c at each step, up
    to LONGEST_STEP.
    """

    def __init__(self, cone: float) -> None:
        self.log = math.log1p(cone)
        if cone > 0.0:
            self.near, self.far = STEP / self.log, LONGEST_STEP / self.log
            self.first, self.last = math.log(self.near) / self.log, math.log(self.far) / self.log

    def of_distance(self, t: Tensor) -> Tensor:
        """Steps n [...] of distances t [...] from 0 on."""
        t = t.double()
        if self.log == 0.0:
            return t / STEP
        middle = torch.log(t.clamp(self.near, self.far)) / self.log
        near = (t - self.near) / STEP + self.first
        far = (t - self.far) / LONGEST_STEP + self.last
        return torch.where(t <= self.near, near, torch.where(t <= self.far, middle, far))

    def distance(self, n: Tensor) -> Tensor:
        """Distances t [...] of steps n [...], float64 as n."""
        if self.log == 0.0:
            return n * STEP
        middle = torch.exp(n.clamp(self.first, self.last) * self.log)
        near = (n - self.first) * STEP + self.near
        far = (n - self.last) * LONGEST_STEP + self.far
        return torch.where(n <= self.first, near, torch.where(n <= self.last, middle, far))
