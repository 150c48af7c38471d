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

from cagefield.cli import main

PAGE = 4096
"""Bytes that a small file takes on such a disk."""


@dataclass
class Filled:
    """What came of some runs on full disks."""

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
def disk(folder: Path, size: int = 1 << 30) -> Iterator[Path]:
    """A file system of so many bytes. Raises PermissionError where it may not be mounted."""
    folder.mkdir()
    done = subprocess.run(_mount(folder, size), capture_output=True, text=True)
    if done.returncode != 0:
        raise PermissionError(f"no small file system: {done.stderr.strip()}")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True, capture_output=True)
        folder.rmdir()


def resize(folder: Path, size: int) -> None:
    """Leaves a mounted disk so many bytes, at least what it holds."""
    subprocess.run(_mount(folder, size, "remount,"), check=True, capture_output=True)


def _mount(folder: Path, size: int, how: str = "") -> list[str]:
    return ["mount", "-t", "tmpfs", "-o", f"{how}size={max(PAGE, size)}", "tmpfs", str(folder)]


def used(folder: Path) -> int:
    """Bytes that a disk holds."""
    return shutil.disk_usage(folder).used


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


def room_for(command: DiskCommand, source: Path) -> int:
    """Bytes that a command's result takes."""
    with tempfile.TemporaryDirectory() as folder, disk(Path(folder) / "disk") as place:
        code, lines = ran(_prepared(command, source, place, again=False))
        if code != 0:
            raise RuntimeError(f"{command.words}: {lines[-1:]}")
        return used(place)


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
    return command.arguments(source, place, again)


def fill(name: str, command: DiskCommand, source: Path, left: int, again: bool, found: Filled) -> bool:
    """One run of a command that finds `left` bytes free; counts what is wrong. False where there was room."""
    with tempfile.TemporaryDirectory() as folder, disk(Path(folder) / "disk") as place:
        arguments = _prepared(command, source, place, again)
        resize(place, used(place) + left)
        before = contents(place)
        code, lines = ran(arguments)
        after = contents(place)
        found.runs += 1
        if code == 0:
            found.fitted += 1
            return False
        where = f"{name}{', over an old one' if again else ''}, {left} bytes free"
        if code != 2:
            found.code += 1
            found.faults.append(f"{where}: exit code {code}, {lines[-1:]}")
        problem = _line_problem(lines, place / command.out)
        if problem and code == 2:
            found.line += 1
            found.faults.append(f"{where}: {problem}")
        fresh = (key for key in after if key not in before)
        added = [key for key in fresh if not _is_told(key, command, place, lines)]
        found.compare(where, before, after, added)
        return True


def _line_problem(lines: list[str], out: Path) -> str | None:
    """What is wrong with what was said: one line at the end, that names the place."""
    said = [line for line in lines if line.startswith("cagefield: ") and "cagefield: warning" not in line]
    if len(said) != 1 or lines[-1] != said[0] or any("Traceback" in line for line in lines):
        return f"said {lines[-3:]}"
    if str(out.with_suffix("")) not in said[0]:  # or what goes beside it
        return f"names no place: {said[0]}"
    return None if "/." not in said[0].replace(str(out), "") else f"names a hidden file: {said[0]}"


def _is_told(name: str, command: DiskCommand, place: Path, lines: list[str]) -> bool:
    """Whether something new may be there: what the line names, all in it, and pictures that fitted."""
    told = [place / name, *(place / name).parents]
    told = told[: told.index(place)]
    if any(str(each) in line for each in told for line in lines if each != place / command.out):
        return True
    return command.keeps and name.split("/")[0] == command.out and "/." not in f"/{name}"


def levels(need: int, count: int) -> list[int]:
    """So many amounts of free room, from none to a page less than what is needed."""
    most = max(0, need - PAGE) // PAGE
    return sorted({round(most * number / max(1, count - 1)) * PAGE for number in range(count)} | {0, PAGE})
