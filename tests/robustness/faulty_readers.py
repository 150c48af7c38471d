"""Readers with faults that `attack` must count; a test puts this in the place of `readers.py`."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from cagefield.errors import FieldError

TAKEN = 60 << 20
"""Bytes: over what reading a small file may take."""


HONEST = 20 << 20
"""Bytes that a large honest file takes."""


class Reader:
    """Reads the honest seed, four times, as `honest` does it, and then damaged ones as `fault` does it."""

    def __init__(self, fault: Callable[[], None], honest: Callable[[], None] = lambda: None) -> None:
        self.damaged = {"a": "bytes"}
        self._fault, self._honest, self._calls = fault, honest, 0

    def make(self, folder: Path) -> None:
        (folder / "a").write_bytes(b"honest" * 20)

    def read(self, folder: Path) -> None:
        self._calls += 1
        (self._fault if self._calls > 4 else self._honest)()


def _crash() -> None:
    raise KeyError("x")


def _burn() -> None:
    while True:
        pass


def _take() -> None:
    bytearray(TAKEN)


def _refuse() -> None:
    _take()
    raise FieldError("it is damaged")


_kept: list[bytearray] = []


def _crumble() -> None:
    """Takes it in small parts and keeps the last, so that the process keeps what was freed before it."""
    parts = [bytearray(1000) for _ in range(TAKEN // 1000)]
    _kept.append(parts[-1])


def _taken(size: float) -> Callable[[], None]:
    return lambda: bytearray(int(size)) and None


READERS: dict[str, Reader] = {
    "crash": Reader(_crash),
    "death": Reader(lambda: os._exit(3)),
    "memory": Reader(_take),
    "refused": Reader(_refuse),
    "crumbs": Reader(_crumble),
    "burn": Reader(_burn),
    "less than twice": Reader(_taken(1.9 * HONEST), _taken(HONEST)),
    "more than twice": Reader(_taken(2.1 * HONEST), _taken(HONEST)),
    "thrice": Reader(_taken(3 * HONEST), _taken(HONEST)),
}
