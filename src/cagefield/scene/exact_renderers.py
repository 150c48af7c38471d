"""Renderers that evaluate every edit in float64, without a lattice."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, cast

from cagefield.cameras.camera import Camera
from cagefield.edits import PreparedStack
from cagefield.fields.external.external_field import ExternalField
from cagefield.fields.nerf_field import NerfField
from cagefield.fields.protocol import Field
from cagefield.fields.voxel_field import VoxelField
from cagefield.rendering.reference_renderer import ReferenceRenderer

if TYPE_CHECKING:
    from cagefield.rendering.renderers import Renderer

SAMPLES_PER_VOXEL = 2.0
"""Samples of a ray along a voxel's smallest edge."""

SAMPLE_RANGE = (64, 4096)
"""Minimum and maximum number of samples of a ray."""

CONTRACTED_RADII = 8.0
"""Distance up to which an unbounded field is sampled, in radii of its box of interest."""


def sampled_renderer(
    field: VoxelField, edits: PreparedStack, preserve_opacity: bool, camera: Camera
) -> Renderer:
    """Sampled renderer of voxels, with samples for the distances that a camera sees."""
    near, far = _sampling_range(field, camera)
    samples = math.ceil(SAMPLES_PER_VOXEL * (far - near) / float(min(field.voxel_size)))
    return ReferenceRenderer(
        # An unbounded field is sampled beyond its bounds: without them, up to `far`.
        cast(Field, field.__call__) if field.contracted else field,
        edits,
        preserve_opacity,
        samples=min(SAMPLE_RANGE[1], max(SAMPLE_RANGE[0], samples)),
        near=near,
        far=far,
    )


def original_renderer(
    original: NerfField | ExternalField, edits: PreparedStack, preserve_opacity: bool
) -> Renderer:
    """Renderer of the field that a scene's voxels were baked from, by its own sampling."""
    if isinstance(original, ExternalField):
        from cagefield.rendering.external.external_renderer import ExternalRenderer

        return ExternalRenderer(original, edits, preserve_opacity)
    from cagefield.rendering.nerf.nerf_renderer import NerfRenderer

    return NerfRenderer(original, edits, preserve_opacity)


def _sampling_range(voxels: VoxelField, camera: Camera) -> tuple[float, float]:
    """Near and far distance from the camera that hold the field's box; 8 times that if unbounded."""
    lower, upper = voxels.bounds
    radius = 0.5 * float(((upper - lower) ** 2).sum()) ** 0.5
    distance = float(((0.5 * (lower + upper) - camera.origin) ** 2).sum()) ** 0.5
    reach = CONTRACTED_RADII if voxels.contracted else 1.0
    return max(0.0, distance - reach * radius), distance + reach * radius
