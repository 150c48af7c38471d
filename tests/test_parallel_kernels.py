"""Kernels whose rows are shared among threads: same results for every number of threads, in any thread."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from cagefield.compute import devices, parallel_kernels
from cagefield.compute.parallel_kernels import parallel_njit, run_blocks


@parallel_njit(lambda values, out: len(out), fastmath=False)
def running_squares(begin: int, end: int, values: Any, out: Any) -> None:
    """Write the sum of the squares of the values up to each row."""
    for row in range(begin, end):
        out[row] = 0.0
        for other in range(row + 1):
            out[row] += values[other] * values[other]


@pytest.mark.parametrize("threads", [1, 2, 3, 7])
@pytest.mark.parametrize("rows", [0, 1, 2, 5, 1000])
def test_rows_are_the_same_for_every_number_of_threads(
    threads: int, rows: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(devices, "threads", lambda: threads)
    parallel_kernels._pool.cache_clear()
    values = np.random.default_rng(rows).standard_normal(rows)
    out = np.full(rows, np.nan)
    running_squares(values, out)
    expected = np.full(rows, np.nan)
    running_squares.block(0, rows, values, expected)
    np.testing.assert_array_equal(out, expected)
    np.testing.assert_allclose(out, np.cumsum(values**2))
    parallel_kernels._pool.cache_clear()


def test_each_row_is_done_once_by_several_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(devices, "threads", lambda: 3)
    parallel_kernels._pool.cache_clear()
    done: list[int] = []
    names: set[str] = set()
    together = threading.Barrier(3)

    def block(begin: int, end: int) -> None:
        if threading.current_thread().name not in names:
            names.add(threading.current_thread().name)
            together.wait(20.0)
        done.extend(range(begin, end))

    run_blocks(block, 100, ())
    assert sorted(done) == list(range(100))
    assert len(names) == 3
    parallel_kernels._pool.cache_clear()


def test_an_error_of_any_block_is_raised_after_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(devices, "threads", lambda: 2)
    parallel_kernels._pool.cache_clear()
    both = threading.Barrier(2)
    ended: list[int] = []

    def block(begin: int, end: int) -> None:
        both.wait(20.0)
        if threading.current_thread() is not threading.main_thread():
            raise ValueError("of another thread")
        ended.append(begin)

    with pytest.raises(ValueError, match="of another thread"):
        run_blocks(block, 2, ())
    assert len(ended) == 1
    parallel_kernels._pool.cache_clear()


def test_kernels_run_in_several_threads_at_once() -> None:
    values = np.random.default_rng(1).standard_normal(2000)
    outs = [np.empty(2000) for _ in range(8)]
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda out: running_squares(values, out), outs))
    for out in outs:
        np.testing.assert_array_equal(out, outs[0])
