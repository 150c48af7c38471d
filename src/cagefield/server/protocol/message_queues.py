"""What waits between a page and the server. Where only the newest counts, an older one gives way to it."""

from __future__ import annotations

import asyncio
from collections import deque

from cagefield.server.protocol import client_messages, common, server_messages

MOST_WAITING = 200
"""Lines that wait for a page that takes none; older ones are dropped."""


class Outbox:
    """Messages in order; a waiting state, drag answer or job's progress gives way to a newer one."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[str, str | bytes]] = deque()
        self._some = asyncio.Event()

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, message: server_messages.ServerMessage) -> None:
        """One message more."""
        key: str = message.type
        if isinstance(message, server_messages.Job):
            key = f"job {message.job}"
        if isinstance(message, (server_messages.State, server_messages.Dragged, server_messages.Job)):
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


class Inbox:
    """Messages that wait to be done; of drag, camera or play messages in a row only the newest waits."""

    def __init__(self) -> None:
        self._waiting: deque[client_messages.PageMessage] = deque()
        self._some = asyncio.Event()

    def put(self, message: client_messages.PageMessage) -> None:
        """One message more."""
        for n in range(len(self._waiting) - 1, -1, -1):
            if _replaces(message, self._waiting[n]):
                del self._waiting[n]
                break
            if not isinstance(self._waiting[n], (common.CameraMessage, client_messages.Play)):
                break
        self._waiting.append(message)
        self._some.set()

    async def get(self) -> client_messages.PageMessage:
        """The next message, waited for."""
        while not self._waiting:
            self._some.clear()
            await self._some.wait()
        return self._waiting.popleft()


def _replaces(new: client_messages.PageMessage, old: client_messages.PageMessage) -> bool:
    if isinstance(new, common.CameraMessage):
        return isinstance(old, common.CameraMessage)
    if isinstance(new, client_messages.Play):
        return isinstance(old, client_messages.Play) and old.play == new.play
    if isinstance(new, (client_messages.DragMove, client_messages.DragEnd)):
        return isinstance(old, client_messages.DragMove) and old.drag == new.drag
    return False
