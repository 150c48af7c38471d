"""Arrays one after the other in one, for kernels, without copying those that have not changed."""

from __future__ import annotations

from collections.abc import Sequence
from threading import Lock
from typing import Any
from weakref import ref

import numpy as np

from cagefield.typing import Float32


class BufferPool:
    """Pool of joined arrays [N,3]; an array that nobody holds any more is written into again.

    A drag asks again and again for the same arrays but one: only that one is copied, and no memory is
    fetched. Arrays that are given must not change, and are held until others take their place.
    """

    def __init__(self, most: int = 3) -> None:
        self._most = most
        self.made: list[_Made] = []
        self._lock = Lock()

    def join(self, parts: Sequence[Float32]) -> Float32:
        """The parts [N,3] one after the other, read-only. Views of it do not outlive it."""
        with self._lock:
            lengths = [len(part) for part in parts]
            made = next((m for m in self.made if m.lengths == lengths and m.is_free), None)
            if made is None:
                made = _Made(lengths)
            else:
                self.made.remove(made)
            self.made = [made, *self.made[: self._most - 1]]
            return made.filled(parts)


class _Made:
    """A joined array, its parts, and a weak reference to its holder."""

    def __init__(self, lengths: list[int]) -> None:
        self.lengths = lengths
        self._rows = np.empty((sum(lengths), 3), dtype=np.float32)
        self._parts: list[Float32 | None] = [None] * len(lengths)
        self._held: ref[Any] | None = None

    @property
    def is_free(self) -> bool:
        return self._held is None or self._held() is None

    def filled(self, parts: Sequence[Float32]) -> Float32:
        at = 0
        for n, part in enumerate(parts):
            if self._parts[n] is not part:
                self._rows[at : at + len(part)] = part
                self._parts[n] = part
            at += len(part)
        # A view of their own: numpy gives views of it `_rows` as their base, so its own life says who looks.
        view = self._rows.view()
        view.setflags(write=False)
        self._held = ref(view)
        return view
