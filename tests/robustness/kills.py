"""Kills of commands, and what came of them."""

from __future__ import annotations

import contextlib
import importlib
import json
import random
import sys
import tempfile
import time
import warnings
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from kill_commands import COMMANDS, SESSION_STEPS, SLOW_COMMANDS, Command
from kill_points import Ended, Say, forked, started
from write_points import is_loaded

ALL = {**COMMANDS, **SLOW_COMMANDS}


@dataclass
class Killed:
    """Counts of kills."""

    kills: int = 0
    lost: int = 0
    unreadable: int = 0
    left: int = 0
    """Kills after which hidden files were there once the command had been run again."""
    outlived: int = 0
    """Kills after which processes were there for over `kill_points.STAYS` seconds."""
    stayed: float = 0.0
    """Seconds that a process was there after the killed one, at most."""
    faults: list[str] = field(default_factory=list)

    def count(self, where: str, ended: Ended, problem: str | None, left: list[str]) -> None:
        """One kill more."""
        self.kills += 1
        self.stayed = max(self.stayed, ended.stayed)
        if ended.outlived:
            self.outlived += 1
            self.faults.append(f"{where}: {ended.outlived} processes go on")
        if problem is not None:
            self.faults.append(f"{where}: {problem}")
            if "unreadable" in problem:
                self.unreadable += 1
            else:
                self.lost += 1
        if left:
            self.left += 1
            self.faults.append(f"{where}: left {left}")


def kill(
    command: Command,
    name: str,
    folder: Path,
    at: int,
    found: Killed,
    after: float | None = None,
    *,
    writes: bool = False,
) -> bool:
    """One kill in an empty folder; False where the command came to its end before. Counts what is wrong.

    At call `at`, `after` seconds, or with `writes` in the middle of write `at`.
    """
    command.make(folder)
    ended = _process(command, name, folder, at, after, writes)
    if not ended.killed:
        return False
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        problem = command.check(folder, ended.said)
        if problem is None:
            again = _process(command, name, folder, 0)
            if again.killed:
                problem = "lost: the next start did not end"
            else:
                problem = command.check(folder, 2 * SESSION_STEPS if name == "changes and saves" else 1)
                problem = None if problem is None else f"{problem} (after the next start)"
    where = f"{name}, {'write' if writes else 'call'} {at}"
    where = where if after is None else f"{name}, after {after:.3f} s"
    found.count(where, ended, problem, hidden(folder))
    return True


def hidden(folder: Path) -> list[str]:
    """Hidden files and folders, beside locks, whose files may stay, and the marks of folders of pictures.

    And the folders of poses that are half found.
    """
    return [
        str(file.relative_to(folder))
        for pattern in (".*", "*.work")
        for file in folder.rglob(pattern)
        if not file.name.endswith(("cagefield-lock", "cagefield-pictures"))
    ]


@cache
def _warm() -> None:
    """Imports what commands need, once for all forked processes."""
    from cagefield.cli import parse

    parse(["info", "scene"])


_IMPORTED: set[str] = set()
"""Slow commands whose modules this process has."""


def import_for(name: str) -> None:
    """Imports what a slow command imports, once for all forked processes; it has been run once for that.

    Its kernels and its threads begin after the fork; this process must have begun none.
    """
    with tempfile.TemporaryDirectory() as place:
        folder, found = Path(place, "folder"), Path(place, "modules.json")
        folder.mkdir()
        ALL[name].make(folder)

        def work(say: Say) -> None:
            ALL[name].work(folder, say)
            found.write_text(json.dumps([module for module in sys.modules if not module.startswith("_")]))

        forked(work, folder, 0)
        for module in json.loads(found.read_text()):
            with contextlib.suppress(Exception):  # some are not found by their names
                importlib.import_module(module)
    _IMPORTED.add(name)


def _process(
    command: Command, name: str, folder: Path, at: int, after: float | None = None, writes: bool = False
) -> Ended:
    if (name in SLOW_COMMANDS and name not in _IMPORTED) or (writes and not is_loaded()):
        return started(name, folder, at, after, writes=writes)
    return forked(lambda say: command.work(folder, say), folder, at, after, writes=writes)


def calls_of(name: str, folder: Path, *, writes: bool = False) -> tuple[int, float]:
    """(calls that the command makes, or its writes, seconds that it takes) in an empty folder."""
    _warm()
    ALL[name].make(folder)
    begun = time.monotonic()
    calls = _process(ALL[name], name, folder, 0, writes=writes).calls
    return calls, time.monotonic() - begun


def moments(count: int, seconds: float, seed: int) -> list[float]:
    """Random moments while a command runs."""
    chance = random.Random(seed)
    return [chance.uniform(0.0, seconds) for _ in range(count)]
