"""Colors and normals of points on the surface of a procedural scene, and the scene as a radiance field."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.procedural.parts import PlacedPrimitive, transform_vectors
from cagefield.procedural.shading import Light, shade
from cagefield.typing import Float32, Int

Openness = Callable[[Float32, Float32], Float32]

SHELL_START_EPS = 2.0
"""Depth in units of eps at which a field's shell starts: less, and outlines grow; more, and faces sink in."""

SHELL_EXTENT_EPS = 6.0
"""Distance in units of eps past which a field's sigma is negligible: sigmoid(-6 - SHELL_START_EPS) = 3e-4."""


def _unit(vectors: Float32) -> Float32:
    length = np.sqrt((vectors**2).sum(0))
    return vectors / np.maximum(length, np.float32(1e-12))


def shade_surface(
    item: PlacedPrimitive,
    points: Float32,
    instance: Int,
    viewdirs: Float32,
    *,
    openness: Openness,
    relit: bool,
    light: Light = shade,
) -> tuple[Float32, Float32]:
    """(rgb [N,3], unit world normals [N,3]) of points [3,N] on the surface of one placed primitive.

    viewdirs [3,N]; openness maps modeled points and normals [3,N] to occlusion.
    """
    local = item.local(points, instance)
    normals = _unit(item.world_gradient(item.local_gradient(local, instance), instance))
    motion = item.part.motion
    modeled_points, modeled_normals, modeled_dirs = points, normals, viewdirs
    if not np.array_equal(motion, np.eye(4)):
        inverse = np.linalg.inv(motion)
        modeled_points = transform_vectors(inverse[:3, :3], points) + inverse[:3, 3:].astype(np.float32)
        modeled_normals = _unit(transform_vectors(motion[:3, :3].T, normals))
        modeled_dirs = _unit(transform_vectors(inverse[:3, :3], viewdirs))
    if item.part.deformation is not None:
        jacobian = item.part.deformation.inverse_jacobian(modeled_points)
        modeled_dirs = _unit(np.einsum("ijn,jn->in", jacobian, modeled_dirs))
        to_modeled = np.linalg.inv(np.moveaxis(jacobian, 2, 0))
        modeled_normals = _unit(np.einsum("nji,jn->in", to_modeled, modeled_normals))
        modeled_points = item.part.deformation.inverse(modeled_points)
    albedo = item.primitive.texture(local.T, instance)
    if item.primitive.luminous:
        return albedo * np.float32(item.primitive.luminous), normals.T
    rgb = light(
        albedo,
        modeled_points,
        normals if relit else modeled_normals,
        viewdirs if relit else modeled_dirs,
        occlusion=openness(modeled_points, modeled_normals),
        gloss=item.primitive.gloss,
    )
    return rgb, normals.T


@dataclass(frozen=True)
class SurfaceField:
    """Radiance field of solid surfaces: sigma = sigmoid(-distance / eps - SHELL_START_EPS) / (eps ln 2).

    The optical depth from open space is 1 at SHELL_START_EPS * eps below a flat surface. Distances are
    Euclidean for parts that were scaled uniformly, accurate to first order for the others.
    """

    placed: tuple[PlacedPrimitive, ...]
    openness: Openness
    relit: bool
    eps: float
    bounds: NDArray[np.float64]
    light: Light = shade

    def __call__(self, positions: NDArray[Any], viewdirs: NDArray[Any]) -> tuple[Float32, Float32]:
        """(sigma [N], rgb [N,3]); rgb is 0 further than SHELL_EXTENT_EPS * eps from all surfaces."""
        points = np.ascontiguousarray(positions, np.float32)
        distance, owner, instance = self.distance(points)
        with np.errstate(over="ignore"):
            sigma = (
                1
                / (1 + np.exp(distance / np.float32(self.eps) + SHELL_START_EPS))
                / np.float32(self.eps * np.log(2))
            )
        rgb = np.zeros((len(points), 3), np.float32)
        for index in np.unique(owner[owner >= 0]):
            rows = np.flatnonzero(owner == index)
            rgb[rows], _ = shade_surface(
                self.placed[index],
                np.ascontiguousarray(points[rows].T),
                instance[rows],
                np.ascontiguousarray(viewdirs[rows].T, np.float32),
                openness=self.openness,
                relit=self.relit,
                light=self.light,
            )
        return sigma, rgb

    def distance(self, points: Float32) -> tuple[Float32, Int, Int]:
        """(signed distance [N], nearest primitive, its instance); inf and -1 beyond SHELL_EXTENT_EPS *
        eps.
        """
        reach = np.float32(SHELL_EXTENT_EPS * self.eps)
        distance = np.full(len(points), np.inf, np.float32)
        owner, which = np.full(len(points), -1, np.intp), np.zeros(len(points), np.intp)
        part_rows: dict[str, Int] = {}
        for index, item in enumerate(self.placed):
            if item.part.name not in part_rows:
                low, high = item.part.bounds[0] - reach, item.part.bounds[1] + reach
                part_rows[item.part.name] = np.flatnonzero(((points > low) & (points < high)).all(1))
            rows, instance = _candidates(item, points, part_rows[item.part.name], reach)
            gap = item.distance(np.ascontiguousarray(points[rows].T), instance)
            is_near = gap < reach
            rows, instance, gap = rows[is_near], instance[is_near], gap[is_near]
            before = distance[rows]
            np.minimum.at(distance, rows, gap)
            is_nearest = (distance[rows] == gap) & (gap < before)
            owner[rows[is_nearest]], which[rows[is_nearest]] = index, instance[is_nearest]
        return distance, owner, which


def _candidates(item: PlacedPrimitive, points: Float32, rows: Int, reach: np.float32) -> tuple[Int, Int]:
    """(rows of points, instances) whose ball, grown by reach, holds the point."""
    kept_rows, kept_instances = [], []
    for instance, (center, radius) in enumerate(zip(item.shift, item.radii, strict=True)):
        offset = points[rows] - center
        inside = np.flatnonzero(np.einsum("ni,ni->n", offset, offset) < (radius + reach) ** 2)
        kept_rows.append(rows[inside])
        kept_instances.append(np.full(len(inside), instance, np.intp))
    return np.concatenate(kept_rows), np.concatenate(kept_instances)
