"""Connections that are encrypted: each agrees on its keys within the limits of `patience`, then speaks HTTP.

asyncio's own way gives a client that says nothing a minute, and tells nobody of it until then.
"""

from __future__ import annotations

import asyncio
import ssl
from typing import Any

from cagefield.server.web.patience import PatientHttp, awaited, no_longer_awaited


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
        transport.set_protocol(protocol)
        protocol.connection_made(transport)
        for data in self._early:
            protocol.data_received(data)
