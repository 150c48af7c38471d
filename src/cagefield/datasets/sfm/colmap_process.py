"""Child processes for COLMAP, which aborts its process where it cannot write its database.

A child reads its task as one line of JSON from its standard input, which stays open: its end means that the
parent has ended, and the child ends too. The child prints `done N` for the progress, and `failed REASON`; all
other lines are COLMAP's.
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

_MAX_KEPT_LINES = 60
"""Number of last output lines of a child that are kept for its error message."""

_EXCEPTION_TEXT = re.compile(r"what\(\): +(\S.*)")
"""Pattern of the C++ library's message about an uncaught exception."""


class StoppedError(DatasetError):
    """Failure of COLMAP, or of the system beneath it, for which the photos are not to blame."""


def run_tasks(stage: str, tasks: Sequence[Mapping[str, Any]], on_done: Callable[[int], None]) -> None:
    """Run tasks of `colmap_tasks` in parallel, each in a process of its own.

    `on_done` is called several times a second with the sum of their progress. Raises StoppedError with the
    reason where one fails, `stage` being the subject of the message; the other processes are then killed, as
    on any error.
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
                    f"{stage} stopped with status {process.popen.returncode}: {process.reason()}"
                )
        on_done(sum(process.done for process in running))
    finally:
        for process in running:
            process.end()


class _Process:
    """Child process of one task, with its progress and last output."""

    def __init__(self, task: Mapping[str, Any]) -> None:
        self.done = 0
        self.ended = threading.Event()
        self._last_lines: collections.deque[str] = collections.deque(maxlen=_MAX_KEPT_LINES)
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
        self._thread = threading.Thread(target=self._read_output, daemon=True)
        self._thread.start()

    def _read_output(self) -> None:
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
                    self._last_lines.append(line.strip())
        self.popen.wait()
        self.ended.set()

    def reason(self) -> str:
        """Reason of the child's end: its own message, else the C++ library's, else its last line."""
        messages = [match[1] for line in self._last_lines if (match := _EXCEPTION_TEXT.match(line))]
        return (
            self._failed
            or next(iter(messages), "")
            or (self._last_lines[-1] if self._last_lines else "no words")
        )

    def end(self) -> None:
        """Kill the child and wait for its end."""
        self.popen.kill()
        self._thread.join()
        for pipe in (self.popen.stdin, self.popen.stdout):
            with contextlib.suppress(OSError):
                if pipe is not None:
                    pipe.close()
