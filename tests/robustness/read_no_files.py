"""Puts what is no file, or one of any length, in the place of each file that is read, and reads it.

python read_no_files.py FOLDER [READER ...]: prints one line of JSON for each of them.
"""

from __future__ import annotations

import contextlib
import gc
import os
import resource
import signal
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

LENGTH = 20 << 30
"""Bytes of a file that is one hole."""

PATIENCE = 20
"""Seconds after which what waits is interrupted."""

MOST = 1 << 30
"""Bytes that reading may take, parts of files that are mapped apart."""


def _hole(file: Path) -> None:
    with file.open("wb") as stream:
        stream.truncate(LENGTH)


def _rest_is_a_hole(file: Path) -> None:
    with file.open("r+b") as stream:
        stream.truncate(LENGTH)


KINDS: dict[str, Callable[[Path], None]] = {
    "device": lambda file: file.symlink_to("/dev/zero"),
    "pipe": lambda file: os.mkfifo(file),
    "hole": _hole,
    "begun, then a hole": _rest_is_a_hole,
}
"""Makers of each of them where no file is; the last has an honest file's beginning."""


def main(folder: Path, names: list[str]) -> None:
    """See the module."""
    here = Path(__file__).resolve().parent
    sys.path[:0] = [str(here), str(here.parent)]
    warnings.simplefilter("ignore")
    signal.signal(signal.SIGALRM, _interrupt)
    from attacked_reader import _attempt, _measured, _now, say
    from readers import READERS

    for number, name in enumerate(names or (name for name in READERS if name != "messages")):
        place, reader = folder / str(number), READERS[name]
        place.mkdir()
        reader.make(place)
        reader.read(place)
        gc.collect()
        gc.freeze()  # modules, through which every later collection would go
        limit = _now("VmData") + MOST
        resource.setrlimit(resource.RLIMIT_DATA, (limit, resource.RLIM_INFINITY))
        for part in reader.damaged:
            file = place / part
            honest = file.read_bytes()
            for kind, make in KINDS.items():
                if kind != "begun, then a hole":
                    file.unlink()
                make(file)
                result: list[str] = []
                begun = time.monotonic()
                signal.alarm(PATIENCE)
                taken = _measured(lambda: result.extend(_attempt(reader, place)))  # noqa: B023
                signal.alarm(0)
                seconds = time.monotonic() - begun
                said: dict[str, Any] = {"reader": name, "file": part, "kind": kind, "what": result[0]}
                say({**said, "text": result[1][:300], "memory": taken, "seconds": seconds})
                with contextlib.suppress(FileNotFoundError):  # a damaged autosave is put aside
                    file.unlink()
                file.write_bytes(honest)
        resource.setrlimit(resource.RLIMIT_DATA, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))


def _interrupt(*_: object) -> None:
    raise InterruptedWaitError


class InterruptedWaitError(BaseException):
    """A read that did not end."""


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
