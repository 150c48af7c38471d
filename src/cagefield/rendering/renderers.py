"""The renderer that goes with a field."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cagefield.edits import EditMap
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField

if TYPE_CHECKING:
    from cagefield.rendering.splats.splat_renderer import SplatRenderer
    from cagefield.rendering.voxels.voxel_renderer import Renderer

    AnyRenderer = Renderer | SplatRenderer


def renderer_of(
    field: VoxelField | SplatField, edits: EditMap | None = None, *, preserve_opacity: bool = True
) -> AnyRenderer:
    """The renderer of the field's kind under the edits: the march through voxels, the rasteriser of splats.

    Raises EditError where an edit cannot be evaluated, DeviceError where no device starts.
    """
    if isinstance(field, SplatField):
        from cagefield.rendering.splats.splat_renderer import SplatRenderer

        return SplatRenderer(field, edits, preserve_opacity=preserve_opacity)
    from cagefield.rendering.voxels.voxel_renderer import Renderer

    return Renderer(field, edits, preserve_opacity=preserve_opacity)
