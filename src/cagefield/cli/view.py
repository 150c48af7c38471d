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
from cagefield.files.safe_open import read_bytes


@dataclass(frozen=True)
class View:
    """Edit a scene by hand, in the browser: set cages, move them, and the field follows."""

    scene: tyro.conf.Positional[Path]
    """Scene folder, or a file of splats: .ply, .compressed.ply, .spz, .sog, .splat, .ksplat, .glb, .gltf."""
    port: int = 8741
    """Port to listen on; 0 takes any that is free."""
    host: str = "localhost"
    """Address to listen on; pages need the token in the printed link, wherever they are."""
    token: str | None = None
    """Token that a page must know; left out, --token-file, $CAGEFIELD_TOKEN, or one of this user's own."""
    token_file: Path | None = None
    """File that holds the token: no list of processes shows it."""
    read_only_link: Flag = False
    """Print a second link too, whose holders may look but not change anything."""
    certificate: Path | None = None
    """PEM file of a certificate, its chain included: pages are served over TLS (https)."""
    certificate_key: Path | None = None
    """PEM file of its key; left out, it is in the certificate's file."""
    root: Path | None = None
    """Folder that pages may save and render into; left out, the one that the scene is in."""
    no_browser: Flag = False
    """Print the link, but do not open it."""
    device: Device = "auto"

    def run(self) -> None:
        """Serves until Ctrl+C."""
        if not 0 <= self.port <= 65535:
            raise CagefieldError(f"--port is {self.port}; give a number from 0 to 65535")
        given = self._given_token()
        if self.certificate is None and self.certificate_key is not None:
            raise CagefieldError("--certificate-key is the key of a --certificate; give that too")
        if self.root is not None and not self.root.is_dir():
            raise CagefieldError(f"--root {self.root} is no folder; give one that pages may save into")
        from cagefield.server.web.launch import Certificate, bound_socket, open_scene, serve
        from cagefield.server.web.security import Guard, is_loopback, new_token, own_token

        certificate = None
        if self.certificate is not None:
            certificate = Certificate(self.certificate, self.certificate_key)
        coordinator, hello = open_scene(self.scene, self.device, self.root)
        listening = bound_socket(self.host, self.port)
        port = int(listening.getsockname()[1])
        own = is_loopback(self.host)
        token = given or (own_token() if own else new_token())
        look_token = (own_token("look") if own else new_token()) if self.read_only_link else None
        place = f"{'http' if certificate is None else 'https'}://{_shown(self.host)}:{port}/"
        link = f"{place}?{urlencode({'token': token})}"
        print(f"editing {self.scene}: open {link}  (Ctrl+C ends)", flush=True)
        if look_token is not None:
            print(f"to look only: {place}?{urlencode({'token': look_token})}", flush=True)
        if not self.no_browser:
            webbrowser.open(link)
        serve(coordinator, hello, Guard(self.host, port, token, look_token), listening, certificate)

    def _given_token(self) -> str | None:
        """The token of the command line, of a file or of the environment; None for none.

        Raises CagefieldError for one that keeps nobody out, and for a file that cannot be read.
        """
        if self.token and self.token_file:
            raise CagefieldError("--token and --token-file exclude each other; give one of them")
        what, given = "--token", self.token
        if self.token_file is not None:
            what = f"--token-file {self.token_file}"
            given = read_bytes(self.token_file, 4096).decode("ascii", "replace").strip()
        elif not given:
            what, given = "$CAGEFIELD_TOKEN", os.environ.get("CAGEFIELD_TOKEN") or None
        if given is None or (not given and self.token_file is None):
            return None
        if len(given) < 8 or not given.isascii() or not given.isprintable():
            raise CagefieldError(
                f"{what} is too short to keep anybody out; give 8 characters of ASCII or more"
            )
        return given


def _shown(host: str) -> str:
    """The host as it stands in a link."""
    if host in ("0.0.0.0", "::", ""):
        import socket

        return socket.gethostname()
    return f"[{host}]" if ":" in host else host
