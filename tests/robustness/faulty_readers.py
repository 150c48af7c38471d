"""Readers with faults that `attack` must count; a test puts this in the place of `readers.py`."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from cagefield.errors import FieldError

TAKEN = 60 << 20
"""Bytes: over what reading a small file may take."""


class Reader:
    """Reads the honest seed, four times, and then damaged ones as `fault` does it."""

    def __init__(self, fault: Callable[[], None]) -> None:
        self.damaged = {"a": "bytes"}
        self._fault, self._calls = fault, 0

    def make(self, folder: Path) -> None:
        (folder / "a").write_bytes(b"honest" * 20)

    def read(self, folder: Path) -> None:
        self._calls += 1
        if self._calls > 4:
            self._fault()


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


READERS: dict[str, Reader] = {
    "crash": Reader(_crash),
    "death": Reader(lambda: os._exit(3)),
    "memory": Reader(_take),
    "refused": Reader(_refuse),
    "crumbs": Reader(_crumble),
    "burn": Reader(_burn),
}
