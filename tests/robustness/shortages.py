"""Shortages of disks: bytes, names, a quota of either, or room that is missed only at the end."""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
from pathlib import Path

import write_limits

PAGE = 4096
"""Bytes that a small file takes on a file system in memory."""
SIZE, NAMES = 1 << 30, 1 << 20
"""Bytes and names of a disk that has enough."""


def mount(folder: Path, size: int = SIZE, names: int = NAMES, *, again: bool = False) -> None:
    """Mounts a file system in memory, or gives a mounted one other limits. Raises PermissionError."""
    options = f"{'remount,' * again}size={max(PAGE, size)},nr_inodes={max(1, names)}"
    command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise PermissionError(f"no small file system: {done.stderr.strip()}")


def used(folder: Path) -> int:
    """Bytes that a disk holds."""
    return shutil.disk_usage(folder).used


def names_of(folder: Path) -> int:
    """Files, folders and further links that a disk holds, itself not counted."""
    found = os.statvfs(folder)
    return found.f_files - found.f_ffree - 1


class Shortage:
    """Bytes that a disk lacks: the file system has no more."""

    words = "bytes free"

    needs_library = False
    """Whether only processes that `write_limits` has loaded can be short of it."""

    def begin(self, folder: Path) -> None:
        """There is enough on a disk, and `taken` can tell."""

    def taken(self, folder: Path) -> int:
        """Bytes that the disk holds now, or that were written to it since `begin`."""
        return used(folder)

    def limit(self, folder: Path, left: int) -> None:
        """Leaves so much from now on."""
        mount(folder, used(folder) + left, again=True)

    def lift(self, folder: Path) -> None:
        """Leaves enough again."""
        mount(folder, again=True)

    def refused(self) -> int:
        """Calls that were refused, where that is known."""
        return 0

    def levels(self, need: int, count: int) -> list[int]:
        """So many amounts that are left, from none to less than what is needed."""
        most = max(0, need - PAGE) // PAGE
        spread = {round(most * number / max(1, count - 1)) * PAGE for number in range(count)}
        return sorted(spread | {0, PAGE})


def _spread(need: int, count: int) -> list[int]:
    most = max(0, need - 1)
    return sorted({round(most * number / max(1, count - 1)) for number in range(count)})


class Names(Shortage):
    """Names that a disk lacks: the file system has no more inodes."""

    words = "names free"

    def taken(self, folder: Path) -> int:
        return names_of(folder)

    def limit(self, folder: Path, left: int) -> None:
        mount(folder, names=names_of(folder) + 1 + left, again=True)

    def levels(self, need: int, count: int) -> list[int]:
        return _spread(need, count)


class Quota(Shortage):
    """Bytes of a quota, counted and refused by `write_limits`."""

    words = "bytes of the quota left"
    needs_library = True
    error, late = errno.EDQUOT, False

    def begin(self, folder: Path) -> None:
        write_limits.arm(folder, error=self.error, late=self.late)

    def taken(self, folder: Path) -> int:
        return write_limits.MANY - write_limits.left()[0]

    def limit(self, folder: Path, left: int) -> None:
        write_limits.arm(folder, size=left, error=self.error, late=self.late)

    def lift(self, folder: Path) -> None:
        write_limits.disarm()

    def refused(self) -> int:
        return write_limits.refused()

    def levels(self, need: int, count: int) -> list[int]:
        return _spread(need, count)


class NamesOfQuota(Quota):
    """Names of a quota."""

    words = "names of the quota left"

    def taken(self, folder: Path) -> int:
        return write_limits.MANY - write_limits.left()[1]

    def limit(self, folder: Path, left: int) -> None:
        write_limits.arm(folder, names=left, error=self.error)


class Late(Quota):
    """Bytes that a disk lacks and misses only when files are closed, or are to be safe: half of them is gone.

    As file systems of networks do.
    """

    words = "bytes until files cannot be closed"
    error, late = errno.ENOSPC, True


SHORTAGES: dict[str, Shortage] = {
    "bytes": Shortage(),
    "names": Names(),
    "quota": Quota(),
    "names of a quota": NamesOfQuota(),
    "closing": Late(),
}
"""Shortages by their words in the tables."""
