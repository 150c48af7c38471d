"""Handlers of messages from a page: one method per class of message."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

import numpy as np

from cagefield.edits import Paste
from cagefield.errors import CagefieldError
from cagefield.geometry.cage import Cage
from cagefield.server.editor.cage_placement import fit_to_content
from cagefield.server.editor.edit_texts import read_edits
from cagefield.server.editor.pasting import build_paste
from cagefield.server.editor.session import Session
from cagefield.server.protocol import (
    alignment_messages,
    client_messages,
    common,
    hotspot_messages,
    point_messages,
    selection_messages,
    server_messages,
)
from cagefield.server.protocol.conversion import (
    cage_of,
    camera_of,
    dragged_of,
    keys_of,
    operation_of,
)
from cagefield.server.render_queue.coordinator import Coordinator, Page
from cagefield.server.render_worker.tasks import (
    FitTask,
    LookTask,
    Shown,
    values_of,
)
from cagefield.server.render_worker.view import Display
from cagefield.server.web.alignment_handlers import change_alignment
from cagefield.server.web.answers import answer_of, seen_point
from cagefield.server.web.hotspot_handlers import change_hotspots, set_tour
from cagefield.server.web.point_handlers import PointChange, change_points
from cagefield.server.web.selection_handlers import change_selection
from cagefield.server.web.worker_threads import run_in_thread

Handler = Callable[[Any, Any], "Coroutine[Any, Any, None] | None"]
Method = TypeVar("Method", bound=Handler)

_HANDLERS: dict[type[common.Message], Handler] = {}
"""The method of `MessageHandlers` for each class of messages that pages send."""


def _handles(message: type[common.Message]) -> Callable[[Method], Method]:
    """Makes a method the handler of a class of messages."""

    def registered(method: Method) -> Method:
        _HANDLERS[message] = method
        return method

    return registered


_SESSION_COMMANDS: dict[str, Callable[[Session], None]] = {"undo": Session.undo, "redo": Session.redo}

_EDIT_COMMANDS: dict[str, Callable[[Session, int], int | None]] = {
    "duplicate": Session.duplicate,
    "remove": Session.remove,
    "reset_operations": Session.reset_operations,
    "remove_last_operation": Session.remove_last_operation,
}


_LOOKING = (
    common.CameraMessage,
    client_messages.DisplayMessage,
    client_messages.PresentedMessage,
    client_messages.Drawing,
    client_messages.Ask,
)
"""Messages without effect on other pages and files, the only ones allowed to pages of read-only links."""


class MessageHandlers:
    """Handlers of one page's messages. Raises CagefieldError where a message cannot be followed."""

    def __init__(self, coordinator: Coordinator, page: Page, may_edit: bool = True) -> None:
        """A page that may not edit may send the messages in `_LOOKING`, and nothing else."""
        self._coordinator, self._page, self._may_edit = coordinator, page, may_edit
        self._session = coordinator.session

    def handle(self, message: client_messages.PageMessage) -> Coroutine[Any, Any, None] | None:
        """Execute a message and publish the result to the pages.

        Returns the rest where it has to wait for the rendering process; other messages need not wait.
        """
        if not self._may_edit and not isinstance(message, _LOOKING):
            raise CagefieldError("this link may look but not change anything; ask for the one that may")
        return _HANDLERS[type(message)](self, message)

    # ---- seeing ----

    @_handles(common.CameraMessage)
    def _camera(self, message: common.CameraMessage) -> None:
        self._coordinator.camera(self._page, camera_of(message), message.seq, message.moving)

    @_handles(client_messages.DisplayMessage)
    def _display(self, message: client_messages.DisplayMessage) -> None:
        self._coordinator.display(self._page, Display(message.view, message.before, message.split))

    @_handles(client_messages.PresentedMessage)
    def _presented(self, message: client_messages.PresentedMessage) -> None:
        self._coordinator.presented(self._page, message.picture)

    @_handles(client_messages.Drawing)
    def _drawing(self, message: client_messages.Drawing) -> None:
        self._coordinator.drawing(self._page, message.here)

    @_handles(client_messages.Ask)
    async def _ask(self, message: client_messages.Ask) -> None:
        try:
            answer = await answer_of(self._coordinator, self._page, message)
        except Exception:
            self._page.send_queue.put(server_messages.Answer(request=message.request, failed=True))
            raise
        self._page.send_queue.put(answer)

    # ---- drags ----

    @_handles(client_messages.DragExpected)
    def _drag_expected(self, message: client_messages.DragExpected) -> None:
        self._coordinator.dispatcher.expect_drag()

    @_handles(client_messages.DragBegin)
    def _drag_begin(self, message: client_messages.DragBegin) -> None:
        self._page.drag, self._page.seq = message.drag, 0
        before, but = (self._session.selected, self._session.preview), None
        try:
            self._session.drag_begin(self._page.number, message.drag, message.edit, message.target)
            if before == (message.edit, None):
                # Nothing is new to this page, whose panels a state would draw again before the first picture.
                but = self._page
        finally:
            self._coordinator.changed(but)

    @_handles(client_messages.DragMove)
    def _drag(self, message: client_messages.DragMove) -> None:
        if message.drag == self._page.lost_drag:
            return
        moved = self._session.drag(self._page.number, message.drag, operation_of(message.operation))
        self._page.seq = message.seq
        self._coordinator.show()
        carriers = self._session.carriers_of(self._page.number)
        self._page.send_queue.put(dragged_of(message.drag, message.seq, moved, carriers))
        self._coordinator.publish(but=self._page)

    @_handles(client_messages.DragEnd)
    def _drag_end(self, message: client_messages.DragEnd) -> None:
        if message.drag == self._page.lost_drag:
            return
        self._page.drag = 0
        try:
            moved = self._session.drag_end(self._page.number, message.drag, operation_of(message.operation))
            self._page.send_queue.put(dragged_of(message.drag, message.seq, moved))
        finally:
            self._coordinator.changed()

    @_handles(client_messages.DragCancel)
    def _drag_cancel(self, message: client_messages.DragCancel) -> None:
        self._page.drag = 0
        self._session.drag_cancel(self._page.number)
        self._coordinator.changed()

    # ---- playing ----

    @_handles(client_messages.PlayBegin)
    def _play_begin(self, message: client_messages.PlayBegin) -> None:
        try:
            self._session.play_begin(self._page.number, message.play)
        except CagefieldError:
            self._page.send_queue.put(
                server_messages.Preview(page=self._page.number, play=message.play, on=False)
            )
            raise
        finally:
            self._coordinator.changed()

    @_handles(client_messages.Play)
    def _play(self, message: client_messages.Play) -> None:
        try:
            self._session.play(self._page.number, message.play, message.seconds)
        except CagefieldError:
            self._coordinator.changed()
            raise
        self._coordinator.pump()

    @_handles(client_messages.PlayEnd)
    def _play_end(self, message: client_messages.PlayEnd) -> None:
        self._session.play_end(self._page.number, message.play)
        self._coordinator.changed()

    # ---- operations ----

    @_handles(client_messages.Apply)
    def _apply(self, message: client_messages.Apply) -> None:
        self._session.apply(message.edit, message.target, operation_of(message.operation))
        self._coordinator.changed()

    # ---- cages ----

    @_handles(client_messages.SetCage)
    def _set_cage(self, message: client_messages.SetCage) -> None:
        self._session.set_cage(message.edit, message.cage, cage_of(message.corners))
        self._coordinator.changed()

    @_handles(client_messages.Place)
    async def _place(self, message: client_messages.Place) -> None:
        point, height = await seen_point(self._coordinator, self._page, message.x, message.y)
        self._session.place(point, height)
        self._coordinator.changed()

    @_handles(point_messages.PlacePoint)
    async def _place_point(self, message: point_messages.PlacePoint) -> None:
        point, height = await seen_point(self._coordinator, self._page, message.x, message.y)
        self._session.place_point(point, height)
        self._coordinator.changed()

    @_handles(point_messages.PlaceMesh)
    @_handles(point_messages.Subdivide)
    @_handles(point_messages.PointReach)
    async def _change_points(self, message: PointChange) -> None:
        await change_points(self._session, self._page, message)
        self._coordinator.changed()

    @_handles(client_messages.PasteScene)
    async def _paste_scene(self, message: client_messages.PasteScene) -> None:
        path = self._coordinator.store.source_of(message.source)
        box, up = await self._coordinator.ask(lambda number: LookTask(number, str(path)))
        point, height = await seen_point(self._coordinator, self._page, None, None)
        own_up = np.array(self._coordinator.up)
        edit = build_paste(str(path), path.stem[:100], np.array(box), np.array(up), point, own_up, height)
        self._session.paste(edit)
        self._coordinator.changed()

    @_handles(client_messages.FitInner)
    async def _fit_inner(self, message: client_messages.FitInner) -> None:
        edit = self._session.document.entry(message.edit).edit
        cage: Cage = edit.inner
        removed = self._session.document.removed
        below = Shown(values_of(self._session.below(message.edit)), removed=removed)
        source = edit.source if isinstance(edit, Paste) else None
        dense = await self._coordinator.ask(lambda number: FitTask(number, below, cage, source))
        if self._session.document.entry(message.edit).edit.inner == cage:
            self._session.fit_inner(message.edit, fit_to_content(cage, np.array(dense)))
        self._coordinator.changed()

    @_handles(client_messages.OuterMargin)
    def _outer_margin(self, message: client_messages.OuterMargin) -> None:
        self._session.outer_margin(message.edit, message.margin)
        self._coordinator.changed()

    # ---- selected elements ----

    @_handles(selection_messages.SelectRegion)
    @_handles(selection_messages.SelectRange)
    @_handles(selection_messages.SelectFlood)
    @_handles(selection_messages.SelectFloaters)
    @_handles(selection_messages.ChangeSelection)
    @_handles(selection_messages.SelectionCage)
    @_handles(selection_messages.Isolate)
    @_handles(selection_messages.RemoveElements)
    async def _select_elements(self, message: selection_messages.SelectionMessage) -> None:
        await change_selection(self._coordinator, self._page, message)
        self._coordinator.changed()

    # ---- options and the list ----

    @_handles(client_messages.Change)
    def _change(self, message: client_messages.Change) -> None:
        named = message.model_dump(exclude={"type", "edit"}, exclude_none=True)
        if "lattice" in named:
            named["lattice"] = named["lattice"] or None
        self._session.change(message.edit, **named)
        self._coordinator.changed()

    @_handles(client_messages.SceneChange)
    def _scene_change(self, message: client_messages.SceneChange) -> None:
        self._session.preserve_opacity(message.preserve_opacity)
        self._coordinator.changed()

    @_handles(alignment_messages.ScaleChange)
    @_handles(alignment_messages.UpChange)
    @_handles(alignment_messages.AlignPaste)
    async def _change_alignment(self, message: alignment_messages.AlignmentMessage) -> None:
        await change_alignment(self._coordinator, self._page, message)
        self._coordinator.changed()

    @_handles(hotspot_messages.PutHotspot)
    @_handles(hotspot_messages.MoveHotspot)
    def _change_hotspots(self, message: hotspot_messages.PutHotspot | hotspot_messages.MoveHotspot) -> None:
        change_hotspots(self._session, message)
        self._coordinator.changed()

    @_handles(hotspot_messages.TourPath)
    def _set_tour(self, message: hotspot_messages.TourPath) -> None:
        coordinator = self._coordinator
        set_tour(self._session, message, coordinator.store.scene.first_camera, coordinator.up)
        coordinator.changed()

    @_handles(client_messages.Command)
    def _command(self, message: client_messages.Command) -> None:
        session = self._session
        if message.name == "select":
            session.select(message.edit)
        elif message.name in _SESSION_COMMANDS:
            _SESSION_COMMANDS[message.name](session)
        elif message.name == "save":
            self._coordinator.save()
        else:
            if message.edit is None:
                raise CagefieldError(f"choose an edit to {message.name.replace('_', ' ')}")
            _EDIT_COMMANDS[message.name](session, message.edit)
        self._coordinator.changed()

    @_handles(client_messages.Mirror)
    def _mirror(self, message: client_messages.Mirror) -> None:
        self._session.mirror(message.edit, "xyz".index(message.axis))
        self._coordinator.changed()

    @_handles(client_messages.Reorder)
    def _reorder(self, message: client_messages.Reorder) -> None:
        self._session.reorder(message.edit, message.to)
        self._coordinator.changed()

    @_handles(client_messages.GoTo)
    def _go_to(self, message: client_messages.GoTo) -> None:
        self._session.go_to(message.entry)
        self._coordinator.changed()

    # ---- keeping ----

    @_handles(client_messages.SaveAs)
    def _save_as(self, message: client_messages.SaveAs) -> None:
        self._coordinator.save_as(message.path, message.overwrite)
        self._coordinator.changed()

    @_handles(client_messages.LoadEdits)
    async def _load_edits(self, message: client_messages.LoadEdits) -> None:
        store = self._coordinator.store
        read = await run_in_thread(lambda: read_edits(message.text, store.admitted))
        store.remember(read)
        self._session.take_edits(read, message.append)
        self._coordinator.changed()

    @_handles(client_messages.SetPath)
    def _set_path(self, message: client_messages.SetPath) -> None:
        self._session.set_path(keys_of(message), message.loop)
        self._coordinator.changed()

    @_handles(client_messages.RenderJob)
    def _render(self, message: client_messages.RenderJob) -> None:
        self._coordinator.background.render(message)
        self._coordinator.pump()

    @_handles(client_messages.ExportSplats)
    @_handles(client_messages.ExportPage)
    def _export(self, message: client_messages.ExportSplats | client_messages.ExportPage) -> None:
        self._coordinator.background.export(self._page.number, message)

    @_handles(client_messages.CancelJob)
    def _cancel_job(self, message: client_messages.CancelJob) -> None:
        self._coordinator.background.cancel(message.job)
        self._coordinator.pump()
