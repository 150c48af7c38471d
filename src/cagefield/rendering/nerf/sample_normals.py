"""Normals of rays from the density's gradient at their samples, through edits."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

from cagefield.rendering.nerf.torch_edit_map import TensorMap

NORMAL_WEIGHT = 1e-4
"""Samples that contribute less than this to a pixel do not get a normal."""


def sample_normals(
    origins: Tensor,
    directions: Tensor,
    t: Tensor,
    weights: Tensor,
    gradient: Callable[[Tensor, Tensor], Tensor],
    mapped: TensorMap | None = None,
) -> Tensor:
    """Unit normals [N,3] in deformed space of rays with samples t [N,S] of weights [N,S]; 0 where nothing is.

    A sample's normal is -J^T g / |J^T g|: g its `gradient` [M,3] by canonical position at points [M,3] along
    viewdirs [M,3], J the edits' Jacobian. A ray's normal is their weighted mean, made unit.
    """
    seen = weights > NORMAL_WEIGHT
    rows = torch.nonzero(seen)[:, 0]
    viewdirs = directions[rows]
    points = origins[rows] + t[seen][:, None] * viewdirs
    if mapped is None:
        slopes = gradient(points, viewdirs)
    else:
        canonical, along, _ = mapped(points, viewdirs)
        slopes = (mapped.jacobian(points) * gradient(canonical, along)[:, :, None]).sum(dim=1)
    # slopes far away in NDC are tiny
    own = -torch.nn.functional.normalize(slopes, dim=1, eps=1e-30) * weights[seen][:, None]
    total = torch.zeros_like(origins).index_add_(0, rows, own)
    return torch.nn.functional.normalize(total, dim=1)
