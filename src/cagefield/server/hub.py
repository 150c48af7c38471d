"""Hub: one session, one rendering process, several pages. Says what to render, and to whom it goes.

Everything here runs in the server's event loop; the rendering process answers through `call_soon_threadsafe`.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from dataclasses import dataclass, field
from typing import Any

from cagefield.cameras import Camera
from cagefield.errors import CagefieldError
from cagefield.server import protocol
from cagefield.server.converting import state_of
from cagefield.server.keeping import Keeper
from cagefield.server.outbox import Outbox
from cagefield.server.scheduler import Look, Request, Scheduler
from cagefield.server.session import Session
from cagefield.server.tasks import (
    Answered,
    Failed,
    PictureDone,
    PictureTask,
    Ready,
    Result,
    Shown,
    Stopped,
    Task,
    values_of,
)
from cagefield.server.worker import Worker

RESTARTS = 3
"""How often in a minute the rendering process is started again."""


@dataclass
class Page:
    """An open page: what it looks at and what waits to be sent to it."""

    number: int
    outbox: Outbox = field(default_factory=Outbox)
    camera: Camera | None = None
    look: Look = field(default_factory=Look)
    drag: int = 0
    seq: int = 0

    def notice(self, level: Any, text: str) -> None:
        """A line for this page's user."""
        self.outbox.put(protocol.Notice(level=level, text=text))


@dataclass
class _Running:
    """What the rendering process does now, and for whom."""

    task: Task
    request: Request | None = None
    future: asyncio.Future[Any] | None = None
    revision: int = 0
    drag: tuple[int, int] = (0, 0)


class Hub:
    """See the module."""

    def __init__(self, session: Session, keeper: Keeper, device: str = "auto") -> None:
        self.session = session
        self.keeper = keeper
        self.scheduler = Scheduler()
        self.pages: dict[int, Page] = {}
        self.worker = Worker(
            str(keeper.origin), device, self._from_thread(self._result), self._from_thread(self._lost)
        )
        self._loop: asyncio.AbstractEventLoop | None = None
        self._ready = False
        self._closing = False
        self._running: _Running | None = None
        self._queue: deque[tuple[Task, asyncio.Future[Any]]] = deque()
        self._pages = 0
        self._numbers = 0
        self._shown = self._what_is_shown()
        self._pictures = 0
        self._wake: asyncio.TimerHandle | None = None
        self._losses: list[float] = []
        self.greeting: str | None = None
        """A line for the pages that come."""
        self.errors: dict[int, tuple[float, float]] = {}

    # ---- the server's life ----

    def start(self) -> None:
        """Starts the rendering process; called in the event loop."""
        self._loop = asyncio.get_running_loop()
        self.worker.start()

    def close(self) -> None:
        """Ends the rendering process."""
        self._closing = True
        self.worker.close()

    # ---- pages ----

    def join(self, hello: protocol.Hello) -> Page:
        """A new page, told what there is."""
        self._pages += 1
        page = Page(self._pages)
        self.pages[page.number] = page
        self.scheduler.join(page.number)
        page.outbox.put(hello.model_copy(update={"page": page.number}))
        page.outbox.put(self.state())
        if self.greeting is not None:
            page.notice("info", self.greeting)
        return page

    def leave(self, page: Page) -> None:
        """A page is gone; its drag is given up."""
        self.pages.pop(page.number, None)
        self.session.drag_cancel(page.number)
        self.scheduler.leave(page.number)
        self.changed()

    def look(self, page: Page, look: Look) -> None:
        """A page shows another view."""
        page.look = look
        self.scheduler.look(page.number, look, time.monotonic())
        self.pump()

    def camera(self, page: Page, camera: Camera, seq: int, moving: bool) -> None:
        """A page looks from another camera."""
        page.camera = camera
        self.scheduler.camera(page.number, seq, camera.width, camera.height, moving, time.monotonic())
        self.pump()

    def presented(self, page: Page, picture: int) -> None:
        """A page has shown a picture."""
        self.scheduler.presented(page.number, picture)
        self.pump()

    def notice(self, level: Any, text: str) -> None:
        """A line for every page."""
        for page in self.pages.values():
            page.notice(level, text)

    def broadcast(self, message: protocol.ServerMessage, but: Page | None = None) -> None:
        """A message for every page, but one."""
        for page in self.pages.values():
            if page is not but:
                page.outbox.put(message)

    def state(self) -> protocol.State:
        """Everything that pages show of the edits."""
        return state_of(self.session, str(self.keeper.path), self.errors)

    def changed(self, but: Page | None = None) -> None:
        """The session is another one: tells the pages, renders what is new to see, keeps it from a crash."""
        self.keeper.autosave(self.session)
        self.broadcast(self.state(), but)
        self.pump()

    # ---- keeping ----

    def save(self) -> None:
        """Saves what is edited where it came from."""
        self.keeper.save(self.session)
        self.notice("info", f"saved to {self.keeper.path}")

    def save_as(self, path: str, overwrite: bool) -> None:
        """Saves the scene with its edits as another folder, which is edited from then on."""
        self.keeper.save_as(self.session, path, overwrite)
        self.notice("info", f"saved to {self.keeper.path}")

    # ---- rendering ----

    async def ask(self, make: Any) -> Any:
        """What the rendering process answers to the task `make(number)`. Raises CagefieldError."""
        assert self._loop is not None
        self._numbers += 1
        future: asyncio.Future[Any] = self._loop.create_future()
        self._queue.append((make(self._numbers), future))
        self.pump()
        return await future

    def shown(self) -> Shown:
        """What pictures show now."""
        return self._what_is_shown()

    def pump(self) -> None:
        """Gives the rendering process its next task, if it is free; abandons what nobody wants any more."""
        now = time.monotonic()
        shown = self._what_is_shown()
        if shown != self._shown:
            self._shown = shown
            self._pictures += 1
        self.scheduler.edits(self._pictures, bool(self.session.drags), now)
        self.worker.abandon(self.scheduler.generation)
        if self._running is not None or not self._ready or self._closing:
            return
        if self._queue:
            task, future = self._queue.popleft()
            self._begin(_Running(task, future=future))
            return
        request = self.scheduler.next(now)
        if request is not None:
            self._begin(self._picture(request))
            return
        self._sleep(self.scheduler.wake(now))

    def _sleep(self, seconds: float | None) -> None:
        if self._wake is not None:
            self._wake.cancel()
            self._wake = None
        if seconds is not None and self._loop is not None:
            self._wake = self._loop.call_later(seconds + 0.002, self.pump)

    def _what_is_shown(self) -> Shown:
        return Shown(values_of(self.session.drawn()), self.session.shown.preserve_opacity)

    def _picture(self, request: Request) -> _Running:
        page = self.pages[request.page]
        assert page.camera is not None
        region = request.region
        camera = page.camera.resized(region.full_width, region.full_height)
        task = PictureTask(
            request.number,
            self._shown,
            camera,
            region,
            request.look,
            request.moving,
            request.exact,
            self.scheduler.generation,
        )
        return _Running(
            task, request, revision=self.session.revision, drag=(page.drag, page.seq) if page.drag else (0, 0)
        )

    def _begin(self, running: _Running) -> None:
        self._running = running
        self.worker.send(running.task)

    def _result(self, result: Result) -> None:
        if self._closing:
            return
        if isinstance(result, Ready):
            self._ready = True
            self.pump()
            return
        running, self._running = self._running, None
        if running is None or running.task.number != result.number:
            self._running = running
            if isinstance(result, Failed) and result.number == 0:
                self.notice("error", result.text)
            return
        if running.request is not None:
            self._after_picture(running, running.request, result)
        elif running.future is not None and not running.future.done():
            if isinstance(result, Answered):
                running.future.set_result(result.value)
            elif isinstance(result, Failed):
                running.future.set_exception(CagefieldError(result.text))
            else:
                running.future.set_result(None)
        self.pump()

    def _after_picture(self, running: _Running, request: Request, result: Result) -> None:
        now = time.monotonic()
        if not isinstance(result, PictureDone):
            self.scheduler.abandoned(request, now)
            if isinstance(result, Failed):
                self.notice("error", result.text)
            elif not isinstance(result, Stopped):
                self.notice("error", "the renderer gave an answer that was not a picture")
            return
        rays = request.region.width * request.region.height
        seconds = result.render_seconds + result.encode_seconds
        self.scheduler.finished(request, rays, seconds, result.map_seconds, now)
        page = self.pages.get(request.page)
        if page is not None:
            page.outbox.put_picture(_packed(running, request, result))

    def _lost(self) -> None:
        if self._closing:
            return
        running, self._running = self._running, None
        self._ready = False
        if running is not None and running.request is not None:
            self.scheduler.abandoned(running.request, time.monotonic())
        if running is not None and running.future is not None and not running.future.done():
            running.future.set_exception(CagefieldError("the renderer was lost on the way; try again"))
        now = time.monotonic()
        self._losses = [at for at in self._losses if now - at < 60.0] + [now]
        if len(self._losses) > RESTARTS:
            self.notice(
                "error",
                "the renderer ends again and again (out of memory?); save your edits and start the editor anew",
            )
            return
        self.notice("warning", "the renderer was lost and is started again; nothing of the edits is lost")
        self.scheduler.refresh(now)
        self.worker.start()

    def _from_thread(self, method: Any) -> Any:
        """The method, callable from another thread: runs in the event loop."""

        def call(*args: Any) -> None:
            loop = self._loop
            if loop is not None and not loop.is_closed() and not self._closing:
                loop.call_soon_threadsafe(method, *args)

        return call


def _packed(running: _Running, request: Request, done: PictureDone) -> bytes:
    """The binary message of a picture."""
    region = request.region
    header = (
        protocol.PictureHeader(
            picture=request.number,
            camera=request.camera,
            drag=running.drag[0],
            seq=running.drag[1],
            revision=running.revision,
            view=request.look.view,
            x=region.x,
            y=region.y,
            width=region.width,
            height=region.height,
            full_width=region.full_width,
            full_height=region.full_height,
            final=request.final,
            picture_bytes=len(done.picture),
            depth_bytes=len(done.depth),
            depth_width=done.depth_size[0],
            depth_height=done.depth_size[1],
            depth_scale=done.depth_scale,
            render_ms=1e3 * done.render_seconds,
            encode_ms=1e3 * done.encode_seconds,
        )
        .model_dump_json()
        .encode()
    )
    return len(header).to_bytes(4, "little") + header + done.picture + done.depth
