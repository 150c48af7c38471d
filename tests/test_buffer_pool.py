"""Arrays one after the other, written into again."""

from __future__ import annotations

import numpy as np
import pytest

from cagefield.edits.buffer_pool import BufferPool


def part(value: float, rows: int = 4) -> np.ndarray:
    return np.full((rows, 3), value, dtype=np.float32)


def address(array: np.ndarray) -> int:
    return int(array.__array_interface__["data"][0])


def test_what_somebody_holds_is_not_written_into() -> None:
    pool, parts = BufferPool(), [part(n) for n in range(5)]
    first = pool.join(parts)
    before = first.copy()
    other = pool.join([*parts[:2], part(9.0), *parts[3:]])
    assert np.array_equal(first, before) and np.array_equal(first, np.concatenate(parts))
    before[8:12] = 9.0
    assert np.array_equal(other, before)
    with pytest.raises(ValueError, match="read-only"):
        first[0] = 1.0


def test_only_what_changed_is_copied_once_nobody_holds_it() -> None:
    pool, parts = BufferPool(), [part(n) for n in range(5)]
    here = address(pool.join(parts))
    parts[0][:] = -1.0  # nobody may do this: it shows that it is not read again
    changed = [*parts[:2], part(9.0), *parts[3:]]
    again = pool.join(changed)
    assert address(again) == here
    assert (again[:4] == 0.0).all() and (again[8:12] == 9.0).all()


def test_other_lengths_get_an_array_of_their_own_and_few_are_kept() -> None:
    pool = BufferPool(most=2)
    for rows in (1, 2, 3, 4):
        assert len(pool.join([part(1.0, rows), part(2.0)])) == rows + 4
    assert len(pool.made) == 2
    assert len(pool.join([])) == 0
