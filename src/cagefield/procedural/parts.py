"""Primitives and parts: textured shapes, their placement, and their motion.

A part is a list of primitives; a primitive is a shape with a texture, placed once or many times. `motion`
[4,4] takes a part from its place as modeled (and deformed, where it has a deformation) to its present place;
texture and occlusion travel with it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from cagefield.procedural.deformations import Deformation
from cagefield.procedural.shapes import Shape
from cagefield.procedural.textures import Texture
from cagefield.typing import Array, Float32, Int


def affine_matrix(
    at: ArrayLike = (0, 0, 0),
    rotate: ArrayLike = (0, 0, 0),
    scale: ArrayLike = 1.0,
    pivot: ArrayLike = (0, 0, 0),
) -> Array:
    """Matrix [4,4] of p -> pivot + at + R S (p - pivot), R from intrinsic XYZ angles in radians."""
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_euler("XYZ", rotate).as_matrix() * np.broadcast_to(scale, (3,))
    center = np.asarray(pivot, np.float64)
    matrix[:3, 3] = center + np.asarray(at, np.float64) - matrix[:3, :3] @ center
    return matrix


def pose_matrix(
    at: ArrayLike = (0, 0, 0), rotate_deg: ArrayLike = (0, 0, 0), scale: ArrayLike = 1.0
) -> Array:
    """Matrix [4,4] that places a primitive's frame at a point, rotated (degrees) and scaled."""
    return affine_matrix(at, np.radians(rotate_deg), scale)


@dataclass(frozen=True)
class Primitive:
    """Textured shape, placed by poses [K,4,4] (from its own frame to the scene as modeled).

    gloss: strength and exponent of the highlight; keep the exponent low, since the color in spherical
    harmonics is smooth. luminous: factor of the texture for a surface that emits it independently of the
    light; 0 for a lit surface. mirror: reflectance of the top face (+z of its own frame) at right angles,
    higher at a slant; 0 for none.
    """

    shape: Shape
    texture: Texture
    poses: Array = field(default_factory=lambda: np.eye(4)[None])
    gloss: tuple[float, float] = (0.08, 12.0)
    luminous: float = 0.0
    mirror: float = 0.0

    def __post_init__(self) -> None:
        poses = np.array(self.poses, np.float64).reshape(-1, 4, 4)
        poses.flags.writeable = False
        object.__setattr__(self, "poses", poses)


@dataclass(frozen=True)
class Part:
    """Primitives that move together; those of a part with a `deformation` are in their deformed shapes."""

    name: str
    primitives: tuple[Primitive, ...]
    motion: Array = field(default_factory=lambda: np.eye(4))
    deformation: Deformation | None = None

    def __post_init__(self) -> None:
        motion = np.array(self.motion, np.float64)
        motion.flags.writeable = False
        object.__setattr__(self, "motion", motion)

    @cached_property
    def bounds(self) -> Array:
        """Box [2,3] that holds the part in its present place; exact up to the boxes of its primitives."""
        lows, highs = [], []
        for primitive in self.primitives:
            poses = self.motion @ primitive.poses
            reach = np.abs(poses[:, :3, :3]) @ np.array(primitive.shape.extent)
            lows.append((poses[:, :3, 3] - reach).min(0))
            highs.append((poses[:, :3, 3] + reach).max(0))
        return np.stack([np.min(lows, 0), np.max(highs, 0)])

    def with_baked_motion(self) -> Part:
        """Part as if modeled in its present place: its motion is in its primitives' poses."""
        primitives = tuple(replace(item, poses=self.motion @ item.poses) for item in self.primitives)
        return replace(self, primitives=primitives, motion=np.eye(4), deformation=None)


@dataclass(frozen=True)
class PlacedPrimitive:
    """Primitive in its present place, in float32: world = linear [K,3,3] @ local + shift [K,3].

    extent [3] local half size; radii [K] of the balls about shift that hold the instances; scale [K] the mean
    magnification; stretched: some instance is scaled differently along different axes.
    """

    part: Part
    primitive: Primitive
    linear: Float32
    inverse: Float32
    shift: Float32
    extent: Float32
    radii: Float32
    scale: Float32
    stretched: bool

    @classmethod
    def build(cls, part: Part, primitive: Primitive) -> PlacedPrimitive:
        poses = part.motion @ primitive.poses
        linear, shift = poses[:, :3, :3], poses[:, :3, 3]
        extent = np.array(primitive.shape.extent)
        corners = np.stack(np.meshgrid(*[(-1, 1)] * 3, indexing="ij"), -1).reshape(-1, 3) * extent
        radii = np.linalg.norm(corners @ linear.transpose(0, 2, 1), axis=-1).max(-1)
        factors = np.linalg.svd(linear, compute_uv=False)
        f32 = np.float32
        return cls(
            part=part,
            primitive=primitive,
            linear=linear.astype(f32),
            inverse=np.linalg.inv(linear).astype(f32),
            shift=shift.astype(f32),
            extent=extent.astype(f32),
            radii=radii.astype(f32),
            scale=(np.abs(np.linalg.det(linear)) ** (1 / 3)).astype(f32),
            stretched=bool((factors[:, 0] > factors[:, -1] * (1 + 1e-5)).any()),
        )

    def local(self, points: Float32, instance: Int) -> Float32:
        """World points [3,N] in the frame of their instance [N]."""
        if len(self.shift) == 1:
            return transform_vectors(self.inverse[0], points - self.shift[0][:, None])
        return self.local_vectors(points - self.shift.T[:, instance], instance)

    def local_vectors(self, vectors: Float32, instance: Int) -> Float32:
        """World vectors [3,N] in the frame of their instance [N]."""
        if len(self.shift) == 1:
            return transform_vectors(self.inverse[0], vectors)
        return _products(self.inverse, instance, vectors)

    def distance(self, points: Float32, instance: Int) -> Float32:
        """Distance [N] of world points [3,N] to their instance [N]; to first order where stretched.

        For stretched primitives it is the local distance over the length of its gradient in the world, exact
        along the axes of a stretched ball and near every surface; but no less than the distance to the ball
        around the instance.
        """
        local = self.local(points, instance)
        distance = self.primitive.shape.distance(local)
        if not self.stretched:
            return distance * self.scale[instance]
        slope = self.world_gradient(self.local_gradient(local, instance), instance)
        distance = distance / np.maximum(np.linalg.norm(slope, axis=0), np.float32(1e-6))
        ball_distance = np.linalg.norm(points - self.shift.T[:, instance], axis=0) - self.radii[instance]
        return np.asarray(np.maximum(distance, ball_distance), np.float32)

    def local_gradient(self, local: Float32, instance: Int) -> Float32:
        """Gradient [3,N] of the distance in the local frame, by differences over a tetrahedron."""
        step = (np.float32(4e-4) / self.scale)[instance]
        gradient = np.zeros_like(local)
        for corner in ((1, -1, -1), (-1, -1, 1), (-1, 1, -1), (1, 1, 1)):
            direction = np.array(corner, np.float32)[:, None]
            gradient += direction * self.primitive.shape.distance(local + step * direction)
        return gradient / (4 * step)

    def world_gradient(self, gradient: Float32, instance: Int) -> Float32:
        """World gradients [3,N] of gradients taken in the local frame: A^-T g."""
        if len(self.shift) == 1:
            return transform_vectors(self.inverse[0].T, gradient)
        return _products(self.inverse.transpose(0, 2, 1), instance, gradient)


def transform_vectors(matrix: NDArray[Any], vectors: Float32) -> Float32:
    """Product matrix [3,3] @ vectors [3,N] in float32.

    Computed without `@`: BLAS starts threads for it, which takes twenty times longer on a machine with other
    work.
    """
    product: Float32 = np.einsum("ij,jn->in", matrix.astype(np.float32), vectors)
    return product


def _products(matrices: Float32, instance: Int, vectors: Float32) -> Float32:
    """Products matrices[instance] @ vectors [3,N]."""
    out = np.empty_like(vectors)
    for row in range(3):
        out[row] = sum(matrices[:, row, column][instance] * vectors[column] for column in range(3))
    return out
