"""Renderer protocols, and the interactive renderer of a field's kind."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from cagefield.cameras.camera import Camera
from cagefield.edits import EditMap
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.images.render_result import Background, RenderResult
from cagefield.rendering.splats.splat_provenance import SplatSet


class Renderer(Protocol):
    """Renderer of one field under one edit stack: of voxels, splats, the original NeRF, or the reference."""

    def render(
        self, camera: Camera, *, background: Background = "white", normals: bool = False
    ) -> RenderResult:
        """Image of the field seen by `camera`."""


class InteractiveRenderer(Renderer, Protocol):
    """Renderer for an editor, a `VoxelRenderer` or a `SplatRenderer`: image regions, and cancellation."""

    @property
    def edits(self) -> EditMap:
        """The edits that images show."""

    @property
    def step(self) -> float:
        """Distance in voxels between samples on a ray; 1 of splats, which have none."""

    def with_edits(
        self,
        edits: EditMap,
        *,
        preserve_opacity: bool | None = None,
        coarse: bool = False,
        proceed: Callable[[], None] | None = None,
    ) -> InteractiveRenderer:
        """Renderer of the same field under other edits; shared results are reused.

        `coarse` makes it ready sooner. `proceed` is called now and then, and cancels by raising.
        """

    def render(
        self,
        camera: Camera,
        *,
        background: Background = "white",
        normals: bool = False,
        near: float = 0.0,
        region: tuple[int, int, int, int] | None = None,
        proceed: Callable[[], None] | None = None,
        step: float | None = None,
    ) -> RenderResult:
        """Image, or its `region` (x, y, width, height) in pixels, of the field farther than `near`.

        `proceed` is called now and then, and cancels by raising; `step` trades quality for speed.
        """


def renderer_of(
    field: VoxelField | SplatField | SplatSet,
    edits: EditMap | None = None,
    *,
    preserve_opacity: bool = True,
) -> InteractiveRenderer:
    """The renderer of the field's kind under the edits: the march through voxels, the rasterizer of splats.

    Raises EditError where an edit cannot be evaluated, DeviceError where no device starts.
    """
    if isinstance(field, SplatField | SplatSet):
        from cagefield.rendering.splats.splat_renderer import SplatRenderer

        return SplatRenderer(field, edits, preserve_opacity=preserve_opacity)
    from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer

    return VoxelRenderer(field, edits, preserve_opacity=preserve_opacity)
