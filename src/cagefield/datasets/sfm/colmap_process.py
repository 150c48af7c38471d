"""COLMAP's work in processes of its own: it ends its process where it cannot write its database.

A process is told what to do in one line of JSON on its input, which stays open: where that closes, the one
that started it has ended, and it ends too. It says `done N` for what is done, and `failed REASON`. What else
it says is COLMAP's.
"""

from __future__ import annotations

import collections
import contextlib
import json
import re
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from cagefield.errors import DatasetError

_LAST_WORDS = 60
"""Lines of a process that has ended that are looked at."""

_SAID = re.compile(r"what\(\): +(\S.*)")
"""What the C++ library says of an error that nobody handles."""


class StoppedError(DatasetError):
    """COLMAP, or the system beneath it, went no further: the photos are not to blame."""


def run(what: str, tasks: Sequence[Mapping[str, Any]], on_done: Callable[[int], None]) -> None:
    """Does tasks of `colmap_tasks`, each in a process of its own, side by side.

    `on_done` is called several times a second with the sum of what they have done. Raises StoppedError, that
    says `what` stopped and why, where one fails; the others are then ended, as they are by any other error.
    """
    running: list[_Process] = []
    try:
        for task in tasks:
            running.append(_Process(task))
        while not all(process.ended.wait(0.1) for process in running):
            on_done(sum(process.done for process in running))
            if any(process.ended.is_set() and process.popen.returncode for process in running):
                break
        for process in running:
            if process.ended.is_set() and process.popen.returncode:
                raise StoppedError(
                    f"{what} stopped with status {process.popen.returncode}: {process.reason()}"
                )
        on_done(sum(process.done for process in running))
    finally:
        for process in running:
            process.end()


class _Process:
    """A process that does a task, and what it said."""

    def __init__(self, task: Mapping[str, Any]) -> None:
        self.done = 0
        self.ended = threading.Event()
        self._words: collections.deque[str] = collections.deque(maxlen=_LAST_WORDS)
        self._failed = ""
        self._task = json.dumps(task)
        self.popen = subprocess.Popen(
            [sys.executable, "-m", "cagefield.datasets.sfm.colmap_tasks"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            encoding="utf-8",
            errors="replace",
        )
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def _listen(self) -> None:
        assert self.popen.stdin is not None and self.popen.stdout is not None
        with contextlib.suppress(OSError, ValueError):  # it has ended
            self.popen.stdin.write(self._task + "\n")
            self.popen.stdin.flush()
        with contextlib.suppress(OSError, ValueError):
            for line in self.popen.stdout:
                kind, _, rest = line.rstrip().partition(" ")
                if kind == "done" and rest.isdecimal():
                    self.done = int(rest)
                elif kind == "failed":
                    self._failed = rest
                elif line.strip():
                    self._words.append(line.strip())
        self.popen.wait()
        self.ended.set()

    def reason(self) -> str:
        """Why it ended: what it said itself, else the C++ library, else its last line."""
        said = [found[1] for line in self._words if (found := _SAID.match(line))]
        return self._failed or next(iter(said), "") or (self._words[-1] if self._words else "no words")

    def end(self) -> None:
        """Ends it, and waits for that."""
        self.popen.kill()
        self._thread.join()
        for pipe in (self.popen.stdin, self.popen.stdout):
            with contextlib.suppress(OSError):
                if pipe is not None:
                    pipe.close()
