"""Patches of one field's edits, computed on demand, with a cache of the latest."""

from __future__ import annotations

import functools
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, cast

from cagefield.cameras.camera import Camera
from cagefield.completion.continuous_relighting import (
    VoxelBlock,
    extract_voxel_block,
    light_edit,
    relight_voxels,
)
from cagefield.completion.detour_cache import DetourCache
from cagefield.completion.discrete_patch import build_patch
from cagefield.completion.edit_context import extract_field_surfels
from cagefield.completion.lighting.ambient_occlusion import (
    LightModel,
    fit_light_model,
    with_diffuse_light,
    with_directional_light,
)
from cagefield.completion.pasting.paste_composite import composite_paste
from cagefield.completion.pasting.paste_loader import PasteLoader
from cagefield.completion.patch_cache import DiskCache
from cagefield.completion.patch_stages import PatchStage, needs_patch, needs_relighting
from cagefield.completion.removal import Removal
from cagefield.completion.removal_cache import RemovalCache
from cagefield.completion.splat_patch import (
    SplatBlock,
    SplatRemoval,
    build_splat_patch,
    extract_splat_block,
    relight_splats,
)
from cagefield.completion.surfaces.splat_voxelization import voxelize_bounds
from cagefield.completion.surfaces.surfels import Surfels
from cagefield.completion.surfaces.visibility import CameraVisibility, render_visibility
from cagefield.compute.cancellation import cancellable, check_cancelled
from cagefield.edits import Continuous, Discrete, Edit, Paste, PreparedEdit, PreparedStack
from cagefield.edits.options import CastShadow
from cagefield.edits.patch import Pasted, Patch, SplatPatch
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.images.render_result import RenderResult
from cagefield.rendering.splats.splat_provenance import SplatSet

MAX_CACHED_PATCHES = 16
"""Maximum number of patches in memory."""

Key = tuple[object, ...]


class Patcher:
    """Patches for the `fill` and `relight` options of edits of one field.

    cameras: the cameras of the field's photos; the light model is fitted to images from there by `render`,
    which renders the field without edits, with normals. pastes: the loader of the content of pastes.
    """

    def __init__(
        self,
        field: VoxelField | SplatField | SplatSet,
        cameras: Sequence[Camera],
        render: Callable[[Camera], RenderResult],
        pastes: PasteLoader | None = None,
    ) -> None:
        self._content = field if isinstance(field, VoxelField) else SplatSet.from_field(field)
        self._field = self._content if isinstance(self._content, VoxelField) else self._content.field
        self._cameras, self._render, self._pastes = cameras, render, pastes
        self._disk_cache = DiskCache(self._field, cameras)
        self._cache: OrderedDict[Key, Patch | SplatPatch | PreparedEdit | None] = OrderedDict()
        self._light_block: tuple[Key, VoxelBlock | SplatBlock] | None = None
        self._removals = RemovalCache(self._content, lambda: self._surfels)
        self._directional_models: dict[tuple[float, float, float] | None, LightModel] = {}
        self._composites: OrderedDict[Key, Pasted] = OrderedDict()
        self.detours = DetourCache(self._field)
        self._images: dict[Key, RenderResult] = {}

    def prepare(
        self,
        edits: Sequence[Edit],
        *,
        stage: PatchStage = PatchStage.LIT,
        relight_continuous: bool = True,
        preserve_opacity: bool = True,
        proceed: Callable[[], None] | None = None,
    ) -> PreparedStack:
        """Stack of the edits, in order, with their patches and the content of their pastes.

        A continuous edit that relights has the change of its light (`completion.continuous_relighting`),
        except below stage LIT or with `relight_continuous` False. An edit whose patch of a later `stage` is
        cached has that one. `proceed` is called between patches and their parts, and may raise to cancel.

        Raises `EditError` for a paste whose scene is missing or cannot be pasted.
        """
        with cancellable(proceed):
            ready = [PreparedEdit(edit) for edit in edits]
            if self._pastes is not None:
                ready = self._pastes.read(
                    edits, self._field, preserve_opacity=preserve_opacity, proceed=proceed
                )
            prepared: list[PreparedEdit] = []
            for step in ready:
                check_cancelled()
                below = PreparedStack(prepared)
                connected = self.detours.prepared(step, below)
                prepared.append(self._prepare(connected, below, stage, relight_continuous, preserve_opacity))
        while len(self._composites) > max(MAX_CACHED_PATCHES, len(prepared)):
            self._composites.popitem(last=False)
        return PreparedStack(prepared)

    def with_detours(self, edits: Sequence[Edit]) -> list[Edit]:
        """The edits of a document, in its order, with the detours of connected control points, which exact
        maps need.

        Raises `EditError` for a control point without matter within the radius.
        """
        return self.detours.in_stack(edits)

    def _prepare(
        self,
        step: PreparedEdit,
        below: PreparedStack,
        stage: PatchStage,
        relight_continuous: bool,
        preserve_opacity: bool,
    ) -> PreparedEdit:
        """One edit with its patch, above those below; arguments as in `prepare`."""
        edit, is_voxels = step.edit, isinstance(self._field, VoxelField)
        if isinstance(edit, Paste) and step.pasted is not None and is_voxels:
            step = replace(step, pasted=self._composite(below, edit, step.pasted, stage, preserve_opacity))
        if isinstance(edit, Discrete) and needs_patch(edit, feathers=is_voxels):
            return replace(step, patch=self._patch(below, edit, step.pasted, stage, preserve_opacity))
        if relight_continuous and isinstance(edit, Continuous) and needs_relighting(edit):
            return replace(step, light=self._build_light(below, edit, stage))
        return step

    def attained_stage(self, prepared: PreparedStack, *, preserve_opacity: bool = True) -> PatchStage:
        """Last stage whose patches the stack of `prepare` has for certain: LIT where it needs none.

        A patch that is there counts as INPAINTED, also where it is that of stage LIT.
        """
        is_voxels = isinstance(self._field, VoxelField)
        known_dark = "light_model" in self.__dict__ and not self.light_model.has_effect
        attained = PatchStage.LIT
        for number, step in enumerate(prepared):
            edit, below = step.edit, PreparedStack(prepared.edits[:number])
            if isinstance(edit, Paste) and is_voxels and edit.enabled:
                attained = min(attained, PatchStage.INPAINTED)  # composited with the field beneath
            if isinstance(edit, Discrete) and needs_patch(edit, feathers=is_voxels):
                has_patch = self._has_patch(below, step, preserve_opacity)
                attained = min(attained, PatchStage.INPAINTED if has_patch else PatchStage.CACHED)
            is_dark = known_dark and edit.relight == "occlusion"
            if needs_relighting(edit) and not is_dark:
                attained = min(attained, PatchStage.INPAINTED)
        return attained

    def _has_patch(self, below: PreparedStack, step: PreparedEdit, preserve_opacity: bool) -> bool:
        """Whether a discrete edit, above those below, has its patch of stage INPAINTED or of LIT."""
        edit = step.edit
        assert isinstance(edit, Discrete)
        if step.patch is None or not self._is_model_known(edit):
            return False
        has_light = (model := self._model_for(edit)) is not None and model.has_effect
        keys = self._patch_keys(below, edit, step.pasted, has_light, preserve_opacity)[:2]
        return any(self._cache.get(key) is step.patch for key in keys)

    def warm(
        self,
        edits: Sequence[Edit] = (),
        *,
        preserve_opacity: bool = True,
        proceed: Callable[[], None] | None = None,
    ) -> None:
        """Compute all that does not depend on where the next drag goes; `proceed` cancels.

        These are the visibility, the light model and the surfels of the field, and of the last of the edits,
        if it is a continuous one that relights, the block around its outer cage, if it is a discrete one,
        the removal of its part.
        """
        with cancellable(proceed):
            _ = self.light_model, self._surfels
            last = edits[-1] if edits else None
            if not isinstance(last, Continuous | Discrete) or isinstance(last, Paste):
                return
            below = self.prepare(edits[:-1], preserve_opacity=preserve_opacity, proceed=proceed)
            has_light = (model := self._model_for(last)) is not None and model.has_effect
            if isinstance(last, Continuous):
                if has_light:
                    assert model is not None
                    self._block_around(below, last, model)
            elif has_light or (last.fill != "none" and last.uncovers):
                used, visibility = self._inputs(last, model, is_lit=True)
                self._removals.get_or_make(below, last, used, visibility, preserve_opacity)

    def _composite(
        self, below: PreparedStack, edit: Paste, pasted: Pasted, stage: PatchStage, preserve_opacity: bool
    ) -> Pasted:
        """Content of a paste, composited with the field beneath; below stage LIT only if cached."""
        assert isinstance(self._field, VoxelField)  # splats need no compositing
        key: Key = (*below.steps, pasted, edit.deformed, edit.mirrored, preserve_opacity)
        if key not in self._composites:
            if stage < PatchStage.LIT:
                return pasted
            self._composites[key] = composite_paste(
                self._field, below, edit, pasted, preserve_opacity=preserve_opacity
            )
        self._composites.move_to_end(key)
        return self._composites[key]

    @cached_property
    def light_model(self) -> LightModel:
        """Light model of the field: openness and diffuse term."""
        # Computed first: a known light model implies known visibility.
        visibility = self._visibility
        return self._disk_cache.get_or_make(
            ("light_model",),
            lambda: with_diffuse_light(
                fit_light_model(self._voxel_field, visibility), self._voxel_field, visibility
            ),
        )

    def _model_for(self, edit: Edit) -> LightModel | None:
        """Light model for the `relight` option of an edit; None where light stays."""
        if edit.relight == "none":
            return None
        if edit.relight == "occlusion":
            return self.light_model
        direction = edit.relight.direction if isinstance(edit.relight, CastShadow) else None
        if direction not in self._directional_models:
            self._directional_models[direction] = self._disk_cache.get_or_make(
                ("sun", direction),
                lambda: with_directional_light(
                    self.light_model, self._voxel_field, self._visibility, direction
                ),
            )
        return self._directional_models[direction]

    def _is_model_known(self, edit: Edit) -> bool:
        """Whether `_model_for` an edit computes nothing."""
        if edit.relight in ("none", "occlusion"):
            return edit.relight == "none" or "light_model" in self.__dict__
        direction = edit.relight.direction if isinstance(edit.relight, CastShadow) else None
        return direction in self._directional_models

    @cached_property
    def _voxel_field(self) -> VoxelField:
        """Voxel field, or splats voxelized at the resolution of the fit of a light model."""
        return self._field if isinstance(self._field, VoxelField) else voxelize_bounds(self._field)

    @cached_property
    def _visibility(self) -> CameraVisibility:
        """Visibility of the field's surfaces; its images are kept where it is cancelled."""
        visibility = self._disk_cache.get_or_make(
            ("sight",), lambda: render_visibility(self._image, self._cameras, self._field.bounds)
        )
        self._images.clear()
        return visibility

    @cached_property
    def _surfels(self) -> Surfels | None:
        """Surfels of the whole field for discrete edits; None of splats, and of a field too large."""
        if not isinstance(field := self._content, VoxelField):
            return None
        make = functools.partial(extract_field_surfels, field, self._visibility)
        return self._disk_cache.get_or_make(("surfels",), make)

    @property
    def visible_surfels(self) -> Surfels:
        """Surfels of the field's surfaces that its cameras see, canonical space."""
        return self._visibility.surface

    def _image(self, camera: Camera) -> RenderResult:
        key = camera.c2w.tobytes(), camera.fx, camera.fy, camera.width, camera.height
        if key not in self._images:
            self._images[key] = self._render(camera)
        return self._images[key]

    def _patch(
        self,
        below: PreparedStack,
        edit: Discrete,
        pasted: Pasted | None,
        stage: PatchStage,
        preserve_opacity: bool,
    ) -> Patch | SplatPatch | None:
        """Patch of a discrete edit; None for an edit without one at a stage."""
        is_voxels = isinstance(self._field, VoxelField)
        is_lit = stage is PatchStage.LIT
        model_or_none = self._model_for(edit) if is_lit or self._is_model_known(edit) else None
        has_light = model_or_none is not None and model_or_none.has_effect
        if isinstance(edit, Paste) and not has_light:
            return None
        final_key, moving_key, unlit_key = self._patch_keys(below, edit, pasted, has_light, preserve_opacity)
        for key in (final_key,) if is_lit else (final_key, moving_key):
            if key in self._cache:
                self._cache.move_to_end(key)
                return cast("Patch | SplatPatch", self._cache[key])
        if stage is PatchStage.CACHED:
            return cast("Patch | SplatPatch | None", self._cache.get(unlit_key))
        if not needs_patch(edit, not is_lit, feathers=is_voxels):
            return None
        model, visibility = self._inputs(edit, model_or_none, is_lit)

        def make() -> Patch | SplatPatch:
            removal: Removal | SplatRemoval | None = None
            if not isinstance(edit, Paste):
                removal = self._removals.get_or_make(below, edit, model, visibility, preserve_opacity)
            common: dict[str, Any] = {"include_destination": is_lit, "removal": removal}
            common |= {"visibility": visibility, "pasted": pasted}
            if isinstance(self._content, VoxelField):
                common |= {"preserve_opacity": preserve_opacity}
                return build_patch(self._content, below, edit, model, **common)
            return build_splat_patch(self._content, below, edit, model, **common)

        inputs = ("patch", model, *below.steps, edit.ungraded, preserve_opacity)
        patch = self._disk_cache.get_or_make(inputs, make) if is_lit else make()
        self._store(final_key if is_lit else moving_key, patch)
        return patch

    def _inputs(
        self, edit: Discrete, model: LightModel | None, is_lit: bool
    ) -> tuple[LightModel | None, CameraVisibility | None]:
        """(light model, visibility) for the patch of an edit, as far as it needs them and they are known."""
        used = model if model is not None and model.has_effect else None
        needs_visibility = used is not None or (edit.fill == "surroundings" and edit.uncovers)
        if not needs_visibility or not (is_lit or "_visibility" in self.__dict__):
            return used, None
        return used, self._visibility

    def _patch_keys(
        self,
        below: PreparedStack,
        edit: Discrete,
        pasted: Pasted | None,
        has_light: bool,
        preserve_opacity: bool,
    ) -> tuple[Key, Key, Key]:
        """Keys of the patch of stage LIT, of that of INPAINTED, and of the latter without light."""
        feather = edit.feather if isinstance(self._field, VoxelField) else 0.0
        kind = type(edit), edit.fill, feather, pasted, preserve_opacity
        base_key: Key = (*below.steps, edit.inner, *kind, has_light and edit.relight)
        shown = (edit.deformed, edit.mirrored) if has_light or feather > 0.0 else None
        unlit_key: Key = (*below.steps, edit.inner, *kind, False, "moving")
        return (*base_key, shown), (*base_key, "moving"), unlit_key

    def _build_light(self, below: PreparedStack, edit: Continuous, stage: PatchStage) -> PreparedEdit | None:
        """Edit that changes the light under a continuous one; None if no light changes, or none is known."""
        if stage < PatchStage.LIT:
            return None
        model = self._model_for(edit)
        if model is None or not model.has_effect:
            return None
        shape = edit.inner, edit.outer, edit.deformed, edit.shell
        key: Key = ("light", *below.steps, *shape, edit.allow_folding, edit.relight, edit.fill)
        if key in self._cache:
            self._cache.move_to_end(key)
            return cast("PreparedEdit | None", self._cache[key])

        def make() -> Patch | SplatPatch | None:
            block = self._block_around(below, edit, model)
            light: PreparedEdit | None
            if isinstance(self._content, VoxelField):
                assert isinstance(block, VoxelBlock)
                light = relight_voxels(self._content, below, edit, model, block, self._visibility)
            else:
                assert isinstance(block, SplatBlock)
                light = relight_splats(self._content, below, edit, model, self._visibility, block)
            return None if light is None else light.patch

        patch = self._disk_cache.get_or_make(("light", model, *below.steps, edit.ungraded), make)
        relighting = None if patch is None else light_edit(edit, patch)
        self._store(key, relighting)
        return relighting

    def _block_around(
        self, below: PreparedStack, edit: Continuous, model: LightModel
    ) -> VoxelBlock | SplatBlock:
        """Block around the outer cage of an edit, above those below: the same over many drags of the cage."""
        key: Key = (*below.steps, edit.outer, model)
        if self._light_block is None or self._light_block[0] != key:
            block: VoxelBlock | SplatBlock
            if isinstance(self._content, VoxelField):
                block = extract_voxel_block(self._content, below, edit, model)
            else:
                block = extract_splat_block(self._content, below, edit, model)
            self._light_block = key, block
        return self._light_block[1]

    def _store(self, key: Key, value: Patch | SplatPatch | PreparedEdit | None) -> None:
        """Store a patch, and drop the oldest beyond MAX_CACHED_PATCHES."""
        self._cache[key] = value
        while len(self._cache) > MAX_CACHED_PATCHES:
            self._cache.popitem(last=False)
