"""Highlights of the selected elements: computed in the background after each change of selection or edits."""

from __future__ import annotations

from collections.abc import Callable

from cagefield.selection.element_selection import Selection
from cagefield.server.editor.session import Session
from cagefield.server.render_queue.binary_messages import highlight_message
from cagefield.server.render_queue.dispatcher import BackgroundTask
from cagefield.server.render_worker.tasks import Answered, HighlightTask, Result, Shown, Stopped


class Highlights:
    """The highlight that pages have, and the task of the next one. None while anything is dragged."""

    def __init__(
        self, session: Session, shown: Callable[[], tuple[int, Shown]], send: Callable[[bytes], None]
    ) -> None:
        """`shown` gives the edits that pages show, numbered; `send` takes a binary message for all pages."""
        self._session, self._shown, self._send = session, shown, send
        self._known: tuple[Selection, int] | None = None
        self.message: bytes | None = None
        """The last highlight, for pages that come; None without one."""

    def next(self, generation: int) -> BackgroundTask | None:
        """Task of a highlight that pages do not have yet, or None."""
        selection = self._session.document.selection
        if selection is None or self._session.moving:
            return None
        number, shown = self._shown()
        wanted = selection, number
        if wanted == self._known:
            return None

        def done(result: Result) -> None:
            if isinstance(result, Stopped):
                return
            self._known = wanted
            if isinstance(result, Answered):
                self.message = highlight_message(result.value)
                self._send(self.message)

        return BackgroundTask(lambda task: HighlightTask(task, shown, selection, generation), done)
