"""WebSocket of a page: receives, validates and hands on messages; sends queued ones. Independent of
editing."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import Coroutine, Iterator
from typing import Any
from weakref import WeakKeyDictionary

from pydantic import ValidationError
from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from cagefield.errors import CagefieldError, line_of
from cagefield.server.protocol import client_messages, common, server_messages
from cagefield.server.protocol.message_queues import ReceiveQueue
from cagefield.server.protocol.validation_errors import refusal
from cagefield.server.render_queue.coordinator import Coordinator, Page
from cagefield.server.web.handlers import MessageHandlers
from cagefield.server.web.security import Allowance

TOO_BIG, TOO_MANY, COME_AGAIN, TRY_LATER = 1009, 1008, 1012, 1013
"""Close codes of RFC 6455 and its registry: too big, policy violation, service restart, try again later."""

MAX_PAGES = 64
"""Open pages of an editor."""

TO_TAKE = 60.0
"""Seconds in which a page must take a message that is sent to it."""

QUICK = 0.02
"""Seconds of a message after which its page waits as long again: the others have their turn."""

BYTES_PER_SECOND = 4 << 20
"""Bytes of messages that a page may send on average; four times as many at once."""

_log = logging.getLogger(__name__)

MAX_REFUSED_MESSAGES = 2000
"""Messages over the rate after which the socket is closed."""


OF_ALL = 1200.0
"""Messages a second of all pages together; more wait in their lines."""


class _Turns:
    """Messages of all pages together: where there are too many, each page has its turn for one."""

    def __init__(self) -> None:
        self._allowance, self._line = Allowance(OF_ALL, OF_ALL, OF_ALL), asyncio.Lock()

    async def take(self) -> None:
        """Returns when one more message may be heard: after at most one of each other page."""
        async with self._line:  # first come, first served
            while not self._allowance.take(time.monotonic()):
                await asyncio.sleep(1.0 / OF_ALL)


_turns: WeakKeyDictionary[asyncio.AbstractEventLoop, _Turns] = WeakKeyDictionary()


async def serve_page(
    socket: WebSocket, coordinator: Coordinator, hello: server_messages.Hello, may_edit: bool = True
) -> None:
    """Serves one page until it is gone; one that may not edit may look."""
    try:
        await socket.accept()
        if len(coordinator.pages) >= MAX_PAGES:
            await socket.close(TRY_LATER, "too many pages are open; close some")
            return
    except (WebSocketDisconnect, ConnectionError):
        return
    page = coordinator.join(hello.model_copy(update={"read_only": not may_edit}))
    receive_queue = ReceiveQueue()
    tasks = [
        asyncio.ensure_future(work)
        for work in (
            _read(socket, page, receive_queue),
            _do(MessageHandlers(coordinator, page, may_edit), page, receive_queue, coordinator.loading),
            _send(socket, page),
        )
    ]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        ends = await asyncio.gather(*tasks, return_exceptions=True)
        coordinator.leave(page)
    for end in ends:
        if isinstance(end, Exception) and not _is_parting(socket, end):
            _log.error("a page's socket failed", exc_info=end)


def _is_parting(socket: WebSocket, error: Exception) -> bool:
    """Whether the error says no more than that the page is gone, or that its socket was closed."""
    if isinstance(error, RuntimeError):
        return WebSocketState.DISCONNECTED in (socket.application_state, socket.client_state)
    return isinstance(error, (WebSocketDisconnect, ConnectionError))


async def _read(socket: WebSocket, page: Page, receive_queue: ReceiveQueue) -> None:
    burst = 4.0 * BYTES_PER_SECOND
    turns = _turns.setdefault(asyncio.get_running_loop(), _Turns())
    allowance, bytes_allowed, refused = Allowance(), Allowance(BYTES_PER_SECOND, burst, burst), 0
    while True:
        received = await socket.receive()
        if received["type"] == "websocket.disconnect":
            return
        text = received.get("text")
        size = len(received.get("bytes") or b"" if text is None else text.encode())
        if size > common.MAX_MESSAGE_BYTES:
            await socket.close(TOO_BIG, "message too big")
            return
        await turns.take()  # the line holds back what more comes
        now = time.monotonic()
        if not (allowance.take(now) and bytes_allowed.take(now, size)):
            refused += 1
            if refused == 1:
                page.notice("error", "too many messages; some were passed over")
            if refused > MAX_REFUSED_MESSAGES:
                await socket.close(TOO_MANY, "too many messages")
                return
            continue
        if text is None:
            page.notice("error", "a message must be text, one JSON object")
            continue
        await receive_queue.room()
        try:
            receive_queue.put(client_messages.page_messages.validate_json(text))
        except ValidationError as error:
            page.notice("error", refusal(error))


async def _do(handlers: MessageHandlers, page: Page, receive_queue: ReceiveQueue, turn: asyncio.Lock) -> None:
    waiting: set[asyncio.Task[None]] = set()
    try:
        while True:
            message = await receive_queue.get()
            # Edit files may take a second each, in a thread: one at a time of all pages, which comes before
            # what its page says next, and as long again for others.
            heavy = isinstance(message, client_messages.LoadEdits)
            async with turn if heavy else contextlib.nullcontext():
                begun = time.monotonic()
                with errors_reported_to(page):
                    rest = handlers.handle(message)
                    if rest is not None and heavy:
                        await rest
                    elif rest is not None:
                        task = asyncio.ensure_future(_finish(rest, page))
                        waiting.add(task)
                        task.add_done_callback(waiting.discard)
                took = time.monotonic() - begun
                await asyncio.sleep(took if took > QUICK else 0)
    finally:
        for task in waiting:
            task.cancel()


async def _finish(rest: Coroutine[Any, Any, None], page: Page) -> None:
    with errors_reported_to(page):
        await rest


@contextlib.contextmanager
def errors_reported_to(page: Page) -> Iterator[None]:
    """Context that reports errors to the page's user in one line."""
    try:
        yield
    except CagefieldError as error:
        page.notice("error", str(error))
    except OSError as error:
        page.notice("error", line_of(error))
    except Exception as error:
        _log.exception("a message could not be followed")
        page.notice("error", f"the server could not do that ({type(error).__name__}: {error}); see its log")


async def _send(socket: WebSocket, page: Page) -> None:
    while True:
        content = await page.send_queue.get()
        if content is None:
            await socket.close(COME_AGAIN, "another scene was opened")
            return
        send = socket.send_bytes(content) if isinstance(content, bytes) else socket.send_text(content)
        # Not `asyncio.wait_for`, which may forget (before 3.12) that it was cancelled.
        sending = asyncio.ensure_future(send)
        try:
            sent, _ = await asyncio.wait({sending}, timeout=TO_TAKE)
        finally:
            sending.cancel()
        if not sent:
            return  # nobody reads; a page that is there comes again
        sending.result()
