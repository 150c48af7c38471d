"""`cagefield view`: the editor of a scene, in the browser."""

from __future__ import annotations

import webbrowser
from dataclasses import dataclass
from pathlib import Path

import tyro

from cagefield.cli.options import Device, Flag
from cagefield.errors import CagefieldError


@dataclass(frozen=True)
class View:
    """Edit a scene by hand, in the browser: set cages, move them, and the field follows."""

    scene: tyro.conf.Positional[Path]
    """Scene folder, or a file of splats: .ply, .compressed.ply, .spz, .sog, .splat, .ksplat, .glb."""
    port: int = 8741
    """Port to listen on; 0 takes any that is free."""
    host: str = "localhost"
    """Address to listen on. Any but this machine's own needs the token in the printed link."""
    token: str | None = None
    """Token that a page must know; a new one is made where --host needs one and none is given."""
    no_browser: Flag = False
    """Print the link, but do not open it."""
    device: Device = "auto"

    def run(self) -> None:
        """Serves until Ctrl+C."""
        if not 0 <= self.port <= 65535:
            raise CagefieldError(f"--port is {self.port}; give a number from 0 to 65535")
        if self.token is not None and len(self.token) < 8:
            raise CagefieldError("--token is too short to keep anybody out; give 8 characters or more")
        from cagefield.server.web.launch import bound_socket, open_scene, serve
        from cagefield.server.web.security import Guard, is_loopback, new_token

        coordinator, hello = open_scene(self.scene, self.device)
        listening = bound_socket(self.host, self.port)
        port = int(listening.getsockname()[1])
        token = self.token or (None if is_loopback(self.host) else new_token())
        link = f"http://{_shown(self.host)}:{port}/" + (f"?token={token}" if token else "")
        print(f"editing {self.scene}: open {link}  (Ctrl+C ends)", flush=True)
        if not self.no_browser:
            webbrowser.open(link)
        serve(coordinator, hello, Guard(self.host, port, token), listening)


def _shown(host: str) -> str:
    """The host as it stands in a link."""
    if host in ("0.0.0.0", "::", ""):
        import socket

        return socket.gethostname()
    return f"[{host}]" if ":" in host else host
