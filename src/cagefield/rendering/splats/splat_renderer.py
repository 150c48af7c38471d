"""SplatRenderer: pictures of a SplatField seen through its edits, by the rasterizer."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.compute import devices
from cagefield.edits import EditMap, EditStack
from cagefield.errors import CagefieldError
from cagefield.fields.splat_field import SplatField
from cagefield.images.render_result import Background, RenderResult
from cagefield.rendering.splats.raster_splats import DeformedSplats, deformed_splats
from cagefield.rendering.splats.rasterizer import (
    DEPTH,
    NORMALS,
    Buffers,
    Projection,
    Region,
    near_depth,
    project,
)
from cagefield.rendering.splats.splat_lod import MIN_CLUSTERED_SPLATS, Clusters
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.rendering.splats.split_views import SplitViews, split_views
from cagefield.rendering.splats.splitting import split_of
from cagefield.typing import Float32

if TYPE_CHECKING:
    from cagefield.rendering.splats.device_rasterizer import DeviceProjection, SplatArrays
    from cagefield.rendering.splats.discs import DiscProjection


MOVING_DETAIL = 1.0
"""Pixels within which splats are drawn as one while something moves (benchmarks/results/splat_speed.md)."""

MIN_MERGED_SPLATS = 500_000
"""Fewer splats that edits change are drawn one by one: merging them anew takes longer than it saves."""


class SplatRenderer:
    """Renders one SplatField under one edit stack, with the same methods as `VoxelRenderer`.

    Renderers of one SplatSet share its cached results.

    On a GPU the splats stay there between frames; see `device_rasterizer`.

    The splats are deformed once, when the renderer is made; frames cost the same with edits and without.
    Pictures are within 50 dB and better of `reference_rasterizer`. A fisheye lens shows directions less than
    87 degrees off its axis.
    """

    step = 1.0
    """Sampling distance of voxel renderers; without effect for splats."""

    def __init__(
        self,
        field: SplatField | SplatSet,
        edits: EditMap | None = None,
        *,
        preserve_opacity: bool = True,
    ) -> None:
        """Raises EditError where an edit cannot be evaluated."""
        self._set = SplatSet.from_field(field)
        self.field = self._set.field
        self.edits: EditMap = edits if edits is not None else EditStack([])
        self.preserve_opacity = preserve_opacity
        self._deform()
        self._buffers = Buffers()
        self._normals: Float32 | None = None
        self._arrays: SplatArrays | None = None

    def with_edits(
        self,
        edits: EditMap,
        *,
        preserve_opacity: bool | None = None,
        coarse: bool = False,
        proceed: Callable[[], None] | None = None,
    ) -> SplatRenderer:
        """A renderer of the same field under other edits.

        `coarse` integrates flow shells with long steps and splits no splats: ready sooner, slightly off.
        `proceed` is called now and then, and gives the renderer up by raising.
        """
        other = object.__new__(SplatRenderer)
        other.__dict__.update(self.__dict__)
        other.edits = edits
        if preserve_opacity is not None:
            other.preserve_opacity = preserve_opacity
        other._deform(coarse, proceed)
        other._normals = other._arrays = None
        return other

    def _deform(self, coarse: bool = False, proceed: Callable[[], None] | None = None) -> None:
        """Deforms the splats: `splats` with all children, `_split_views` for those that views choose from."""
        split = None if coarse else split_of(self._set, self.edits, proceed=proceed)
        self.splats: DeformedSplats
        self._split_views: SplitViews | None = None
        if split is None or devices.is_gpu() or self.field.discs:
            self.splats = deformed_splats(
                self._set,
                self.edits,
                preserve_opacity=self.preserve_opacity,
                coarse=coarse,
                split=split,
                proceed=proceed,
            )
            return
        self._split_views = split_views(
            self._set, self.edits, split, preserve_opacity=self.preserve_opacity, proceed=proceed
        )
        self.splats = self._split_views.split()

    def render(
        self,
        camera: Camera,
        *,
        background: Background = "white",
        normals: bool = False,
        near: float = 0.0,
        region: Region | None = None,
        proceed: Callable[[], None] | None = None,
        step: float | None = None,
    ) -> RenderResult:
        """Image of the splats seen by `camera`; `proceed`, called around the projection, cancels
        by raising.

        `region` (x, y, width, height) in pixels is the part of the camera's picture that is rendered; nothing
        nearer than `near` is drawn; where a `step` is given, as while something moves, groups of splats
        within MOVING_DETAIL pixels are drawn as one.
        """
        if region is not None:
            x, y, width, height = region
            inside = x + width <= camera.width and y + height <= camera.height
            if min(x, y) < 0 or min(width, height) < 1 or not inside:
                raise CagefieldError(
                    f"region {region} (x, y, width, height) is not inside the picture of"
                    f" {camera.width}x{camera.height} pixels; make it smaller"
                )
        if proceed is not None:
            proceed()
        with self._buffers.lock:
            is_merged = not self.edits.steps or len(self.splats) >= MIN_MERGED_SPLATS
            detail = MOVING_DETAIL if step is not None and is_merged else 0.0
            seen = self.project(camera, near=near, region=region, normals=normals, detail=detail)
            if proceed is not None:
                proceed()
            if not normals and self._arrays is not None:
                return self._device_frame(seen, self._arrays, background)
            picture = seen.picture(NORMALS if normals else DEPTH)
        return _frame(picture, background, normals)

    @staticmethod
    def _device_frame(seen: Any, arrays: SplatArrays, background: Background) -> RenderResult:
        """Image of a DeviceProjection, on the device."""
        from cagefield.rendering.device_image import DeviceRenderResult

        return DeviceRenderResult.of_sums(seen.sums(arrays.sum_buffers), background)

    def project(
        self,
        camera: Camera,
        *,
        near: float = 0.0,
        region: Region | None = None,
        normals: bool = False,
        detail: float = 0.0,
    ) -> Projection | DeviceProjection | DiscProjection:
        """The splats as the camera sees them; valid until this renderer projects again.

        `detail` as `rasterizer.project`, on CPUs alone. Discs are projected there in any case.
        """
        least = MIN_MERGED_SPLATS if self.edits.steps else MIN_CLUSTERED_SPLATS
        views = None if len(self.splats) >= least else self._split_views
        splats = self.splats if views is None else views.splats
        if normals and self._normals is None:
            self._normals = flattest_axes(splats.covariances)
        near = max(near, near_depth(self.field.bounds))
        if self.splats.tangents is not None:
            from cagefield.rendering.splats.discs import project_discs

            return project_discs(
                self.splats,
                camera,
                near=near,
                region=region,
                normals=self._normals if normals else None,
                buffers=self._buffers,
            )
        if devices.is_gpu():
            from cagefield.rendering.splats import device_rasterizer

            if self._arrays is None or (normals and not self._arrays.has_normals):
                self._arrays = device_rasterizer.SplatArrays(self.splats, self._normals)
            return device_rasterizer.project(self._arrays, camera, near=near, region=region)
        return project(
            splats,
            camera,
            near=near,
            region=region,
            normals=self._normals if normals else None,
            buffers=self._buffers,
            clusters=self._clusters() if len(self.splats) >= least else None,
            detail=0.0 if normals else detail,
            choose=None if views is None else views.chosen,
        )

    def _clusters(self) -> Clusters:
        """The splats' clusters; those of edited splats lie in the order of the field's own."""
        own = DeformedSplats.of_field(self.field)
        return Clusters.build(self.splats, None if own is self.splats else Clusters.build(own))

    def opacity_before(self, camera: Camera, pixels: NDArray[Any], distances: NDArray[Any]) -> Float32:
        """Opacity [K] gathered before distances [K] along the rays of pixel positions [K,2] of a camera.

        Raises CagefieldError for positions outside the picture.
        """
        pixels = np.asarray(pixels, np.float64)
        if len(pixels) and not ((pixels >= 0) & (pixels < (camera.width, camera.height))).all():
            raise CagefieldError(f"pixels must lie inside the picture of {camera.width}x{camera.height}")
        with self._buffers.lock:
            return self.project(camera).opacity_before(pixels, np.asarray(distances))


def flattest_axes(covariances: Float32) -> Float32:
    """Unit axes [N,3] of the least variance of covariances [N,6]: the normals of flat splats."""
    full = covariances[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3).astype(np.float64)
    return np.ascontiguousarray(np.linalg.eigh(full)[1][:, :, 0], np.float32)


def _frame(picture: Float32, background: Background, with_normals: bool) -> RenderResult:
    opacity = 1.0 - picture[..., 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.where(opacity > 1e-6, picture[..., 4] / opacity, np.inf)
    normals = None
    if with_normals:
        normals = picture[..., 5:8]
        length = np.linalg.norm(normals, axis=-1, keepdims=True)
        normals = np.where(length > 1e-6, normals / np.maximum(length, 1e-6), 0.0)
    return RenderResult.from_premultiplied(
        picture[..., 1:4], opacity, depth.astype(np.float32), normals=normals, background=background
    )
