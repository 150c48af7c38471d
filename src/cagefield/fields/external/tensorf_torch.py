"""TensoRF in PyTorch; notation and source as in `tensorf_parameters`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch
from torch import Tensor
from torch.nn.functional import grid_sample, linear, softplus

from cagefield.fields.external.torch_field import DensityAt, RaySamples, TorchField, box_crossing

if TYPE_CHECKING:
    from cagefield.fields.external.tensorf_parameters import TensorfParameters

PLANE_AXES = ((0, 1), (0, 2), (1, 2))
LINE_AXES = (2, 1, 0)

_C1, _C2 = 0.4886025119029199, (1.0925484305920792, 0.31539156525252005, 0.5462742152960396)


class TorchTensorf(TorchField):
    """Tensors of `TensorfParameters`."""

    def __init__(self, field: TensorfParameters, device: torch.device | None = None) -> None:
        super().__init__(field.box, device)
        self.field, self.color_weight = field, field.color_weight
        # [1,C,H,W] and [1,C,L,1], as grid_sample takes them
        self._density = _Products(
            [self.tensor(plane)[None] for plane in field.density_planes],
            [self.tensor(line)[None, ..., None] for line in field.density_lines],
        )
        self._appearance = _Products(
            [self.tensor(plane)[None] for plane in field.appearance_planes],
            [self.tensor(line)[None, ..., None] for line in field.appearance_lines],
        )
        self._basis = self.tensor(field.basis)
        self._mlp = [(self.tensor(weight), self.tensor(bias)) for weight, bias in field.mlp]
        self._mask = None if field.mask is None else self.tensor(field.mask)[None, None]
        self._mask_box = self.tensor(field.box if field.mask_box is None else field.mask_box)

    def occupied(self, positions: Tensor) -> Tensor:
        """Mask [N]: inside the box, and where the alpha mask does not interpolate to 0."""
        inside = super().occupied(positions)
        if self._mask is None or not bool(inside.any()):
            return inside
        u = _normalized(positions[inside], self._mask_box)
        alpha = grid_sample(self._mask, u[None, :, None, None], align_corners=True).reshape(-1)
        return inside.masked_scatter(inside, alpha > 0)

    def density_inside(self, positions: Tensor) -> Tensor:
        """Density [N] per world unit at occupied positions [N,3]."""
        raw = self._raw(positions)
        field = self.field
        activated = softplus(raw + field.density_shift) if field.activation == "softplus" else torch.relu(raw)
        return field.distance_scale * activated

    def signed_inside(self, positions: Tensor) -> Tensor:
        """Density [N] before its ReLU; with softplus the density itself."""
        if self.field.activation == "softplus":
            return self.density_inside(positions)
        return self.field.distance_scale * self._raw(positions)

    def color(self, positions: Tensor, viewdirs: Tensor) -> Tensor:
        """rgb [N,3] at positions [N,3], those outside moved to the box, along unit viewdirs [N,3]."""
        u = _normalized(positions, self.box).clamp(-1.0, 1.0)
        return self._shade(linear(self._appearance.products(u).T, self._basis), u, viewdirs)

    def view_colors(self, positions: Tensor, viewdirs: Tensor) -> Tensor:
        """rgb [N,K,3]; features are evaluated once per position."""
        n, k, _ = viewdirs.shape
        u = _normalized(positions, self.box).clamp(-1.0, 1.0)
        features = linear(self._appearance.products(u).T, self._basis)
        features, u = features.repeat_interleave(k, dim=0), u.repeat_interleave(k, dim=0)
        return self._shade(features, u, viewdirs.reshape(-1, 3)).reshape(n, k, 3)

    def ray_samples(
        self, origins: Tensor, directions: Tensor, reach: Tensor | None, density_at: DensityAt
    ) -> RaySamples:
        """Samples every `step` from where the ray enters the box, the last one of length 0.

        With edits they begin whole steps earlier, and end later, where `reach` goes beyond the box.
        """
        step, (near, far) = self.field.step, self.field.near_far
        start = box_crossing(origins, directions, self.box)[0].clamp(min=near, max=far)
        diagonal = (self.box[1] - self.box[0]).norm()
        if reach is not None:
            enter = box_crossing(origins, directions, reach)[0].clamp(min=near, max=far)
            start = start - step * torch.ceil((start - enter).clamp_min(0.0) / step)
            diagonal = (reach[1] - reach[0]).norm() + step
        count = int(diagonal.item() / step) + 1
        steps = torch.arange(count, device=self.device, dtype=origins.dtype)
        t = start[:, None] + step * steps
        return RaySamples(t, torch.cat([t[:, 1:] - t[:, :-1], torch.zeros_like(t[:, :1])], dim=1))

    def _raw(self, positions: Tensor) -> Tensor:
        return self._density.products(_normalized(positions, self.box)).sum(dim=0)

    def _shade(self, features: Tensor, u: Tensor, viewdirs: Tensor) -> Tensor:
        field = self.field
        if field.shading == "RGB":
            return features
        if field.shading == "SH":
            coefficients = features.reshape(-1, 3, 9)
            return torch.relu((_sh_basis(viewdirs)[:, None] * coefficients).sum(dim=2) + 0.5)
        parts = [features, viewdirs]
        if field.shading == "MLP_Fea":
            parts.append(_encoded(features, field.feature_octaves))
        if field.shading == "MLP_PE":
            parts.append(_encoded(u, field.position_octaves))
        hidden = torch.cat([*parts, _encoded(viewdirs, field.view_octaves)], dim=1)
        for weight, bias in self._mlp[:-1]:
            hidden = torch.relu(linear(hidden, weight, bias))
        return torch.sigmoid(linear(hidden, *self._mlp[-1]))


class _Products:
    """Components as products of planes [1,C,H,W] and lines [1,C,L,1]; of lines alone without planes."""

    def __init__(self, planes: list[Tensor], lines: list[Tensor]) -> None:
        self.planes, self.lines = planes, lines

    def products(self, u: Tensor) -> Tensor:
        """Products [C,N] at normalized coordinates [N,3]; with planes those of the three in turn."""
        lines = [
            _sampled(line, torch.stack([torch.zeros_like(u[:, axis]), u[:, axis]], dim=1))
            for line, axis in zip(self.lines, LINE_AXES, strict=True)
        ]
        if not self.planes:
            return lines[0] * lines[1] * lines[2]
        planes = [_sampled(plane, u[:, axes]) for plane, axes in zip(self.planes, PLANE_AXES, strict=True)]
        return torch.cat(planes) * torch.cat(lines)


def _sampled(image: Tensor, at: Tensor) -> Tensor:
    """Values [C,N] of an image [1,C,H,W] at (x, y) [N,2] in [-1,1]."""
    return grid_sample(image, at[None, :, None], align_corners=True).reshape(image.shape[1], len(at))


def _normalized(positions: Tensor, box: Tensor) -> Tensor:
    return (positions - box[0]) * (2.0 / (box[1] - box[0])) - 1.0


def _encoded(x: Tensor, octaves: int) -> Tensor:
    """Sines of x 2^k, then cosines [N, 2 octaves D]; all octaves of a coordinate in turn."""
    scaled = (x[:, :, None] * 2.0 ** torch.arange(octaves, device=x.device)).flatten(1)
    return torch.cat([torch.sin(scaled), torch.cos(scaled)], dim=1)


def _sh_basis(d: Tensor) -> Tensor:
    """Real spherical harmonics [N,9] of degree 2 at unit directions [N,3], as `fields.sh` orders them."""
    x, y, z = d.unbind(1)
    return torch.stack(
        [
            torch.full_like(x, 0.28209479177387814),
            -_C1 * y,
            _C1 * z,
            -_C1 * x,
            _C2[0] * x * y,
            -_C2[0] * y * z,
            _C2[1] * (2.0 * z * z - x * x - y * y),
            -_C2[0] * x * z,
            _C2[2] * (x * x - y * y),
        ],
        dim=1,
    )
