"""Parts that are bent, twisted or pulled: their primitives become shapes seen through the inverse."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import SceneError
from cagefield.procedural.deformations import Deformation
from cagefield.procedural.parts import Part, Primitive, pose_matrix, transform_vectors
from cagefield.procedural.shapes import Shape
from cagefield.procedural.textures import Texture
from cagefield.typing import Array, Float32, Int


@dataclass(frozen=True, eq=False)
class _Placement:
    """Deformation of one instance: its pose [4,4] as modeled, the center [3] of the deformed frame."""

    deformation: Deformation
    pose: Array
    center: Array

    def local(self, points: Float32) -> Float32:
        """Points [3,N] of the deformed frame in the instance's own frame."""
        canonical = self.deformation.inverse(points + self.center[:, None].astype(np.float32))
        inverse = np.linalg.inv(self.pose)
        return transform_vectors(inverse[:3, :3], canonical) + inverse[:3, 3:].astype(np.float32)


@dataclass(frozen=True, eq=False)
class DeformedShape:
    """Shape seen through a deformation, in a frame that is not turned; `distance` is a lower bound."""

    shape: Shape
    placement: _Placement
    extent: tuple[float, float, float]

    def distance(self, points: Float32) -> Float32:
        """Lower bound [N] of the distance at points [3,N]."""
        scale = np.linalg.svd(self.placement.pose[:3, :3], compute_uv=False)[-1]
        canonical = self.shape.distance(self.placement.local(points)) * np.float32(scale)
        world = points + self.placement.center[:, None].astype(np.float32)
        return self.placement.deformation.bound_distance(world, canonical)


@dataclass(frozen=True, eq=False)
class _DeformedTexture:
    """Texture of one instance, which keeps its place on the surface."""

    texture: Texture
    placement: _Placement
    instance: int

    def __call__(self, points: Float32, instance: Int) -> Float32:
        local = self.placement.local(np.ascontiguousarray(points.T))
        return self.texture(np.ascontiguousarray(local.T), np.full(len(points), self.instance))


def deform_part(part: Part, deformation: Deformation) -> Part:
    """Part that is deformed in world space; its light is that of the modeled part, where it is carried along.

    Raises:
        SceneError: a part that was moved or deformed before, that has a mirror, or that reaches past a bend's
            center.
    """
    if part.deformation is not None or not np.array_equal(part.motion, np.eye(4)):
        raise SceneError(
            f"part {part.name} was moved or deformed before; deform it first, once, and move it then"
        )
    if any(primitive.mirror for primitive in part.primitives):
        raise SceneError(f"part {part.name} has a mirror, which must stay flat; deform a part without one")
    primitives = tuple(item for primitive in part.primitives for item in _deformed(primitive, deformation))
    return replace(part, primitives=primitives, deformation=deformation)


def _deformed(primitive: Primitive, deformation: Deformation) -> Iterator[Primitive]:
    """Primitives of one instance each."""
    signs = np.stack(np.meshgrid(*[(-1.0, 1.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
    local: NDArray[np.float64] = signs * np.array(primitive.shape.extent)
    for instance, pose in enumerate(primitive.poses):
        low, high = deformation.image_bounds(local @ pose[:3, :3].T + pose[:3, 3])
        x, y, z = (high - low) / 2
        placement = _Placement(deformation, pose, (low + high) / 2)
        yield replace(
            primitive,
            shape=DeformedShape(primitive.shape, placement, (float(x), float(y), float(z))),
            texture=_DeformedTexture(primitive.texture, placement, instance),
            poses=pose_matrix(placement.center)[None],
        )
