"""The rendering process: a kernel holds the interpreter to its end, so the server's own would stand still.

`serve` runs in it, told what to do over a pipe, one task at a time. `Worker` is the server's side: starts it,
hands it tasks, passes results on, and starts it again when it is lost.

The process reads the scene by itself. Where another program has replaced that on disk, it says `Replaced` and
is given a copy of the one that the server has.
"""

from __future__ import annotations

import ctypes
import dataclasses
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cagefield.compute.parent_watch import end_with_parent
from cagefield.errors import CagefieldError, line_of, warnings_in_one_line
from cagefield.files.temporary_folders import TemporaryFolder
from cagefield.server.render_worker.tasks import (
    BACKGROUND_TASKS,
    Failed,
    Ready,
    Replaced,
    Result,
    Task,
)
from cagefield.server.render_worker.unused_memory import UnusedMemory

if TYPE_CHECKING:
    from cagefield.scene.scene import Scene

PAUSE_STEP = 0.002
"""Seconds between two looks of a background task whether its pause is over."""

TO_END = 10.0
"""Seconds that a process that has its scene may take to end: then it keeps the kernels that it compiled."""

Color = tuple[float, float, float] | None

_LOST = (EOFError, OSError)
"""Errors of sending to, and receiving from, a process that has ended."""


@dataclass(frozen=True)
class Signals:
    """Shared memory by which the server reaches a task that is being done.

    Tasks of generations before `generation` stop at their next look; background tasks wait there until the
    time `paused_until` (`time.monotonic`).
    """

    generation: ctypes.c_ulong
    paused_until: ctypes.c_double

    @classmethod
    def shared(cls) -> Signals:
        """Signals in memory that a child process shares."""
        context = multiprocessing.get_context("spawn")
        return cls(context.RawValue(ctypes.c_ulong, 0), context.RawValue(ctypes.c_double, 0.0))

    def is_over(self, task: Task, wanted: int) -> bool:
        """Whether the generation `wanted` of a task is over, after the pause of a background task."""
        if isinstance(task, BACKGROUND_TASKS):
            while self.generation.value <= wanted and time.monotonic() < self.paused_until.value:
                time.sleep(PAUSE_STEP)
        return self.generation.value > wanted


@warnings_in_one_line()
def serve(
    connection: Connection,
    signals: Signals,
    scene: str,
    device: str,
    files: object = None,
    background: Color = None,
) -> None:
    """Does tasks until one is None or the pipe closes; an error of a task becomes `Failed`.

    `files` are the states (`scene.scene_files.field_states`) of the scene that is edited, and `background`
    its color or None for nothing behind the field. `files` None is any scene, with its own background.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()
    from cagefield.compute import devices
    from cagefield.server.render_worker.renderer_cache import RendererCache
    from cagefield.server.render_worker.task_handlers import TaskHandlers

    try:
        devices.start(device)
        opened = _opened(connection, scene, files)
        if opened is None:
            return
        if files is not None:
            opened = dataclasses.replace(opened, background=background)
        handlers = TaskHandlers(RendererCache(opened))
    except CagefieldError as error:
        _sent(connection, Failed(0, str(error)))
        return
    unused = UnusedMemory()
    going_on = _sent(connection, Ready())
    while going_on:
        unused.give_back()
        try:
            task = connection.recv()
        except _LOST:
            break
        going_on = task is not None and _sent(connection, _done(handlers, task, signals))
    handlers.close()


def _opened(connection: Connection, folder: str, files: object) -> Scene | None:
    """The scene that is edited, from `folder` or, where that holds another, one that the server names.

    None where the server has none, or has gone.
    """
    from cagefield.scene.scene import Scene
    from cagefield.scene.scene_files import field_states

    if files is None:
        return Scene.open(folder, whole=True)
    if field_states(folder) == files:
        try:
            scene = Scene.open(folder, whole=True)
        except CagefieldError:
            if field_states(folder) == files:
                raise
        else:
            if field_states(folder) == files:  # and it was while it was read
                return scene
    try:
        connection.send(Replaced())
        copy = connection.recv()
    except _LOST:
        return None
    return None if copy is None else Scene.open(copy, whole=True)


def _sent(connection: Connection, content: Any) -> bool:
    """Whether there was still somebody to send it to."""
    try:
        connection.send(content)
    except _LOST:
        return False
    return True


def _done(handlers: Any, task: Task, signals: Signals) -> Result:
    try:
        return handlers.do(task, lambda wanted: signals.is_over(task, wanted))
    except CagefieldError as error:
        return Failed(task.number, str(error))
    except OSError as error:
        return Failed(task.number, line_of(error))
    except Exception as error:
        return Failed(task.number, f"rendering failed: {type(error).__name__}: {error}")


class Worker:
    """The rendering process as the server has it.

    `on_result` is called, from a thread of its own, with every result, and `on_lost` when the process is
    gone; `start` starts it again.
    """

    def __init__(
        self,
        scene: str,
        device: str,
        on_result: Callable[[Result], None],
        on_lost: Callable[[], None],
    ) -> None:
        self.scene = scene
        """The folder that is read when the process starts."""
        self.files: object = None
        """The states that its files have as long as it is the scene that is edited; None for any."""
        self.background: Color = None
        """The color behind the scene that is edited."""
        self.write_opened: Callable[[Path], None] | None = None
        """Writes the scene that is edited as another folder."""
        self._device = device
        self._on_result, self._on_lost = on_result, on_lost
        self._context = multiprocessing.get_context("spawn")
        self._signals = Signals.shared()
        self.process: Any = None
        self._connection: Connection | None = None
        self._has_scene = False

    def start(self) -> None:
        """Starts the process; `Ready` or `Failed` with number 0 comes when it has its scene.

        Where it is gone before it has begun, `on_lost` is called.
        """
        here, there = self._context.Pipe()
        # Threads of OpenBLAS wait in loops after each product, and take the cores from the kernels' threads.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        process = self._context.Process(
            target=serve,
            args=(there, self._signals, self.scene, self._device, self.files, self.background),
            daemon=True,
            name="cagefield-renderer",
        )
        try:
            process.start()
        except _LOST:
            self.process = self._connection = None
            here.close()
            self._on_lost()
            return
        finally:
            there.close()
        self.process, self._connection, self._has_scene = process, here, False
        threading.Thread(target=self._listen, args=(here,), daemon=True).start()

    def send(self, task: Task) -> None:
        """Hands over a task; if the process is gone, `on_lost` is called instead of an answer."""
        if self._connection is not None:
            _sent(self._connection, task)

    def abandon(self, generation: int) -> None:
        """Tasks of older generations stop at their next look."""
        self._signals.generation.value = generation

    def pause(self, until: float) -> None:
        """Background tasks wait, at their next look, until a time of `time.monotonic`."""
        self._signals.paused_until.value = until

    @property
    def pid(self) -> int | None:
        """The process's number, or None before `start`."""
        return None if self.process is None else self.process.pid

    def close(self) -> None:
        """End the process and abandon its task."""
        connection, self._connection = self._connection, None
        if connection is not None:
            self._signals.generation.value = ctypes.c_ulong(-1).value
            _sent(connection, None)
            if self.process is not None and self._has_scene:
                self.process.join(TO_END)
            connection.close()
        if self.process is not None:
            self.process.terminate()
            self.process.join(5.0)

    def _listen(self, connection: Connection) -> None:
        while True:
            try:
                result = connection.recv()
                if isinstance(result, Replaced):
                    self._on_result(result)
                    result = self._hand_over(connection)
            except (*_LOST, TypeError):
                if self._connection is connection:
                    self._on_lost()
                return
            self._has_scene = True
            self._on_result(result)

    def _hand_over(self, connection: Connection) -> Result:
        """Send the process a copy of the edited scene; returns its answer."""
        assert self.write_opened is not None  # nothing is replaced where `files` are not known
        with ExitStack() as kept:
            try:
                copy = kept.enter_context(TemporaryFolder("copy")) / "scene"
                self.write_opened(copy)
            except (CagefieldError, OSError, MemoryError) as error:
                _sent(connection, None)
                why = line_of(error) if isinstance(error, OSError) else str(error) or "too little memory"
                return Failed(0, f"the scene that was opened cannot be kept for pictures: {why}")
            connection.send(str(copy))
            result: Result = connection.recv()
            return result
