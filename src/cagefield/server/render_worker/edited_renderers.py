"""Renderers of one field under the edits shown last, by the refinement of their picture."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from cagefield.completion.patch_stages import PatchStage
from cagefield.edits import Continuous, Edit, PreparedStack
from cagefield.server.editor.identity_cache import IdentityCache
from cagefield.server.render_worker.refinement import FINAL, Refinement

if TYPE_CHECKING:
    from cagefield.rendering.renderers import InteractiveRenderer

QUICK_LATTICE = 32
"""Most lattice nodes along an axis while a cage is dragged."""


MAX_MERGED_SECONDS = 1.5
"""Time in which holes are inpainted, up to which no picture comes before the final one: light takes no longer
where all else is exact, and a picture on the way would delay it by a third."""

KEPT_FINAL = 2
"""Final renderers that are kept: of the pages' pictures, and of a job's."""


class PatchSource(Protocol):
    """Source of prepared edits: a `Patcher`, or one without patches."""

    def prepare(
        self,
        edits: Sequence[Edit],
        *,
        stage: PatchStage = ...,
        preserve_opacity: bool = ...,
        proceed: Callable[[], None] | None = ...,
    ) -> PreparedStack:
        """Stack of the edits with their patches of a stage (`Patcher.prepare`)."""

    def attained_stage(self, prepared: PreparedStack, *, preserve_opacity: bool = ...) -> PatchStage:
        """Last stage whose patches a stack of `prepare` has already (`Patcher.attained_stage`)."""


@dataclass(frozen=True)
class RefinedRenderer:
    """A renderer of edits.

    `refinement` is the last one that it has: at least the one asked for, later ones where they are known or
    change nothing.
    """

    edits: tuple[Edit, ...]
    preserve_opacity: bool
    refinement: Refinement
    renderer: InteractiveRenderer

    def shows(self, edits: tuple[Edit, ...], preserve_opacity: bool) -> bool:
        """Whether it shows these edits."""
        return self.edits == edits and self.preserve_opacity == preserve_opacity


class EditedRenderers:
    """See the module."""

    def __init__(self, plain: InteractiveRenderer, is_sampled: bool, patcher: PatchSource) -> None:
        """`is_sampled`: rays are sampled, and samples mapped; lattices are for those alone."""
        self._plain, self._is_sampled, self._patcher = plain, is_sampled, patcher
        self._coarse: IdentityCache[Edit, Edit] = IdentityCache(32)
        self._kept: list[RefinedRenderer] = []
        """The newest last: one that is not final, at most KEPT_FINAL that are."""

    @property
    def final(self) -> list[InteractiveRenderer]:
        """The final renderers that are ready, the newest last."""
        return [kept.renderer for kept in self._kept if kept.refinement == FINAL]

    def keep_only(self, edits: Sequence[Edit]) -> None:
        """Release results of other edits, except renderers."""
        self._coarse.keep_only(edits)

    def renderer(
        self,
        edits: Sequence[Edit],
        preserve_opacity: bool,
        refinement: Refinement,
        proceed: Callable[[], None] | None = None,
    ) -> RefinedRenderer:
        """The renderer of the edits with a refinement, or a later one: one that is kept, else made now.

        `proceed` is called while it is made, and cancels by raising.
        """
        wanted = tuple(edits)
        for kept in sorted(self._kept, key=lambda kept: -kept.refinement):
            if kept.refinement >= refinement and kept.shows(wanted, preserve_opacity):
                return kept
        shown = list(wanted)
        if refinement.is_coarse and self._is_sampled:
            exact = (kept.edits for kept in self._kept if not kept.refinement.is_coarse)
            ready = {id(edit) for each in exact for edit in each}
            shown = [edit if id(edit) in ready else self._quickly(edit) for edit in shown]
        began = time.perf_counter()
        stack = self._patcher.prepare(
            shown, stage=PATCH_STAGES[refinement], preserve_opacity=preserve_opacity, proceed=proceed
        )
        patches = self._patcher.attained_stage(stack, preserve_opacity=preserve_opacity)
        is_quick = time.perf_counter() - began < MAX_MERGED_SECONDS
        bends = any(isinstance(edit, Continuous) and _is_active(edit) for edit in wanted)
        is_awaited = refinement in (Refinement.INPAINTED, Refinement.EXACT)
        if is_awaited and is_quick and not bends and patches is PatchStage.INPAINTED:
            refinement, patches = FINAL, PatchStage.LIT
            stack = self._patcher.prepare(shown, preserve_opacity=preserve_opacity, proceed=proceed)
        attained = attained_refinement(refinement, wanted, patches, splits=not self._is_sampled)
        # Occupancy under edits that both share is kept.
        alike = [kept for kept in self._kept if kept.refinement.is_coarse == refinement.is_coarse]
        base = (alike or self._kept)[-1].renderer if alike or self._kept else self._plain
        renderer = base.with_edits(
            stack, preserve_opacity=preserve_opacity, coarse=refinement.is_coarse, proceed=proceed
        )
        made = RefinedRenderer(wanted, preserve_opacity, attained, renderer)
        final = [kept for kept in self._kept if kept.refinement == FINAL]
        if attained == FINAL:
            self._kept = [*final[1 - KEPT_FINAL :], made]
        else:
            self._kept = [*final, made]
        return made

    def _quickly(self, edit: Edit) -> Edit:
        """The edit with a coarser lattice, kept as long as the edit is."""
        if not isinstance(edit, Continuous) or (edit.kernel_lattice or 512) <= QUICK_LATTICE:
            return edit
        if edit in self._coarse:
            return self._coarse[edit]
        return self._coarse.put(edit, edit.replace(lattice=QUICK_LATTICE))


PATCH_STAGES = {
    Refinement.DRAFT: PatchStage.CACHED,
    Refinement.INPAINTED: PatchStage.INPAINTED,
    Refinement.EXACT: PatchStage.INPAINTED,
    Refinement.LIT: PatchStage.LIT,
}
"""Patches of each refinement."""


def attained_refinement(
    made: Refinement, edits: Sequence[Edit], patches: PatchStage, *, splits: bool
) -> Refinement:
    """The last refinement that a picture of edits `made` with one has: those after it change nothing.

    patches: the stage that the picture's patches have attained; splits: whether elements are split where an
    edit cuts or bends them.
    """
    is_coarse = made.is_coarse and any(
        _is_active(edit) and (splits or isinstance(edit, Continuous)) for edit in edits
    )
    if made < Refinement.INPAINTED and patches < PatchStage.INPAINTED:
        return made
    if is_coarse:
        return max(made, Refinement.INPAINTED)
    return max(made, Refinement.EXACT) if patches < PatchStage.LIT else FINAL


def _is_active(edit: Edit) -> bool:
    return edit.enabled and edit.changes_anything
