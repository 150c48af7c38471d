"""What waits between a page and the server. Where only the newest counts, an older one gives way to it."""

from __future__ import annotations

import asyncio
import json
from collections import deque

from pydantic_core import PydanticSerializationError

from cagefield.server.protocol import client_messages, server_messages

MOST_WAITING = 200
"""Messages that wait for a page that takes none; older ones are dropped."""


class SendQueue:
    """Messages to a page in order; those that a newer one supersedes are not sent."""

    def __init__(self) -> None:
        self.waiting: deque[tuple[str | None, str | bytes | None]] = deque()
        self._some = asyncio.Event()

    def __len__(self) -> int:
        return len(self.waiting)

    def put(self, message: server_messages.ServerMessage) -> None:
        """One message more."""
        superseded = message.supersedes()
        if superseded is not None:
            self.waiting = deque(item for item in self.waiting if item[0] != superseded)
        elif len(self.waiting) >= MOST_WAITING:
            self.waiting.popleft()
        self.waiting.append((message.redundancy_key(), _text(message)))
        self._some.set()

    def put_picture(self, content: bytes) -> None:
        """One picture more; there are never more than two on their way."""
        self.waiting.append((None, content))
        self._some.set()

    def end(self) -> None:
        """Nothing comes after what waits."""
        self.waiting.append((None, None))
        self._some.set()

    async def get(self) -> str | bytes | None:
        """The next message, waited for; None at the end."""
        while not self.waiting:
            self._some.clear()
            await self._some.wait()
        return self.waiting.popleft()[1]


class ReceiveQueue:
    """Messages from a page in order; those that a newer one supersedes are not done."""

    def __init__(self) -> None:
        self.waiting: deque[client_messages.PageMessage] = deque()
        self._some = asyncio.Event()

    def put(self, message: client_messages.PageMessage) -> None:
        """One message more."""
        superseded = message.supersedes()
        for n in range(len(self.waiting) - 1, -1, -1):
            if superseded is not None and self.waiting[n].redundancy_key() == superseded:
                del self.waiting[n]
                break
            if self.waiting[n].ordered:
                break
        self.waiting.append(message)
        self._some.set()

    async def get(self) -> client_messages.PageMessage:
        """The next message, waited for."""
        while not self.waiting:
            self._some.clear()
            await self._some.wait()
        return self.waiting.popleft()


def _text(message: server_messages.ServerMessage) -> str:
    """The message as JSON. Half characters, of a folder's name or a text that is quoted, are escaped."""
    try:
        return message.model_dump_json()
    except PydanticSerializationError:
        return json.dumps(message.model_dump(), separators=(",", ":"))
