"""Stale files: hidden files and folders of killed programs, known by name, removed by the next program.

A name is .TARGET.ROLE-HOST-PROCESS-RANDOM, with the destination and the writer. Names whose process has
ended are stale. TARGET is the whole name, or a long one's beginning and a hash of it: another scene's name
may begin with this one's.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import shutil
import socket
import time
import uuid
from pathlib import Path

_MARK = re.compile(r"\.(.+)\.(part|new|old)-([0-9a-f]{6})-(\d+)-\w+(\.\w+)*")
_LONGEST = 100
"""Bytes of a target's name in a hidden one: names have 255 at most."""

ABANDONED_AFTER_SECONDS = 300.0
"""Age after which a displaced folder counts as stale: its writer needs no time between two renames."""


def hidden_name(target: Path, role: str) -> str:
    """Hidden name of a future or former `target`: role "part" (a file), "new" or "old" (folders)."""
    suffix = target.suffix if role == "part" and len(target.suffix) < 16 else ""
    return f".{_cut(target.name)}.{role}-{host()}-{os.getpid()}-{uuid.uuid4().hex[:8]}{suffix}"


def is_hidden(path: Path) -> bool:
    """Whether this is such a name."""
    return _MARK.fullmatch(path.name) is not None


def is_abandoned(path: Path) -> bool:
    """Whether a hidden name is of a program on this machine that has ended."""
    found = _MARK.fullmatch(path.name)
    return found is not None and found[3] == host() and not is_alive(int(found[4]))


def displaced_folders(target: Path) -> list[Path]:
    """The folders of exactly its name that programs have put aside beside `target`, where nothing is now.

    A maker that has another host's name (a container's), or a number that is a process's again, cannot be
    told from one that goes on: its folders count once nothing has touched them for ABANDONED_AFTER_SECONDS
    seconds.
    """
    found = []
    for path in target.parent.glob(".*"):
        made = _MARK.fullmatch(path.name)
        if made is None:  # the names of older versions
            is_left = re.fullmatch(rf"\.{re.escape(target.name)}\.old-\w+", path.name) is not None
        else:
            is_left = (made[1], made[2]) == (_cut(target.name), "old") and _is_settled(path)
        if is_left and path.is_dir():
            found.append(path)
    return found


def remove_leftovers(target: Path, *, inside: bool = False) -> None:
    """Remove stale files beside `target`: those of itself, its autosave, training and work folder.

    With `inside` also the unfinished files in the folder itself. A displaced folder stays while `target`
    does not exist.
    """
    name = target.name
    beside = {
        _cut(each) for each in (name, f".{name}.cagefield-autosave.json", f"{name}.work", f"{name}.training")
    }
    for path in target.parent.glob(".*"):
        made = _MARK.fullmatch(path.name)
        if made is None or made[1] not in beside or not is_abandoned(path):
            continue
        if made[2] != "old" or (made[1] == _cut(name) and target.exists()):
            _remove(path)
    if inside and target.is_dir():
        remove_unfinished(target)


def remove_unfinished(folder: Path) -> None:
    """Remove unfinished files of ended programs in a folder, for any destination."""
    for path in folder.glob(".*"):
        made = _MARK.fullmatch(path.name)
        if made is not None and made[2] != "old" and is_abandoned(path):
            _remove(path)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with contextlib.suppress(OSError):
            path.unlink()


def _is_settled(path: Path) -> bool:
    """Whether nobody is about to put something at the place that a folder had."""
    if is_abandoned(path):
        return True
    try:
        return time.time() - path.stat().st_ctime > ABANDONED_AFTER_SECONDS
    except OSError:
        return False


def _cut(name: str) -> str:
    """A target's name in hidden ones: a long one is cut, and told from others by a hash of it."""
    whole = os.fsencode(name)
    if len(whole) <= _LONGEST:
        return name
    digest = hashlib.blake2b(whole, digest_size=8).hexdigest()
    return f"{whole[: _LONGEST - len(digest) - 1].decode(errors='ignore')}~{digest}"


def host() -> str:
    """A short name of this machine in names of files."""
    return hashlib.blake2b(socket.gethostname().encode(), digest_size=3).hexdigest()


def is_alive(process: int) -> bool:
    """Whether a process of that number goes on, whosever it is."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True  # of another user
    return True
