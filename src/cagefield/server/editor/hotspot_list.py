"""Hotspots of a document: each has a number, which is never given out twice; undone as edits are."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from cagefield.errors import EditError
from cagefield.scene.hotspots import MAX_HOTSPOTS, Hotspot


@dataclass(frozen=True)
class HotspotEntry:
    """A hotspot in the list, with its number."""

    id: int
    hotspot: Hotspot


HotspotList = tuple[HotspotEntry, ...]


def numbered(hotspots: Iterable[Hotspot], first: int = 1) -> HotspotList:
    """Entries of a scene's hotspots, numbered from `first`."""
    return tuple(HotspotEntry(number, hotspot) for number, hotspot in enumerate(hotspots, start=first))


def next_number(entries: HotspotList) -> int:
    """The least number above all in a list."""
    return max((entry.id for entry in entries), default=0) + 1


def added(entries: HotspotList, number: int, hotspot: Hotspot) -> HotspotList:
    """The list with one more hotspot at its end. Raises EditError where it is full."""
    if len(entries) >= MAX_HOTSPOTS:
        raise EditError(f"a scene has at most {MAX_HOTSPOTS} hotspots; remove some")
    return (*entries, HotspotEntry(number, hotspot))


def changed(entries: HotspotList, number: int, hotspot: Hotspot) -> HotspotList:
    """The list with another hotspot of that number. Raises EditError where it is not there any more."""
    at = index_of(entries, number)
    return (*entries[:at], replace(entries[at], hotspot=hotspot), *entries[at + 1 :])


def removed(entries: HotspotList, number: int) -> HotspotList:
    """The list without the hotspot of that number. Raises EditError where it is not there any more."""
    at = index_of(entries, number)
    return (*entries[:at], *entries[at + 1 :])


def moved(entries: HotspotList, number: int, to: int) -> HotspotList:
    """The list with a hotspot at another place, 0 first. Raises EditError where it is not there any more."""
    entry = entries[index_of(entries, number)]
    rest = removed(entries, number)
    return (*rest[:to], entry, *rest[to:])


def index_of(entries: HotspotList, number: int) -> int:
    """Place in the list of the hotspot of that number. Raises EditError where it is not there any more."""
    for at, entry in enumerate(entries):
        if entry.id == number:
            return at
    raise EditError(f"hotspot {number} is not there any more; choose another in the list")
