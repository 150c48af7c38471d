"""State of an editing session: document and history, the edits that pictures show, drags and the preview.

A drag works on the edit as it was when the drag began, and becomes one entry of the history when it ends.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from cagefield.cameras.keyframes import Timeline
from cagefield.edits import Continuous, Edit
from cagefield.edits.chains import parent_numbers
from cagefield.edits.edit_files import MAX_EDITS
from cagefield.edits.operations import Operation
from cagefield.edits.options import problem_of_lattices
from cagefield.errors import EditError
from cagefield.geometry.detour_grid import DetourGrid
from cagefield.scene.hotspot_motion import shown_hotspots
from cagefield.scene.hotspots import Hotspot
from cagefield.selection.element_selection import Selection
from cagefield.server.editor import hotspot_list
from cagefield.server.editor.active_drags import Drags
from cagefield.server.editor.chain_edits import Carriers, descendants
from cagefield.server.editor.connected_edits import ConnectedEdits, Wanted, is_unprepared
from cagefield.server.editor.document import Document, Entry
from cagefield.server.editor.drag_solver import Moved, Target, move
from cagefield.server.editor.history import History
from cagefield.server.editor.identity_cache import IdentityCache
from cagefield.server.editor.labels import edit_label
from cagefield.server.editor.path_edits import edits_at_time
from cagefield.server.editor.path_preview import Preview
from cagefield.server.editor.validity import problem
from cagefield.typing import Array


class SessionState:
    """The document with its history, the selection, the drags and the preview that go on."""

    def __init__(
        self,
        document: Document,
        bounds: Array,
        voxel: float,
        source_problem: Callable[[Edit], str | None] = lambda edit: None,
    ) -> None:
        """`bounds` [2,3] and `voxel` are the field's, world units.

        `source_problem` says why the scene that an edit pastes from cannot be had, or None.
        """
        self.history = History.begin(document)
        self._source_problem = source_problem
        self.bounds = bounds
        self.voxel = voxel
        self.selected: int | None = document.entries[-1].id if document.entries else None
        self.drags = Drags()
        self.preview: Preview | None = None
        """Preview that a page plays; ends with the next change of the document or drag."""
        self.isolated: Selection | None = None
        """The only elements that pictures show, None for all; no entry of the history."""
        self.revision = 1
        self._saved: Document | None = document
        self._next = max((entry.id for entry in document.entries), default=0) + 1
        self._next_hotspot = hotspot_list.next_number(document.hotspots)
        self._hotspots: tuple[tuple[Hotspot, ...], tuple[Edit, ...], tuple[Hotspot | None, ...]] | None = None
        self._problems: IdentityCache[Edit, str | None] = IdentityCache(4 * MAX_EDITS)
        self._connected = ConnectedEdits()
        self._carriers = Carriers(self.problem, self._connected.resolved)

    # ---- what is there ----

    @property
    def document(self) -> Document:
        """The document as it is, without the drags."""
        return self.history.state

    @property
    def shown(self) -> Document:
        """The document as the drags that go on show it."""
        return self.drags.shown(self.document)

    @property
    def moving(self) -> bool:
        """True while images differ from the document: during drags and previews."""
        return bool(self.drags) or self.preview is not None

    @property
    def saved(self) -> bool:
        """True where the document is as it was last saved."""
        return self.document.saved_part == self._saved

    def problem(self, edit: Edit) -> str | None:
        """Why an edit cannot be shown, or None; remembered for the edits that were asked about last."""
        found = self._problem(edit)
        resolved = self._connected.resolved(edit)
        if found is None and resolved is not edit:
            return self._problem(resolved)
        return found or self._connected.problem(edit)

    def _problem(self, edit: Edit) -> str | None:
        if edit in self._problems:
            return self._problems[edit]
        found = problem(edit) if edit.changes_anything else None
        return self._problems.put(edit, found or self._source_problem(edit))

    def shown_hotspots(self) -> tuple[Hotspot | None, ...]:
        """Hotspots of the document where its edits, without drags, carry them; None for hidden ones."""
        hotspots = tuple(entry.hotspot for entry in self.document.hotspots)
        edits = self._drawn(self.document.applied) if any(each.follows for each in hotspots) else ()
        if self._hotspots is None or self._hotspots[:2] != (hotspots, edits):
            self._hotspots = hotspots, edits, shown_hotspots(hotspots, edits)
        return self._hotspots[2]

    def drawn(self) -> tuple[Edit, ...]:
        """The edits that the picture shows, in the order of application; or the preview's.

        They are enabled, change something, and are possible.
        """
        if self.preview is not None:
            return self.preview.edits
        return self._drawn(self.shown.applied)

    def drawn_below(self, number: int) -> tuple[Edit, ...]:
        """Edits as in `drawn` that are applied before the applied entry `number`, without the preview."""
        return self._drawn(self.shown.applied[:number])

    def _drawn(self, entries: Iterable[Entry]) -> tuple[Edit, ...]:
        edits = (entry.edit for entry in entries)
        return tuple(
            edit.without_parent
            for edit in edits
            if edit.enabled and edit.changes_anything and self.problem(edit) is None
        )

    def carrier(self, entry: Entry) -> Array | None:
        """Affine map [3,4] by which the parents of a shown entry carry its cages; None without any."""
        return self._carriers.carrier(self.shown, entry)

    def carriers_of(self, page: int) -> dict[int, Array | None]:
        """The affine map [3,4] of every entry that the one that a page drags carries, by number; None where
        it stays."""
        dragged = self.drags.dragged(page)
        if dragged is None:
            return {}
        shown = self.shown
        return {entry.id: self._carriers.carrier(shown, entry) for entry in descendants(shown, dragged)}

    def detours_wanted(self) -> Wanted | None:
        """Connected control points whose detours pages and pictures need and the session does not know."""
        applied, removed = self.shown.applied, self.shown.removed
        edits = [
            (entry.edit, self._drawn(applied[:at]))
            for at, entry in enumerate(applied)
            if entry.edit.enabled and is_unprepared(entry.edit)
        ]
        return self._connected.wanted(edits, removed)

    def detours_found(self, wanted: Wanted, found: DetourGrid | str) -> None:
        """Detours that were wanted, or why there are none, which is then the edit's problem."""
        self._connected.put(wanted, found)
        self.revision += 1

    def below(self, number: int) -> tuple[Edit, ...]:
        """Drawn edits before edit `number`, which define the space of its inner cage."""
        applied = self.document.applied
        first = applied[: applied.index(self.document.entry(number))]
        edits = (entry.edit for entry in first)
        return tuple(edit.without_parent for edit in edits if edit.enabled and self.problem(edit) is None)

    # ---- drags ----

    def drag_begin(self, page: int, number: int, edit: int, target: Target) -> None:
        """A page begins to drag; a drag of its own that went on is given up."""
        self.drag_cancel(page)
        self.drags.begin(page, number, self._unlocked(edit), target)
        self.preview = None
        self.selected = edit
        self.revision += 1

    def drag(self, page: int, number: int, operation: Operation) -> Moved:
        """How far the drag could follow its operation since the beginning; it shows that."""
        moved = self.drags.move(page, number, operation)
        self._problems.put(moved.edit, moved.problem)
        self.revision += 1
        return moved

    def drag_end(self, page: int, number: int, operation: Operation) -> Moved:
        """Last step of a drag, as an entry of the history.

        Where another page has changed the edit meanwhile, the operation is applied to its present state.
        """
        drag = self.drags.take(page, number)
        self.revision += 1
        entry = self.document.entry(drag.before.id)
        moved = move(entry, drag.target, operation)
        if moved.part > 0.0 and moved.edit != entry.edit:
            self._put(edit_label(operation, drag.target, entry), replace(entry, edit=moved.edit))
        return moved

    def drag_cancel(self, page: int) -> None:
        """The page's drag is given up, if there is one."""
        if self.drags.cancel(page):
            self.revision += 1

    # ---- the preview ----

    def play_begin(self, page: int, number: int) -> None:
        """Start the preview of the camera path from its beginning; ends an earlier preview.

        Raises EditError while anybody drags, CagefieldError where the path or an edit on it is not possible.
        """
        if self.drags:
            raise EditError("an edit is being dragged; play the camera path when the drag is over")
        timeline = Timeline(self.document.keys, loop=self.document.loop)
        self.preview = Preview(page, number, timeline, self.drawn())
        self.revision += 1
        self.play(page, number, 0.0)

    def play(self, page: int, number: int, seconds: float) -> None:
        """Shows the edits as the video will at a time; nothing where this is not played any more.

        Raises CagefieldError, and the preview is over, where an edit is not possible there.
        """
        preview = self.preview
        if preview is None or not preview.is_of(page, number):
            return
        self.preview = None
        self.revision += 1
        edits = edits_at_time(self.document, preview.parts(seconds), self.problem)
        self.preview = replace(preview, edits=edits)

    def play_end(self, page: int, number: int | None = None) -> None:
        """End the page's preview: the one of a number, or any."""
        preview = self.preview
        if preview is not None and preview.is_of(page, preview.number if number is None else number):
            self.preview = None
            self.revision += 1

    # ---- history ----

    def undo(self) -> None:
        """One entry of the history back."""
        self._travel(History.undo)

    def redo(self) -> None:
        """One entry of the history on."""
        self._travel(History.redo)

    def go_to(self, entry: int) -> None:
        """To an entry of the history."""
        self._travel(lambda history: history.go_to(entry))

    def mark_saved(self) -> None:
        """Mark the present document as saved."""
        self._saved = self.document.saved_part
        self.revision += 1

    # ---- inside ----

    def _travel(self, step: Callable[[History[Document]], History[Document]]) -> None:
        self.drags.clear()
        self.preview = None
        removed = self.document.removed
        self.history = step(self.history)
        if self.document.removed != removed:
            self.isolated = None
        if not self.document.has(self.selected):
            entries = self.document.entries
            self.selected = entries[-1].id if entries else None
        self.revision += 1

    def _unlocked(self, number: int) -> Entry:
        entry = self.document.entry(number)
        if entry.locked:
            raise EditError(f'edit "{entry.edit.name}" is locked; unlock it to change it')
        return entry

    def _entry(self, edit: Edit, document: Document) -> Entry:
        number = self._next
        self._next += 1
        return Entry(number, edit, document.next_color)

    def _add(self, name: str, edit: Edit, at: int | None = None) -> int:
        entry = self._entry(edit, self.document)
        self._push(name, self.document.insert(entry, at))
        self.selected = entry.id
        return entry.id

    def _put(self, name: str, entry: Entry) -> None:
        self._push(name, self.document.put(entry))
        self.selected = entry.id

    def _push(self, name: str, document: Document) -> None:
        parent_numbers([entry.edit for entry in document.entries])
        shown = (entry.edit for entry in document.entries if entry.edit.enabled)
        too_large = problem_of_lattices(edit.kernel_lattice for edit in shown if isinstance(edit, Continuous))
        if too_large is not None:
            raise EditError(too_large)
        self.preview = None
        self.drags.keep(document)
        self.history = self.history.push(name, document)
        self.revision += 1
