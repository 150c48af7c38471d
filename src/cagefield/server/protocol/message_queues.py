"""Queues of messages between a page and the server; a newer message of a kind may replace an older one."""

from __future__ import annotations

import asyncio
import json
from collections import deque

from pydantic_core import PydanticSerializationError

from cagefield.server.protocol import client_messages, server_messages

MAX_WAITING_MESSAGES = 200
"""Messages that wait for a page that takes none; older ones are dropped."""

MAX_WAITING_BYTES = 32 << 20
"""Bytes that wait for a page; with more it has to come again."""

MAX_RECEIVED_MESSAGES = 64
"""Messages of a page that wait to be done; no more are read meanwhile."""


class SendQueue:
    """Messages to a page in order; those that a newer one supersedes are not sent."""

    def __init__(self) -> None:
        self.waiting: deque[tuple[str | None, str | bytes | None]] = deque()
        self._some = asyncio.Event()
        self._ended = False

    def __len__(self) -> int:
        return len(self.waiting)

    def put(self, message: server_messages.ServerMessage) -> None:
        """One message more."""
        superseded = message.supersedes()
        if superseded is not None:
            self.waiting = deque(item for item in self.waiting if item[0] != superseded)
        elif len(self.waiting) >= MAX_WAITING_MESSAGES:
            self.waiting.popleft()
        self._append(message.redundancy_key(), _text(message))

    def put_picture(self, content: bytes) -> None:
        """One picture more; there are never more than two on their way."""
        self._append(None, content)

    def put_highlight(self, content: bytes) -> None:
        """A highlight of the selected elements; one that waits is not sent."""
        self.waiting = deque(item for item in self.waiting if item[0] != "highlight")
        self._append("highlight", content)

    def end(self) -> None:
        """End the queue after its waiting messages."""
        self._append(None, None)
        self._ended = True

    def _append(self, key: str | None, content: str | bytes | None) -> None:
        if self._ended:
            return
        size = sum(len(item[1] or "") for item in self.waiting) + len(content or "")
        if size > MAX_WAITING_BYTES and self.waiting:
            self.waiting.clear()
            key = content = None
            self._ended = True
        self.waiting.append((key, content))
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
        self._some, self._room = asyncio.Event(), asyncio.Event()

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
        self._room.set()
        return self.waiting.popleft()

    async def room(self) -> None:
        """Returns when there is room for one more message."""
        while len(self.waiting) >= MAX_RECEIVED_MESSAGES:
            self._room.clear()
            await self._room.wait()


def _text(message: server_messages.ServerMessage) -> str:
    """The message as JSON. Half characters, of a folder's name or a text that is quoted, are escaped."""
    try:
        return message.model_dump_json()
    except PydanticSerializationError:
        return json.dumps(message.model_dump(), separators=(",", ":"))
