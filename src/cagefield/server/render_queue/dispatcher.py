"""Dispatcher: hands tasks to the rendering process, one at a time, and passes the results on.

Tasks with a waiting caller come first, then images as the scheduler orders them, then background tasks.
Everything here runs in the server's event loop; the rendering process answers through
`call_soon_threadsafe`.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from cagefield.errors import CagefieldError
from cagefield.server.protocol.common import Level
from cagefield.server.render_queue.damage import Rect
from cagefield.server.render_queue.requests import EditsRequest, Request
from cagefield.server.render_queue.scheduler import Scheduler
from cagefield.server.render_worker.process import Worker
from cagefield.server.render_worker.refinement import FINAL
from cagefield.server.render_worker.tasks import (
    Answered,
    EditsDone,
    Failed,
    PageEditsTask,
    PictureDone,
    PictureTask,
    Ready,
    Replaced,
    Result,
    Stopped,
    Task,
)

RESTARTS = 3
"""How often in a minute the rendering process is started again."""

_GIVEN_UP = "the renderer ends again and again (out of memory?); save your edits and restart the editor"

REST_SECONDS = 0.3
"""Time without a task that a page or a caller waits for after which a background task may be a long one."""

PAUSE_SECONDS, LONGEST_PAUSE, PAUSE_GAP = 0.6, 3.0, 1.0
"""Pause of background tasks where a drag is expected, seconds: after the last sign of it, at most, and least
time until the next one: a mouse that plays with handles does not hold them up."""

PATIENT = 4
"""Tasks that wait until no page does, at most."""

Make = Callable[[int], Task]
_Patient = tuple[Callable[[int, int], Task], asyncio.Future[Any]]


class TooManyError(CagefieldError):
    """More is asked for than is kept waiting."""


@dataclass(frozen=True)
class Stamp:
    """Session state of an image: its revision, and the newest step of the page's drag."""

    revision: int
    drag: int = 0
    seq: int = 0


@dataclass(frozen=True)
class BackgroundTask:
    """Background task: a task built when the process is idle, and the receiver of its result."""

    make: Make
    done: Callable[[Result], None]


class TaskSource(Protocol):
    """Source of the dispatcher's tasks and receiver of its reports."""

    def picture_task(self, request: Request, generation: int) -> tuple[PictureTask, Stamp]:
        """The task of a picture that the scheduler wants."""

    def edits_task(self, request: EditsRequest, generation: int) -> tuple[PageEditsTask, Stamp]:
        """The task of edits that a page draws itself."""

    def differing(self, page: int, one: int, another: int) -> Rect | None:
        """Where two revisions differ in a page's picture; None for nowhere."""

    def deliver(self, request: Request, stamp: Stamp, done: PictureDone) -> None:
        """A picture is there."""

    def deliver_edits(self, request: EditsRequest, stamp: Stamp, done: EditsDone | Failed) -> None:
        """Edits are there, or cannot be drawn by a page."""

    def notice(self, level: Level, text: str) -> None:
        """A line for the users."""

    def replaced(self) -> None:
        """The scene's folder holds another scene, but pictures are of the one that was opened."""

    def background_task(self, rested: bool) -> BackgroundTask | None:
        """Next background task while no page waits for an image, or None; `rested` for REST_SECONDS."""


@dataclass
class _Running:
    task: Task
    request: Request | EditsRequest | None = None
    stamp: Stamp | None = None
    done: Callable[[Result], None] | None = None


class Dispatcher:
    """See the module."""

    def __init__(self, scene: str, device: str, source: TaskSource, *, whole_at_rest: bool = False) -> None:
        """`whole_at_rest` as for `Scheduler`."""
        self.scheduler = Scheduler(source.differing, whole_at_rest=whole_at_rest)
        self.worker = Worker(scene, device, self._from_thread(self._result), self._from_thread(self._lost))
        self._source = source
        self._loop: asyncio.AbstractEventLoop | None = None
        self._ready = False
        self._closing = False
        self._given_up = False
        self._running: _Running | None = None
        self._queue: deque[_Running] = deque()
        self._patient: list[_Patient] = []
        self._asked: _Patient | None = None
        """Of `_patient` the one that is being done."""
        self._numbers = 0
        self._wake: asyncio.TimerHandle | None = None
        self._busy = time.monotonic()
        """When a task that somebody waits for was last handed on or done."""
        self._losses: list[float] = []
        self._pause_began = self._paused_until = float("-inf")

    def start(self) -> None:
        """Starts the rendering process; called in the event loop."""
        self._loop = asyncio.get_running_loop()
        self.worker.start()

    def close(self) -> None:
        """Ends the rendering process."""
        self._closing = True
        self._sleep(None)
        self.worker.close()

    async def ask(self, make: Make) -> Any:
        """Result of the task `make(number)` of the rendering process. Raises CagefieldError."""
        if self._given_up:
            raise CagefieldError(_GIVEN_UP)
        future: asyncio.Future[Any] = asyncio.get_running_loop().create_future()

        def done(result: Result) -> None:
            if future.done():
                return
            if isinstance(result, Answered):
                future.set_result(result.value)
            else:
                text = (
                    result.text if isinstance(result, Failed) else "the renderer was interrupted; try again"
                )
                future.set_exception(CagefieldError(text))

        self._queue.append(_Running(make(self._number()), done=done))
        self.pump()
        return await future

    async def ask_patiently(self, make: Callable[[int, int], Task]) -> Any:
        """Result of a task `make(number, generation)` of lower priority than the pages' images.

        Begun anew where a page interrupts it; not done at all where the caller is cancelled before.

        Raises:
            CagefieldError: it cannot be done.
            TooManyError: PATIENT of them wait already.
        """
        if self._given_up:
            raise CagefieldError(_GIVEN_UP)
        if len(self._patient) >= PATIENT:
            raise TooManyError(f"{PATIENT} pictures are being made already; try again when they are there")
        future: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        waiting = (make, future)
        self._patient.append(waiting)
        try:
            self.pump()
            return await future
        finally:
            self._patient.remove(waiting)
            if self._asked is waiting:  # nobody waits for what is being done
                self.interrupt()
                self.worker.abandon(self.scheduler.generation)

    def _patient_task(self) -> _Running | None:
        waiting = next((each for each in self._patient if not each[1].done()), None)
        if waiting is None:
            return None
        make, future = waiting

        def done(result: Result) -> None:
            self._asked = None
            if future.done() or isinstance(result, Stopped):
                return
            if isinstance(result, Answered):
                future.set_result(result.value)
            else:
                text = result.text if isinstance(result, Failed) else "it could not be made; try again"
                future.set_exception(CagefieldError(text))

        self._asked = waiting
        return _Running(make(self._number(), self.scheduler.generation), done=done)

    def pump(self) -> None:
        """Hand the next task to a free rendering process; cancel tasks without a receiver."""
        now = time.monotonic()
        if not self.scheduler.idle():
            self.interrupt()
        self.worker.abandon(self.scheduler.generation)
        if self._running is not None or not self._ready or self._closing:
            return
        running = self._next(now)
        if running is None:
            rest = self._busy + REST_SECONDS - now if self.scheduler.idle() else 0.0
            pause = self._paused_until - now
            waits = [wait for wait in (self.scheduler.wake(now), rest, pause) if wait is not None]
            self._sleep(min((wait for wait in waits if wait > 0.0), default=None))
            return
        self._running = running
        self.worker.send(running.task)

    def interrupt(self) -> None:
        """Abandons a background task that is being done: it has to wait after all."""
        if self._running is not None and self._running.request is None:
            self.scheduler.generation += 1

    def expect_drag(self) -> None:
        """Pauses background tasks: a mouse is on a handle, and a drag's first picture needs the machine."""
        now = time.monotonic()
        if now > self._paused_until + PAUSE_GAP:
            self._pause_began = now
        until = min(now + PAUSE_SECONDS, self._pause_began + LONGEST_PAUSE)
        if until > now:
            self._paused_until = until
            self.worker.pause(until)
            self.pump()

    def _next(self, now: float) -> _Running | None:
        awaited = self._awaited(now)
        if awaited is not None:
            self._busy = now
            return awaited
        if not self.scheduler.idle() or now < self._paused_until:
            return None
        background_task = self._source.background_task(now - self._busy >= REST_SECONDS)
        return (
            None
            if background_task is None
            else _Running(background_task.make(self._number()), done=background_task.done)
        )

    def _awaited(self, now: float) -> _Running | None:
        """Next task that a caller or a page waits for."""
        if self._queue:
            return self._queue.popleft()
        request = self.scheduler.next(now)
        if isinstance(request, EditsRequest):
            edits, stamp = self._source.edits_task(request, self.scheduler.generation)
            return _Running(edits, request, stamp)
        if request is not None:
            task, stamp = self._source.picture_task(request, self.scheduler.generation)
            return _Running(task, request, stamp)
        return self._patient_task() if self.scheduler.idle() else None

    def _number(self) -> int:
        """Numbers of tasks that are no pictures; those have the scheduler's."""
        self._numbers -= 1
        return self._numbers

    def _sleep(self, seconds: float | None) -> None:
        if self._wake is not None:
            self._wake.cancel()
            self._wake = None
        if seconds is not None and self._loop is not None:
            self._wake = self._loop.call_later(seconds + 0.002, self.pump)

    def _result(self, result: Result) -> None:
        if isinstance(result, Ready):
            self._ready = True
        elif isinstance(result, Replaced):
            self._source.replaced()
        elif result.number == 0:
            if isinstance(result, Failed):
                self._source.notice("error", result.text)
        elif self._running is not None and self._running.task.number == result.number:
            running, self._running = self._running, None
            self._finish(running, result)
        self.pump()

    def _finish(self, running: _Running, result: Result) -> None:
        if running.done is not None:
            running.done(result)
        request = running.request
        if request is None or running.stamp is None:
            return
        self._busy = time.monotonic()
        if isinstance(request, EditsRequest):
            if isinstance(result, (EditsDone, Failed)):
                self.scheduler.sent(request, result.refinement if isinstance(result, EditsDone) else FINAL)
                self._source.deliver_edits(request, running.stamp, result)
            else:
                self.scheduler.abandoned(request, again=True)
            return
        if isinstance(result, PictureDone):
            region = request.region
            self.scheduler.finished(
                request,
                region.width * region.height,
                result.render_seconds + result.encode_seconds,
                result.map_seconds,
                result.refinement,
            )
            self._source.deliver(request, running.stamp, result)
            return
        self.scheduler.abandoned(request, again=isinstance(result, Stopped))
        if isinstance(result, Failed):
            self._source.notice("error", result.text)

    def _lost(self) -> None:
        running, self._running = self._running, None
        self._ready = False
        if running is not None:
            self._finish(running, Stopped(running.task.number))
        now = time.monotonic()
        self._losses = [at for at in self._losses if now - at < 60.0] + [now]
        if len(self._losses) > RESTARTS:
            self._give_up()
            return
        self._source.notice("warning", "the renderer was lost and is started again; no edits are lost")
        self.scheduler.refresh(now)
        self.worker.start()

    def _give_up(self) -> None:
        self._given_up = True
        self._source.notice("error", _GIVEN_UP)
        while self._queue:
            waiting = self._queue.popleft()
            self._finish(waiting, Failed(waiting.task.number, _GIVEN_UP))
        for _, future in self._patient:
            if not future.done():
                future.set_exception(CagefieldError(_GIVEN_UP))

    def _from_thread(self, method: Callable[..., None]) -> Callable[..., None]:
        """The method, callable from another thread: runs in the event loop."""

        def here(*args: Any) -> None:
            if not self._closing:
                method(*args)

        def call(*args: Any) -> None:
            loop = self._loop
            if loop is None:
                return
            try:
                loop.call_soon_threadsafe(here, *args)
            except RuntimeError:
                if not loop.is_closed():
                    raise

        return call
