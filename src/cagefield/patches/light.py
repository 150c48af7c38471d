"""Ambient occlusion as it shows in a field's colours, and what moved content makes of it.

The openness of a surface point p with normal n is

    o(p) = 1 - sum_r w_r max(0, 1 - D(p + r n) / r),

D the distance to the nearest solid, for a few reaches r: how much nearer other surfaces are than open space.
The weights w are fitted to the field: where surfaces go on smoothly, most differences of log colour between
neighbours are texture, of either sign, and the rest follows log o. A field without contact shadows gets
weights near 0, and then nothing is changed.

Source: Evans, "Fast approximations for global illumination on dynamic scenes" (2006), for the openness.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, optimize

from cagefield.patches.block import Block, world_of
from cagefield.typing import Array, Mask

REACHES = (0.01, 0.02, 0.04, 0.08)
"""The reaches r, shares of the diagonal of what the field holds."""

LEAST = 0.08
"""Least openness that counts: colours that are darker still are noise."""


@dataclass(frozen=True)
class Ambience:
    """How a field's colours follow its openness: reaches [R] in world units, and their weights [R]."""

    reaches: tuple[float, ...]
    weights: tuple[float, ...]

    @property
    def shows(self) -> bool:
        """False where colours do not follow the openness."""
        return sum(self.weights) > 0.05

    def openness(self, nearness: Array) -> Array:
        """o [N], at least LEAST, of nearnesses [N,R]."""
        return np.asarray(np.maximum(1.0 - nearness @ np.array(self.weights), LEAST))


def distances(solid: Mask, voxel: Array) -> NDArray[np.float32]:
    """Distance [X,Y,Z] in world units of the vertices of a block to its nearest solid one."""
    if not solid.any():
        return np.full(solid.shape, np.inf, np.float32)
    return np.asarray(ndimage.distance_transform_edt(~solid, sampling=tuple(voxel)), np.float32)


def nearness(
    block: Block, distance: NDArray[np.float32], points: Array, normals: Array, reaches: Sequence[float]
) -> Array:
    """max(0, 1 - D(p + r n) / r) [N,R] at points [N,3] with normals [N,3], for each reach r."""
    columns = []
    for reach in reaches:
        found = block.lookup(np.minimum(distance, reach), points + reach * normals, outside=reach)
        columns.append(np.clip(1.0 - found / reach, 0.0, 1.0))
    return np.stack(columns, axis=1)


def ambience_of(block: Block, reaches: Sequence[float], *, most: int = 40_000, seed: int = 0) -> Ambience:
    """The weights that explain the colours of a block's surfaces; see the module."""
    chance = np.random.default_rng(seed)
    surface = surfaces(block)
    at = np.argwhere(surface)
    nothing = Ambience(tuple(reaches), (0.0,) * len(reaches))
    if len(at) < 200:
        return nothing
    at = at[chance.choice(len(at), min(most, len(at)), replace=False)]
    normal = block.normals[tuple(at.T)]
    # A neighbour a few voxels away in the surface's plane.
    aside = np.cross(normal, chance.normal(size=normal.shape))
    aside /= np.maximum(np.linalg.norm(aside, axis=1, keepdims=True), 1e-6)
    other = np.round(at + chance.uniform(2.0, 6.0, (len(at), 1)) * aside).astype(np.int64)
    kept = ((other >= 0) & (other < block.shape)).all(axis=1)
    at, other = at[kept], other[kept]
    kept = surface[tuple(other.T)]
    at, other = at[kept], other[kept]
    same = (block.normals[tuple(at.T)] * block.normals[tuple(other.T)]).sum(axis=1) > 0.95
    at, other = at[same], other[same]
    if len(at) < 200:
        return nothing
    logs, near = [], []
    distance = distances(block.solid, block.field.voxel_size)
    for each in (at, other):
        place = tuple(each.T)
        rgb = 0.5 + 0.28209479 * block.sh[block.slot[place], 0]
        logs.append(np.log(np.clip(rgb, 0.02, 1.0).mean(axis=1)))
        points = world_of(block.field, each + block.low)
        near.append(nearness(block, distance, points, block.normals[place], reaches))
    change = logs[1] - logs[0]

    def residuals(weights: Array) -> Array:
        first, second = (np.log(np.maximum(1.0 - n @ weights, LEAST)) for n in near)
        return np.asarray(second - first - change)

    fit = optimize.least_squares(
        residuals, np.full(len(reaches), 0.1), bounds=(0.0, 1.0), loss="soft_l1", f_scale=0.03
    )
    weights = fit.x * min(1.0, 1.0 / max(float(fit.x.sum()), 1e-9))
    return Ambience(tuple(reaches), tuple(float(w) for w in weights))


def surfaces(block: Block) -> Mask:
    """Vertices [X,Y,Z] with colour near a surface: solid ones beside others, and their neighbours."""
    solid = block.solid
    near = ndimage.binary_dilation(~solid) & solid
    return np.asarray(near & (block.slot >= 0) & (np.abs(block.normals).sum(axis=-1) > 0.5))
