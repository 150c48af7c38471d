"""Serves an editor on a socket, until it is told to end."""

from __future__ import annotations

import contextlib
import socket

import uvicorn

from cagefield.server import from_server, wire
from cagefield.server.app import application
from cagefield.server.hub import Hub
from cagefield.server.safety import Guard


def serve(hub: Hub, hello: from_server.Hello, guard: Guard, listening: socket.socket) -> None:
    """Runs the web server to its end (Ctrl+C, or a signal to terminate)."""
    config = uvicorn.Config(
        application(hub, hello, guard),
        log_level="warning",
        ws_max_size=wire.MOST_BYTES,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=2,
        server_header=False,
    )
    with contextlib.suppress(KeyboardInterrupt):
        uvicorn.Server(config).run(sockets=[listening])
