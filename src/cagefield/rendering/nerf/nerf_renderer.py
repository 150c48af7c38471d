"""Exact pictures of a NerfField through edits: hierarchical sampling in deformed space.

Notation: a ray's samples have the parameter s, planar depth (along the camera's axis) without NDC, and the
NDC ray's own parameter in [0,1] with it; t(s) is the distance along the unit ray and delta = t'(s) ds, the
last one endless. Every sample's position and view direction go through the edit stack before a network sees
them; emptied samples have sigma 0. The coarse network's weights place the fine samples, so they gather where
the edited scene is.

Normals are -J^T g / |J^T g| at the samples, g the gradient of sigma by canonical position (automatic
differentiation) and J the edits' Jacobian, weighted like the color.

Without edits the sums are those of nerf-pytorch for the same rays. Source: Mildenhall et al., "NeRF" (2020),
sections 4 and 5.2; Li & Pan, section 3 (sample points are deformed).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from cagefield.cameras.camera import Camera
from cagefield.edits import EditMap
from cagefield.fields.mlp import NerfParameters
from cagefield.fields.nerf_field import NerfField
from cagefield.fields.nerf_torch import TorchMlp, TorchNerf
from cagefield.images.render_result import Background, RenderResult
from cagefield.rendering.nerf.sample_normals import sample_normals
from cagefield.rendering.nerf.torch_edit_map import TensorMap

ENDLESS = 1e10
"""Length of the last sample's segment."""

LAST_NDC = 1.0 - 1e-6
"""The NDC ray parameter 1 lies at infinity; sampling stops this close to it."""

LEAST_COSINE = 0.05
"""Rays further from the camera's axis are sampled as if they were this close to it."""


class Rays(NamedTuple):
    """Origins [N,3], unit directions [N,3] and cosines [N] to the camera's axis."""

    origins: Tensor
    directions: Tensor
    cosines: Tensor

    @classmethod
    def from_camera(cls, camera: Camera, device: torch.device, pixels: Any = None) -> Rays:
        """The rays of a camera's pixels [N,2] (column, row), all of them row by row if left out."""
        origins, directions = camera.rays() if pixels is None else camera.rays(pixels)
        cosines = (directions @ camera.forward).astype(np.float32)
        return cls(
            *(torch.from_numpy(np.array(a, np.float32)).to(device) for a in (origins, directions, cosines))
        )

    def part(self, rows: slice) -> Rays:
        """Some of the rays."""
        return Rays(self.origins[rows], self.directions[rows], self.cosines[rows])


class Sums(NamedTuple):
    """Along rays: premultiplied rgb [N,3], opacity [N], sum of weights times distance [N].

    Their samples have the weights [N,S] and the distances t [N,S].
    """

    premultiplied: Tensor
    opacity: Tensor
    distance: Tensor
    weights: Tensor
    t: Tensor


@dataclass(frozen=True)
class Jitter:
    """Chance in training: samples anywhere in their strata, noise of this deviation on the raw density."""

    noise: float = 0.0


@dataclass(frozen=True, eq=False)
class NerfRenderer:
    """Renderer of a NerfField under edits, by hierarchical sampling, `chunk_rays` rays at a time.

    `preserve_opacity` multiplies sigma by |J d|, which keeps optical depth under the edits' stretch.
    """

    field: NerfField
    edits: EditMap | None = None
    preserve_opacity: bool = True
    chunk_rays: int = 2048

    def render(
        self, camera: Camera, *, background: Background = "white", normals: bool = False
    ) -> RenderResult:
        """Image of the field seen by `camera`."""
        rays = Rays.from_camera(camera, self.field.torch.device)
        columns = _traced(self.field.torch, rays, self.edits, self.chunk_rays, self.preserve_opacity, normals)
        shape = (camera.height, camera.width)
        premultiplied, opacity, depth, normal = (
            values.cpu().numpy().reshape(*shape, *values.shape[1:]) for values in columns
        )
        return RenderResult.from_premultiplied(
            premultiplied, opacity, depth, normals=normal if normals else None, background=background
        )


def trace(
    field: TorchNerf,
    rays: Rays,
    edits: EditMap | None = None,
    chunk: int = 2048,
    preserve_opacity: bool = True,
) -> tuple[Tensor, Tensor, Tensor]:
    """(premultiplied color [N,3], opacity [N], depth [N]) of rays; depth is inf at opacity 0."""
    return _traced(field, rays, edits, chunk, preserve_opacity, False)[:3]


def _traced(
    field: TorchNerf, rays: Rays, edits: EditMap | None, chunk: int, preserve_opacity: bool, normals: bool
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Results of `trace`, and normals [N,3], or [N,0] unless requested."""
    mapped = None
    if edits is not None and len(edits.steps):
        mapped = TensorMap(edits, field.device, preserve_opacity=preserve_opacity)
    parts = []
    with torch.no_grad():
        for start in range(0, len(rays.origins), chunk):
            some = rays.part(slice(start, start + chunk))
            _coarse, sums = march(field, some, mapped)
            depth = sums.distance / sums.opacity.clamp_min(1e-10)
            depth = torch.where(sums.opacity > 1e-6, depth, torch.full_like(depth, float("inf")))
            normal = _normals(field, some, sums, mapped) if normals else some.origins[:, :0]
            parts.append((sums.premultiplied, sums.opacity, depth, normal))
    premultiplied, opacity, depth, normal = (torch.cat(column) for column in zip(*parts, strict=True))
    return premultiplied, opacity, depth, normal


def _normals(field: TorchNerf, rays: Rays, sums: Sums, mapped: TensorMap | None) -> Tensor:
    """Unit normals [N,3] in deformed space, 0 where nothing is seen."""
    return sample_normals(rays.origins, rays.directions, sums.t, sums.weights, field.density_gradient, mapped)


def march(
    field: TorchNerf, rays: Rays, mapped: TensorMap | None = None, jitter: Jitter | None = None
) -> tuple[Sums, Sums]:
    """(coarse sums, fine sums) of rays; the same sums twice where the field takes no fine samples."""
    coarse_count, fine_count = field.field.samples
    s = stratified_samples(field.field, rays, coarse_count, jitter)
    coarse = _integrate(field, field.coarse, rays, s, mapped, jitter)
    if fine_count == 0:
        return coarse, coarse
    middles = 0.5 * (s[:, 1:] + s[:, :-1])
    more = sample_pdf(middles, coarse.weights[:, 1:-1].detach(), fine_count, jitter is not None)
    s = torch.sort(torch.cat([s, more], dim=1), dim=1).values
    return coarse, _integrate(field, field.network, rays, s, mapped, jitter)


def sample_pdf(bins: Tensor, weights: Tensor, count: int, random: bool = False) -> Tensor:
    """`count` places [N,count] in bins with edges [N,B+1] as often as weights [N,B] say.

    Places are the quantiles even in [0,1], or random ones. Source: NeRF, section 5.2.
    """
    density = weights + 1e-5
    density = density / density.sum(dim=1, keepdim=True)
    total = torch.cat([torch.zeros_like(density[:, :1]), torch.cumsum(density, dim=1)], dim=1)
    if random:
        u = torch.rand(len(bins), count, device=bins.device)
    else:
        u = torch.linspace(0.0, 1.0, count, device=bins.device).expand(len(bins), count).contiguous()
    above = torch.searchsorted(total, u, right=True)
    below = (above - 1).clamp_min(0)
    above = above.clamp_max(total.shape[1] - 1)
    low, high = torch.gather(total, 1, below), torch.gather(total, 1, above)
    width = torch.where(high - low < 1e-5, torch.ones_like(low), high - low)
    start, end = torch.gather(bins, 1, below), torch.gather(bins, 1, above)
    return start + (u - low) / width * (end - start)


def stratified_samples(field: NerfParameters, rays: Rays, count: int, jitter: Jitter | None) -> Tensor:
    """Parameters s [N,count] of the coarse samples."""
    even = torch.linspace(0.0, 1.0, count, device=rays.origins.device)
    if field.ndc is not None:
        s = even
    elif field.lindisp:
        s = 1.0 / ((1.0 - even) / field.near + even / field.far)
    else:
        s = field.near * (1.0 - even) + field.far * even
    s = s.expand(len(rays.origins), count)
    if jitter is not None:
        middles = 0.5 * (s[:, 1:] + s[:, :-1])
        lower = torch.cat([s[:, :1], middles], dim=1)
        upper = torch.cat([middles, s[:, -1:]], dim=1)
        s = lower + (upper - lower) * torch.rand_like(s)
    return s


def _along(field: NerfParameters, rays: Rays, s: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """(t [N,S], dt/ds [N,S], seen [N]) of parameters s; rays that see nothing of the field are not `seen`."""
    if field.ndc is None:
        scale = 1.0 / rays.cosines.clamp_min(LEAST_COSINE)[:, None]
        return s * scale, scale.expand(s.shape), torch.ones_like(rays.cosines, dtype=torch.bool)
    down = -rays.directions[:, 2]
    seen = down > 1e-3
    down = torch.where(seen, down, torch.ones_like(down))[:, None]
    start = (1.0 + rays.origins[:, 2:3]) / down
    left = 1.0 - s.clamp_max(LAST_NDC)
    return start + (1.0 - left) / (left * down), 1.0 / (left * left * down), seen


def _integrate(
    field: TorchNerf,
    network: TorchMlp,
    rays: Rays,
    s: Tensor,
    mapped: TensorMap | None,
    jitter: Jitter | None,
) -> Sums:
    t, rate, seen = _along(field.field, rays, s)
    points = (rays.origins[:, None] + t[..., None] * rays.directions[:, None]).reshape(-1, 3)
    viewdirs = rays.directions[:, None].expand(*s.shape, 3).reshape(-1, 3)

    def evaluate(p: Tensor, d: Tensor) -> tuple[Tensor, Tensor]:
        return field(p, d, network, 0.0 if jitter is None else jitter.noise)

    if mapped is None:
        sigma, rgb = evaluate(points, viewdirs)
    else:
        sigma, rgb = mapped.evaluated(points, viewdirs, evaluate)
    sigma = torch.where(seen[:, None], sigma.reshape(s.shape), torch.zeros_like(s))
    delta = torch.cat([s[:, 1:] - s[:, :-1], torch.full_like(s[:, :1], ENDLESS)], dim=1) * rate
    alpha = 1.0 - torch.exp(-sigma * delta)
    clear = torch.cumprod(torch.cat([torch.ones_like(s[:, :1]), 1.0 - alpha[:, :-1] + 1e-10], dim=1), dim=1)
    weights = alpha * clear
    return Sums(
        (weights[..., None] * rgb.reshape(*s.shape, 3)).sum(dim=1),
        weights.sum(dim=1),
        (weights * t).sum(dim=1),
        weights,
        t,
    )
