"""Selected elements in the rendering process: picking, highlights, boxes and histograms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from cagefield.cameras.camera import Camera
from cagefield.edits import EditStack
from cagefield.errors import CagefieldError
from cagefield.selection.brush_and_lasso import elements_in_region
from cagefield.selection.element_positions import DeformedPositions, deformed_positions
from cagefield.selection.element_selection import Selection
from cagefield.selection.elements import Elements, histogram
from cagefield.selection.field_elements import elements_of_field
from cagefield.selection.floater_preset import floaters
from cagefield.selection.neighborhoods import flood, grow, interior, shrink
from cagefield.selection.selection_cages import cage_around
from cagefield.server.render_worker.picks import (
    EveryPick,
    FloaterPick,
    FloodPick,
    Highlight,
    Pick,
    RangePick,
    RegionPick,
)
from cagefield.server.render_worker.refinement import Refinement
from cagefield.server.render_worker.renderer_cache import RendererCache
from cagefield.server.render_worker.tasks import BoxTask, HistogramTask, PickTask, SelectionTask, Shown
from cagefield.typing import Array, Float32, Mask

DEPTH_PIXELS = 120_000
"""Pixels of the depth image that decides visibility, at most."""

MAX_HIGHLIGHT_POINTS = 60_000
"""Positions of a highlight, at most: 360 kB."""

QUANTIZED_MAX = 65_535


class SelectionHandlers:
    """Tasks about selected elements of one scene's field."""

    def __init__(self, renderers: RendererCache) -> None:
        self._renderers = renderers

    def answer(self, task: SelectionTask, proceed: Callable[[], None] | None = None) -> Any:
        """Result of a task: a Selection, a Histogram, a Highlight, or a cage.

        Raises CagefieldError where there is none; `proceed` is called now and then, and cancels by raising.
        """
        if isinstance(task, PickTask):
            picked = self._picked(task.shown, task.pick)
            if task.shown.isolated is not None:
                picked = picked & self._mask(task.shown.isolated)
            if task.shown.removed is not None:
                picked = picked & ~self._mask(task.shown.removed)
            return Selection.from_mask(picked)
        elements = self._elements
        if isinstance(task, HistogramTask):
            selected = np.zeros(len(elements), bool) if task.selection is None else self._mask(task.selection)
            return histogram(elements, task.attribute, selected)
        mask = self._mask(task.selection)
        if isinstance(task, BoxTask):
            seen = self._positions(task.shown, np.flatnonzero(mask))
            if not len(seen.points):
                raise CagefieldError(
                    "nothing of the selection is to be seen: edits delete or cover all of it"
                )
            margin = task.margin * elements.cell_edge
            return cage_around(task.shape, seen.points, margin, elements.radii[seen.element])
        if elements.kind == "cells":
            mask = mask & ~interior(elements, mask)
        seen = self._positions(task.shown, np.flatnonzero(mask), proceed)
        size = elements.cell_edge
        if elements.kind == "splats" and len(seen.element):
            size = 2.0 * float(np.median(elements.radii[seen.element]))
        return _highlight(seen.points, size)

    @property
    def _elements(self) -> Elements:
        return elements_of_field(self._renderers.scene.field)

    def _mask(self, selection: Selection) -> Mask:
        if selection.total != len(self._elements):
            raise CagefieldError(
                f"the selection is of a field of {selection.total} elements, this one has "
                f"{len(self._elements)}; select anew"
            )
        return selection.mask

    def _positions(
        self, shown: Shown, rows: np.ndarray[Any, Any], proceed: Callable[[], None] | None = None
    ) -> DeformedPositions:
        """Deformed positions of some elements, by the elements' numbers."""
        patcher = self._renderers.shown_scene(shown).patcher
        edits = EditStack(patcher.with_detours(self._renderers.edits(shown.edits)))
        found = deformed_positions(self._elements.positions[rows], edits, coarse=True, proceed=proceed)
        return DeformedPositions(found.points, rows[found.element])

    def _picked(self, shown: Shown, pick: Pick) -> Mask:
        elements = self._elements
        if isinstance(pick, RegionPick):
            return self._in_region(shown, pick)
        if isinstance(pick, FloodPick):
            return flood(elements, self._seed(shown, pick), pick.threshold, pick.reach)
        if isinstance(pick, RangePick):
            return elements.in_range(pick.attribute, pick.low, pick.high)
        if isinstance(pick, FloaterPick):
            return floaters(elements, pick.strength)
        if isinstance(pick, EveryPick):
            return np.ones(len(elements), bool)
        change = grow if pick.steps > 0 else shrink
        return change(elements, self._mask(pick.selection), abs(pick.steps))

    def _in_region(self, shown: Shown, pick: RegionPick) -> Mask:
        elements = self._elements
        camera = _with_pixels(pick.camera, DEPTH_PIXELS)
        seen = self._positions(shown, np.arange(len(elements)))
        if pick.tolerance is None:
            return elements_in_region(pick.region, camera, seen, len(elements))
        reach = np.maximum(elements.radii, elements.cell_edge)[seen.element]
        return elements_in_region(
            pick.region,
            camera,
            seen,
            len(elements),
            depth=self._depth(shown, camera),
            tolerance=pick.tolerance * reach,
        )

    def _depth(self, shown: Shown, camera: Camera) -> Float32:
        """Depth image [H,W], infinite where most light passes."""
        frame = self._renderers.renderer(shown, Refinement.DRAFT).renderer.render(camera)
        return np.where(frame.opacity > 0.5, frame.depth, np.inf).astype(np.float32)

    def _seed(self, shown: Shown, pick: FloodPick) -> int:
        """Number of the element whose deformed position is nearest to the surface at a pixel."""
        found = self._renderers.surface(shown, pick.camera, pick.x, pick.y)
        if found is None:
            raise CagefieldError("there is no surface under the mouse; click on the object")
        point, _ = found
        there = np.ones(len(self._elements), bool)
        if shown.removed is not None:
            there &= ~self._mask(shown.removed)
        seen = self._positions(shown, np.flatnonzero(there))
        if not len(seen.points):
            raise CagefieldError("the field has nothing to select: all of it is transparent or deleted")
        return int(seen.element[np.argmin(((seen.points - point) ** 2).sum(axis=1))])


def _with_pixels(camera: Camera, most: int) -> Camera:
    """The camera with at most so many pixels."""
    scale = min(1.0, float(np.sqrt(most / (camera.width * camera.height))))
    return camera.resized(max(1, round(camera.width * scale)), max(1, round(camera.height * scale)))


def _highlight(points: Array, size: float) -> Highlight:
    if len(points) > MAX_HIGHLIGHT_POINTS:
        chosen = np.random.default_rng(0).choice(len(points), MAX_HIGHLIGHT_POINTS, replace=False)
        points = points[np.sort(chosen)]
    low = points.min(axis=0) if len(points) else np.zeros(3)
    high = points.max(axis=0) if len(points) else np.ones(3)
    span = np.where(high > low, high - low, 1.0)
    quantized = np.round((points - low) / span * QUANTIZED_MAX).astype("<u2")
    return Highlight(
        tuple(low.tolist()), tuple((low + span).tolist()), quantized.tobytes(), len(points), size
    )
