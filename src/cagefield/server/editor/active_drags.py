"""Active drags, at most one per page, each with its entry before the drag and its present result."""

from __future__ import annotations

from dataclasses import dataclass, replace

from cagefield.edits.operations import Operation
from cagefield.errors import EditError
from cagefield.server.editor.document import Document, Entry
from cagefield.server.editor.drag_solver import Limit, Moved, Target, move

DRAG_OVER = "this drag is over: the edit was changed or removed, or the server restarted; begin again"
"""Notice for a page whose drag was given up."""


@dataclass(frozen=True)
class Drag:
    """A drag in progress: its number on its page, the entry before it, and its present result."""

    number: int
    target: Target
    before: Entry
    now: Entry
    limit: Limit | None = None
    """The last one that stopped the drag."""


class Drags:
    """The drags by page."""

    def __init__(self) -> None:
        self._drags: dict[int, Drag] = {}

    def __len__(self) -> int:
        return len(self._drags)

    def begin(self, page: int, number: int, entry: Entry, target: Target) -> None:
        """A page begins to drag an entry's cages."""
        self._drags[page] = Drag(number, target, entry, entry)

    def move(self, page: int, number: int, operation: Operation) -> Moved:
        """How far the drag could follow its operation since the beginning."""
        drag = self._find(page, number)
        moved = move(drag.before, drag.target, operation, drag.limit)
        now = replace(drag.before, edit=moved.edit)
        self._drags[page] = replace(drag, now=now, limit=moved.limit or drag.limit)
        return moved

    def take(self, page: int, number: int) -> Drag:
        """The drag, which is over with that. Raises EditError where it was over before."""
        drag = self._find(page, number)
        del self._drags[page]
        return drag

    def cancel(self, page: int) -> bool:
        """True where the page dragged; it does so no more."""
        return self._drags.pop(page, None) is not None

    def clear(self) -> None:
        """All drags are given up."""
        self._drags.clear()

    def keep(self, document: Document) -> None:
        """Drags of edits that the document does not have are given up."""
        self._drags = {page: drag for page, drag in self._drags.items() if document.has(drag.before.id)}

    def goes_on(self, page: int, number: int) -> bool:
        """True where the drag of this number goes on."""
        return page in self._drags and self._drags[page].number == number

    def dragged(self, page: int) -> Entry | None:
        """Present result of the page's drag, or None without a drag."""
        drag = self._drags.get(page)
        return None if drag is None else drag.now

    def shown(self, document: Document) -> Document:
        """The document as the drags show it."""
        for drag in self._drags.values():
            if document.has(drag.now.id):
                document = document.put(drag.now)
        return document

    def _find(self, page: int, number: int) -> Drag:
        drag = self._drags.get(page)
        if drag is None or drag.number != number:
            raise EditError(DRAG_OVER)
        return drag
