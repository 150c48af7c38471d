"""Runs commands on disks that are too small for what they write, and says what came of it."""

from __future__ import annotations

import contextlib
import io
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from disk_commands import DiskCommand
from shortages import SHORTAGES, SIZE, Shortage, mount

from cagefield.cli import main

BYTES = SHORTAGES["bytes"]


@dataclass
class Filled:
    """Counts of runs on full disks."""

    runs: int = 0
    fitted: int = 0
    """Runs that ended well: there was room enough."""
    code: int = 0
    """Runs that ended otherwise than with exit code 2."""
    line: int = 0
    """Runs whose last words were not one line that names the place."""
    changed: int = 0
    """Runs after which what had been there was not as before."""
    left: int = 0
    """Runs that left something of their own, of which they did not tell."""
    faults: list[str] = field(default_factory=list)

    def compare(
        self, where: str, before: dict[str, bytes], after: dict[str, bytes], added: list[str]
    ) -> None:
        """Counts a run that changed what had been there, or that left the files `added`."""
        changed = sorted(key for key, value in before.items() if after.get(key, b"gone") != value)
        if changed:
            self.changed += 1
            self.faults.append(f"{where}: changed {changed}")
        if added:
            self.left += 1
            self.faults.append(f"{where}: left {added}")


@contextlib.contextmanager
def disk(folder: Path, size: int = SIZE) -> Iterator[Path]:
    """A file system of so many bytes. Raises PermissionError where it may not be mounted."""
    folder.mkdir()
    mount(folder, size)
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True, capture_output=True)
        folder.rmdir()


def contents(folder: Path) -> dict[str, bytes | None]:
    """Every name under a folder -> what the file holds, None for a folder."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
        for path in sorted(folder.rglob("*"))
    }


def ran(arguments: list[str]) -> tuple[int, list[str]]:
    """(exit code, lines of stderr) of a command; code -1 and the error where it ends in a traceback."""
    errors = io.StringIO()
    with contextlib.redirect_stderr(errors), contextlib.redirect_stdout(io.StringIO()):
        try:
            code = main(arguments)
        except BaseException as error:
            return -1, [f"{type(error).__name__}: {error}"]
    return code, errors.getvalue().splitlines()


def room_for(command: DiskCommand, source: Path, short: Shortage = BYTES) -> int:
    """Bytes and names that a command's result takes."""
    with tempfile.TemporaryDirectory() as folder, disk(Path(folder) / "disk") as place:
        arguments = _prepared(command, source, place, again=False)
        short.begin(place)
        code, lines = ran(arguments)
        if code != 0:
            raise RuntimeError(f"{command.words}: {lines[-1:]}")
        return short.taken(place)


def _prepared(command: DiskCommand, source: Path, place: Path, again: bool) -> list[str]:
    """Puts on the disk what is there before; the command line."""
    if command.on_disk:
        shutil.copytree(source / command.on_disk, place / command.out)
        (place / command.out / "notes.txt").write_text("mine")
        return command.arguments(source, place, True)
    if again:
        code, lines = ran(command.arguments(source, place, False))
        if code != 0:
            raise RuntimeError(f"{command.words}: {lines[-1:]}")
        if command.work:  # what it would find there is not made again
            shutil.rmtree(place / command.work)
    return command.arguments(source, place, again)


def fill(
    name: str,
    command: DiskCommand,
    source: Path,
    left: int,
    again: bool,
    found: Filled,
    short: Shortage = BYTES,
) -> bool:
    """One run of a command that finds `left` free; counts what is wrong. False where that was enough."""
    with tempfile.TemporaryDirectory() as folder, disk(Path(folder) / "disk") as place:
        arguments = _prepared(command, source, place, again)
        short.limit(place, left)
        before = contents(place)
        code, lines = ran(arguments)
        refused = short.refused()
        short.lift(place)
        after = contents(place)
        found.runs += 1
        where = f"{name}{', over an old one' if again else ''}, {left} {short.words}"
        if code == 0:
            found.fitted += 1
            if refused:
                found.code += 1
                found.faults.append(f"{where}: ended well, {refused} calls were refused, {lines[-3:]}")
            return False
        if code != 2:
            found.code += 1
            found.faults.append(f"{where}: exit code {code}, {lines[-1:]}")
        problem = _line_problem(lines, [place / each for each in (command.out, command.work) if each])
        if problem and code == 2:
            found.line += 1
            found.faults.append(f"{where}: {problem}")
        if (after.get(command.first) or b"").endswith(b"\n"):
            before[command.first] = after[command.first]
        fresh = (key for key in after if key not in before)
        added = [key for key in fresh if not _is_told(key, command, place, lines)]
        found.compare(where, before, after, added)
        if command.work and ran(arguments)[0] != 0:
            found.left += 1
            found.faults.append(f"{where}: the next run fails with what was left in {command.work}")
        return True


def _line_problem(lines: list[str], places: list[Path]) -> str | None:
    """Fault of the output, which must end with one line that names one of the places."""
    said = [line for line in lines if line.startswith("cagefield: ") and "cagefield: warning" not in line]
    if len(said) != 1 or lines[-1] != said[0] or any("Traceback" in line for line in lines):
        return f"said {lines[-3:]}"
    named = [out for out in places if str(out.with_suffix("")) in said[0]]  # or what goes beside it
    if not named:
        return f"names no place: {said[0]}"
    return None if "/." not in said[0].replace(str(named[0]), "") else f"names a hidden file: {said[0]}"


def _is_told(name: str, command: DiskCommand, place: Path, lines: list[str]) -> bool:
    """Whether something new may be there: what the line names, all in it, and pictures that fitted."""
    told = [place / name, *(place / name).parents]
    told = told[: told.index(place)]
    if any(str(each) in line for each in told for line in lines if each != place / command.out):
        return True
    kept = (command.out if command.keeps else None, command.work or None)
    return name.split("/")[0] in kept and "/." not in f"/{name}"
