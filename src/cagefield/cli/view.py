"""`cagefield view`: the editor of a scene, in the browser."""

from __future__ import annotations

import os
import webbrowser
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlencode

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
    """Address to listen on; pages need the token in the printed link, wherever they are."""
    token: str | None = None
    """Token that a page must know; left out, $CAGEFIELD_TOKEN, which no process list shows, or a new one."""
    root: Path | None = None
    """Folder that pages may save and render into; left out, the one that the scene is in."""
    no_browser: Flag = False
    """Print the link, but do not open it."""
    device: Device = "auto"

    def run(self) -> None:
        """Serves until Ctrl+C."""
        if not 0 <= self.port <= 65535:
            raise CagefieldError(f"--port is {self.port}; give a number from 0 to 65535")
        given = self.token or os.environ.get("CAGEFIELD_TOKEN") or None
        if given is not None and (len(given) < 8 or not given.isascii() or not given.isprintable()):
            what = "--token" if self.token else "$CAGEFIELD_TOKEN"
            raise CagefieldError(
                f"{what} is too short to keep anybody out; give 8 characters of ASCII or more"
            )
        if self.root is not None and not self.root.is_dir():
            raise CagefieldError(f"--root {self.root} is no folder; give one that pages may save into")
        from cagefield.server.web.launch import bound_socket, open_scene, serve
        from cagefield.server.web.security import Guard, is_loopback, new_token, own_token

        coordinator, hello = open_scene(self.scene, self.device, self.root)
        listening = bound_socket(self.host, self.port)
        port = int(listening.getsockname()[1])
        token = given or (own_token() if is_loopback(self.host) else new_token())
        link = f"http://{_shown(self.host)}:{port}/?{urlencode({'token': token})}"
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
