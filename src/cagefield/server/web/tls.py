"""Connections that are encrypted: each agrees on its keys within the limits of `patience`, then speaks HTTP.

asyncio's own way gives a client that says nothing a minute, and tells nobody of it until then; and one that
says no goodbye another half (Python 3.10: for ever).
"""

from __future__ import annotations

import asyncio
import contextlib
import ssl
from typing import Any

from cagefield.server.web.patience import PatientHttp, awaited, no_longer_awaited

GOODBYE_SECONDS = 3.0
"""Seconds in which a client must say goodbye of a connection that is closed, or take more of what is left."""


class _Goodbye:
    """A connection that is closed, until its client has taken what is left for it and has said goodbye."""

    def __init__(self, transport: asyncio.Transport, raw: asyncio.Transport) -> None:
        """From now on `transport.close` begins it; `raw` is what it speaks by."""
        self._transport, self._raw, self._close = transport, raw, transport.close
        self._left: int | None = None
        transport.close = self._begin  # type: ignore[method-assign]

    def _begin(self) -> None:
        self._close()
        if self._left is None:
            self._await()

    def _await(self) -> None:
        if self._raw.is_closing():
            return
        loop, left = asyncio.get_running_loop(), self._raw.get_write_buffer_size()
        with contextlib.suppress(AttributeError):  # asyncio's, of one that has been closed twice
            left += self._transport.get_write_buffer_size()
        if not left:
            awaited(self, loop, GOODBYE_SECONDS)
        elif self._left is None or left < self._left:
            self._left = left
            loop.call_later(GOODBYE_SECONDS, self._await)
        else:
            self.give_up()

    def give_up(self) -> None:
        """Closes the connection at once."""
        no_longer_awaited(self)
        self._raw.abort()


class TlsHttp(asyncio.Protocol):
    """A connection until its keys are agreed on; `PatientHttp` has it from then on."""

    def __init__(self, context: ssl.SSLContext, **http: Any) -> None:
        """`http` is what a protocol of uvicorn's is made of."""
        self._context, self._http = context, http
        self._early: list[bytes] = []
        self._ended = False
        self._raw: asyncio.Transport | None = None
        self._task: asyncio.Task[None] | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """A connection, of which nothing has come yet."""
        assert isinstance(transport, asyncio.Transport)
        self._raw = transport
        awaited(self, asyncio.get_running_loop())
        self._task = asyncio.ensure_future(self._agree(transport))

    def data_received(self, data: bytes) -> None:
        """What a client sends with the last of its handshake."""
        self._early.append(data)

    def eof_received(self) -> None:
        """A client that has sent all it will."""
        self._ended = True

    def connection_lost(self, exc: Exception | None) -> None:
        """The connection is over."""
        self._ended = True
        no_longer_awaited(self)

    def give_up(self) -> None:
        """Closes the connection at once."""
        no_longer_awaited(self)
        if self._raw is not None:
            self._raw.abort()

    async def _agree(self, raw: asyncio.Transport) -> None:
        try:
            transport = await asyncio.get_running_loop().start_tls(raw, self, self._context, server_side=True)
        except OSError:  # no TLS, or the client has gone
            raw.abort()
            return
        finally:
            no_longer_awaited(self)
            # Or each would hold the other, and what it has of keys, until garbage is collected.
            self._task = None
        if transport is None or self._ended or raw.is_closing():
            raw.abort()
            return
        protocol = PatientHttp(**self._http)
        _Goodbye(transport, raw)
        transport.set_protocol(protocol)
        protocol.connection_made(transport)
        for data in self._early:
            protocol.data_received(data)
