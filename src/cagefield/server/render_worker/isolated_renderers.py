"""Renderers of some elements of a field: isolated ones, without patches, or all that are not deleted."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

from cagefield.completion.patch_stages import PatchStage
from cagefield.edits import Edit, Paste, PreparedStack
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.rendering.renderers import InteractiveRenderer, renderer_of
from cagefield.scene.removed_elements import without_removed
from cagefield.scene.scene import Scene
from cagefield.selection.element_selection import Selection
from cagefield.selection.field_elements import elements_of_field, without_elements
from cagefield.server.render_worker.edited_renderers import EditedRenderers


class Unpatched:
    """Source of prepared edits without patches and pastes: these are of the whole field."""

    def prepare(
        self,
        edits: Sequence[Edit],
        *,
        stage: PatchStage = PatchStage.LIT,
        preserve_opacity: bool = True,
        proceed: Callable[[], None] | None = None,
    ) -> PreparedStack:
        """Stack of the edits alone, pastes left out."""
        return PreparedStack(edit for edit in edits if not isinstance(edit, Paste))

    def attained_stage(self, prepared: PreparedStack, *, preserve_opacity: bool = True) -> PatchStage:
        """The last stage: nothing refines a picture without patches."""
        return PatchStage.LIT


class IsolatedRenderers:
    """Renderers of the elements of a field that were isolated last."""

    def __init__(self, field: VoxelField | SplatField) -> None:
        self._field = field
        self._known: tuple[Selection, InteractiveRenderer, EditedRenderers] | None = None

    def renderers(self, isolated: Selection) -> tuple[InteractiveRenderer, EditedRenderers]:
        """(renderer without edits, edited renderers) of the field that has the isolated elements alone."""
        if self._known is None or self._known[0] != isolated:
            field = without_elements(self._field, elements_of_field(self._field), ~isolated.mask)
            plain = renderer_of(field)
            edited = EditedRenderers(plain, isinstance(field, VoxelField), Unpatched())
            self._known = isolated, plain, edited
        return self._known[1], self._known[2]


class RemainingRenderers:
    """Renderers, and the scene, of the elements that are not deleted, of the deletion shown last."""

    def __init__(self, scene: Scene) -> None:
        self._whole = scene
        self._known: tuple[Selection, Scene, InteractiveRenderer, EditedRenderers] | None = None

    def renderers(self, removed: Selection) -> tuple[InteractiveRenderer, EditedRenderers]:
        """(renderer without edits, edited renderers) of the field without the deleted elements."""
        _, _, plain, edited = self._of(removed)
        return plain, edited

    def scene(self, removed: Selection) -> Scene:
        """The scene without the deleted elements."""
        return self._of(removed)[1]

    def _of(self, removed: Selection) -> tuple[Selection, Scene, InteractiveRenderer, EditedRenderers]:
        if self._known is None or self._known[0] != removed:
            scene = dataclasses.replace(self._whole, field=without_removed(self._whole.field, removed))
            plain = renderer_of(scene.rendered_field)
            edited = EditedRenderers(plain, isinstance(scene.field, VoxelField), scene.patcher)
            self._known = removed, scene, plain, edited
        return self._known
