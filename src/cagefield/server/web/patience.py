"""HTTP connections that are given up: requests whose head does not come, or too many of them at a time."""

from __future__ import annotations

import asyncio
from typing import Any, ClassVar

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

HEAD_SECONDS = 10.0
"""Seconds that the head of a request may take, from the connection, or from its first byte."""

MOST_WAITING = 256
"""Connections whose request's head has not come yet; the oldest is closed for another one."""

AT_A_TIME = 8 << 10
"""Bytes of a page's messages that are read before other connections have their turn."""


def read_little(transport: asyncio.BaseTransport) -> None:
    """A connection's bytes come in parts of `AT_A_TIME` from now on; asyncio's own are of 256 kB."""
    transport.max_size = AT_A_TIME  # type: ignore[attr-defined]


class PatientHttp(H11Protocol):
    """uvicorn's, with limits on connections that hold a place and ask nothing."""

    waiting: ClassVar[dict[PatientHttp, asyncio.TimerHandle]] = {}

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """A connection: its request is awaited."""
        super().connection_made(transport)
        self._await_head()

    def data_received(self, data: bytes) -> None:
        """Some of a request, or of the next one."""
        super().data_received(data)
        if self.conn.their_state is not h11.IDLE:
            self._stop()
        elif self not in self.waiting and self.conn.trailing_data[0]:
            self._await_head()

    def connection_lost(self, exc: Exception | None) -> None:
        """The connection is over."""
        self._stop()
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: Any) -> None:
        """The connection is a socket from now on."""
        self._stop()
        read_little(self.transport)
        super().handle_websocket_upgrade(event)

    def _await_head(self) -> None:
        while len(self.waiting) >= MOST_WAITING:
            next(iter(self.waiting))._give_up()
        self.waiting[self] = self.loop.call_later(HEAD_SECONDS, self._give_up)

    def _give_up(self) -> None:
        self._stop()
        self.transport.abort()

    def _stop(self) -> None:
        timer = self.waiting.pop(self, None)
        if timer is not None:
            timer.cancel()
