"""Volume rendering sums in plain numpy: the readable oracle of the fused kernels.

Notation: along a ray, sample i at distance t_i stands for a segment of length delta_i;
alpha_i = 1 - exp(-sigma_i delta_i), transmittance T_i = prod_{j<i} (1 - alpha_j), weights w_i = T_i alpha_i.
Arrays are [..., S] with the samples last, ordered away from the camera; the dtype of the input is kept.
Source: Max, "Optical models for direct volume rendering" (1995); Mildenhall et al., NeRF (2020), equation 3.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cagefield.typing import AnyArray


class Composite(NamedTuple):
    """Sums along rays: premultiplied [...,3], opacity and depth [...] (inf at opacity 0), weights [...,S]."""

    premultiplied: AnyArray
    opacity: AnyArray
    depth: AnyArray
    weights: AnyArray


def alpha(sigma: AnyArray, delta: AnyArray) -> AnyArray:
    """Share of light absorbed by each segment: 1 - exp(-sigma delta), exact for small arguments."""
    return -np.expm1(-sigma * delta)


def transmittance(sigma: AnyArray, delta: AnyArray) -> AnyArray:
    """Share of light that reaches the start of each segment: exp(-sum_{j<i} sigma_j delta_j)."""
    tau = np.cumsum(sigma * delta, axis=-1)
    before = np.concatenate([np.zeros_like(tau[..., :1]), tau[..., :-1]], axis=-1)
    return np.exp(-before)


def weights(sigma: AnyArray, delta: AnyArray) -> AnyArray:
    """Contribution of each sample: T_i alpha_i; they add up to the opacity."""
    return transmittance(sigma, delta) * alpha(sigma, delta)


def composite(sigma: AnyArray, rgb: AnyArray, t: AnyArray, delta: AnyArray) -> Composite:
    """Premultiplied color, opacity, expected depth and weights of rays.

    sigma, t, delta [...,S]; rgb [...,S,3]. Depth is sum(w t) / sum(w). Exact when sigma and rgb are constant
    on each segment (depth: to the midpoint of a segment).
    """
    w = weights(sigma, delta)
    opacity = w.sum(-1)
    hit = opacity > 0
    depth = np.where(hit, (w * t).sum(-1) / np.where(hit, opacity, 1.0), np.inf)
    return Composite((w[..., None] * rgb).sum(-2), opacity, depth, w)
