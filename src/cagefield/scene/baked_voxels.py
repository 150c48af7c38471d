"""Voxels of a scene's original field, in the region that its cameras see."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from cagefield.cameras.camera import Camera
from cagefield.errors import SceneError
from cagefield.fields.external.external_field import ExternalField
from cagefield.fields.frusta import in_frusta
from cagefield.fields.nerf_field import NerfField
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField


def bake_original(
    original: NerfField | ExternalField | SplatField,
    cameras: Mapping[str, tuple[Camera, ...]],
    resolution: int,
    sh_degree: int,
    unbounded: bool,
    on_progress: Callable[[float], None] | None,
) -> VoxelField:
    """The voxels of a field, `resolution` along its longest edge; see `Scene.baked`."""
    if not isinstance(original, NerfField | ExternalField | SplatField):
        raise SceneError(
            "the original must be a NerfField, an ExternalField or a SplatField, got "
            f"{type(original).__name__}; of another field make Scene(bake(field))"
        )
    from cagefield.fields.baking import bake

    if isinstance(original, SplatField) and any(original.offset):
        warnings.warn(
            f"voxels keep no offset: {list(original.offset)} is to be added to their coordinates",
            stacklevel=3,
        )
    every = [camera for group in cameras.values() for camera in group]
    near = 0.0 if isinstance(original, SplatField) or getattr(original, "ndc", None) else original.near
    return bake(
        original,
        resolution,
        sh_degree=sh_degree,
        eyes=np.array([camera.origin for camera in every]) if every else None,
        contracted=unbounded,
        visible=partial(in_frusta, every, near=near) if unbounded and every else None,
        on_progress=on_progress,
    )
