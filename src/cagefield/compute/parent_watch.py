"""A process that ends with the one that started it, even where that is killed and a kernel runs."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import sys
import threading
from multiprocessing.connection import wait

_PR_SET_PDEATHSIG = 1
"""Of Linux's <sys/prctl.h>."""


def end_with_parent() -> None:
    """Ends this process, at once, when its parent ends.

    On Linux by a signal of the system's, which no kernel can hold back; elsewhere by a thread that waits for
    the parent, which has its turn when no kernel holds the interpreter.
    """
    parent = multiprocessing.parent_process()
    if parent is None:
        return
    if sys.platform.startswith("linux"):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        if os.getppid() != parent.pid:  # it has ended already
            os._exit(1)
    threading.Thread(target=_watch, args=(parent.sentinel,), daemon=True, name="lifeline").start()


def _watch(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)
