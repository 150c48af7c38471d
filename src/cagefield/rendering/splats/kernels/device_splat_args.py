"""Arguments of the kernels that draw splats on Quadrants' devices: splats, a camera, a projection."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from dataclasses import dataclass

from cagefield.compute.quadrants import qd
from cagefield.rendering.voxels.kernels.grid import F32, I32, vec3

vec2 = qd.types.vector(2, qd.f32)
vec4 = qd.types.vector(4, qd.f32)
vec6 = qd.types.vector(6, qd.f32)
ivec2 = qd.types.vector(2, qd.i32)
mat3 = qd.types.matrix(3, 3, qd.f32)


@dataclass(frozen=True, eq=False)
class SplatArgs:
    """N = `count` splats as kernels take them, flattened; see `DeformedSplats`.

    `rotations` is read where `turned` is 1, `normals` [N,3] where `with_normals` is 1.
    """

    means: F32
    covariances: F32
    opacities: F32
    sh: F32
    rotations: F32
    normals: F32
    count: qd.i32
    antialiased: qd.i32
    turned: qd.i32
    with_normals: qd.i32


@dataclass(frozen=True, eq=False)
class CameraArgs:
    """As `splat_args.CameraArgs`, without the lens's model.

    W is the world-to-camera rotation. The camera is at origin + origin_rest, for float32 to hold it.
    """

    W: mat3
    origin: vec3
    origin_rest: vec3
    focal: vec2
    center: vec2
    size: ivec2
    limits: vec4
    coefficients: vec6
    radius_limit: qd.f32
    near: qd.f32


@dataclass(frozen=True, eq=False)
class ProjectionArgs:
    """Output of a projection, flattened; see `splat_args.ProjectedSplats`."""

    packed: F32
    keys: F32
    tiles: I32
