"""One session, several pages, one rendering process: which picture is rendered, and to which page it goes."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from cagefield.cameras.camera import Camera
from cagefield.edits import EditStack
from cagefield.fields.splat_field import SplatField
from cagefield.scene.alignment import Direction
from cagefield.scene.paste_sources import up_of_cameras
from cagefield.selection.element_selection import Selection
from cagefield.server.editor.active_drags import DRAG_OVER
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.session import Session
from cagefield.server.protocol import server_messages
from cagefield.server.protocol.common import DrawnHere, Level
from cagefield.server.protocol.conversion import state_of
from cagefield.server.protocol.message_queues import SendQueue
from cagefield.server.render_queue.background import BackgroundWork
from cagefield.server.render_queue.binary_messages import edits_message, picture_message
from cagefield.server.render_queue.damage import WHOLE, Rect, screen_bounds
from cagefield.server.render_queue.dispatcher import BackgroundTask, Dispatcher, Stamp, TooManyError
from cagefield.server.render_queue.highlights import Highlights
from cagefield.server.render_queue.patch_extent import PatchExtent
from cagefield.server.render_queue.requests import EditsRequest, Request
from cagefield.server.render_queue.splat_extent import splat_extent
from cagefield.server.render_worker.tasks import (
    EditsDone,
    Failed,
    PageEditsTask,
    PictureDone,
    PictureTask,
    Shown,
    Task,
    values_of,
)
from cagefield.server.render_worker.view import Display

Options = tuple[bool, Selection | None, Selection | None]
"""Options that change all of a picture: the opacity choice, isolated and deleted elements."""


@dataclass
class Page:
    """An open page: its camera and view, and its outgoing messages."""

    number: int
    read_only: bool = False
    send_queue: SendQueue = field(default_factory=SendQueue)
    camera: Camera | None = None
    display: Display = field(default_factory=Display)
    drag: int = 0
    seq: int = 0
    lost_drag: int = 0
    """Its last drag that the session gave up, of which messages may still come."""
    has: tuple[str, ...] = ()
    """Keys of the layers that the page already has, of edits that it draws itself."""

    @property
    def stamp(self) -> tuple[int, int]:
        """Its drag that goes on and the newest of that, 0, 0 where none does."""
        return (self.drag, self.seq) if self.drag else (0, 0)

    def notice(self, level: Level, text: str) -> None:
        """A line for this page's user."""
        self.send_queue.put(server_messages.Notice(level=level, text=" ".join(text.split())))


class Coordinator:
    """See the module."""

    def __init__(self, session: Session, store: SceneStore, device: str = "auto") -> None:
        self.session = session
        self.store = store
        self.device = device
        self.pages: dict[int, Page] = {}
        self.loading = asyncio.Lock()
        """Held while an edit file of a page is read."""
        shown = store.scene.field
        self.spread = splat_extent(shown) if isinstance(shown, SplatField) else 0.0
        """How far beside where an edit maps points its content shows, world units."""
        self._patches = PatchExtent(shown)
        self.dispatcher = Dispatcher(str(store.origin), device, self, whole_at_rest=self.spread > 0.0)
        worker = self.dispatcher.worker
        worker.files, worker.write_opened = store.files, store.write_opened
        worker.background = store.scene.background
        self.background = BackgroundWork(session, store, self._measured, self.broadcast, self.changed, device)
        self.highlights = Highlights(session, self._numbered_shown, self._send_highlight)
        self.greeting: str | None = None
        """A line for the pages that come."""
        self._replaced: str | None = None
        """Notice for new pages that the scene on disk was replaced, or None."""
        self._pages = 0
        self._shown = self.shown()
        self._drawn = session.drawn()
        self._shown_revision = session.revision
        """The revision that `_shown` was taken from."""
        self._pictured = session.revision
        """The first revision that is shown as `_shown`."""
        self._pictures = 0
        self._stacks: dict[int, tuple[EditStack, Options]] = {}
        """The edits and the options of pictures' revisions, of those that pages may still show."""
        self._trouble: str | None = None
        self._asking: set[int] = set()
        """Pages of which a picture is made for a download."""
        self._preview: tuple[int, int] | None = None
        """The page and the number of the preview that pages were told of."""

    # ---- pages ----

    def join(self, hello: server_messages.Hello) -> Page:
        """A new page; it is sent the scene, the edits and the jobs."""
        self._pages += 1
        page = Page(self._pages, hello.read_only)
        self.pages[page.number] = page
        self.dispatcher.scheduler.join(page.number)
        page.send_queue.put(hello.model_copy(update={"page": page.number}))
        page.send_queue.put(self.state())
        if self.greeting is not None:
            page.notice("info", self.greeting)
        if self._replaced is not None:
            page.notice("warning", self._replaced)
        if self._preview is not None:
            page.send_queue.put(
                server_messages.Preview(page=self._preview[0], play=self._preview[1], on=True)
            )
        page.send_queue.put(self.background.preparing())
        for job in self.background.jobs():
            page.send_queue.put(job)
        if self.highlights.message is not None:
            page.send_queue.put_highlight(self.highlights.message)
        return page

    def leave(self, page: Page) -> None:
        """Remove a closed page; its drag is cancelled and its preview ends."""
        self.pages.pop(page.number, None)
        self.session.drag_cancel(page.number)
        self.session.play_end(page.number)
        self.dispatcher.scheduler.leave(page.number)
        self.changed()

    def display(self, page: Page, display: Display) -> None:
        """A page shows another view."""
        page.display = display
        self.dispatcher.scheduler.display(page.number, display, time.monotonic())
        self.pump()

    def camera(self, page: Page, camera: Camera, seq: int, moving: bool) -> None:
        """A page looks from another camera."""
        page.camera = camera
        self.dispatcher.scheduler.camera(
            page.number, seq, camera.width, camera.height, moving, time.monotonic()
        )
        self.pump()

    def drawing(self, page: Page, here: DrawnHere) -> None:
        """A page draws pictures itself, or no more."""
        if here == "nothing":
            page.has = ()
        self.dispatcher.scheduler.drawing(page.number, here, time.monotonic())
        self.pump()

    def presented(self, page: Page, picture: int) -> None:
        """A page has shown a picture."""
        self.dispatcher.scheduler.presented(page.number, picture)
        self.dispatcher.pump()

    def notice(self, level: Level, text: str) -> None:
        """A line for every page."""
        for page in self.pages.values():
            page.notice(level, text)

    def replaced(self) -> None:
        """The scene's folder holds another scene; tells the pages that pictures are not of that."""
        self._replaced = (
            f"{self.dispatcher.worker.scene} was replaced by another program; pictures and edits stay those "
            "of the scene that was opened: Save as keeps it, and opening it again shows the new one"
        )
        self.notice("warning", self._replaced)

    def broadcast(self, message: server_messages.ServerMessage, but: Page | None = None) -> None:
        """A message for every page, but one."""
        for page in self.pages.values():
            if page is not but:
                page.send_queue.put(message)

    # ---- the session ----

    def state(self) -> server_messages.State:
        """Everything that pages show of the edits."""
        self._refresh_shown()
        return state_of(
            self.session,
            str(self.store.shown_path),
            self._pictured,
            self.background.errors(),
            is_file=self.store.source is not None,
        )

    def changed(self, but: Page | None = None) -> None:
        """Publish a changed session: render visible changes, write the autosave, notify the pages."""
        self._tell_lost_drags()
        self.show()
        self.publish(but)

    def publish(self, but: Page | None = None) -> None:
        """Write the autosave of a changed session, and notify the pages, after the request of a picture."""
        self.store.autosave(self.session)
        if self.store.trouble is not None and self.store.trouble != self._trouble:
            self.notice("warning", self.store.trouble)
        self._trouble = self.store.trouble
        if any(page is not but for page in self.pages.values()):
            self.broadcast(self.state(), but)
        self._tell_preview()

    def _tell_lost_drags(self) -> None:
        for page in self.pages.values():
            if page.drag and not self.session.drags.goes_on(page.number, page.drag):
                page.lost_drag, page.drag = page.drag, 0
                page.send_queue.put(server_messages.DragOver(drag=page.lost_drag))
                page.notice("error", DRAG_OVER)

    def save(self) -> None:
        """Save the document to its scene folder."""
        self.store.save(self.session)
        self.notice("info", f"saved to {self.store.path}")

    def save_as(self, path: str, overwrite: bool) -> None:
        """Saves the scene with its edits as another folder, which is edited from then on."""
        self.store.save_as(self.session, path, overwrite)
        worker = self.dispatcher.worker
        worker.scene, worker.files, self._replaced = str(self.store.path), self.store.files, None
        self.notice("info", f"saved to {self.store.path}")

    # ---- rendering ----

    def close(self) -> None:
        """End the rendering process and its tasks, and tell the pages to reconnect."""
        self.background.exports.close()
        self.dispatcher.close()
        self.store.close()

    @property
    def up(self) -> Direction:
        """The unit direction [3] that is up: the document's, else that of the scene's cameras."""
        if self.session.document.up is not None:
            return self.session.document.up
        x, y, z = up_of_cameras(self.store.scene.cameras).tolist()
        return x, y, z

    async def ask(self, make: Callable[[int], Task]) -> Any:
        """Result of a task of the rendering process. Raises CagefieldError."""
        self.dispatcher.interrupt()
        return await self.dispatcher.ask(make)

    async def ask_patiently(self, page: int, make: Callable[[int, int], Task]) -> Any:
        """Result of a task of lower priority than the pages' images; one at a time for each page.

        Raises TooManyError where the page has one already, or too many wait.
        """
        if page in self._asking:
            raise TooManyError("a picture of this page is being made already; try again when it is there")
        self._asking.add(page)
        try:
            return await self.dispatcher.ask_patiently(make)
        finally:
            self._asking.discard(page)

    def shown(self) -> Shown:
        """Edits and options that images show now."""
        session = self.session
        edits = values_of(session.drawn())
        return Shown(edits, session.shown.preserve_opacity, session.isolated, session.shown.removed)

    def pump(self) -> None:
        """Dispatch the rendering of visible changes, and tell the pages of a preview."""
        self._tell_preview()
        self.show()

    def show(self) -> None:
        """Dispatch the rendering of visible changes, and nothing else: pictures come before messages."""
        self._refresh_shown()
        self.dispatcher.scheduler.edits(self._pictures, self.session.moving, time.monotonic())
        self.dispatcher.pump()

    def picture_task(self, request: Request, generation: int) -> tuple[PictureTask, Stamp]:
        """The task of a picture that the scheduler wants."""
        page, region = self.pages[request.page], request.region
        assert page.camera is not None  # the scheduler asks for pictures of pages with a camera alone
        camera = _resized(page.camera, region.full_width, region.full_height)
        task = PictureTask(
            request.number,
            self._shown,
            camera,
            region,
            request.display,
            request.moving,
            request.refinement,
            generation,
        )
        return task, Stamp(self._shown_revision, *page.stamp)

    def edits_task(self, request: EditsRequest, generation: int) -> tuple[PageEditsTask, Stamp]:
        """The task of edits that a page draws itself."""
        page = self.pages[request.page]
        task = PageEditsTask(request.number, self._shown, request.refinement, page.has, generation)
        return task, Stamp(self._shown_revision, *page.stamp)

    def differing(self, page: int, one: int, another: int) -> Rect | None:
        """Where two revisions differ in a page's picture; None for nowhere."""
        camera = self.pages[page].camera
        stacks = [self._stack(revision) for revision in (one, another)]
        if camera is None or None in stacks:
            return WHOLE
        (before, options), (after, others) = (stack for stack in stacks if stack is not None)
        if options != others:
            return WHOLE
        beside = np.array([[-self.spread], [self.spread]])
        changed = after.changed_boxes(before, lambda step: self._patches.boxes(step.edit))
        return screen_bounds(camera, changed + beside)

    def deliver(self, request: Request, stamp: Stamp, done: PictureDone) -> None:
        """A picture for a page."""
        page = self.pages.get(request.page)
        if page is not None:
            page.send_queue.put_picture(picture_message(request, stamp, done))

    def deliver_edits(self, request: EditsRequest, stamp: Stamp, done: EditsDone | Failed) -> None:
        """Edits for a page that draws them itself, or why it cannot."""
        page = self.pages.get(request.page)
        if page is not None:
            page.has = done.keys if isinstance(done, EditsDone) else ()
            page.send_queue.put_picture(edits_message(request, stamp, done))

    def background_task(self, rested: bool) -> BackgroundTask | None:
        """Next background task while no page waits for an image, or None; `rested` for REST_SECONDS."""
        generation = self.dispatcher.scheduler.generation
        may_edit = any(not page.read_only for page in self.pages.values())
        highlight = self.highlights.next(generation)
        return highlight or self.background.next(generation, rested and may_edit, rested)

    def _numbered_shown(self) -> tuple[int, Shown]:
        """Number of the pictures' revision, and its content."""
        return self._pictures, self._shown

    def _send_highlight(self, content: bytes) -> None:
        for page in self.pages.values():
            page.send_queue.put_highlight(content)

    def _tell_preview(self) -> None:
        """Tells the pages which preview is over, and which has begun."""
        preview = self.session.preview
        now = None if preview is None else (preview.page, preview.number)
        before, self._preview = self._preview, now
        if before != now:
            for which, on in ((before, False), (now, True)):
                if which is not None:
                    self.broadcast(server_messages.Preview(page=which[0], play=which[1], on=on))

    def _refresh_shown(self) -> None:
        shown = self.shown()
        self._shown_revision = self.session.revision
        if shown != self._shown:
            self._keep_stack()
            self._shown = shown
            self._pictures += 1
            self._pictured = self.session.revision
        self._drawn = self.session.drawn()

    def _measured(self) -> None:
        self.broadcast(self.state())

    def _stack(self, revision: int) -> tuple[EditStack, Options] | None:
        if revision == self._pictures:
            return EditStack(self._drawn), _options_of(self._shown)
        return self._stacks.get(revision)

    def _keep_stack(self) -> None:
        """Store the shown stack before it changes."""
        wanted = self.dispatcher.scheduler.remembered()
        self._stacks = {number: stack for number, stack in self._stacks.items() if number in wanted}
        self._stacks[self._pictures] = EditStack(self._drawn), _options_of(self._shown)


@lru_cache(maxsize=64)
def _resized(camera: Camera, width: int, height: int) -> Camera:
    return camera.resized(width, height)


def _options_of(shown: Shown) -> Options:
    return shown.preserve_opacity, shown.isolated, shown.removed
