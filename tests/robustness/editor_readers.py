"""Files that an editor reads beside its scene: tokens, locks, certificates.

Honest seeds, and how they are read.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from unittest import mock

from reader_seeds import Reader, written

from cagefield.cli.view import View
from cagefield.errors import CagefieldError
from cagefield.server.editor.scene_lock import SceneLock
from cagefield.server.web.launch import Certificate
from cagefield.server.web.security import Guard, new_token, own_token


def _make_token(folder: Path) -> None:
    (folder / "cagefield").mkdir()
    (folder / "cagefield" / "token").touch(0o600)
    (folder / "cagefield" / "token").write_text("A" * 32)


def _read_token(folder: Path) -> None:
    """The user's own; another one is made where it is damaged."""
    (folder / "cagefield" / "token").chmod(0o600)
    before = (folder / "cagefield" / "token").read_bytes()
    with mock.patch.dict(os.environ, XDG_CACHE_HOME=str(folder)):
        token = own_token()
    assert len(token) >= 16 and token.isascii() and token.isprintable(), "a token that stands in no link"
    Guard("localhost", 8741, token, None)
    if token.encode() != before.strip():
        raise CagefieldError("it is damaged: another one is made")


def _read_token_file(folder: Path) -> None:
    token = View(folder, token_file=folder / "token")._given_token()
    assert token is not None and len(token) >= 8 and token.isascii() and token.isprintable()
    Guard("localhost", 8741, token, None)


def _make_lock(folder: Path) -> None:
    (folder / ".scene.cagefield-lock").write_bytes(b"%d" % os.getpid())


def _read_lock(folder: Path) -> None:
    """Held by somebody else, who is named; then free."""
    import fcntl

    if not (folder / ".scene.cagefield-lock").exists():  # it went when it was released
        _make_lock(folder)
    handle = os.open(folder / ".scene.cagefield-lock", os.O_RDWR)
    fcntl.flock(handle, fcntl.LOCK_EX)
    try:
        SceneLock(folder / "scene")
    except CagefieldError as error:
        said = str(error)
    finally:
        os.close(handle)
    assert said.isprintable(), "a terminal would do what stands in the file"
    SceneLock(folder / "scene").release()
    if "(process " not in said:
        raise CagefieldError("nobody is named")


_made: dict[str, bytes] = {}


def _make_certificate(folder: Path) -> None:
    """One of localhost's with its key, made once by openssl."""
    if not _made:
        if shutil.which("openssl") is None:
            raise RuntimeError("certificates are made by openssl, which is not here")
        subject = ["-subj", "/CN=localhost", "-keyout", str(folder / "k.pem"), "-out", str(folder / "c.pem")]
        command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", *subject]
        subprocess.run(command, check=True, capture_output=True)
        _made.update({name: (folder / name).read_bytes() for name in ("c.pem", "k.pem")})
    for name, content in _made.items():
        (folder / name).write_bytes(content)


EDITOR_READERS: dict[str, Reader] = {
    "token": Reader(_make_token, _read_token, {"cagefield/token": "small text"}),
    "token file": Reader(
        written("token", lambda file: file.write_text(new_token() + "\n")),
        _read_token_file,
        {"token": "small text"},
    ),
    "lock": Reader(_make_lock, _read_lock, {".scene.cagefield-lock": "small text"}),
    "certificate": Reader(
        _make_certificate,
        lambda folder: Certificate(folder / "c.pem", folder / "k.pem") and None,
        {"c.pem": "text", "k.pem": "text"},
    ),
}
