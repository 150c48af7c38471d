"""Cache of results per object identity: equal objects are different keys."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Generic, TypeVar

K = TypeVar("K")
V = TypeVar("V")


class IdentityCache(Generic[K, V]):
    """Values of the last `capacity` objects that were put in. Keeps the objects alive."""

    def __init__(self, capacity: int) -> None:
        self._capacity = capacity
        self._items: dict[int, tuple[K, V]] = {}

    def __contains__(self, key: K) -> bool:
        return id(key) in self._items

    def __getitem__(self, key: K) -> V:
        """Raises KeyError where nothing is known of this object."""
        return self._items[id(key)][1]

    def get(self, key: K) -> V | None:
        """The value, or None where nothing is known of this object."""
        item = self._items.get(id(key))
        return None if item is None else item[1]

    def put(self, key: K, value: V) -> V:
        """Remembers a value; the oldest is forgotten where there are too many."""
        self._items.pop(id(key), None)
        self._items[id(key)] = key, value
        if len(self._items) > self._capacity:
            del self._items[next(iter(self._items))]
        return value

    def keep_only(self, keys: Iterable[K]) -> None:
        """Forgets all other objects."""
        known = {id(key) for key in keys}
        self._items = {number: item for number, item in self._items.items() if number in known}

    def values(self) -> list[V]:
        """Cached values, oldest first."""
        return [value for _, value in self._items.values()]
