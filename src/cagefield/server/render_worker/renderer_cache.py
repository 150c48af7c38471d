"""A scene and its renderers, kept ready between pictures. Lives in the rendering process."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cagefield.cameras.camera import Camera
from cagefield.completion.inpainting.support_inpainting import load_solvers
from cagefield.compute.kernel_cache import numba_kernel_folder
from cagefield.edits import Continuous, Copy, Edit, EditStack, Move
from cagefield.errors import EditError
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.images.render_result import RenderResult
from cagefield.rendering.renderers import renderer_of
from cagefield.scene.scene import Scene
from cagefield.server.render_worker import encoding
from cagefield.server.render_worker.cancellation import GivenUpError, Stop, cancellation_check
from cagefield.server.render_worker.edited_renderers import EditedRenderers, RefinedRenderer
from cagefield.server.render_worker.isolated_renderers import IsolatedRenderers, RemainingRenderers
from cagefield.server.render_worker.refinement import FINAL, Refinement
from cagefield.server.render_worker.tasks import (
    EditValues,
    PictureDone,
    PictureTask,
    Shown,
    Stopped,
    WarmStage,
)
from cagefield.server.render_worker.view import Display, Region
from cagefield.typing import Array, Float32
from cagefield.warps.forward import to_deformed

if TYPE_CHECKING:
    from cagefield.rendering.renderers import InteractiveRenderer

MOVING_STEP_VOXELS = (1.0, 1.5)
"""Voxels between samples while something moves: least, and most where a pixel shows as much."""

MOVING_QUALITY, REST_QUALITY = 85, 95
"""JPEG qualities."""

KEPT_EDITS = 64
"""Edits whose maps are kept for when they are shown again."""

KEPT_BYTES = 256 << 20
"""Bytes of the lattices of those of them that are not shown, at most."""

MAX_DEPTH_IMAGES = 120_000
"""Depths sent with a picture, at most."""


class RendererCache:
    """Pictures of one field under any edits; renderers of the last edits are kept."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.plain = renderer_of(scene.rendered_field)
        self._is_sampled = isinstance(scene.field, VoxelField)
        """Whether rays are sampled, and samples mapped: lattices and steps are for those alone."""
        self._edits: list[Edit] = []
        self.edited = EditedRenderers(self.plain, self._is_sampled, scene.patcher)
        self._isolated = IsolatedRenderers(scene.field)
        self._remaining = RemainingRenderers(scene)
        lower, upper = scene.field.bounds
        self._middle = 0.5 * (lower + upper)
        self._radius = 0.5 * float(np.linalg.norm(upper - lower))

    def picture(self, task: PictureTask, stop: Stop) -> PictureDone | Stopped:
        """The part of a picture that a task asks for, encoded."""
        began = time.perf_counter()
        try:
            attained, renderer = FINAL, self._renderers_of(task.shown)[0]
            if not task.display.before:
                refined = self.renderer(task.shown, task.refinement, cancellation_check(stop))
                attained, renderer = refined.refinement, refined.renderer
            mapped = time.perf_counter()
            frame = self._frame(task, renderer, stop)
        except GivenUpError:
            return Stopped(task.number)
        rendered = time.perf_counter()
        near, far = self.reach(task.camera)
        pixels = encoding.picture_of(frame, task.display.view, (near, far))
        picture, form = encoding.plain_or_jpeg(pixels, MOVING_QUALITY if task.moving else REST_QUALITY)
        few = not task.moving and frame.width * frame.height <= MAX_DEPTH_IMAGES
        stride = 1 if few else 2
        scale = (far if not self.scene.field.unbounded else 16.0 * far) / 65_000.0
        depth = encoding.depths(frame, scale, stride)
        return PictureDone(
            task.number,
            picture,
            form,
            depth.tobytes(),
            attained,
            (depth.shape[1], depth.shape[0]),
            scale,
            mapped - began,
            rendered - began,
            time.perf_counter() - rendered,
        )

    def still(self, shown: Shown, camera: Camera, display: Display, stop: Stop | None = None) -> RenderResult:
        """A whole image, its edits exact. Raises GivenUpError once `stop` returns True."""
        region = Region(0, 0, camera.width, camera.height, camera.width, camera.height)
        task = PictureTask(0, shown, camera, region, display, stop is None, FINAL, 0)
        stopping = stop or (lambda: False)
        renderer = self._renderers_of(shown)[0]
        if not display.before:
            renderer = self.renderer(shown, FINAL, cancellation_check(stopping)).renderer
        return self._frame(task, renderer, stopping)

    def warm(self, stage: WarmStage) -> None:
        """Makes the kernels of one stage ready, on a small edit."""
        if stage is WarmStage.DELETION:
            load_solvers()
        if not stage.is_for_moving:
            _compile_forward_map(stage)
            return
        if not self._is_sampled:
            _warm_splats(stage)
            return
        voxel = self.scene.field.sample_spacing
        inner = Cage.box(self._middle, 8.0 * voxel)
        edit = Edit.continuous(inner, inner.grown(8.0 * voxel), lattice=8).translate((2.0 * voxel, 0.0, 0.0))
        size = float(np.linalg.norm(self._middle)) + 4.0 * self._radius
        camera = Camera.look_at(
            self._middle + size * np.array([1.0, 0.0, 0.3]), self._middle, width=8, height=8, fov_x=0.5
        )
        if stage is WarmStage.DELETION:
            self.plain.with_edits(EditStack([Edit.delete(inner)]))
            self.plain.render(camera)  # as patches do, to find out about the light
            return
        renderer = self.plain.with_edits(EditStack([edit]), coarse=stage is not WarmStage.EXACT_EDIT)
        if stage is WarmStage.PICTURE:
            renderer.render(camera)

    def warm_light(self, shown: Shown, proceed: Callable[[], None]) -> None:
        """Light of the shown field, and around the last edit (`Patcher.warm`); `proceed` cancels.

        Where the last edit moves a part, the renderer of its next drag too: it has the patch of the drag.
        """
        edits = self.edits(shown.edits)
        self.shown_scene(shown).patcher.warm(edits, preserve_opacity=shown.preserve_opacity, proceed=proceed)
        last = edits[-1] if edits else None
        if isinstance(last, Move | Copy) and last.changes_anything:
            proceed()
            with suppress(EditError):
                moved = last.translate((1e-3 * self.scene.field.sample_spacing, 0.0, 0.0))
                edited = self._renderers_of(shown)[1]
                edited.renderer((*edits[:-1], moved), shown.preserve_opacity, Refinement.DRAFT, proceed)

    def renderer(
        self, shown: Shown, refinement: Refinement, proceed: Callable[[], None] | None = None
    ) -> RefinedRenderer:
        """The renderer of the edits with a refinement (`EditedRenderers.renderer`)."""
        edits = self.edits(shown.edits)
        edited = self._renderers_of(shown)[1]
        return edited.renderer(edits, shown.preserve_opacity, refinement, proceed)

    def _renderers_of(self, shown: Shown) -> tuple[InteractiveRenderer, EditedRenderers]:
        """(renderer without edits, edited renderers) of the field, or of its elements that are shown."""
        if shown.isolated is not None:
            isolated = shown.isolated
            if shown.removed is not None:
                isolated = isolated.combine(shown.removed, "subtract")
            return self._isolated.renderers(isolated)
        if shown.removed is not None:
            return self._remaining.renderers(shown.removed)
        return self.plain, self.edited

    def shown_scene(self, shown: Shown) -> Scene:
        """The scene without deleted elements."""
        return self.scene if shown.removed is None else self._remaining.scene(shown.removed)

    def surface(
        self, shown: Shown, camera: Camera, x: float, y: float, *, normals: bool = False
    ) -> tuple[Array, Array | None] | None:
        """(point [3], normal [3] if asked for) of the surface seen at a pixel, x and y in [0,1].

        None where the picture is half empty.
        """
        column, row = (
            min(int(x * camera.width), camera.width - 1),
            min(int(y * camera.height), camera.height - 1),
        )
        renderer = self.renderer(shown, Refinement.DRAFT).renderer
        frame = renderer.render(camera, normals=normals, region=(column, row, 1, 1))
        if frame.opacity[0, 0] < 0.5:
            return None
        origins, directions = camera.rays(np.array([[column, row]]))
        point = origins[0] + float(frame.depth[0, 0]) * directions[0]
        return point, None if frame.normals is None else frame.normals[0, 0]

    def edits(self, values: tuple[EditValues, ...]) -> list[Edit]:
        """Edits with these field values; unchanged ones are the same objects as before.

        Edits shown last are kept, as far as `KEPT_EDITS` and `KEPT_BYTES` allow.
        """
        found = []
        for each in values:
            edit = each.edit()
            found.append(next((known for known in self._edits if known == edit), edit))
        others = [known for known in self._edits if not any(known is edit for edit in found)]
        sizes = itertools.accumulate(_lattice_bytes(edit) for edit in others)
        others = [edit for edit, size in zip(others, sizes, strict=True) if size <= KEPT_BYTES]
        self._edits = [*found, *others][: max(KEPT_EDITS, len(found))]
        self.edited.keep_only(self._edits)
        return found

    @property
    def known_edits(self) -> Sequence[Edit]:
        """The edits that are kept, those shown last first."""
        return self._edits

    def reach(self, camera: Camera) -> tuple[float, float]:
        """(nearest, farthest) distance of the field's box from a camera."""
        distance = float(np.linalg.norm(camera.origin - self._middle))
        return max(0.0, distance - self._radius), distance + self._radius

    def _frame(self, task: PictureTask, edited: InteractiveRenderer, stop: Stop) -> RenderResult:
        """The region of the picture; left of a split without the edits."""
        region, split = task.region, task.display.split
        if task.display.before or split is None:
            return self.part(task, edited, region, stop)
        left = min(max(round(split * region.full_width) - region.x, 0), region.width)
        parts: list[RenderResult] = []
        plain = self._renderers_of(task.shown)[0]
        for renderer, x, width in ((plain, 0, left), (edited, left, region.width - left)):
            if width > 0:
                parts.append(self.part(task, renderer, replace(region, x=region.x + x, width=width), stop))
        return parts[0] if len(parts) == 1 else _beside(parts[0], parts[1])

    def part(
        self, task: PictureTask, renderer: InteractiveRenderer, region: Region, stop: Stop
    ) -> RenderResult:
        return renderer.render(
            task.camera,
            background=self.scene.background,
            normals=task.display.view == "normals",
            region=(region.x, region.y, region.width, region.height),
            proceed=None if task.moving else cancellation_check(stop),
            step=self._step(task.camera, renderer.step) if task.moving else None,
        )

    def _step(self, camera: Camera, least: float) -> float:
        """Sampling distance of a moving image, voxels: the size of a pixel in the middle of the field.

        Of splats, which take no samples, the least one.
        """
        if not self._is_sampled:
            return least
        distance = float(np.linalg.norm(camera.origin - self._middle))
        shown = distance / camera.fx / self.scene.field.sample_spacing
        low, high = MOVING_STEP_VOXELS
        return min(max(shown, least, low), high)


def _lattice_bytes(edit: Edit) -> int:
    """Bytes of the lattice of an edit, whether it has been made or not."""
    return 12 * (edit.kernel_lattice or 0) ** 3 if isinstance(edit, Continuous) else 0


def _compile_forward_map(stage: WarmStage) -> None:
    """Compiles the map to deformed space, which takes light and splats along: of boxes, or of bent cages.

    Once on a machine, where kernels are cached: importing Numba takes a second that no drag should wait for.
    """
    folder = numba_kernel_folder()
    note = None if folder is None else folder / f"{stage.value}.compiled"
    if note is not None and note.exists():
        return
    inner = Cage.box((0.0, 0.0, 0.0), 1.0)
    outer = inner.grown(1.0)
    edit = Edit.continuous(inner, outer).translate((0.1, 0.0, 0.0))
    if stage is WarmStage.BENT_CAGE:
        edit = edit.move_corner(7, (0.1, 0.1, 0.1))
    to_deformed(edit.warp, 0.5 * (inner.corners + outer.corners))  # the shell takes the most time to compile
    if note is not None:
        with suppress(OSError):
            note.touch()


def _warm_splats(stage: WarmStage) -> None:
    """Makes the kernels of splats ready: under a coarse edit, in plain pictures, at rest, with normals."""
    chance = np.random.default_rng(0)
    count = 64
    field = SplatField(
        chance.random((count, 3), np.float32) - 0.5,
        np.full((count, 3), -3.0, np.float32),
        chance.standard_normal((count, 4), np.float32),
        np.full(count, 0.5, np.float32),
        np.zeros((count, 1, 3), np.float32),
    )
    inner = Cage.box((0.0, 0.0, 0.0), 0.5)
    turned = Edit.continuous(inner, inner.grown(0.4)).rotate((0.0, 0.0, 0.3))
    edits = EditStack() if stage is WarmStage.PICTURE else EditStack([turned, turned, Edit.delete(inner)])
    renderer = renderer_of(field).with_edits(edits, coarse=stage is WarmStage.COARSE_EDIT)
    camera = Camera.look_at((4.0, 0.0, 1.0), (0.0, 0.0, 0.0), width=32, height=32, fov_x=0.5)
    renderer.render(camera, normals=stage is WarmStage.DELETION)


def _beside(left: RenderResult, right: RenderResult) -> RenderResult:
    """Two frames of the same height as one."""

    def join(a: Float32, b: Float32) -> Float32:
        return np.concatenate([a, b], axis=1)

    normals = None
    if left.normals is not None and right.normals is not None:
        normals = join(left.normals, right.normals)
    return RenderResult(
        join(left.rgb, right.rgb),
        join(left.opacity, right.opacity),
        join(left.depth, right.depth),
        normals,
        left.background,
    )
