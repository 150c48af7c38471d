"""Array functions on parts of their rows, by all threads: loops of NumPy hold no lock of the interpreter."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextvars import ContextVar, copy_context
from typing import TypeVar

from cagefield.compute import devices
from cagefield.compute.cancellation import check_cancelled

Result = TypeVar("Result")
Other = TypeVar("Other")

_is_part: ContextVar[bool] = ContextVar("is_part", default=False)
"""Whether the caller is a part itself: all threads have work already."""


def map_parts(function: Callable[[slice], Result], rows: int, part: int) -> list[Result]:
    """Results of `function(rows)` for parts of at most `part` rows each, in their order; one for no rows.

    Each call is in the caller's scope of cancellation. The first error ends the rest, and is raised.
    """
    parts = [slice(begin, min(begin + part, rows)) for begin in range(0, max(rows, 1), part)]
    threads = min(devices.threads(), len(parts))
    if threads < 2 or _is_part.get():
        return [function(each) for each in parts]

    errors: list[BaseException] = []

    def run(part: slice) -> Result:
        _is_part.set(True)
        if errors:
            raise errors[0]
        try:
            return function(part)
        except BaseException as error:
            errors.append(error)
            raise

    pool = ThreadPoolExecutor(threads)
    try:
        waiting = [pool.submit(copy_context().run, run, each) for each in parts]
        results = []
        for each in waiting:
            results.append(each.result())
            check_cancelled()
        return results
    finally:
        pool.shutdown(cancel_futures=True)


def run_both(first: Callable[[], Result], second: Callable[[], Other]) -> tuple[Result, Other]:
    """Results of two functions, the second one in a thread of its own where there is more than one thread.

    Both are in the caller's scope of cancellation. Raises the error of the first one, else of the second.
    """
    if devices.threads() < 2 or _is_part.get():
        return first(), second()
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(copy_context().run, second)
        return first(), waiting.result()
