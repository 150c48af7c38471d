"""Exact pictures of an ExternalField through edits, sampled in deformed space as its program samples.

Notation: a ray's samples lie at t_k with segments delta_k. Every sample's position and view direction go
through the edit stack before the field sees them; emptied samples have sigma 0.

    alpha_k = 1 - exp(-sigma_k delta_k),  T_k = prod_{j<k} (1 - alpha_j + 1e-10),  w_k = alpha_k T_k

Without edits the sums are those of the program for the same rays. Source: Li & Pan, section 3 (sample points
are deformed); each field's `ray_samples` names its program.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from cagefield.cameras.camera import Camera
from cagefield.edits import EditMap
from cagefield.fields.external.external_field import ExternalField
from cagefield.fields.external.torch_field import TorchField
from cagefield.images.render_result import Background, RenderResult
from cagefield.rendering.edited_field import edited_bounds
from cagefield.rendering.nerf.nerf_renderer import Rays
from cagefield.rendering.nerf.sample_normals import sample_normals
from cagefield.rendering.nerf.torch_edit_map import TensorMap


@dataclass(frozen=True, eq=False)
class ExternalRenderer:
    """Renderer of an ExternalField under edits, `chunk_rays` rays at a time.

    `preserve_opacity` multiplies sigma by |J d|, which keeps optical depth under the edits' stretch.
    """

    field: ExternalField
    edits: EditMap | None = None
    preserve_opacity: bool = True
    chunk_rays: int = 1024

    def render(
        self, camera: Camera, *, background: Background = "white", normals: bool = False
    ) -> RenderResult:
        """Image of the field seen by `camera`."""
        rays = Rays.from_camera(camera, self.field.torch.device)
        columns = _traced(self.field, rays, self.edits, self.chunk_rays, self.preserve_opacity, normals)
        shape = (camera.height, camera.width)
        premultiplied, opacity, depth, normal = (
            values.cpu().numpy().reshape(*shape, *values.shape[1:]) for values in columns
        )
        return RenderResult.from_premultiplied(
            premultiplied, opacity, depth, normals=normal if normals else None, background=background
        )


def trace_external(
    field: ExternalField,
    rays: Rays,
    edits: EditMap | None = None,
    chunk: int = 1024,
    preserve_opacity: bool = True,
) -> tuple[Tensor, Tensor, Tensor]:
    """(premultiplied color [N,3], opacity [N], depth [N]) of rays; depth is inf at opacity 0."""
    return _traced(field, rays, edits, chunk, preserve_opacity, False)[:3]


def _traced(
    field: ExternalField,
    rays: Rays,
    edits: EditMap | None,
    chunk: int,
    preserve_opacity: bool,
    normals: bool,
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Results of `trace_external`, and normals [N,3], or [N,0] unless requested."""
    torch_field, mapped, reach = field.torch, None, None
    if edits is not None and len(edits.steps):
        mapped = TensorMap(edits, torch_field.device, preserve_opacity=preserve_opacity)
        reach = torch_field.tensor(edited_bounds(np.asarray(field.bounds, np.float64), edits))
    parts = []
    with torch.no_grad():
        for start in range(0, len(rays.origins), chunk):
            some = rays.part(slice(start, start + chunk))
            march = _March(torch_field, some.origins, some.directions, mapped)
            parts.append(march.sums(reach, normals))
    premultiplied, opacity, depth, normal = (torch.cat(column) for column in zip(*parts, strict=True))
    return premultiplied, opacity, depth, normal


@dataclass(frozen=True, eq=False)
class _March:
    """Rays from origins [N,3] along unit directions [N,3] through an edited field."""

    field: TorchField
    origins: Tensor
    directions: Tensor
    mapped: TensorMap | None

    def sums(self, reach: Tensor | None, normals: bool) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """(premultiplied color [N,3], opacity [N], depth [N], normals [N,3] or [N,0])."""
        t, delta = self.field.ray_samples(self.origins, self.directions, reach, self._density_at)
        sigma = self._density_at(self.field.density, t)
        alpha = 1.0 - torch.exp(-sigma * delta)
        clear = torch.cumprod(
            torch.cat([torch.ones_like(t[:, :1]), 1.0 - alpha[:, :-1] + 1e-10], dim=1), dim=1
        )
        weights = alpha * clear
        rows, columns = torch.nonzero(weights > self.field.color_weight, as_tuple=True)
        rgb = self._color(rows, t[rows, columns]) * weights[rows, columns][:, None]
        premultiplied = torch.zeros_like(self.origins).index_add_(0, rows, rgb)
        opacity = weights.sum(dim=1)
        depth = (weights * t).sum(dim=1) / opacity.clamp_min(1e-10)
        depth = torch.where(opacity > 1e-6, depth, torch.full_like(depth, float("inf")))
        normal = self.origins[:, :0]
        if normals:
            normal = sample_normals(
                self.origins, self.directions, t, weights, self._density_gradient, self.mapped
            )
        return premultiplied, opacity, depth, normal

    def _density_at(self, query: Callable[[Tensor], Tensor], t: Tensor) -> Tensor:
        """Density [N,S] of a canonical density at the distances t [N,S] along the rays, through the edits."""
        points = (self.origins[:, None] + t[..., None] * self.directions[:, None]).reshape(-1, 3)
        if self.mapped is None:
            return query(points).reshape(t.shape)
        viewdirs = self.directions[:, None].expand(*t.shape, 3).reshape(-1, 3)

        def density(at: Tensor, along: Tensor) -> tuple[Tensor, Tensor]:
            return query(at), torch.zeros_like(along)

        sigma: Tensor = self.mapped.evaluated(points, viewdirs, density)[0]
        return sigma.reshape(t.shape)

    def _color(self, rows: Tensor, t: Tensor) -> Tensor:
        """rgb [M,3] of samples at distances t [M] along the rays of rows [M]."""
        viewdirs = self.directions[rows]
        points = self.origins[rows] + t[:, None] * viewdirs
        if self.mapped is None:
            return self.field.blocked_color(points, viewdirs)

        def color(at: Tensor, along: Tensor) -> tuple[Tensor, Tensor]:
            return torch.zeros_like(at[:, 0]), self.field.blocked_color(at, along)

        rgb: Tensor = self.mapped.evaluated(points, viewdirs, color)[1]
        return rgb

    def _density_gradient(self, points: Tensor, _: Any) -> Tensor:
        return self.field.density_gradient(points)
