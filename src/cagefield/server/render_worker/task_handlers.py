"""Handlers of the rendering process, one per kind of task."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from cagefield.completion.patch_stages import PatchStage
from cagefield.compute.cancellation import cancellable
from cagefield.edits import Continuous, Edit, EditMap
from cagefield.errors import EditError
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.control_points import ControlPoints
from cagefield.rendering.splats.raster_splats import deformed_splats
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.server.editor.cage_placement import probes
from cagefield.server.render_worker.alignment import aligned_paste, floor_of
from cagefield.server.render_worker.cancellation import GivenUpError, cancellation_check
from cagefield.server.render_worker.encoding import picture_of, png
from cagefield.server.render_worker.grid_lines import grid_lines
from cagefield.server.render_worker.job_files import JobFiles
from cagefield.server.render_worker.page_files import PageFiles
from cagefield.server.render_worker.renderer_cache import RendererCache
from cagefield.server.render_worker.selection_handlers import SelectionHandlers
from cagefield.server.render_worker.splat_density import dense_cells
from cagefield.server.render_worker.tasks import (
    AlignTask,
    Answered,
    BoxTask,
    DetoursTask,
    EndJobTask,
    ErrorTask,
    FitTask,
    FloorTask,
    FrameTask,
    GridTask,
    HighlightTask,
    HistogramTask,
    LightTask,
    LookTask,
    PageEditsTask,
    PageFieldTask,
    PickTask,
    PictureTask,
    Result,
    Shown,
    StillTask,
    Stopped,
    SurfaceTask,
    Task,
    WarmTask,
)
from cagefield.server.render_worker.view import Display

DENSE_VOXEL_OPACITY = 0.05
"""Optical depth of a voxel from which on it counts as dense."""

SAMPLES = 2_000
"""Points at which a lattice is measured."""

Abandoned = Callable[[int], bool]


class TaskHandlers:
    """Does tasks, one after the other, on one scene."""

    def __init__(self, renderers: RendererCache) -> None:
        self._renderers = renderers
        self._files = JobFiles()
        self._pages = PageFiles(renderers)
        self._selections = SelectionHandlers(renderers)

    def do(self, task: Task, abandoned: Abandoned) -> Result:
        """The task's result. Raises CagefieldError where it cannot be done."""
        if isinstance(task, PictureTask):
            return self._renderers.picture(task, lambda: abandoned(task.generation))
        if isinstance(task, PageEditsTask):
            return self._pages.edits(task, lambda: abandoned(task.generation))
        if isinstance(task, FrameTask):
            return self._frame(task, lambda: abandoned(task.generation))
        if isinstance(task, LightTask):
            return self._light(task, lambda: abandoned(task.generation))
        if isinstance(task, ErrorTask):
            return self._error(task, lambda: abandoned(task.generation))
        if isinstance(task, DetoursTask):
            return self._detours(task, lambda: abandoned(task.generation))
        if isinstance(task, StillTask):
            return self._still(task, lambda: abandoned(task.generation))
        if isinstance(task, HighlightTask):
            return self._highlight(task, lambda: abandoned(task.generation))
        if isinstance(task, PickTask | BoxTask | HistogramTask):
            return Answered(task.number, self._selections.answer(task))
        return Answered(task.number, self._answer(task))

    def close(self) -> None:
        """Drop unfinished work."""
        self._files.close()

    def _answer(
        self,
        task: SurfaceTask
        | FitTask
        | LookTask
        | FloorTask
        | AlignTask
        | WarmTask
        | GridTask
        | EndJobTask
        | PageFieldTask,
    ) -> Any:
        if isinstance(task, SurfaceTask):
            return self._surface(task)
        if isinstance(task, FitTask):
            return self._fit(task)
        if isinstance(task, LookTask):
            return self._look(task)
        if isinstance(task, FloorTask):
            return floor_of(self._renderers.shown_scene(Shown((), removed=task.removed)), task)
        if isinstance(task, AlignTask):
            return aligned_paste(self._renderers.shown_scene(Shown((), removed=task.removed)), task)
        if isinstance(task, WarmTask):
            return self._renderers.warm(task.stage)
        if isinstance(task, EndJobTask):
            return self._files.end(task.job, task.keep)
        if isinstance(task, PageFieldTask):
            return self._pages.field()
        return grid_lines(self._connected(task))

    def _highlight(self, task: HighlightTask, stop: Callable[[], bool]) -> Result:
        try:
            return Answered(task.number, self._selections.answer(task, cancellation_check(stop)))
        except GivenUpError:
            return Stopped(task.number)

    def _light(self, task: LightTask, stop: Callable[[], bool]) -> Result:
        try:
            self._renderers.warm_light(task.shown, cancellation_check(stop))
        except GivenUpError:
            return Stopped(task.number)
        return Answered(task.number)

    def _error(self, task: ErrorTask, stop: Callable[[], bool]) -> Result:
        """(max, mean) error of an edit's lattice, voxels; none for splats, which take no lattice."""
        if isinstance(self._renderers.scene.field, SplatField):
            return Answered(task.number, (0.0, 0.0))
        try:
            edit = self._connected(task)
            if not isinstance(edit, Continuous):
                return Answered(task.number, (0.0, 0.0))
            most, mean = edit.lattice_error(samples=SAMPLES, proceed=cancellation_check(stop))
        except GivenUpError:
            return Stopped(task.number)
        voxel = self._renderers.scene.field.sample_spacing
        return Answered(task.number, (most / voxel, mean / voxel))

    def _connected(self, task: ErrorTask | GridTask) -> Edit:
        """The task's edit, with the detours of its control points where they are connected."""
        *below, edit = self._renderers.edits((*task.below.edits, task.edit))
        points = edit.inner
        if not (isinstance(points, ControlPoints) and points.is_unprepared):
            return edit
        return self._renderers.shown_scene(task.below).patcher.with_detours([*below, edit])[-1]

    def _detours(self, task: DetoursTask, stop: Callable[[], bool]) -> Result:
        """Detours of the points; the reason as text where a point is connected to nothing."""
        patcher = self._renderers.shown_scene(task.below).patcher
        proceed = cancellation_check(stop)
        try:
            below = patcher.prepare(
                self._renderers.edits(task.below.edits),
                stage=PatchStage.CACHED,
                preserve_opacity=task.below.preserve_opacity,
                proceed=proceed,
            )
            with cancellable(proceed):
                return Answered(task.number, patcher.detours.of_points(task.points, below))
        except GivenUpError:
            return Stopped(task.number)
        except EditError as error:
            return Answered(task.number, str(error))

    def _frame(self, task: FrameTask, stop: Callable[[], bool]) -> Result:
        """Whether the picture was added; False where those before it are gone."""
        if self._files.misses(task):
            return Answered(task.number, False)
        try:
            frame = self._renderers.still(task.shown, task.still.camera, Display(), stop)
        except GivenUpError:
            return Stopped(task.number)
        self._files.add(task, frame)
        return Answered(task.number, True)

    def _still(self, task: StillTask, stop: Callable[[], bool]) -> Result:
        """The picture as a PNG."""
        try:
            frame = self._renderers.still(task.shown, task.camera, task.display, stop)
        except GivenUpError:
            return Stopped(task.number)
        picture = picture_of(frame, task.display.view, self._renderers.reach(task.camera))
        return Answered(task.number, png(picture))

    def _surface(self, task: SurfaceTask) -> tuple[list[float], list[float]] | None:
        """(point, normal) of the surface at a pixel; None where the picture is half empty."""
        found = self._renderers.surface(task.shown, task.camera, task.x, task.y, normals=True)
        if found is None or found[1] is None:
            return None
        return found[0].tolist(), found[1].tolist()

    def _fit(self, task: FitTask) -> list[bool]:
        """Which of the cage's `probes` are dense."""
        scene = self._renderers.shown_scene(task.shown)
        field: VoxelField | SplatField | SplatSet = scene.rendered_field
        edits: EditMap
        if task.source is not None:
            content = scene.sources.read(task.source)
            field, edits = content.field, content.edits
        else:
            below = self._renderers.edits(task.shown.edits)
            edits = scene.patcher.prepare(below, stage=PatchStage.CACHED, preserve_opacity=False)
        if not isinstance(field, VoxelField):
            return dense_cells(task.cage, deformed_splats(field, edits)).tolist()
        from cagefield.edits.kernel_map import KernelMap
        from cagefield.rendering.edited_field import EditedField

        points = probes(task.cage).astype(np.float32)
        edited = EditedField(field, KernelMap(edits), field.bounds, preserve_opacity=False)
        sigma, _ = edited(points, np.tile(np.array([1.0, 0.0, 0.0], np.float32), (len(points), 1)))
        return (sigma * field.sample_spacing > DENSE_VOXEL_OPACITY).tolist()

    def _look(self, task: LookTask) -> tuple[list[list[float]], list[float]]:
        """(box, up direction) of the content to paste."""
        scene = self._renderers.scene
        look = scene.sources.look(task.source, scene.field)
        return look.box.tolist(), look.up.tolist()
