"""Hidden files and folders of programs that were ended: known by their names, removed by the next one.

A name is .TARGET.ROLE-HOST-PROCESS-RANDOM: what it is for, and who makes it. Those whose process is gone
belong to nobody.
"""

from __future__ import annotations

import contextlib
import glob
import hashlib
import os
import re
import shutil
import socket
import uuid
from pathlib import Path

_MARK = re.compile(r"\.(part|new|old)-([0-9a-f]{6})-(\d+)-\w+(\.\w+)*$")
_LONGEST = 100
"""Characters of a target's name in a hidden one: names have 255 bytes at most."""


def hidden_name(target: Path, role: str) -> str:
    """A new name for what becomes `target`, or was it: role "part" (a file), "new" or "old" (folders)."""
    suffix = target.suffix if role == "part" and len(target.suffix) < 16 else ""
    return f".{target.name[:_LONGEST]}.{role}-{_host()}-{os.getpid()}-{uuid.uuid4().hex[:8]}{suffix}"


def is_abandoned(path: Path) -> bool:
    """Whether a hidden name is of a program on this machine that has ended."""
    found = _MARK.search(path.name)
    return found is not None and found[2] == _host() and not _lives(int(found[3]))


def is_ours(path: Path) -> bool:
    """Whether a program that goes on made this hidden name, or one on another machine."""
    return _MARK.search(path.name) is not None and not is_abandoned(path)


def remove_leftovers(target: Path, *, inside: bool = False) -> None:
    """Removes what ended programs left beside `target` for it and for what is named after it.

    With `inside` also what they left in the folder itself. A folder that one had put aside stays while there
    is nothing at `target`.
    """
    name = glob.escape(target.name[:_LONGEST])
    found = [path for dots in (".", "..") for path in target.parent.glob(f"{dots}{name}*")]
    if inside and target.is_dir():
        found += target.glob(".*")
    for path in found:
        role = _MARK.search(path.name)
        if role is None or not is_abandoned(path) or (role[1] == "old" and not target.exists()):
            continue
        _remove(path)


def remove_unfinished(folder: Path) -> None:
    """Removes what ended programs were writing in a folder, whatever it was to become."""
    for path in folder.glob(".*"):
        role = _MARK.search(path.name)
        if role is not None and role[1] != "old" and is_abandoned(path):
            _remove(path)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with contextlib.suppress(OSError):
            path.unlink()


def _host() -> str:
    return hashlib.blake2b(socket.gethostname().encode(), digest_size=3).hexdigest()


def _lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True  # of another user
    return True
