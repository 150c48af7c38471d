"""Connections that are given up: what is awaited of them does not come, or of too many at a time."""

from __future__ import annotations

import asyncio
from typing import Any, Protocol

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

HEAD_SECONDS = 10.0
"""Seconds that the head of a request may take, from the connection or its first byte; and a handshake."""

MOST_WAITING = 256
"""Connections that owe a handshake, a head, the rest of a body that was answered, or TLS's goodbye.

The oldest is closed for another.
"""

AT_A_TIME = 8 << 10
"""Bytes of a page's messages that are read before other connections have their turn."""


class Impatient(Protocol):
    """A connection of which something is awaited."""

    def give_up(self) -> None:
        """Closes the connection at once, and is `no_longer_awaited`."""


_waiting: dict[Impatient, asyncio.TimerHandle] = {}


def awaited(connection: Impatient, loop: asyncio.AbstractEventLoop, seconds: float = HEAD_SECONDS) -> None:
    """The connection is given up unless it is `no_longer_awaited` in time, or when too many others come."""
    no_longer_awaited(connection)
    while len(_waiting) >= MOST_WAITING:
        next(iter(_waiting)).give_up()
    _waiting[connection] = loop.call_later(seconds, connection.give_up)


def no_longer_awaited(connection: Impatient) -> None:
    """What was awaited has come, or the connection is over."""
    timer = _waiting.pop(connection, None)
    if timer is not None:
        timer.cancel()


def read_little(transport: asyncio.BaseTransport) -> None:
    """A connection's bytes come in parts of `AT_A_TIME` from now on; asyncio's own are of 256 kB."""
    transport.max_size = AT_A_TIME  # type: ignore[attr-defined]


class PatientHttp(H11Protocol):
    """uvicorn's, with limits on connections that hold a place and ask nothing."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """A connection: its request is awaited."""
        super().connection_made(transport)
        awaited(self, self.loop)

    def data_received(self, data: bytes) -> None:
        """Some of a request, or of the next one."""
        super().data_received(data)
        if self._owes():
            if self not in _waiting:
                awaited(self, self.loop)
        elif self.conn.their_state is not h11.IDLE:
            no_longer_awaited(self)

    def connection_lost(self, exc: Exception | None) -> None:
        """The connection is over."""
        no_longer_awaited(self)
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: Any) -> None:
        """The connection is a socket from now on."""
        no_longer_awaited(self)
        read_little(self.transport)
        super().handle_websocket_upgrade(event)

    def give_up(self) -> None:
        """Closes the connection at once."""
        no_longer_awaited(self)
        self.transport.abort()

    def _owes(self) -> bool:
        """Whether the rest of a head is awaited, or of a body that was answered before it had come.

        Or the next request, once data has stopped uvicorn's own timer of that.
        """
        if self.conn.their_state is h11.IDLE:
            return bool(self.conn.trailing_data[0]) or self.timeout_keep_alive_task is None
        return (
            self.conn.their_state is h11.SEND_BODY and self.cycle is not None and self.cycle.response_complete
        )
