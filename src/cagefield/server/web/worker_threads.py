"""Work that takes long in a thread, so that others have their answers meanwhile."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")

THREADS = 8
"""Threads that work at a time; more work waits: on disks, mostly, which are no faster with more of them."""


def start_all_threads(count: int = THREADS) -> ThreadPoolExecutor:
    """Threads that have all begun, so that none more is there after hours, nor the memory that each keeps."""
    executor, met = ThreadPoolExecutor(count, thread_name_prefix="work"), threading.Barrier(count)
    try:
        waiting = [executor.submit(met.wait) for _ in range(count)]
    except RuntimeError:  # the system allows no more
        met.abort()
        executor.shutdown()
        return start_all_threads(count // 2) if count > 1 else ThreadPoolExecutor(1)
    for each in waiting:
        each.result()
    return executor


async def run_in_thread(work: Callable[[], T]) -> T:
    """Result of `work`, run in a worker thread. A cancelled caller still waits for its end, as its lock is
    held so long."""
    working = asyncio.get_running_loop().run_in_executor(None, work)
    try:
        return await asyncio.shield(working)
    except asyncio.CancelledError:
        await asyncio.wait((working,))
        raise
