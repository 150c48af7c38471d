"""Fields and edits as files that pages draw with their own GPU. Lives in the rendering process."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import cast

from cagefield.edits import Edit, Paste
from cagefield.errors import CagefieldError
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.pages.page_edits import encode_changed_edits, for_page
from cagefield.pages.page_field import encode_page_field
from cagefield.pages.page_file import LEVEL, QUICK_LEVEL
from cagefield.pages.page_splat_edits import encode_page_splat_edits
from cagefield.pages.page_splats import encode_page_splats
from cagefield.rendering.splats.raster_splats import changed_splats
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.rendering.splats.splitting import split_of
from cagefield.rendering.voxels.occupancy import Occupancy
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from cagefield.server.editor.identity_cache import IdentityCache
from cagefield.server.render_worker.cancellation import GivenUpError, Stop, cancellation_check
from cagefield.server.render_worker.edited_renderers import PATCH_STAGES, EditedRenderers, attained_refinement
from cagefield.server.render_worker.renderer_cache import RendererCache
from cagefield.server.render_worker.tasks import EditsDone, PageEditsTask, Stopped

KEPT_OCCUPANCIES = 6
"""Occupancies of which pages may be sent the changed part, those that were sent last."""

NOT_DRAWN = "pages draw voxels and splats alone; the server draws this scene"

REMOVED = "cells are deleted; the server draws the others"

ISOLATED = "elements are isolated; the server draws them"


class PageFiles:
    """Builder of the page files of one scene; layers of voxels that a page has are not sent again."""

    def __init__(self, renderers: RendererCache) -> None:
        self._renderers = renderers
        self._for_page: IdentityCache[Edit, Edit] = IdentityCache(64)
        self._own = EditedRenderers(renderers.plain, True, renderers.scene.patcher)
        """Of stacks with an exact shell, which a page draws with a lattice."""
        self._occupancies: dict[str, Occupancy] = {}

    def field(self) -> bytes:
        """File of the field. Raises CagefieldError for a field that pages cannot draw, and for an empty
        one."""
        scene, plain = self._renderers.scene, self._renderers.plain
        if isinstance(scene.field, SplatField):
            return encode_page_splats(scene.field, background=scene.background)
        if not isinstance(scene.field, VoxelField) or not isinstance(plain, VoxelRenderer):
            raise CagefieldError(NOT_DRAWN)
        return encode_page_field(scene.field, step=plain.step, background=scene.background)

    def edits(self, task: PageEditsTask, stop: Stop) -> EditsDone | Stopped:
        """The edits' file, or the part of it that the page has not. Raises EditError, CagefieldError."""
        if task.shown.isolated is not None:
            raise CagefieldError(ISOLATED)
        began = time.perf_counter()
        edits = self._renderers.edits(task.shown.edits)
        self._for_page.keep_only(self._renderers.known_edits)
        self._own.keep_only([*self._for_page.values()])
        field = self._renderers.scene.rendered_field
        if isinstance(field, SplatSet):
            return self._splat_edits(field, edits, task, stop)
        if task.shown.removed is not None:
            raise CagefieldError(REMOVED)
        drawn = [self._prepared(edit) for edit in edits]
        same = all(one is other for one, other in zip(edits, drawn, strict=True))
        renderers = self._renderers.edited if same else self._own
        try:
            refined = renderers.renderer(
                drawn, task.shown.preserve_opacity, task.refinement, cancellation_check(stop)
            )
        except GivenUpError:
            return Stopped(task.number)
        renderer = refined.renderer
        if not isinstance(renderer, VoxelRenderer):
            raise CagefieldError(NOT_DRAWN)
        mapped = time.perf_counter()
        level = QUICK_LEVEL if task.refinement.is_coarse or task.has else LEVEL
        found = encode_changed_edits(renderer, task.has, self._occupancies, level)
        assert found.occupancy is not None  # `encode_changed_edits` says which
        self._occupancies.pop(found.keys[-1], None)
        self._occupancies[found.keys[-1]] = found.occupancy
        while len(self._occupancies) > KEPT_OCCUPANCIES:
            del self._occupancies[next(iter(self._occupancies))]
        spent = mapped - began, time.perf_counter() - mapped
        return EditsDone(task.number, found.data, found.keys, refined.refinement, *spent)

    def _splat_edits(
        self, splats: SplatSet, shown: Sequence[Edit], task: PageEditsTask, stop: Stop
    ) -> EditsDone | Stopped:
        """All that edits change of splats, whatever the page has; deleted ones are hidden.

        None is split while something moves.

        Raises CagefieldError for pastes, whose colors a page that has loaded its splats does not have.
        """
        if any(isinstance(edit, Paste) for edit in shown):
            raise CagefieldError("the server draws what is pasted between scenes of splats")
        began, proceed, whole = time.perf_counter(), cancellation_check(stop), splats.field
        try:
            scene, removed = self._renderers.shown_scene(task.shown), task.shown.removed
            patcher = scene.patcher
            if removed is not None:
                splats = cast(SplatSet, scene.rendered_field)
            edits = patcher.prepare(shown, stage=PATCH_STAGES[task.refinement], proceed=proceed)
            is_coarse = task.refinement.is_coarse
            changed = changed_splats(
                splats,
                edits,
                preserve_opacity=task.shown.preserve_opacity,
                coarse=is_coarse,
                split=None if is_coarse else split_of(splats, edits, proceed=proceed),
                proceed=proceed,
            )
        except GivenUpError:
            return Stopped(task.number)
        mapped = time.perf_counter()
        if removed is not None:
            changed = changed.of_whole(removed.mask)
        content = encode_page_splat_edits(whole, changed)
        attained = attained_refinement(task.refinement, shown, patcher.attained_stage(edits), splits=True)
        return EditsDone(task.number, content, (), attained, mapped - began, time.perf_counter() - mapped)

    def _prepared(self, edit: Edit) -> Edit:
        """The edit as a page draws it, the same object each time."""
        if edit in self._for_page:
            return self._for_page[edit]
        return self._for_page.put(edit, for_page(edit))
