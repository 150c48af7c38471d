"""Entry point of the child processes of `colmap_process`: `python -m cagefield.datasets.sfm.colmap_tasks`."""

from __future__ import annotations

import json
import os
import signal
import threading
from collections.abc import Callable
from typing import Any

from cagefield.datasets.sfm import features, matching
from cagefield.errors import CagefieldError, line_of

_TASKS: dict[str, Callable[..., None]] = {
    "extract": features.extract_in_process,
    "match": matching.match_in_process,
}


def main() -> int:
    """Run the task on standard input, and return the exit code."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the one that started this process ends it
    task: dict[str, Any] = json.loads(_read_first_line())
    threading.Thread(target=_end_with_parent, daemon=True, name="lifeline").start()
    try:
        _TASKS[task.pop("task")](**task, on_done=lambda count: print(f"done {count}", flush=True))
    except (CagefieldError, OSError) as error:
        reason = line_of(error) if isinstance(error, OSError) else str(error)
        print("failed " + " ".join(reason.split()), flush=True)
        return 1
    return 0


def _read_first_line() -> bytes:
    """Bytes of standard input to the first line end, and nothing after it."""
    line = b""
    while not line.endswith(b"\n"):
        part = os.read(0, 1 << 16)
        if not part:
            os._exit(1)
        line += part
    return line


def _end_with_parent() -> None:
    """End this process when its parent ends in any way: the parent holds standard input open."""
    os.read(0, 1)
    os._exit(1)


if __name__ == "__main__":
    raise SystemExit(main())
