"""The web application: the page, its socket, and downloads, behind the checks of `security`."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from urllib.parse import urlencode

from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, HTTPConnection, Request
from starlette.responses import FileResponse, PlainTextResponse, RedirectResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from cagefield.edits import dump_edits
from cagefield.errors import CagefieldError, line_of
from cagefield.server.protocol import server_messages
from cagefield.server.render_queue.coordinator import Coordinator
from cagefield.server.render_queue.dispatcher import TooManyError
from cagefield.server.render_worker.tasks import PageFieldTask, StillTask
from cagefield.server.render_worker.unused_memory import return_memory_periodically
from cagefield.server.web.security import Attempts, Guard
from cagefield.server.web.uploads import OpenEditor, Reopen, TooLargeError
from cagefield.server.web.websocket import serve_page
from cagefield.server.web.worker_threads import start_all_threads

STATIC = Path(__file__).parent / "static"
"""The page as it was built."""

_PAGE = frozenset({"/", *("/" + file.relative_to(STATIC).as_posix() for file in STATIC.rglob("*"))})
"""Paths of the page itself, which other sites may lead to; all others have data of the scene."""

_READING = ("GET", "HEAD")
"""Methods of requests that change nothing; all others must say their origin, as sockets must."""

_HEADERS = {
    "Content-Security-Policy": (
        "default-src 'self'; img-src 'self' blob: data:; style-src 'self' 'unsafe-inline'; "
        "connect-src 'self'; worker-src 'self' blob:; frame-ancestors 'none'; base-uri 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-cache",
}


def application(
    coordinator: Coordinator,
    hello: server_messages.Hello,
    guard: Guard,
    reopen: Reopen | None = None,
) -> ASGIApp:
    """The application of one editor; starts the rendering process and ends it.

    `reopen` makes the editor of a file that a page sends; without it none is taken.
    """

    editor = OpenEditor(coordinator, hello, reopen)

    @contextlib.asynccontextmanager
    async def life(_: Starlette) -> AsyncIterator[None]:
        asyncio.get_running_loop().set_default_executor(start_all_threads())
        trimming = asyncio.create_task(return_memory_periodically())
        try:
            editor.start()
            yield
            editor.close()
        finally:
            trimming.cancel()

    async def socket(websocket: WebSocket) -> None:
        may_edit = websocket.scope["cagefield.role"] == "edit"
        await serve_page(websocket, editor.coordinator, editor.hello, may_edit)

    async def edits(_: Request) -> Response:
        coordinator = editor.coordinator
        edits = coordinator.store.written(coordinator.session.document.stack)
        return _download(dump_edits(edits), "edits.yaml", "application/yaml")

    async def open_file(request: Request) -> Response:
        length = request.headers.get("content-length", "")
        try:
            await editor.open(
                request.query_params.get("name", ""),
                request.stream(),
                int(length) if length.isascii() and length.isdigit() else None,
            )
        except TooLargeError as error:
            return PlainTextResponse(str(error), 413)
        except ClientDisconnect:
            return PlainTextResponse("the page that sent the file has hung up", 499)
        except OSError as error:
            return PlainTextResponse(line_of(error), 400)
        except CagefieldError as error:
            return PlainTextResponse(str(error), 400)
        return PlainTextResponse("opened")

    async def export(request: Request) -> Response:
        number = _number(request.path_params["number"])
        file = editor.coordinator.background.exports.file(number)
        if file is None or not file.is_file():
            return PlainTextResponse("there is no such file any more; export it again", 404)
        return FileResponse(file, media_type="application/octet-stream", filename=file.name)

    async def camera_path(_: Request) -> Response:
        from cagefield.cameras.keyframe_files import dump_path

        document = editor.coordinator.session.document
        try:
            text = dump_path(document.placed_keys, loop=document.loop)
        except CagefieldError as error:
            return PlainTextResponse(str(error), 409)
        return _download(text, "camera_path.json", "application/json")

    async def screenshot(request: Request) -> Response:
        coordinator = editor.coordinator
        newest = max(coordinator.pages, default=0)
        page = coordinator.pages.get(_number(request.query_params.get("page", str(newest))))
        if page is None:
            return PlainTextResponse("give ?page=, the number of an open page", 404)
        camera, display, shown = page.camera, page.display, coordinator.shown()
        if camera is None:
            return PlainTextResponse("this page has sent no camera yet", 409)
        made = asyncio.ensure_future(
            coordinator.ask_patiently(
                page.number, lambda number, generation: StillTask(number, shown, camera, display, generation)
            )
        )
        gone = asyncio.ensure_future(_gone(request))
        try:
            await asyncio.wait((made, gone), return_when=asyncio.FIRST_COMPLETED)
            if not made.done():
                return PlainTextResponse("nobody waits for this picture any more", 499)
            return _download(made.result(), "screenshot.png", "image/png")
        except asyncio.CancelledError:
            return PlainTextResponse("the editor is ended", 503)
        except TooManyError as error:
            return PlainTextResponse(str(error), 429, headers={"Retry-After": "2"})
        except CagefieldError as error:
            return PlainTextResponse(str(error), 500)
        finally:
            made.cancel()
            gone.cancel()

    async def field(request: Request) -> Response:
        coordinator, name = editor.coordinator, f'"{editor.hello.field}"'
        headers = {"ETag": name}
        if request.headers.get("if-none-match") == name:
            return Response(status_code=304, headers=headers)
        try:
            content = await coordinator.ask(PageFieldTask)
        except CagefieldError as error:
            return PlainTextResponse(str(error), 409)
        return Response(content, media_type="application/octet-stream", headers=headers)

    routes = [
        Route("/field", field),
        WebSocketRoute("/socket", socket),
        Route("/edits.yaml", edits),
        Route("/camera_path.json", camera_path),
        Route("/screenshot.png", screenshot),
        Route("/open", open_file, methods=["POST"]),
        Route("/exports/{number}/{name}", export),
        Mount("/", StaticFiles(directory=STATIC, html=True)),
    ]
    return _Guarded(Starlette(routes=routes, lifespan=life), guard)


def _number(text: str) -> int:
    """The number, or 0, which no page has."""
    return int(text) if text.isascii() and text.isdigit() and len(text) < 10 else 0


async def _gone(request: Request) -> None:
    """Returns when the client has hung up."""
    while (await request.receive())["type"] != "http.disconnect":
        pass


def _download(content: str | bytes, name: str, kind: str) -> Response:
    return Response(
        content, media_type=kind, headers={"Content-Disposition": f'attachment; filename="{name}"'}
    )


class _Guarded:
    """Middleware that admits requests by the guard, and adds the headers of every answer."""

    def __init__(self, app: ASGIApp, guard: Guard) -> None:
        self._app, self._guard, self._attempts = app, guard, Attempts()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        connection = HTTPConnection(scope)
        address, now = (scope.get("client") or ("", 0))[0], time.monotonic()
        given = self._guard.given(connection.headers, connection.cookies, connection.query_params)
        role = self._guard.role(given)
        too_many = self._guard.can_be_guessed and self._attempts.is_locked(address, now)
        if role is None and given:
            too_many = not self._attempts.wrong(address, now) or too_many
        scope["cagefield.role"] = role
        refusal = self._guard.refusal(
            connection.headers,
            connection.cookies,
            connection.query_params,
            needs_origin=scope["type"] == "websocket" or scope["method"] not in _READING,
            has_data=scope["type"] == "websocket" or scope["path"] not in _PAGE,
        )
        status = 403
        if too_many:
            status, refusal = 429, "too many wrong tokens; wait some seconds"
        elif refusal is None and role == "look" and scope.get("method", "GET") not in _READING:
            refusal = "this link may look but not change anything"
        if scope["type"] == "websocket":
            if refusal is None:
                await self._app(scope, receive, send)
            else:
                with contextlib.suppress(WebSocketDisconnect):
                    await WebSocket(scope, receive, send).close(1008, refusal[:120])
            return
        respond = _with_headers(send)
        if refusal is not None:
            await PlainTextResponse(refusal + "\n", status)(scope, receive, respond)
        elif (
            self._guard.token is not None
            and "token" in connection.query_params
            and scope["method"] in _READING
        ):
            await self._keep_token(given, scope, receive, respond)
        else:
            await self._app(scope, receive, respond)

    async def _keep_token(self, token: str, scope: Scope, receive: Receive, send: Send) -> None:
        """Redirect that moves the token from the address to a cookie and keeps the rest of the address."""
        others = [(k, v) for k, v in HTTPConnection(scope).query_params.multi_items() if k != "token"]
        path = "/" + scope["path"].lstrip("/\\")  # two of them would be another site
        response = RedirectResponse(path + (f"?{urlencode(others)}" if others else ""), 303)
        response.set_cookie(
            self._guard.cookie,
            token,
            httponly=True,
            samesite="strict",
            max_age=30 * 86400,
            secure=scope.get("scheme") == "https",
        )
        await response(scope, receive, send)


def _with_headers(send: Send) -> Callable[[Message], Awaitable[None]]:
    async def respond(message: Message) -> None:
        if message["type"] == "http.response.start":
            extra = [(name.lower().encode(), value.encode()) for name, value in _HEADERS.items()]
            message = {**message, "headers": [*message["headers"], *extra]}
        await send(message)

    return respond
