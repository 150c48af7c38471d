"""Arguments of the training kernels on Quadrants' devices; arrays are flattened."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from dataclasses import dataclass

from cagefield.compute.quadrants import qd
from cagefield.rendering.splats.kernels.projection import AREA
from cagefield.rendering.voxels.kernels.grid import F32, I32, U8, vec3

vec2 = qd.types.vector(2, qd.f32)
vec5 = qd.types.vector(5, qd.f32)


@dataclass(frozen=True, eq=False)
class ParameterArgs:
    """Parameters of N splats, as `SplatState`."""

    means: F32
    log_scales: F32
    quaternions: F32
    logits: F32
    sh: F32


@dataclass(frozen=True, eq=False)
class AverageArgs:
    """Running means of each splat, as `gauss_newton_splats.AverageArgs`, and error [N] and hits [N]."""

    momentum: F32
    running: F32
    ticks: I32
    error: F32
    hits: I32


@dataclass(frozen=True, eq=False)
class StepArgs:
    """Rule of a Gauss-Newton step, as `gauss_newton_splats.StepArgs`; `log_range` [2] of the log scales."""

    memory: vec2
    rates: vec5
    damping: vec2
    caps: vec2
    log_range: vec2
    terms: qd.i32
    pull: qd.f32


@dataclass(frozen=True, eq=False)
class PhotoArgs:
    """Photo in tiles and the conditions under which an image is compared with it.

    target [tiles,`channels`,AREA] uint8, of straight alpha where it has 4 channels; weights [tiles,AREA];
    gain and background [3]; width and height in pixels.
    """

    target: U8
    weights: F32
    gain: vec3
    background: vec3
    width: qd.i32
    height: qd.i32
    channels: qd.i32


@dataclass(frozen=True, eq=False)
class PairArgs:
    """Pairs of an image's `tiles` with splats, as `device_rasterizer.DeviceProjection`."""

    packed: F32
    ids: I32
    starts: I32
    tiles: qd.i32


@qd.func
def photo_value(photo: PhotoArgs, tile: qd.i32, channel: qd.i32, pixel: qd.i32):
    """Channel of a photo's pixel over the background, in [0,1]."""
    at = tile * photo.channels
    value = qd.cast(photo.target[(at + channel) * AREA + pixel], qd.f32) / 255.0
    if photo.channels == 4:
        share = qd.cast(photo.target[(at + 3) * AREA + pixel], qd.f32) / 255.0
        value = value * share + photo.background[channel] * (1.0 - share)
    return value
