"""nerfacto in PyTorch; notation and source as in `nerfacto`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch
from torch import Tensor

from cagefield.fields.external.hash_grid_torch import TorchHashNetwork, TorchLayers, sh_values
from cagefield.fields.external.torch_field import DensityAt, RaySamples, TorchField

if TYPE_CHECKING:
    from cagefield.fields.external.nerfacto_parameters import NerfactoParameters

ENDLESS_SEGMENT = 1e20
"""Length of the last sample's segment where it absorbs all that is left."""

HISTOGRAM_PADDING = 0.01
"""Weight added to each bin of a proposal, as nerfstudio's PDFSampler does."""


class TorchNerfacto(TorchField):
    """Tensors of a `NerfactoParameters`."""

    def __init__(self, field: NerfactoParameters, device: torch.device | None = None) -> None:
        super().__init__(field.bounds, device)
        self.field = field
        self._base = TorchHashNetwork(field.base, self.device)
        self._head = TorchLayers(field.head, self.device)
        self._proposals = [TorchHashNetwork(network, self.device) for network in field.proposals]

    def occupied(self, positions: Tensor) -> Tensor:
        """Mask [N] of positions inside the open cube of the grids."""
        x = self._unit(positions)
        return ((x > 0.0) & (x < 1.0)).all(dim=1)

    def density_inside(self, positions: Tensor) -> Tensor:
        """Density [N] per world unit at positions [N,3]."""
        return self.field.density_scale * torch.exp(self._base(self._unit(positions))[:, 0])

    def color(self, positions: Tensor, viewdirs: Tensor) -> Tensor:
        """rgb [N,3] at positions [N,3], those outside taken to the grids' origin, along viewdirs [N,3]."""
        return self._shade(self._geometry(positions), viewdirs)

    def view_colors(self, positions: Tensor, viewdirs: Tensor) -> Tensor:
        """rgb [N,K,3]; the grid is evaluated once per position."""
        n, k, _ = viewdirs.shape
        features = self._geometry(positions).repeat_interleave(k, dim=0)
        return self._shade(features, viewdirs.reshape(-1, 3)).reshape(n, k, 3)

    def ray_samples(
        self, origins: Tensor, directions: Tensor, reach: Tensor | None, density_at: DensityAt
    ) -> RaySamples:
        """Centers of the bins that the proposal networks place, from 0 to `far`.

        The proposals' densities are seen through the edits, so samples gather where the edited scene is.
        """
        rounds = self.field.samples
        bins = torch.linspace(0.0, 1.0, rounds[0] + 1, device=self.device).expand(len(origins), -1)
        for index, count in enumerate(rounds[1:]):
            network = self._proposals[min(index, len(self._proposals) - 1)]
            edges = self._distance(bins)
            t, delta = 0.5 * (edges[:, 1:] + edges[:, :-1]), edges[:, 1:] - edges[:, :-1]

            def proposed(positions: Tensor, network: TorchHashNetwork = network) -> Tensor:
                return self._masked(lambda inside: self._proposed(network, inside), positions)

            bins = next_bins(bins, ray_weights(density_at(proposed, t), delta), count)
        edges = self._distance(bins)
        t, delta = 0.5 * (edges[:, 1:] + edges[:, :-1]), edges[:, 1:] - edges[:, :-1]
        if self.field.endless:
            delta = torch.cat([delta[:, :-1], torch.full_like(delta[:, :1], ENDLESS_SEGMENT)], dim=1)
        return RaySamples(t, delta)

    def _proposed(self, network: TorchHashNetwork, positions: Tensor) -> Tensor:
        return self.field.density_scale * torch.exp(network(self._unit(positions))[:, 0])

    def _geometry(self, positions: Tensor) -> Tensor:
        """Geometry features [N,G] at any positions [N,3]."""
        x = self._unit(positions)
        inside = ((x > 0.0) & (x < 1.0)).all(dim=1, keepdim=True)
        return self._base(torch.where(inside, x, torch.zeros_like(x)))[:, 1:]

    def _shade(self, features: Tensor, viewdirs: Tensor) -> Tensor:
        tcnn = self.field.layout == "tcnn"
        harmonics = sh_values(viewdirs if tcnn else 0.5 * (viewdirs + 1.0), phase=tcnn)
        return torch.sigmoid(self._head(torch.cat([harmonics, features], dim=1)))

    def _unit(self, positions: Tensor) -> Tensor:
        """Grid coordinates x [N,3] of positions [N,3]."""
        if not self.field.contracted:
            return (positions - self.box[0]) / (self.box[1] - self.box[0])
        m = positions.abs().amax(dim=1, keepdim=True)
        far = (2.0 - 1.0 / m.clamp_min(1.0)) * (positions / m.clamp_min(1.0))
        return (torch.where(m < 1.0, positions, far) + 2.0) / 4.0

    def _distance(self, s: Tensor) -> Tensor:
        """Distance t along the ray of spacing parameters s in [0,1]."""
        far = self.field.far
        if self.field.spacing == "uniform":
            return far * s
        last = 0.5 * far if far < 1.0 else 1.0 - 0.5 / far
        spaced = last * s
        return torch.where(spaced < 0.5, 2.0 * spaced, 1.0 / (2.0 - 2.0 * spaced.clamp_max(last)))


def ray_weights(sigma: Tensor, delta: Tensor) -> Tensor:
    """Weights [N,S] of samples with densities [N,S] and lengths [N,S]."""
    depth = sigma * delta
    before = torch.cumsum(depth, dim=1) - depth
    return torch.nan_to_num((1.0 - torch.exp(-depth)) * torch.exp(-before))


def next_bins(bins: Tensor, weights: Tensor, count: int) -> Tensor:
    """Edges [N,count+1] at the quantiles (k + 1/2) / (count + 1) of the weights [N,B] of bins [N,B+1].

    Source: nerfstudio, model_components/ray_samplers.py, PDFSampler in evaluation.
    """
    padded = weights + HISTOGRAM_PADDING
    share = padded / padded.sum(dim=1, keepdim=True)
    total = torch.cumsum(share, dim=1).clamp_max(1.0)
    total = torch.cat([torch.zeros_like(total[:, :1]), total], dim=1)
    edges = count + 1
    u = torch.linspace(0.0, 1.0 - 1.0 / edges, edges, device=bins.device) + 0.5 / edges
    u = u.expand(len(bins), edges).contiguous()
    above = torch.searchsorted(total, u, right=True)
    below = (above - 1).clamp(0, bins.shape[1] - 1)
    above = above.clamp(0, bins.shape[1] - 1)
    low, high = torch.gather(total, 1, below), torch.gather(total, 1, above)
    start, end = torch.gather(bins, 1, below), torch.gather(bins, 1, above)
    part = torch.nan_to_num((u - low) / (high - low), nan=0.0).clamp(0.0, 1.0)
    return start + part * (end - start)
