"""Patches of one field's edits, made when they are asked for, and the last ones kept."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import cast

from cagefield.cameras.camera import Camera
from cagefield.completion.continuous_relighting import extract_bent_block, light_edit, relight_voxels
from cagefield.completion.discrete_patch import build_patch
from cagefield.completion.lighting.ambient_occlusion import (
    LightModel,
    fit_light_model,
    with_diffuse_light,
    with_directional_light,
)
from cagefield.completion.pasting.paste_composite import composite_paste
from cagefield.completion.pasting.paste_loader import PasteLoader
from cagefield.completion.patch_cache import DiskCache
from cagefield.completion.splat_patch import build_splat_patch, relight_splats
from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.completion.surfaces.splat_voxelization import voxelize_bounds
from cagefield.completion.surfaces.visibility import CameraVisibility, render_visibility
from cagefield.edits import Edit, EditStack
from cagefield.edits.options import CastShadow
from cagefield.edits.patch import Pasted, Patch, SplatPatch
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.images.render_result import RenderResult

MAX_CACHED_PATCHES = 16
"""Patches that are kept for when they are asked for again."""

Key = tuple[object, ...]


class Patcher:
    """Gives discrete edits the patches that their `fill` and `relight` ask for.

    `cameras` are those that the field was photographed from: how contact shadows show is found in pictures
    from there by `render`, which draws the field without edits, with normals. Pastes show what `pastes`
    reads.
    """

    def __init__(
        self,
        field: VoxelField | SplatField,
        cameras: Sequence[Camera],
        render: Callable[[Camera], RenderResult],
        pastes: PasteLoader | None = None,
    ) -> None:
        self._field, self._cameras, self._render, self._pastes = field, cameras, render, pastes
        self._on_disk = DiskCache(field, cameras)
        self._kept: OrderedDict[Key, Patch | SplatPatch | Edit | None] = OrderedDict()
        self._around: tuple[Key, GridBlock] | None = None
        self._suns: dict[tuple[float, float, float] | None, LightModel] = {}
        self._pasted: OrderedDict[Key, Pasted] = OrderedDict()

    def patched(
        self,
        edits: Sequence[Edit],
        *,
        moving: bool = False,
        bending: bool = True,
        preserve_opacity: bool = True,
        proceed: Callable[[], None] | None = None,
    ) -> EditStack:
        """The stack of the edits, in order, with their patches.

        Before a continuous edit that takes light along comes one of its own for that
        (`completion.continuous_relighting`),
        unless it is `moving`; with `bending` False there is none, and the stack is as long as the edits.

        While an edit is `moving` its patch shows what it left, without the shadow of the part at its new
        place: this does not depend on where that is. Edits that stay meanwhile keep the patches they have.
        `proceed` is called between patches, and may raise.

        Raises `EditError` for a paste of a scene that is not there, or that cannot be pasted.
        """
        made: list[Edit] = []
        feathers = isinstance(self._field, VoxelField)
        if self._pastes is not None:
            edits = self._pastes.read(edits, self._field, preserve_opacity=preserve_opacity, proceed=proceed)
        for edit in edits:
            if edit.pasted is not None and isinstance(self._field, VoxelField):
                if proceed is not None:
                    proceed()
                edit = edit.replace(pasted=self._joined(tuple(made), edit, moving, preserve_opacity))
            if needs_patch(edit, feathers=feathers):
                if proceed is not None:
                    proceed()
                patch = self._patch(tuple(made), edit, moving, preserve_opacity)
                edit = edit if patch is None else edit.replace(patch=patch)
            elif bending and not moving and needs_relighting(edit):
                if proceed is not None:
                    proceed()
                light = self._light(tuple(made), edit)
                made += [] if light is None else [light]
            made.append(edit)
        while len(self._pasted) > max(MAX_CACHED_PATCHES, len(made)):
            self._pasted.popitem(last=False)
        return EditStack(made)

    def _joined(
        self, below: tuple[Edit, ...], edit: Edit, moving: bool, preserve_opacity: bool
    ) -> Pasted | None:
        """What a paste shows; of one that moves, without what it is put over, unless that is known."""
        assert isinstance(self._field, VoxelField)  # splats are put between others
        stack = EditStack(below)
        key: Key = (*stack.active, edit.pasted, edit.deformed, preserve_opacity)
        if key not in self._pasted:
            if moving:
                return edit.pasted
            self._pasted[key] = composite_paste(self._field, stack, edit, preserve_opacity=preserve_opacity)
        self._pasted.move_to_end(key)
        return self._pasted[key]

    @cached_property
    def ambience(self) -> LightModel:
        """How the field's colours follow its openness, and where its surfaces face."""
        sight = self._sight  # whoever knows the light has it: drags do not wait for either
        return self._on_disk.get_or_make(
            ("ambience",),
            lambda: with_diffuse_light(fit_light_model(self._voxels, sight), self._voxels, sight),
        )

    def _lit(self, edit: Edit) -> LightModel | None:
        """What goes along of the light of an edit; None where all stays."""
        if edit.relight == "none":
            return None
        if edit.relight == "occlusion":
            return self.ambience
        direction = edit.relight.direction if isinstance(edit.relight, CastShadow) else None
        if direction not in self._suns:
            self._suns[direction] = self._on_disk.get_or_make(
                ("sun", direction),
                lambda: with_directional_light(self.ambience, self._voxels, self._sight, direction),
            )
        return self._suns[direction]

    @cached_property
    def _voxels(self) -> VoxelField:
        """The field, or splats as coarsely as light is found out about."""
        return self._field if isinstance(self._field, VoxelField) else voxelize_bounds(self._field)

    @cached_property
    def _sight(self) -> CameraVisibility:
        return self._on_disk.get_or_make(
            ("sight",), lambda: render_visibility(self._render, self._cameras, self._field.bounds)
        )

    def _patch(
        self, below: tuple[Edit, ...], edit: Edit, moving: bool, preserve_opacity: bool
    ) -> Patch | SplatPatch | None:
        """The patch of an edit; None for one that wants none while it moves."""
        stack = EditStack(below)
        # A drag does not wait for the light to be found out about.
        known = not moving or "ambience" in self.__dict__
        lit = self._lit(edit) if known else None
        relit = lit is not None and lit.shows
        if edit.source is not None and not relit:
            return None
        feather = edit.feather if isinstance(self._field, VoxelField) else 0.0
        kind = edit.deleted, edit.keep_source, edit.fill, feather, edit.pasted, preserve_opacity
        what: Key = (*stack.active, edit.inner, *kind, relit and edit.relight)
        settled: Key = (*what, edit.deformed if relit or feather > 0.0 else None)
        key: Key = (*what, "moving") if moving and settled not in self._kept else settled
        if key in self._kept:
            self._kept.move_to_end(key)
            return cast("Patch | SplatPatch", self._kept[key])
        if not needs_patch(edit, moving, feathers=isinstance(self._field, VoxelField)):
            return None
        ambience = lit if relit else None
        looks = relit or (edit.fill == "surroundings" and not edit.keep_source)

        sight = self._sight if looks and (not moving or "_sight" in self.__dict__) else None

        def make() -> Patch | SplatPatch:
            if isinstance(self._field, VoxelField):
                return build_patch(
                    self._field,
                    stack,
                    edit,
                    ambience,
                    settled=not moving,
                    sight=sight,
                    preserve_opacity=preserve_opacity,
                )
            return build_splat_patch(self._field, stack, edit, ambience, settled=not moving, sight=sight)

        follows_from = ("patch", ambience, *stack.active, edit, preserve_opacity)
        patch = make() if moving else self._on_disk.get_or_make(follows_from, make)
        self._keep(key, patch)
        return patch

    def _light(self, below: tuple[Edit, ...], edit: Edit) -> Edit | None:
        """The edit that changes the light under a continuous one; None where none changes."""
        lit = self._lit(edit)
        if lit is None or not lit.shows:
            return None
        stack = EditStack(below)
        shape = edit.inner, edit.outer, edit.deformed, edit.shell, edit.falloff, edit.width
        key: Key = ("light", *stack.active, *shape, edit.allow_folding, edit.relight, edit.fill)
        if key in self._kept:
            self._kept.move_to_end(key)
            return cast("Edit | None", self._kept[key])

        def make() -> Patch | SplatPatch | None:
            if isinstance(self._field, VoxelField):
                # While a cage is dragged again and again what is below it stays.
                around: Key = (*stack.active, edit.outer, lit)
                if self._around is None or self._around[0] != around:
                    self._around = around, extract_bent_block(self._field, stack, edit, lit)
                light = relight_voxels(self._field, stack, edit, lit, self._around[1], self._sight)
            else:
                light = relight_splats(self._field, stack, edit, lit, self._sight)
            return None if light is None else light.patch

        patch = self._on_disk.get_or_make(("light", lit, *stack.active, edit), make)
        found = None if patch is None else light_edit(edit, patch)
        self._keep(key, found)
        return found

    def _keep(self, key: Key, found: Patch | SplatPatch | Edit | None) -> None:
        self._kept[key] = found
        while len(self._kept) > MAX_CACHED_PATCHES:
            self._kept.popitem(last=False)


def needs_patch(edit: Edit, moving: bool = False, *, feathers: bool = True) -> bool:
    """True for an edit that is shown, and leaves something to be filled or put into another light.

    `feathers`: or that has a seam, which splats have not.
    """
    if edit.adjustment != "discrete" or not (edit.enabled and edit.changes_anything):
        return False
    seam = feathers and edit.feather > 0.0
    if edit.keep_source:
        return not moving and (edit.relight != "none" or seam)
    return edit.fill != "none" or edit.relight != "none" or (seam and not edit.deleted)


def needs_relighting(edit: Edit) -> bool:
    """True for a continuous edit that is shown and takes light along."""
    return (
        edit.adjustment == "continuous"
        and edit.enabled
        and edit.changes_anything
        and edit.relight != "none"
        and edit.is_possible
    )
