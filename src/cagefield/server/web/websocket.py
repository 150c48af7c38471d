"""One WebSocket per page: reads, checks and hands on messages; sends what waits. Knows nothing of editing."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import Coroutine, Iterator
from typing import Any

from pydantic import ValidationError
from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from cagefield.errors import CagefieldError, line_of
from cagefield.server.protocol import client_messages, common, server_messages
from cagefield.server.protocol.message_queues import ReceiveQueue
from cagefield.server.protocol.validation_errors import refusal
from cagefield.server.render_queue.coordinator import Coordinator, Page
from cagefield.server.web.handlers import MessageHandlers
from cagefield.server.web.security import Allowance

TOO_BIG, TOO_MANY, COME_AGAIN = 1009, 1008, 1012
"""Close codes of RFC 6455 and its registry: message too big, policy violation, service restart."""

_log = logging.getLogger(__name__)

MOST_REFUSED = 2000
"""Messages over the rate after which the socket is closed."""


async def attend(socket: WebSocket, coordinator: Coordinator, hello: server_messages.Hello) -> None:
    """Serves one page until it is gone."""
    try:
        await socket.accept()
    except (WebSocketDisconnect, ConnectionError):
        return
    page = coordinator.join(hello)
    receive_queue = ReceiveQueue()
    tasks = [
        asyncio.ensure_future(work)
        for work in (
            _read(socket, page, receive_queue),
            _do(MessageHandlers(coordinator, page), page, receive_queue),
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
    allowance, refused = Allowance(), 0
    while True:
        received = await socket.receive()
        if received["type"] == "websocket.disconnect":
            return
        text = received.get("text")
        if text is None:
            page.notice("error", "a message must be text, one JSON object")
            continue
        if len(text.encode()) > common.MOST_BYTES:
            await socket.close(TOO_BIG, "message too big")
            return
        if not allowance.take(time.monotonic()):
            refused += 1
            if refused == 1:
                page.notice("error", "too many messages; some were passed over")
            if refused > MOST_REFUSED:
                await socket.close(TOO_MANY, "too many messages")
                return
            continue
        try:
            receive_queue.put(client_messages.page_messages.validate_json(text))
        except ValidationError as error:
            page.notice("error", refusal(error))


async def _do(handlers: MessageHandlers, page: Page, receive_queue: ReceiveQueue) -> None:
    waiting: set[asyncio.Task[None]] = set()
    try:
        while True:
            message = await receive_queue.get()
            with errors_reported_to(page):
                rest = handlers.handle(message)
                if rest is not None:
                    task = asyncio.ensure_future(_finish(rest, page))
                    waiting.add(task)
                    task.add_done_callback(waiting.discard)
            await asyncio.sleep(0)
    finally:
        for task in waiting:
            task.cancel()


async def _finish(rest: Coroutine[Any, Any, None], page: Page) -> None:
    with errors_reported_to(page):
        await rest


@contextlib.contextmanager
def errors_reported_to(page: Page) -> Iterator[None]:
    """What cannot be done becomes a line for the page's user."""
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
        if isinstance(content, bytes):
            await socket.send_bytes(content)
        else:
            await socket.send_text(content)
