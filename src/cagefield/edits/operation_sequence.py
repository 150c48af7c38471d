"""Operations done one after the other: the cage that comes of them, and the one that is not possible."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence

from cagefield.edits.operations import Operation
from cagefield.edits.safe_fraction import format_share, is_valid, largest_safe
from cagefield.errors import CageError
from cagefield.geometry.cage import Cage

MAX_OPERATIONS = 2000
"""Operations of one edit: 0.1 ms each whenever its cage is computed anew."""

_befores: deque[tuple[Cage, tuple[Operation, ...], Cage]] = deque(maxlen=8)
"""Cages, operations on them, and the cages that came of these: those before the last operations of edits."""

_lasts: deque[tuple[Cage, Operation, Cage]] = deque(maxlen=4)
"""Cages, an operation on each, and the cages that came of them."""


class ImpossibleOperationError(CageError):
    """An operation that makes no cage; `number` counts from 1."""

    def __init__(self, message: str, number: int) -> None:
        super().__init__(message)
        self.number = number


def applied(operation: Operation, cage: Cage) -> Cage:
    """The cage after an operation; the last few are remembered. Raises `CageError`."""
    for start, done, after in tuple(_lasts):
        if start is cage and done == operation:
            return after
    after = operation.apply(cage)
    _lasts.append((cage, operation, after))
    return after


def cage_before_last(cage: Cage, operations: tuple[Operation, ...]) -> Cage:
    """The cage before the last of some operations, which a drag does not change: remembered.

    Raises as `cages_along`.
    """
    first = operations[:-1]
    if not first:
        return cage
    for start, done, after in tuple(_befores):
        if start is cage and done == first:
            return after
    *_, after = cages_along(cage, first)
    _befores.append((cage, first, after))
    return after


def cage_after(cage: Cage, operations: tuple[Operation, ...]) -> Cage:
    """The cage after all of the operations. Raises as `cages_along`."""
    if not operations:
        return cage
    before = cage_before_last(cage, operations)
    return next(cages_along(before, operations[-1:], len(operations)))


def cages_along(cage: Cage, operations: Sequence[Operation], first: int = 1) -> Iterator[Cage]:
    """The cage after each of the operations, which are numbered from `first`.

    Raises:
        ImpossibleOperationError: an operation makes an impossible cage; says how much of it is safe.
    """
    for number, operation in enumerate(operations, start=first):
        try:
            after = applied(operation, cage)
        except CageError as error:
            safe = largest_safe(lambda t, c=cage, o=operation: is_valid(o, t, c))  # type: ignore[misc]
            raise ImpossibleOperationError(
                f"operation {number}, {operation.noun} {operation}: {error}"
                + (f"; {format_share(safe)} of it is safe" if safe > 0.0 else ""),
                number,
            ) from None
        cage = after
        yield cage


def problem_of_count(count: int) -> str | None:
    """Why there are too many operations, and the cure; None where there are not."""
    if count <= MAX_OPERATIONS:
        return None
    return (
        f"{count} operations are too many, an edit has at most {MAX_OPERATIONS};"
        " join them, or go on in another edit"
    )
