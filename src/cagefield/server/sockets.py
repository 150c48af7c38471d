"""One WebSocket per page: reads, checks and hands on messages; sends what waits. Knows nothing of editing."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections import deque
from collections.abc import Coroutine, Iterator
from typing import Any

from pydantic import ValidationError
from starlette.websockets import WebSocket, WebSocketDisconnect

from cagefield.errors import CagefieldError
from cagefield.server import protocol
from cagefield.server.hub import Hub, Page
from cagefield.server.safety import Allowance
from cagefield.server.speaking import Speaker

TOO_BIG, TOO_MANY = 1009, 1008
"""Close codes of RFC 6455: message too big, policy violation."""

_log = logging.getLogger(__name__)

MOST_REFUSED = 2000
"""Messages over the rate after which the socket is closed."""


class Inbox:
    """Messages that wait to be done; of drag, camera or play messages in a row only the newest waits."""

    def __init__(self) -> None:
        self._waiting: deque[protocol.PageMessage] = deque()
        self._some = asyncio.Event()

    def put(self, message: protocol.PageMessage) -> None:
        """One message more."""
        for n in range(len(self._waiting) - 1, -1, -1):
            if _replaces(message, self._waiting[n]):
                del self._waiting[n]
                break
            if not isinstance(self._waiting[n], (protocol.CameraMessage, protocol.Play)):
                break
        self._waiting.append(message)
        self._some.set()

    async def get(self) -> protocol.PageMessage:
        """The next message, waited for."""
        while not self._waiting:
            self._some.clear()
            await self._some.wait()
        return self._waiting.popleft()


def _replaces(new: protocol.PageMessage, old: protocol.PageMessage) -> bool:
    if isinstance(new, protocol.CameraMessage):
        return isinstance(old, protocol.CameraMessage)
    if isinstance(new, protocol.Play):
        return isinstance(old, protocol.Play) and old.play == new.play
    if isinstance(new, (protocol.DragMove, protocol.DragEnd)):
        return isinstance(old, protocol.DragMove) and old.drag == new.drag
    return False


async def attend(socket: WebSocket, hub: Hub, hello: protocol.Hello) -> None:
    """Serves one page until it is gone."""
    await socket.accept()
    page = hub.join(hello)
    inbox = Inbox()
    tasks = [
        asyncio.ensure_future(work)
        for work in (_read(socket, page, inbox), _do(Speaker(hub, page), page, inbox), _send(socket, page))
    ]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        for task in tasks:
            with contextlib.suppress(asyncio.CancelledError, WebSocketDisconnect, RuntimeError, OSError):
                await task
        hub.leave(page)


async def _read(socket: WebSocket, page: Page, inbox: Inbox) -> None:
    allowance, refused = Allowance(), 0
    while True:
        received = await socket.receive()
        if received["type"] == "websocket.disconnect":
            return
        text = received.get("text")
        if text is None:
            page.notice("error", "a message must be text, one JSON object")
            continue
        if len(text.encode()) > protocol.MOST_BYTES:
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
            inbox.put(protocol.page_messages.validate_json(text))
        except ValidationError as error:
            page.notice("error", f"malformed message: {_first(error)}")


def _first(error: ValidationError) -> str:
    """The first thing wrong with a message, in a line."""
    problem = error.errors(include_url=False, include_input=False)[0]
    where = ".".join(str(part) for part in problem["loc"])
    return f"{where}: {problem['msg']}" if where else str(problem["msg"])


async def _do(speaker: Speaker, page: Page, inbox: Inbox) -> None:
    waiting: set[asyncio.Task[None]] = set()
    try:
        while True:
            message = await inbox.get()
            with _told(page):
                rest = speaker.hear(message)
                if rest is not None:
                    task = asyncio.ensure_future(_finish(rest, page))
                    waiting.add(task)
                    task.add_done_callback(waiting.discard)
            await asyncio.sleep(0)
    finally:
        for task in waiting:
            task.cancel()


async def _finish(rest: Coroutine[Any, Any, None], page: Page) -> None:
    with _told(page):
        await rest


@contextlib.contextmanager
def _told(page: Page) -> Iterator[None]:
    """What cannot be done becomes a line for the page's user."""
    try:
        yield
    except (CagefieldError, OSError) as error:
        page.notice("error", str(error))
    except Exception as error:
        _log.exception("a message could not be followed")
        page.notice("error", f"the server could not do that ({type(error).__name__}: {error}); see its log")


async def _send(socket: WebSocket, page: Page) -> None:
    while True:
        content = await page.outbox.get()
        if isinstance(content, bytes):
            await socket.send_bytes(content)
        else:
            await socket.send_text(content)
