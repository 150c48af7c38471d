"""Array functions on parts of their rows: order, cancellation, errors."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from cagefield.compute import devices
from cagefield.compute.cancellation import cancellable, check_cancelled
from cagefield.compute.parallel_parts import map_parts, run_both


class CancelledError(Exception):
    """Raised by a check."""


@pytest.fixture(params=[1, 3])
def threads(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr(devices, "threads", lambda: request.param)
    return int(request.param)


@pytest.mark.parametrize(("rows", "part"), [(0, 4), (1, 4), (10, 4), (12, 4), (10_000, 7)])
def test_parts_cover_all_rows_in_order(threads: int, rows: int, part: int) -> None:
    parts = map_parts(lambda part: np.arange(rows)[part], rows, part)
    assert all(0 < len(each) <= part for each in parts) or rows == 0
    np.testing.assert_array_equal(np.concatenate(parts), np.arange(rows))


def test_parts_are_in_the_callers_scope_of_cancellation(threads: int) -> None:
    seen: set[int] = set()

    def proceed() -> None:
        seen.add(threading.get_ident())
        if len(done) > 3:
            raise CancelledError

    done: list[int] = []

    def work(part: slice) -> None:
        check_cancelled()
        done.append(part.start)

    with cancellable(proceed), pytest.raises(CancelledError):
        map_parts(work, 1000, 1)
    assert 3 < len(done) < 1000 and seen


def test_the_first_error_ends_the_rest(threads: int) -> None:
    done: list[int] = []

    def work(part: slice) -> None:
        if part.start == 5:
            raise ValueError("part 5")
        done.append(part.start)

    with pytest.raises(ValueError, match="part 5"):
        map_parts(work, 100_000, 1)
    assert len(done) < 100_000 - 1


def test_parts_of_parts_start_no_threads(threads: int) -> None:
    def work(part: slice) -> list[tuple[int, int]]:
        own = threading.get_ident()
        return map_parts(lambda inner: (own, threading.get_ident()), 8, 1)

    found = [pair for each in map_parts(work, 6, 1) for pair in each]
    assert len(found) == 48 and all(outer == inner for outer, inner in found)
    assert map_parts(lambda part: part.stop, 4, 2) == [2, 4]


def test_two_functions_run_in_the_callers_scope_of_cancellation(threads: int) -> None:
    own: list[int] = []

    def work(value: int) -> int:
        own.append(threading.get_ident())
        check_cancelled()
        return value

    assert run_both(lambda: work(1), lambda: work(2)) == (1, 2)
    assert len(set(own)) == min(threads, 2)

    def cancel() -> None:
        if threading.get_ident() != own[0] or threads < 2:
            raise CancelledError

    with cancellable(cancel), pytest.raises(CancelledError):
        run_both(lambda: work(1), lambda: work(2))


def test_the_error_of_the_first_of_two_functions_is_raised(threads: int) -> None:
    def fail(text: str) -> None:
        raise ValueError(text)

    with pytest.raises(ValueError, match="one"):
        run_both(lambda: fail("one"), lambda: fail("two"))
    with pytest.raises(ValueError, match="two"):
        run_both(lambda: None, lambda: fail("two"))
    assert map_parts(lambda part: run_both(threading.get_ident, threading.get_ident), 1, 1)
