"""Attacks a reader from outside: its own process, limits on time and memory, and a count."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

HANG = 5.0
"""Seconds of a processor that one input may take."""

WAIT = 60.0
"""Seconds of the clock: for what waits without a processor."""

SLACK = 16 << 20
"""Bytes beside twice the honest file's: seeds are small, allocators take whole pages and arenas."""

LARGE_SLACK = 0
"""Bytes beside twice the honest file's where honest files are large (`large_readers.py`)."""


Work = tuple[str, int, int]
"""A reader, and the first and (not included) the last of its inputs."""


@dataclass
class Outcome:
    """Counts and faults over the inputs of a reader."""

    tried: int = 0
    refused: int = 0
    read: int = 0
    crashed: int = 0
    hung: int = 0
    over_memory: int = 0
    most: int = 0
    """Most bytes that reading one took."""
    honest: int = 0
    slowest: float = 0.0
    """Most seconds of a processor that reading one took."""
    seconds: float = 0.0
    """Of all of them."""
    faults: list[str] = field(default_factory=list)
    """A line for each input that crashed, hung, or took too much memory."""
    slack: int = SLACK
    """Bytes that reading one may take beside twice the honest file's."""

    def add(self, other: Outcome) -> None:
        """Another one's counts on top."""
        for name in ("tried", "refused", "read", "crashed", "hung", "over_memory"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        self.most, self.honest = max(self.most, other.most), max(self.honest, other.honest)
        self.slowest, self.seconds = max(self.slowest, other.slowest), self.seconds + other.seconds
        self.faults += other.faults


def attack(
    names: Iterable[str],
    first: int,
    last: int,
    seed: str = "",
    kept: Path | None = None,
    *,
    large: bool = False,
) -> dict[str, Outcome]:
    """Reads the inputs `first` to `last` of some readers, in one process for as long as it lives.

    Inputs with faults are kept in a folder, if one is given. With `large` the readers are those of
    `large_readers.py`, whose honest files are large, and judged by LARGE_SLACK.
    """
    return _attacked([(name, first, last) for name in names], (seed, large), kept)


def attack_by(name: str, numbers: Iterable[int]) -> Outcome:
    """Reads those inputs of a reader, in one process for as long as it lives."""
    return _attacked([(name, number, number + 1) for number in numbers], ("", False), None)[name]


def _attacked(work: list[Work], how: tuple[str, bool], kept: Path | None) -> dict[str, Outcome]:
    found = {name: Outcome(slack=LARGE_SLACK if how[1] else SLACK) for name, _, _ in work}
    while work:
        with tempfile.TemporaryDirectory(prefix="cagefield-attack-") as folder:
            work = _batch(Path(folder), work, how, found, kept)
    return found


def _batch(
    folder: Path,
    work: list[Work],
    how: tuple[str, bool],
    found: dict[str, Outcome],
    kept: Path | None,
) -> list[Work]:
    """One process: to the end, or to the input that ended it; what is left is returned.

    `how`: the seed of the damages, and whether the readers are the large ones.
    """
    seed, large = how
    # Python's own allocator keeps arenas that others' small objects are in, of which nothing is seen then.
    environment = os.environ | ({"PYTHONMALLOC": "malloc"} if large else {})
    arguments = [str(part) for each in work for part in each]
    module = "large_readers" if large else "readers"
    command = [sys.executable, str(Path(__file__).with_name("attacked_reader.py")), str(folder), seed, module]
    log = folder / "stderr"
    with (
        log.open("wb") as errors,
        subprocess.Popen(
            [*command, *arguments],
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
            env=environment,
        ) as process,
    ):
        lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        threading.Thread(target=_passed_on, args=(process, lines), daemon=True).start()
        name, now, file, begun, spent, done = "", -1, folder, 0.0, 0.0, 0
        try:
            for line in _awaited(lines):
                if line is None:
                    break
                if line == "":
                    used = _used(process.pid) - spent
                    if now >= 0 and (used > HANG or time.monotonic() - begun > WAIT):
                        _end(found[name], name, now, "hung", f"after {used:.0f} s", file, kept)
                        return _after(work, name, now)
                    continue
                said = json.loads(line)
                if "honest" in said:
                    name, place = said["reader"], Path(said["folder"])
                    found[name].honest = max(found[name].honest, said["honest"])
                elif "begin" in said:
                    now, file, done = said["begin"], place / said["place"], said["begin"]
                    begun, spent = time.monotonic(), _used(process.pid)
                else:
                    _count(found[name], name, said, file, kept)
                    now = -1
            if now >= 0:
                tail = log.read_text(errors="replace").strip().splitlines()[-1:]
                _end(found[name], name, now, "died", f"{process.wait()} {tail}", file, kept)
                return _after(work, name, now)
            if process.wait() != 0:
                raise RuntimeError(f"{name} {done}: {log.read_text(errors='replace')[-2000:]}")
            return []
        finally:
            process.kill()


def _after(work: list[Work], name: str, number: int) -> list[Work]:
    """Rest of the work after an input of a reader."""
    at = next(k for k, (each, first, last) in enumerate(work) if each == name and first <= number < last)
    last = work[at][2]
    rest = [(name, number + 1, last)] if number + 1 < last else []
    return [*rest, *work[at + 1 :]]


def _end(
    found: Outcome, reader: str, number: int, what: str, text: str, file: Path, kept: Path | None
) -> None:
    """An input that ended the process, or did not end."""
    found.tried += 1
    if what == "hung":
        found.hung += 1
    else:
        found.crashed += 1
    _fault(found, reader, number, what, text, file, kept)


def _count(found: Outcome, reader: str, said: dict[str, object], file: Path, kept: Path | None) -> None:
    what, memory = str(said["what"]), int(str(said["memory"]))
    found.tried += 1
    found.most = max(found.most, memory)
    seconds = float(str(said["seconds"]))
    found.slowest, found.seconds = max(found.slowest, seconds), found.seconds + seconds
    slow = seconds > HANG
    found.hung += slow
    if what == "refused":
        found.refused += 1
    elif what == "read":
        found.read += 1
    elif what != "memory":
        found.crashed += 1
    too_much = what == "memory" or memory > 2 * found.honest + found.slack
    found.over_memory += too_much
    if slow or too_much or what not in ("refused", "read"):
        what = "hung" if slow else what
        text = f"{seconds:.1f} s; {said['text']}; {memory >> 20} MiB, the honest one {found.honest >> 20}"
        _fault(found, reader, int(str(said["end"])), "memory" if too_much else what, text, file, kept)


def _fault(
    found: Outcome, reader: str, number: int, what: str, text: str, file: Path, kept: Path | None
) -> None:
    found.faults.append(f"{reader} {number}: {what}: {text}")
    if kept is not None:
        kept.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(OSError):
            shutil.copy(file, kept / f"{reader.replace(' ', '_')}-{number}-{file.name}")


def _passed_on(process: subprocess.Popen[str], lines: queue.SimpleQueue[str | None]) -> None:
    assert process.stdout is not None
    with contextlib.suppress(ValueError, OSError):
        for line in process.stdout:
            lines.put(line)
    lines.put(None)


def _awaited(lines: queue.SimpleQueue[str | None]) -> Iterator[str | None]:
    """The lines; "" where none came for a second, None at the end."""
    while True:
        try:
            yield lines.get(timeout=1.0)
        except queue.Empty:
            yield ""


def _used(pid: int) -> float:
    """Seconds of processors that a process has taken."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
