"""What waits between a page and the server. Where only the newest counts, an older one gives way to it."""

from __future__ import annotations

import asyncio
from collections import deque

from cagefield.server.protocol import client_messages, server_messages

MOST_WAITING = 200
"""Messages that wait for a page that takes none; older ones are dropped."""


class SendQueue:
    """Messages to a page in order; those that a newer one supersedes are not sent."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[str | None, str | bytes]] = deque()
        self._some = asyncio.Event()

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, message: server_messages.ServerMessage) -> None:
        """One message more."""
        superseded = message.supersedes()
        if superseded is not None:
            self._waiting = deque(item for item in self._waiting if item[0] != superseded)
        elif len(self._waiting) >= MOST_WAITING:
            self._waiting.popleft()
        self._waiting.append((message.redundancy_key(), message.model_dump_json()))
        self._some.set()

    def put_picture(self, content: bytes) -> None:
        """One picture more; there are never more than two on their way."""
        self._waiting.append((None, content))
        self._some.set()

    async def get(self) -> str | bytes:
        """The next message, waited for."""
        while not self._waiting:
            self._some.clear()
            await self._some.wait()
        return self._waiting.popleft()[1]


class ReceiveQueue:
    """Messages from a page in order; those that a newer one supersedes are not done."""

    def __init__(self) -> None:
        self._waiting: deque[client_messages.PageMessage] = deque()
        self._some = asyncio.Event()

    def put(self, message: client_messages.PageMessage) -> None:
        """One message more."""
        superseded = message.supersedes()
        for n in range(len(self._waiting) - 1, -1, -1):
            if superseded is not None and self._waiting[n].redundancy_key() == superseded:
                del self._waiting[n]
                break
            if self._waiting[n].ordered:
                break
        self._waiting.append(message)
        self._some.set()

    async def get(self) -> client_messages.PageMessage:
        """The next message, waited for."""
        while not self._waiting:
            self._some.clear()
            await self._some.wait()
        return self._waiting.popleft()
