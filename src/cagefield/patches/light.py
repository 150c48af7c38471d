"""Ambient occlusion as it shows in a field's colours, and what moved content makes of it.

The openness of a surface point p with normal n is

    o(p) = 1 - sum_r w_r max(0, 1 - D(p + r n) / r),

D the distance to the nearest solid, for a few reaches r: how much nearer other surfaces are than open space.
The weights w are fitted to the field, as it is seen: between neighbours on a surface, log colour differs by
texture, of either sign, and by log o. Where that says little, weights stay near usual ones. A field without
contact shadows gets weights near 0, and then nothing is changed. Weights that add up to less than 1 leave
the light that reaches the deepest corner.

Source: Evans, "Fast approximations for global illumination on dynamic scenes" (2006), for the openness.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, optimize

from cagefield.edits.patch import NewLight
from cagefield.fields.voxel import VoxelField
from cagefield.patches.block import SOLID, Block
from cagefield.patches.seen import SeenPairs
from cagefield.patches.sun import Distance, Sun, sun_of
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

FINEST = 128
"""Vertices along the longest axis of the grid on which distances in a whole field are found."""

FAR = 1e9
"""A distance beyond all reaches."""

SMOOTH = 2.0
"""Standard deviation, in voxels along the surface, by which ratios of openness are smoothed."""


@dataclass(frozen=True)
class Ambience:
    """How a field's colours follow its openness: reaches [R] in world units, and their weights [R].

    And its dominant light, where that is to go along.
    """

    reaches: tuple[float, ...]
    weights: tuple[float, ...]
    sun: Sun | None = None

    @property
    def shows(self) -> bool:
        """False where colours follow neither openness nor a light."""
        return self.sun is not None or sum(self.weights) > SHOWING

    @property
    def reach(self) -> float:
        """The largest distance, in world units, at which it makes a difference; 0 where it shows nowhere."""
        return max((r for r, w in zip(self.reaches, self.weights, strict=True) if w > 0.01), default=0.0)

    @property
    def falls(self) -> Array:
        """Directions [K,3] in which shadows fall that go along."""
        return np.zeros((0, 3)) if self.sun is None else -np.array([self.sun.direction])

    def log_light(self, distance: Distance, points: Array, normals: AnyArray) -> Array:
        """The log of how bright surface points [N,3] with normals [N,3] are, [N]."""
        log = np.zeros(len(points))
        if sum(self.weights) > SHOWING:
            log += self.log_openness(nearness(distance, points, normals, self.reaches))
        if self.sun is not None:
            log += self.sun.log_light(distance, points, normals)
        return log

    def log_openness(self, nearness: Array) -> Array:
        """log o [N], o at least DARKEST, of nearnesses [N,R]."""
        return np.asarray(np.log(np.maximum(1.0 - nearness @ np.array(self.weights), DARKEST)))


def distance_in(block: Block, solid: Mask) -> Distance:
    """The distance to what is solid [X,Y,Z] of a block; far outside of the block."""
    if not solid.any():
        return lambda points: np.full(len(points), FAR)
    values = ndimage.distance_transform_edt(~solid, sampling=block.spacing)
    return lambda points: block.lookup(values, points, outside=FAR)


def distance_in_field(field: VoxelField) -> Distance:
    """The distance to what is solid in all of a field, on a grid of at most FINEST vertices an axis."""
    stride = -(-max(field.resolution) // FINEST)
    solid = np.zeros(field.resolution, bool)
    solid.reshape(-1)[_solid_vertices(field)] = True
    solid = np.pad(solid, [(0, -n % stride) for n in field.resolution])
    nx, ny, nz = (n // stride for n in solid.shape)
    pooled = solid.reshape(nx, stride, ny, stride, nz, stride).any(axis=(1, 3, 5))
    values = np.full(pooled.shape, FAR)
    if pooled.any():
        values = ndimage.distance_transform_edt(~pooled, sampling=tuple(stride * field.voxel_size))

    def lookup(points: Array) -> NDArray[np.float64]:
        g = (field.grid_coordinates(points) - 0.5 * (stride - 1)) / stride
        return np.asarray(ndimage.map_coordinates(values, g.T, np.float64, order=1, cval=FAR))

    return lookup


def nearness(distance: Distance, points: Array, normals: AnyArray, reaches: Sequence[float]) -> Array:
    """max(0, 1 - D(p + r n) / r) [N,R] at points [N,3] with normals [N,3], for each reach r."""
    found = [distance(points + reach * normals) / reach for reach in reaches]
    return np.clip(1.0 - np.stack(found, axis=1), 0.0, 1.0)


def _solid_vertices(field: VoxelField) -> NDArray[np.int64]:
    return np.asarray(field.vertices[field.density * field.sample_spacing > SOLID])


def reaches_of(field: VoxelField) -> tuple[float, ...]:
    """The reaches r at which a field's colours are compared with its openness, world units.

    Shares of the diagonal of what is solid; none for a field of less than ENOUGH solid vertices.
    """
    solid = _solid_vertices(field)
    if len(solid) < ENOUGH:
        return ()
    at = np.stack(np.unravel_index(solid[:: max(1, len(solid) // 100_000)], field.resolution), axis=1)
    span = np.subtract(*np.percentile(at, [99, 1], axis=0)) * field.voxel_size
    return tuple(share * float(np.linalg.norm(span)) for share in REACHES)


def ambience_of(field: VoxelField, pairs: SeenPairs) -> Ambience:
    """The weights that explain the colours of a field's surfaces, as they are seen."""
    nothing = Ambience((), ())
    if len(pairs.points) < ENOUGH or _solid_vertices(field).size < ENOUGH:
        return nothing
    reaches = reaches_of(field)
    distance = distance_in_field(field)
    first = nearness(distance, pairs.points, pairs.normals, reaches)
    second = nearness(distance, pairs.other_points, pairs.other_normals, reaches)
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


def with_sun(
    ambience: Ambience, field: VoxelField, pairs: SeenPairs, direction: Sequence[float] | None
) -> Ambience:
    """The ambience and the dominant light that explains what openness does not, if one does.

    `direction` [3] is that to the light, None where it is to be found.
    """
    reaches = reaches_of(field)
    if len(pairs.points) < ENOUGH or not reaches:
        return ambience
    distance = distance_in_field(field)
    change = pairs.log_change
    if sum(ambience.weights) > SHOWING:
        near = nearness(distance, pairs.points, pairs.normals, reaches)
        other = nearness(distance, pairs.other_points, pairs.other_normals, reaches)
        change = change - (ambience.log_openness(other) - ambience.log_openness(near))
    both = pairs.points, pairs.normals, pairs.other_points, pairs.other_normals
    return replace(ambience, sun=sun_of(distance, both, change, reaches, direction))


@dataclass(frozen=True, eq=False)
class Lighting:
    """The light on some vertices (`where` [X,Y,Z]) of a block: the log of what it is multiplied by, [N]."""

    where: Mask
    log_ratio: Array

    def smoothed(self, block: Block) -> Lighting:
        """The same, smoothed along surfaces."""
        weight = np.zeros(block.shape)
        weight[self.where] = np.minimum(block.depth[self.where], 1.0) + 1e-3
        values = np.zeros(block.shape)
        values[self.where] = self.log_ratio * weight[self.where]
        total = ndimage.gaussian_filter(weight, SMOOTH)[self.where]
        smooth = ndimage.gaussian_filter(values, SMOOTH)[self.where] / np.maximum(total, 1e-9)
        return replace(self, log_ratio=smooth)

    def at(self, block: Block, points: Array) -> Array:
        """The log of the ratio [N] at points [N,3]: that of the vertices around, 0 where there are none."""
        total = block.lookup(self.where.astype(np.float32), points)
        return np.asarray(block.lookup(self.dense(block), points) / np.maximum(total, 1e-3))

    def on_grid(self, block: Block) -> NewLight:
        """The same, for splats. Not of contracted fields."""
        first = np.zeros(block.shape, bool)
        first[0, 0, 0] = True
        values = self.dense(block).astype(np.float32)
        return NewLight(
            block.positions(first)[0], np.array(block.spacing), values, self.where.astype(np.float32)
        )

    def dense(self, block: Block) -> Array:
        """The log of the ratio [X,Y,Z], 0 elsewhere."""
        out = np.zeros(block.shape)
        out[self.where] = self.log_ratio
        return out


def lit_vertices(block: Block) -> Mask:
    """Vertices [X,Y,Z] whose colour shows, also those beside a surface, and whose normal is known."""
    return np.asarray((block.slot >= 0) & ((block.normals**2).sum(axis=-1) > 0.25))
