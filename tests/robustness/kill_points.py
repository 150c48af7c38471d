"""Programs that are killed where they write: at the n-th call that changes something, or at any moment.

Or in the middle of the n-th write, with half of its bytes in the file (`write_points`).

A process is forked for each kill, so that what it imports is imported once. Python tells of every such call
(`sys.addaudithook`) just before it is made; the call after it is the next kill point. A process that a
killed one had started becomes a child of this one (Linux), which sees how long that goes on.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import struct
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import write_points

_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC
_EVENTS = (
    "os.rename",
    "os.remove",
    "os.mkdir",
    "os.rmdir",
    "os.link",
    "os.symlink",
    "os.truncate",
    "os.chmod",
)
_PR_SET_CHILD_SUBREAPER = 36
"""Of Linux's <sys/prctl.h>."""
PATIENCE = 600.0
"""Seconds after which work that does not end is killed."""
STAYS = 5.0
"""Seconds after which no process of a killed one may be there."""

Say = Callable[[int], None]


@dataclass(frozen=True)
class Ended:
    """How work in a process of its own came to its end."""

    killed: bool
    calls: int
    """Calls that it made which change something in its folder, or its writes."""
    said: int
    """The last number that it said, or -1."""
    outlived: int = 0
    """Processes that it had started, and that were there `STAYS` seconds after it."""
    stayed: float = 0.0
    """Seconds that the last of them was there."""


def forked(
    work: Callable[[Say], None], folder: Path, at: int, after: float | None = None, *, writes: bool = False
) -> Ended:
    """The end of work in a forked process.

    It is killed at call number `at` that changes something in `folder`, with `writes` in the middle of that
    write, or by its parent `after` seconds.
    """
    reading, writing = os.pipe()
    others = adopted()
    process = os.fork()
    if process == 0:
        os.close(reading)
        run(work, folder, at, writing, writes)
    os.close(writing)
    return _waited(process, reading, after, others)


def started(name: str, folder: Path, at: int, after: float | None = None, *, writes: bool = False) -> Ended:
    """End of a command with kernels, in a new process: a forked one has none of their threads."""
    reading, writing = os.pipe()
    others = adopted()
    script = str(Path(__file__).with_name("killed_command.py"))
    paths = os.pathsep.join((*sys.path, str(Path(__file__).resolve().parent.parent)))
    process = subprocess.Popen(
        [sys.executable, script, name, str(folder), str(at), str(writing), str(int(writes))],
        pass_fds=[writing],
        env=os.environ | {"PYTHONPATH": paths} | (write_points.preloading() if writes else {}),
    )
    os.close(writing)
    ended = _waited(process.pid, reading, after, others)
    process.returncode = 0  # it has been waited for
    return ended


def _waited(process: int, reading: int, after: float | None, others: Collection[int]) -> Ended:
    timer = threading.Timer(PATIENCE if after is None else after, _kill, (process,))
    timer.start()
    _, status = os.waitpid(process, 0)
    timer.cancel()
    timer.join()
    # Nobody else writes; some hundred numbers fit into a pipe.
    os.set_blocking(reading, False)
    said = bytearray()
    with contextlib.suppress(BlockingIOError):
        while part := os.read(reading, 1 << 16):
            said += part
    os.close(reading)
    count, seconds = outliving(others, STAYS)
    numbers = list(struct.iter_unpack("<bq", said[: len(said) // 9 * 9]))
    killed = os.WIFSIGNALED(status)
    if not killed and os.waitstatus_to_exitcode(status) != 0:
        raise RuntimeError(f"the work failed; its error is on stderr ({status})")
    calls = max((value for kind, value in numbers if kind == 0), default=0)
    last = max((value for kind, value in numbers if kind == 1), default=-1)
    return Ended(killed, calls, last, count, seconds)


def adopted() -> set[int]:
    """This process's children. From now on it takes those that a killed one of them leaves, where it can."""
    if sys.platform.startswith("linux"):
        ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    return children(os.getpid())


def children(process: int) -> set[int]:
    """The processes that a process has started or taken; none where the system does not tell."""
    found: set[int] = set()
    for task in Path(f"/proc/{process}/task").glob("*/children"):
        with contextlib.suppress(OSError):
            found.update(map(int, task.read_text().split()))
    return found


def outliving(others: Collection[int], longest: float) -> tuple[int, float]:
    """(children beside `others` that are there after `longest` seconds, seconds that the last was there).

    Children that are left are then killed.
    """
    begun = time.monotonic()
    while left := _living(children(os.getpid()).difference(others)):
        if time.monotonic() - begun > longest:
            break
        time.sleep(0.02)
    seconds = time.monotonic() - begun
    while rest := _living(children(os.getpid()).difference(others)):
        for child in rest:
            _kill(child)
        time.sleep(0.02)
    return len(left), seconds


def _living(processes: Collection[int]) -> set[int]:
    """Children of this process that have not ended; ended ones are taken from the system."""
    living = set()
    for process in processes:
        with contextlib.suppress(ChildProcessError):
            if os.waitpid(process, os.WNOHANG)[0] == 0:
                living.add(process)
    return living


def _kill(process: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(process, signal.SIGKILL)


def run(work: Callable[[Say], None], folder: Path, at: int, writing: int, writes: bool = False) -> None:
    """In the process that is killed: never returns."""
    code = 1
    try:
        os.set_inheritable(writing, False)
        calls, root = 0, str(folder.resolve())

        def hook(event: str, arguments: tuple[Any, ...]) -> None:
            nonlocal calls
            if not _changes(event, arguments, root):
                return
            calls += 1
            os.write(writing, struct.pack("<bq", 0, calls))
            if calls == at:
                os.kill(os.getpid(), signal.SIGKILL)

        if writes:
            write_points.arm(folder, at)
        else:
            sys.addaudithook(hook)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            work(lambda number: os.write(writing, struct.pack("<bq", 1, number)) and None)
        if writes:
            os.write(writing, struct.pack("<bq", 0, write_points.count()))
        code = 0
    except BaseException:
        import traceback

        traceback.print_exc()
    finally:
        os._exit(code)


def _changes(event: str, arguments: tuple[Any, ...], root: str) -> bool:
    """Whether an event of Python's is a call that changes something in a folder."""
    if event == "ctypes.dlsym":
        return "renameat2" in arguments
    if event == "open":
        path, _, flags = arguments
        return (
            isinstance(path, (str, bytes)) and bool(flags & _WRITING) and os.fsdecode(path).startswith(root)
        )
    if event not in _EVENTS:
        return False
    paths = [os.fsdecode(path) for path in arguments if isinstance(path, (str, bytes, os.PathLike))]
    if any(path.startswith(root) for path in paths):
        return True
    # A name in a folder that is open, as in a tree that is removed.
    handles = [handle for handle in arguments if isinstance(handle, int) and handle > 2]
    return any(_path_of(handle).startswith(root) for handle in handles)


def _path_of(handle: int) -> str:
    """The path of an open file, where the system tells."""
    try:
        return os.readlink(f"/proc/self/fd/{handle}")
    except OSError:
        return ""
