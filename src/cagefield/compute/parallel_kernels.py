"""Numba kernels whose rows are shared among threads.

Numba's own parallel loops (`parallel=True`) take two to three times as long to compile, which every first
picture after an installation has to wait for, and may not run in several Python threads at once. So a kernel
here takes the rows [begin, end), without the interpreter's lock, and is called on blocks of rows by the
caller's thread and by a pool of threads. Every row's result must be independent of the others: results are
the same for every number of threads.
"""

from __future__ import annotations

import functools
import itertools
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from cagefield.compute import devices
from cagefield.compute.numba_cache import njit


def parallel_njit(rows: Callable[..., int], **options: Any) -> Callable[[Callable[..., None]], Any]:
    """Decorate a kernel `f(begin, end, *args)` that handles rows [begin, end) and returns nothing.

    It is called as `f(*args)`; `rows(*args)` is the number of all rows. `options` are those of
    `numba_cache.njit`. The compiled function of [begin, end) is the attribute `block`.
    """

    def decorate(function: Callable[..., None]) -> Any:
        block = njit(nogil=True, **options)(function)

        @functools.wraps(function)
        def kernel(*args: Any) -> None:
            run_blocks(block, rows(*args), args)

        kernel.block = block  # type: ignore[attr-defined]
        return kernel

    return decorate


def run_blocks(block: Callable[..., None], rows: int, args: tuple[Any, ...]) -> None:
    """Call `block(begin, end, *args)` until all rows are done, in the caller's thread and in others."""
    threads = min(devices.threads(), rows)
    if threads < 2:
        block(0, rows, *args)
        return
    count = min(rows, devices.parts())
    numbers = itertools.count()

    def work() -> None:
        while (number := next(numbers)) < count:
            block(rows * number // count, rows * (number + 1) // count, *args)

    others = [_pool(os.getpid()).submit(work) for _ in range(threads - 1)]
    try:
        work()
    finally:
        # Arguments live until the last block is done; threads that are busy elsewhere are not waited for.
        started = [other for other in others if not other.cancel()]
        failures = [other.exception() for other in started]
    for failure in failures:
        if failure is not None:
            raise failure


@functools.cache
def _pool(process: int) -> ThreadPoolExecutor:
    """Threads of this process: those of its parent are not there after a fork."""
    return ThreadPoolExecutor(max(1, devices.threads() - 1), thread_name_prefix=f"kernel-{process}")
