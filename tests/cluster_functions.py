"""Functions that workers of a cluster import."""

from __future__ import annotations

import os
import signal
from pathlib import Path

from cagefield.errors import CagefieldError


def cubed(number: int) -> int:
    return number**3


def killed_twice(folder: Path) -> bytes:
    """Ends its worker by SIGKILL in the first and the second try; the third reads what they left."""
    tries = len(list(folder.iterdir()))
    if tries < 2:
        (folder / str(tries)).write_bytes(bytes([tries]))
        os.kill(os.getpid(), signal.SIGKILL)
    return b"".join(path.read_bytes() for path in sorted(folder.iterdir()))


def refusing() -> None:
    raise CagefieldError("no photo is left; take some")
