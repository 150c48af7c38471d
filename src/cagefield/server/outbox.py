"""What waits to be sent to one page. Never more than the newest of what only the newest counts of."""

from __future__ import annotations

import asyncio
from collections import deque

from cagefield.server import from_server

MOST_WAITING = 200
"""Lines that wait for a page that takes none; older ones are dropped."""


class Outbox:
    """Messages in order; a waiting state, drag answer or job's progress gives way to a newer one."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[str, str | bytes]] = deque()
        self._some = asyncio.Event()

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, message: from_server.ServerMessage) -> None:
        """One message more."""
        key: str = message.type
        if isinstance(message, from_server.Job):
            key = f"job {message.job}"
        if isinstance(message, (from_server.State, from_server.Dragged, from_server.Job)):
            self._waiting = deque(item for item in self._waiting if item[0] != key)
        elif len(self._waiting) >= MOST_WAITING:
            self._waiting.popleft()
        self._waiting.append((key, message.model_dump_json()))
        self._some.set()

    def put_picture(self, content: bytes) -> None:
        """One picture more; there are never more than two on their way."""
        self._waiting.append(("picture", content))
        self._some.set()

    async def get(self) -> str | bytes:
        """The next message, waited for."""
        while not self._waiting:
            self._some.clear()
            await self._some.wait()
        return self._waiting.popleft()[1]
