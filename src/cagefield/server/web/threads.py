"""Work that takes long in a thread, so that others have their answers meanwhile."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")

THREADS = 8
"""Threads that work at a time; more work waits."""


def all_started(count: int = THREADS) -> ThreadPoolExecutor:
    """Threads that have all begun, so that none more is there after hours, nor the memory that each keeps."""
    executor, met = ThreadPoolExecutor(count, thread_name_prefix="work"), threading.Barrier(count)
    for begun in [executor.submit(met.wait) for _ in range(count)]:
        begun.result()
    return executor


async def in_thread(work: Callable[[], T]) -> T:
    """What `work` returns. Who gives it up waits for its end: so long a lock keeps others out."""
    working = asyncio.get_running_loop().run_in_executor(None, work)
    try:
        return await asyncio.shield(working)
    except asyncio.CancelledError:
        await asyncio.wait((working,))
        raise
