"""The dispatcher between the scheduler and the rendering process, with a process that the tests play."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from cagefield.cameras.camera import Camera
from cagefield.errors import CagefieldError
from cagefield.server.render_queue import dispatcher as module
from cagefield.server.render_queue.damage import WHOLE, Rect
from cagefield.server.render_queue.dispatcher import (
    PATIENT,
    RESTARTS,
    BackgroundTask,
    Dispatcher,
    Stamp,
    TooManyError,
)
from cagefield.server.render_queue.requests import Request
from cagefield.server.render_worker.process import Signals
from cagefield.server.render_worker.refinement import FINAL
from cagefield.server.render_worker.tasks import (
    Answered,
    Failed,
    LightTask,
    PictureDone,
    PictureTask,
    Ready,
    Result,
    Shown,
    StillTask,
    Stopped,
    SurfaceTask,
    Task,
    WarmStage,
    WarmTask,
)
from cagefield.server.render_worker.view import Display, Region

CAMERA = Camera.look_at((0, -3, 0), (0, 0, 0), width=64, height=64, fov_x=0.8)


class PlayedWorker:
    """A rendering process that does nothing by itself."""

    def __init__(self, scene: str, device: str, on_result: Any, on_lost: Any) -> None:
        self.answer: Callable[[Result], None] = on_result
        self.lose: Callable[[], None] = on_lost
        self.tasks: list[Task] = []
        self.starts = 0
        self.generation = 0
        self.pauses: list[float] = []

    def start(self) -> None:
        self.starts += 1

    def send(self, task: Task) -> None:
        self.tasks.append(task)

    def abandon(self, generation: int) -> None:
        self.generation = generation

    def pause(self, until: float) -> None:
        self.pauses.append(until)

    def close(self) -> None:
        self.tasks.clear()


class PlayedDispatcher:
    """Notes down what the dispatcher tells it."""

    def __init__(self) -> None:
        self.delivered: list[int] = []
        self.notices: list[str] = []
        self.background: list[BackgroundTask] = []
        self.rests: list[bool] = []

    def picture_task(self, request: Request, generation: int) -> tuple[PictureTask, Stamp]:
        task = PictureTask(
            request.number,
            Shown(()),
            CAMERA,
            request.region,
            request.display,
            request.moving,
            request.refinement,
            generation,
        )
        return task, Stamp(1)

    def differing(self, page: int, one: int, another: int) -> Rect | None:
        return WHOLE

    def deliver(self, request: Request, stamp: Stamp, done: PictureDone) -> None:
        self.delivered.append(request.number)

    def notice(self, level: str, text: str) -> None:
        self.notices.append(text)

    def background_task(self, rested: bool) -> BackgroundTask | None:
        self.rests.append(rested)
        return self.background.pop(0) if self.background else None


@pytest.fixture
def source() -> PlayedDispatcher:
    return PlayedDispatcher()


def play(
    source: PlayedDispatcher,
    monkeypatch: pytest.MonkeyPatch,
    script: Callable[[Dispatcher, Any], Awaitable[None]],
) -> None:
    """Runs a script with a dispatcher whose rendering process is ready."""
    monkeypatch.setattr(module, "Worker", PlayedWorker)

    async def run() -> None:
        dispatcher = Dispatcher("scene", "cpu", source)
        dispatcher.start()
        worker: Any = dispatcher.worker
        worker.answer(Ready())
        await settle()
        await script(dispatcher, worker)
        dispatcher.close()

    asyncio.run(run())


async def settle() -> None:
    for _ in range(5):
        await asyncio.sleep(0)


def done(task: Task) -> PictureDone:
    return PictureDone(task.number, b"", "rgb", b"", FINAL, (0, 0), 1.0, 0.0, 0.01, 0.0)


def surface(number: int) -> SurfaceTask:
    return SurfaceTask(number, Shown(()), CAMERA, 0.5, 0.5)


def test_one_task_at_a_time_and_answers_before_pictures(
    source: PlayedDispatcher, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def script(dispatcher: Dispatcher, worker: PlayedWorker) -> None:
        dispatcher.scheduler.join(1)
        dispatcher.scheduler.camera(1, 1, 64, 64, True, 0.0)
        dispatcher.pump()
        (picture,) = worker.tasks
        asked = asyncio.ensure_future(dispatcher.ask(surface))
        dispatcher.scheduler.camera(1, 2, 64, 64, True, 0.0)
        await settle()
        assert worker.tasks == [picture]
        worker.answer(done(picture))
        await settle()
        assert isinstance(worker.tasks[-1], SurfaceTask) and source.delivered == [picture.number]
        worker.answer(Answered(worker.tasks[-1].number, "point"))
        await settle()
        assert await asked == "point"
        dispatcher.scheduler.presented(1, picture.number)
        dispatcher.pump()
        assert isinstance(worker.tasks[-1], PictureTask) and len(worker.tasks) == 3

    play(source, monkeypatch, script)


def test_chores_wait_until_no_page_does(source: PlayedDispatcher, monkeypatch: pytest.MonkeyPatch) -> None:
    async def script(dispatcher: Dispatcher, worker: PlayedWorker) -> None:
        results: list[Result] = []
        dispatcher.scheduler.join(1)
        dispatcher.scheduler.camera(1, 1, 64, 64, True, 0.0)
        source.background.append(
            BackgroundTask(lambda number: WarmTask(number, WarmStage.COARSE_EDIT), results.append)
        )
        dispatcher.pump()
        assert isinstance(worker.tasks[-1], PictureTask)
        dispatcher.scheduler.camera(1, 1, 64, 64, False, 0.0)
        worker.answer(done(worker.tasks[-1]))
        await settle()
        while isinstance(worker.tasks[-1], PictureTask):
            dispatcher.scheduler.presented(1, worker.tasks[-1].number)
            worker.answer(done(worker.tasks[-1]))
            await settle()
        background_task = worker.tasks[-1]
        assert isinstance(background_task, WarmTask)
        generation = dispatcher.scheduler.generation
        dispatcher.pump()
        assert worker.generation == generation
        dispatcher.scheduler.camera(1, 2, 64, 64, True, 0.0)
        dispatcher.pump()
        assert worker.generation == generation + 1
        worker.answer(Stopped(background_task.number))
        await settle()
        assert results == [Stopped(background_task.number)]

    play(source, monkeypatch, script)


def test_long_background_tasks_wait_for_a_rest(
    source: PlayedDispatcher, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A timer asks for them; a task that a caller waits for begins the rest anew."""
    monkeypatch.setattr(module, "REST_SECONDS", 0.2)

    async def script(dispatcher: Dispatcher, worker: PlayedWorker) -> None:
        assert source.rests == [False]
        await asyncio.sleep(0.3)
        assert source.rests[-1]
        asked = asyncio.ensure_future(dispatcher.ask(surface))
        await settle()
        worker.answer(Answered(worker.tasks[-1].number, "point"))
        await settle()
        assert await asked == "point" and not source.rests[-1]
        await asyncio.sleep(0.3)
        assert source.rests[-1]

    play(source, monkeypatch, script)


def test_a_failure_is_told_to_who_asked(source: PlayedDispatcher, monkeypatch: pytest.MonkeyPatch) -> None:
    async def script(dispatcher: Dispatcher, worker: PlayedWorker) -> None:
        asked = asyncio.ensure_future(dispatcher.ask(surface))
        await settle()
        worker.answer(Failed(worker.tasks[-1].number, "no surface"))
        with pytest.raises(CagefieldError, match="no surface"):
            await asked
        dispatcher.scheduler.join(1)
        dispatcher.scheduler.camera(1, 1, 64, 64, True, 0.0)
        dispatcher.pump()
        worker.answer(Failed(worker.tasks[-1].number, "not possible"))
        await settle()
        assert source.notices == ["not possible"] and len(worker.tasks) == 2

    play(source, monkeypatch, script)


def test_a_lost_process_is_started_again_and_its_picture_rendered_again(
    source: PlayedDispatcher, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def script(dispatcher: Dispatcher, worker: PlayedWorker) -> None:
        dispatcher.scheduler.join(1)
        dispatcher.scheduler.camera(1, 1, 64, 64, True, 0.0)
        dispatcher.pump()
        worker.lose()
        await settle()
        assert worker.starts == 2 and "started again" in source.notices[-1]
        assert len(worker.tasks) == 1  # nothing before it is ready
        worker.answer(Ready())
        await settle()
        assert len(worker.tasks) == 2 and isinstance(worker.tasks[-1], PictureTask)

    play(source, monkeypatch, script)


def test_a_process_that_is_lost_again_and_again_is_given_up(
    source: PlayedDispatcher, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def script(dispatcher: Dispatcher, worker: PlayedWorker) -> None:
        asked = asyncio.ensure_future(dispatcher.ask(surface))
        await settle()
        waiting = asyncio.ensure_future(dispatcher.ask(surface))
        for _ in range(RESTARTS + 1):
            worker.lose()
            await settle()
        assert worker.starts == RESTARTS + 1
        assert "ends again and again" in source.notices[-1]
        with pytest.raises(CagefieldError, match="interrupted; try again"):
            await asked
        with pytest.raises(CagefieldError, match="restart the editor"):
            await waiting
        with pytest.raises(CagefieldError, match="restart the editor"):
            await dispatcher.ask(surface)

    play(source, monkeypatch, script)


def test_a_scene_that_the_process_cannot_read_is_told(
    source: PlayedDispatcher, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def script(dispatcher: Dispatcher, worker: PlayedWorker) -> None:
        worker.answer(Failed(0, "scene x does not exist"))
        await settle()
        assert source.notices == ["scene x does not exist"]

    play(source, monkeypatch, script)


def still(number: int, generation: int) -> StillTask:
    return StillTask(number, Shown(()), CAMERA, Display(), generation)


def test_downloads_wait_for_pictures_and_give_way_to_them(
    source: PlayedDispatcher, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def script(dispatcher: Dispatcher, worker: PlayedWorker) -> None:
        asked = asyncio.ensure_future(dispatcher.ask_patiently(still))
        await settle()
        (first,) = worker.tasks
        assert isinstance(first, StillTask)
        dispatcher.scheduler.join(1)
        dispatcher.scheduler.camera(1, 1, 64, 64, True, 0.0)
        dispatcher.pump()
        assert worker.generation > first.generation  # it is abandoned
        worker.answer(Stopped(first.number))
        await settle()
        picture = worker.tasks[-1]
        assert isinstance(picture, PictureTask) and not asked.done()
        worker.answer(done(picture))
        await settle()
        dispatcher.scheduler.presented(1, picture.number)
        dispatcher.scheduler.leave(1)
        dispatcher.pump()
        again = worker.tasks[-1]
        assert isinstance(again, StillTask) and again.generation >= worker.generation
        worker.answer(Answered(again.number, b"png"))
        assert await asked == b"png"

    play(source, monkeypatch, script)


def test_downloads_that_nobody_waits_for_are_dropped_and_only_some_wait(
    source: PlayedDispatcher, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def script(dispatcher: Dispatcher, worker: PlayedWorker) -> None:
        asked = [asyncio.ensure_future(dispatcher.ask_patiently(still)) for _ in range(60)]
        await settle()
        refused = [one for one in asked if one.done()]
        assert len(refused) == 60 - PATIENT
        assert all(isinstance(one.exception(), TooManyError) for one in refused)
        (first,) = worker.tasks
        for one in asked[:PATIENT]:
            one.cancel()
        await settle()
        assert worker.generation > first.number and worker.generation > getattr(first, "generation", -1)
        worker.answer(Stopped(first.number))
        await settle()
        assert worker.tasks == [first]
        surely = asyncio.ensure_future(dispatcher.ask_patiently(still))
        await settle()
        worker.answer(Answered(worker.tasks[-1].number, b"png"))
        assert await surely == b"png"

    play(source, monkeypatch, script)


def test_background_tasks_wait_where_a_drag_is_expected_but_not_for_ever(
    source: PlayedDispatcher, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [100.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])

    async def script(dispatcher: Dispatcher, worker: PlayedWorker) -> None:
        def wait() -> None:
            source.background.append(BackgroundTask(lambda number: LightTask(number, 0), lambda _: None))
            dispatcher.pump()

        dispatcher.expect_drag()
        assert worker.pauses == [100.0 + module.PAUSE_SECONDS]
        wait()
        assert not worker.tasks
        # Asked tasks and pictures do not wait.
        asked = asyncio.ensure_future(dispatcher.ask(surface))
        await settle()
        worker.answer(Answered(worker.tasks[0].number, "point"))
        await settle()
        assert await asked == "point" and len(worker.tasks) == 1
        for _ in range(9):  # a mouse that plays with the handles
            now[0] += 0.4
            dispatcher.expect_drag()
        assert worker.pauses[-1] == 100.0 + module.LONGEST_PAUSE < now[0]
        dispatcher.pump()
        assert isinstance(worker.tasks[-1], LightTask)
        now[0] += module.PAUSE_GAP + 10.0
        dispatcher.expect_drag()
        assert worker.pauses[-1] == now[0] + module.PAUSE_SECONDS

    play(source, monkeypatch, script)


def test_a_paused_task_goes_on_or_stops_at_once() -> None:
    signals = Signals.shared()
    signals.paused_until.value = time.monotonic() + 0.05
    assert not signals.is_over(LightTask(1, 3), 3) and time.monotonic() >= signals.paused_until.value
    signals.paused_until.value = time.monotonic() + 60.0
    picture = PictureTask(2, Shown(()), CAMERA, Region(0, 0, 8, 8, 8, 8), Display(), False, FINAL, 3)
    assert not signals.is_over(picture, 3)
    signals.generation.value = 4
    assert signals.is_over(LightTask(1, 3), 3) and signals.is_over(picture, 3)
