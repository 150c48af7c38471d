"""Renderers of one field under the edits shown last: exact ones, and coarse ones for motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cagefield.edits import Continuous, Edit
from cagefield.server.editor.identity_cache import IdentityCache

if TYPE_CHECKING:
    from cagefield.completion.patcher import Patcher
    from cagefield.rendering.renderers import InteractiveRenderer

QUICK_LATTICE = 32
"""Most lattice nodes along an axis while a cage is dragged."""


@dataclass(frozen=True)
class _Kept:
    """A renderer that is ready, and its edits."""

    edits: tuple[Edit, ...]
    preserve_opacity: bool
    renderer: InteractiveRenderer

    def shows(self, edits: tuple[Edit, ...], preserve_opacity: bool) -> bool:
        return self.edits == edits and self.preserve_opacity == preserve_opacity


class EditedRenderers:
    """See the module."""

    def __init__(self, plain: InteractiveRenderer, is_sampled: bool, patcher: Patcher) -> None:
        """`is_sampled`: rays are sampled, and samples mapped; lattices are for those alone."""
        self._plain, self._is_sampled, self._patcher = plain, is_sampled, patcher
        self._coarse: IdentityCache[Edit, Edit] = IdentityCache(32)
        self._exact: list[_Kept] = []
        self._quick: list[_Kept] = []

    @property
    def exact(self) -> list[InteractiveRenderer]:
        """The exact renderers that are ready, the newest last."""
        return [kept.renderer for kept in self._exact]

    def keep_only(self, edits: Sequence[Edit]) -> None:
        """Release results of other edits, except renderers."""
        self._coarse.keep_only(edits)

    def renderer(
        self,
        edits: Sequence[Edit],
        preserve_opacity: bool,
        exact: bool,
        proceed: Callable[[], None] | None = None,
    ) -> InteractiveRenderer:
        """The renderer of the edits: one that is ready, else an exact or a quick one made now.

        `proceed` is called while it is made, and gives it up by raising.
        """
        wanted = tuple(edits)
        for kept in self._exact if exact else (*self._exact, *self._quick):
            if kept.shows(wanted, preserve_opacity):
                return kept.renderer
        shown = list(wanted)
        if not exact and self._is_sampled:
            ready = {id(edit) for kept in self._exact for edit in kept.edits}
            shown = [edit if id(edit) in ready else self._quickly(edit) for edit in shown]
        # Occupancy under edits that both share is kept.
        last = self._exact[-1:] if exact else (self._quick or self._exact[-1:])
        stack = self._patcher.prepare(
            shown, moving=not exact, preserve_opacity=preserve_opacity, proceed=proceed
        )
        renderer = (last[0].renderer if last else self._plain).with_edits(
            stack, preserve_opacity=preserve_opacity, coarse=not exact, proceed=proceed
        )
        kept = _Kept(wanted, preserve_opacity, renderer)
        if exact:
            # Two: what pages show, and what a job renders.
            self._exact = [*self._exact[-1:], kept]
        else:
            self._quick = [kept]
        return renderer

    def _quickly(self, edit: Edit) -> Edit:
        """The edit with a coarser lattice, kept as long as the edit is."""
        if not isinstance(edit, Continuous) or (edit.lattice or 512) <= QUICK_LATTICE:
            return edit
        if edit in self._coarse:
            return self._coarse[edit]
        return self._coarse.put(edit, edit.replace(lattice=QUICK_LATTICE))
