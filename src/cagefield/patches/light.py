"""Ambient occlusion as it shows in a field's colours, and what moved content makes of it.

The openness of a surface point p with normal n is

    o(p) = 1 - sum_r w_r max(0, 1 - D(p + r n) / r),

D the distance to the nearest solid, for a few reaches r: how much nearer other surfaces are than open space.
The weights w are fitted to the field, as it is seen: between neighbours on a surface, log colour differs by
texture, of either sign, and by log o. Where that says little, weights stay near usual ones. A field without
contact shadows gets weights near 0, and then nothing is changed. Weights that add up to less than 1 leave what light reaches the deepest corner.

Source: Evans, "Fast approximations for global illumination on dynamic scenes" (2006), for the openness.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, optimize

from cagefield.patches.block import Block
from cagefield.patches.seen import SeenPairs
from cagefield.typing import AnyArray, Array, Mask

REACHES = (0.01, 0.02, 0.04, 0.08)
"""The reaches r, shares of the diagonal of what the field holds."""

USUAL, SPREAD = (0.1, 0.2, 0.2, 0.15), 0.2
"""Weights that are usual where light comes from all around, and their standard deviation."""

ALIKE = 10.0
"""Pairs that count as one."""

DARKEST = 0.08
"""Least openness that counts: colours that are darker still are noise."""

SHOWING = 0.1
"""Sum of the weights from which on contact shadows are there."""

ENOUGH = 150
"""Pairs from which weights are fitted, at least."""

SMOOTH = 2.0
"""Standard deviation, in voxels along the surface, by which ratios of openness are smoothed."""


@dataclass(frozen=True)
class Ambience:
    """How a field's colours follow its openness: reaches [R] in world units, and their weights [R]."""

    reaches: tuple[float, ...]
    weights: tuple[float, ...]

    @property
    def shows(self) -> bool:
        """False where colours do not follow the openness."""
        return sum(self.weights) > SHOWING

    @property
    def reach(self) -> float:
        """The largest distance, in world units, at which it makes a difference; 0 where it shows nowhere."""
        return max((r for r, w in zip(self.reaches, self.weights, strict=True) if w > 0.01), default=0.0)

    def log_openness(self, nearness: Array) -> Array:
        """log o [N], o at least DARKEST, of nearnesses [N,R]."""
        return np.asarray(np.log(np.maximum(1.0 - nearness @ np.array(self.weights), DARKEST)))


def distances(solid: Mask, block: Block) -> NDArray[np.float32]:
    """Distance [X,Y,Z] in world units of the vertices of a block to its nearest solid one."""
    if not solid.any():
        return np.full(solid.shape, 1e9, np.float32)
    spacing = tuple(float(edge) for edge in block.field.voxel_size)
    return np.asarray(ndimage.distance_transform_edt(~solid, sampling=spacing), np.float32)


def nearness(
    block: Block, distance: AnyArray, points: AnyArray, normals: AnyArray, reaches: Sequence[float]
) -> Array:
    """max(0, 1 - D(p + r n) / r) [N,R] at points [N,3] with normals [N,3], for each reach r."""
    columns = []
    for reach in reaches:
        found = block.lookup(distance, points + reach * normals, outside=1e9)
        columns.append(np.clip(1.0 - found / reach, 0.0, 1.0))
    return np.stack(columns, axis=1)


def ambience_of(block: Block, pairs: SeenPairs) -> Ambience:
    """The weights that explain the colours of a field's surfaces; `block` holds all of the field."""
    at = np.argwhere(block.solid)
    nothing = Ambience((), ())
    if len(at) < ENOUGH or len(pairs.points) < ENOUGH:
        return nothing
    span = np.subtract(*np.percentile(at, [99, 1], axis=0)) * block.field.voxel_size
    reaches = tuple(share * float(np.linalg.norm(span)) for share in REACHES)
    distance = distances(block.solid, block)
    first = nearness(block, distance, pairs.points, pairs.normals, reaches)
    second = nearness(block, distance, pairs.other_points, pairs.other_normals, reaches)
    change = pairs.log_change

    usual = np.array(USUAL)
    # Neighbouring pairs see the same texture.
    noise = float(np.median(np.abs(change - np.median(change)))) * 1.4826 * np.sqrt(ALIKE)

    def residuals(weights: Array) -> Array:
        ambience = Ambience(reaches, tuple(weights))
        told = ambience.log_openness(second) - ambience.log_openness(first) - change
        return np.concatenate([told / max(noise, 1e-3), (weights - usual) / SPREAD])

    fit = optimize.least_squares(residuals, usual, bounds=(0.0, 1.0))
    share = min(1.0, (1.0 - DARKEST) / max(float(fit.x.sum()), 1e-9))
    return Ambience(reaches, tuple(float(w) * share for w in fit.x))


@dataclass(frozen=True, eq=False)
class Lighting:
    """The light on some vertices (`where` [X,Y,Z]) of a block: the log of what it is multiplied by, [N]."""

    where: Mask
    log_ratio: Array

    def smoothed(self, block: Block) -> Lighting:
        """The same, smoothed along surfaces."""
        weight = np.zeros(block.shape)
        weight[self.where] = np.minimum(block.depth[self.where], 1.0)
        values = np.zeros(block.shape)
        values[self.where] = self.log_ratio * weight[self.where]
        total = ndimage.gaussian_filter(weight, SMOOTH)[self.where]
        smooth = ndimage.gaussian_filter(values, SMOOTH)[self.where] / np.maximum(total, 1e-9)
        return replace(self, log_ratio=smooth)

    def stronger(self, factor: float) -> Lighting:
        """The same to the power of a factor."""
        return replace(self, log_ratio=factor * self.log_ratio)

    def dense(self, block: Block) -> Array:
        """The log of the ratio [X,Y,Z], 0 elsewhere."""
        out = np.zeros(block.shape)
        out[self.where] = self.log_ratio
        return out


def lit_vertices(block: Block) -> Mask:
    """Vertices [X,Y,Z] whose colour shows and whose normal is known."""
    return np.asarray((block.slot >= 0) & (block.depth > 0.01) & ((block.normals**2).sum(axis=-1) > 0.25))
