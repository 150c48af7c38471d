"""Return of freed memory to the operating system.

The C library keeps what lies between blocks that are in use. Edits, lattices and pictures come and go in all
sizes: after some minutes that was 175 MiB beside 420 MiB in use, and it grew for hours.
"""

from __future__ import annotations

import asyncio
import ctypes
import sys
import time

RETURN_INTERVAL_SECONDS = 10.0
"""Seconds between two times: each takes milliseconds."""


class UnusedMemory:
    """Gives it back now and then."""

    def __init__(self) -> None:
        self._trim = getattr(ctypes.CDLL(None), "malloc_trim", None) if sys.platform == "linux" else None
        self._last = time.monotonic()

    def give_back(self) -> bool:
        """Return freed memory; False within RETURN_INTERVAL_SECONDS of the last time, or where it cannot be
        done."""
        now = time.monotonic()
        if self._trim is None or now - self._last < RETURN_INTERVAL_SECONDS:
            return False
        self._trim(0)
        self._last = now
        return True


async def return_memory_periodically() -> None:
    """Periodic return of freed memory in an event loop, until cancelled."""
    unused = UnusedMemory()
    while True:
        await asyncio.sleep(RETURN_INTERVAL_SECONDS)
        unused.give_back()
