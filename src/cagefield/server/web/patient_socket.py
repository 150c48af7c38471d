"""WebSockets of pages that send much and read nothing: each has its turn, and holds little memory."""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from cagefield.server.web.patience import AT_A_TIME

MOST_PARTS = 4096
"""Frames of one message: browsers send parts of 64 kB and more."""

MOST_UNSENT = 64 << 10
"""Bytes that wait for a page to read before the next message waits: of TLS, eight times as many else."""


class PatientSocket(WebSocketsSansIOProtocol):
    """uvicorn's, with limits on what one page takes of the server's time and memory."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._unread = bytearray()
        self._turn: asyncio.Handle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """The connection, whose request has come."""
        super().connection_made(transport)
        self.transport.set_write_buffer_limits(MOST_UNSENT)

    def connection_lost(self, exc: Exception | None) -> None:
        """The connection is over."""
        self._unread.clear()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Bytes of a page: parts of AT_A_TIME, others have their turn between two.

        TLS hands on what has come at once, a quarter of a megabyte at most.
        """
        self._unread += data
        if self._turn is None:
            self._take_turn()

    async def receive(self) -> Any:
        """The next message for the application; bytes that waited for that are looked at next."""
        message = await super().receive()
        self._go_on()
        return message

    def _take_turn(self) -> None:
        """Looks at some bytes, and comes again for more in another turn of the loop."""
        self._turn = None
        if self.transport.is_closing():
            self._unread.clear()
            return
        part = bytes(self._unread[:AT_A_TIME])
        del self._unread[:AT_A_TIME]
        super().data_received(part)
        self._go_on()

    def _go_on(self) -> None:
        """Comes for the bytes that wait once no message waits for the application; no more come meanwhile."""
        if self.transport.is_closing():
            return
        if self._unread:
            self.transport.pause_reading()
            if self._turn is None and not self.read_paused:
                self._turn = self.loop.call_soon(self._take_turn)
        elif not self.read_paused:
            self.transport.resume_reading()

    def handle_ping(self) -> None:
        """Answers pings, but of a page that does not read its answers: they would wait in memory."""
        answer = b"".join(self.conn.data_to_send())
        if self.writable.is_set():
            self.transport.write(answer)

    def handle_cont(self, event: Any) -> None:
        """A part of a message: empty ones add no bytes, and still take memory."""
        if len(self.frames) >= MOST_PARTS:
            self.conn.fail(1009, "too many parts")
            self.handle_parser_exception()
            return
        super().handle_cont(event)

    def send_receive_event_to_app(self) -> None:
        """A whole message. A text in another encoding ends the connection, without a traceback."""
        if self.curr_msg_data_type == "text":
            try:
                b"".join(self.frames).decode()
            except UnicodeDecodeError:
                self.frames = []
                self.conn.fail(1007, "no UTF-8")
                self.handle_parser_exception()
                return
        super().send_receive_event_to_app()

    def handle_parser_exception(self) -> None:
        """Bytes that are no frames; of a page that is not let in yet there is nobody to tell of it."""
        if self.conn.close_sent is None:
            self.queue.put_nowait({"type": "websocket.disconnect", "code": 1006})
            self.close_sent = True
            self.transport.abort()
            return
        super().handle_parser_exception()
