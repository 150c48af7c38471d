"""Undo history: the sequence of states and the index of the present one.

A new entry replaces the undone entries. Beyond `MAX_ENTRIES` entries the oldest after the initial state is
dropped; the initial state always stays.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

T = TypeVar("T")

MAX_ENTRIES = 500
"""Entries at most: all names go to every page with every change, for as many hours as it is edited."""


@dataclass(frozen=True)
class History(Generic[T]):
    """Named states, oldest first, and the number of the present one; entry 0 is the beginning."""

    names: tuple[str, ...]
    states: tuple[T, ...]
    entry: int = 0

    @classmethod
    def begin(cls, state: T, name: str = "Open") -> History[T]:
        """A history of one state."""
        return cls((name,), (state,))

    @property
    def state(self) -> T:
        """The present state."""
        return self.states[self.entry]

    def push(self, name: str, state: T) -> History[T]:
        """History with one more entry after the present one and without the undone ones."""
        keep = self.entry + 1
        first = 1 + max(0, keep + 1 - MAX_ENTRIES)
        names = (self.names[0], *self.names[first:keep], name)
        return History(names, (self.states[0], *self.states[first:keep], state), len(names) - 1)

    def undo(self) -> History[T]:
        """One entry back; the same at the beginning."""
        return self.go_to(self.entry - 1)

    def redo(self) -> History[T]:
        """One entry on; the same at the end."""
        return self.go_to(self.entry + 1)

    def go_to(self, entry: int) -> History[T]:
        """The entry of that number, or the nearest there is."""
        return History(self.names, self.states, min(max(entry, 0), len(self.states) - 1))
