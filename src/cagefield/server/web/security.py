"""Who may talk to the editor: checks of Host, Origin and token, and a limit on how much a page may say.

Pages of other sites can make a browser send requests here, with any path and with our cookies. They cannot
choose `Origin`; a name of theirs that resolves to this machine (DNS rebinding) shows in `Host`. Both must be
ours. Other programs can send any header, and other users of this machine reach every port: all need the token
that is in the printed link. Other machines reach the server only where it was told to listen to them.
"""

from __future__ import annotations

import hmac
import ipaddress
import os
import secrets
import socket
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal
from urllib.parse import urlsplit

from cagefield.files.safe_open import UnreadableError, read_bytes
from cagefield.files.user_cache import cache_root

_LEAST = 32
"""Characters of a token that is taken from a file of ours: those nobody guesses."""

_MOST = 256
"""Of them at most: ours have as many as are needed, and nothing else is one of ours."""

Role = Literal["edit", "look"]
"""Permission of a token."""

LOOPBACK = ("localhost", "127.0.0.1", "::1")


def new_token() -> str:
    """A token that nobody guesses."""
    return secrets.token_urlsafe(24)


def own_token(role: Role = "edit") -> str:
    """The token of this user's editors on this machine: made once, and kept where no other user reads it.

    Pages that are open come again by themselves when an editor is started again. A new one each time where
    it cannot be kept.
    """
    folder = cache_root()
    file = folder / ("token" if role == "edit" else "token-to-look")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        try:
            handle = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        except FileExistsError:
            pass
        else:
            with os.fdopen(handle, "w", encoding="ascii") as out:
                out.write(new_token())
        status = file.stat()
        try:
            kept = read_bytes(file, 4096).decode("ascii", "replace").strip()
        except UnreadableError:  # too long: no token of ours
            kept = ""
        private = os.name != "posix" or (status.st_uid == os.getuid() and not status.st_mode & 0o077)
        if private and _LEAST <= len(kept) <= _MOST and kept.isascii() and kept.isprintable():
            return kept
        file.unlink()  # read by others, cut off or damaged: the next editor makes another
    except (OSError, ValueError):
        pass
    return new_token()


def is_loopback(host: str) -> bool:
    """True for names and addresses of this machine that no other machine reaches."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


@dataclass(frozen=True)
class Guard:
    """Checks of every request. `token` None admits every request that passes the other checks.

    Who has `look_token` in its place may look but not change anything.
    """

    host: str
    port: int
    token: str | None = None
    look_token: str | None = None

    @property
    def cookie(self) -> str:
        """The name of the cookie that holds the token; browsers share cookies between ports."""
        return f"cagefield_{self.port}"

    def refusal(
        self,
        headers: Mapping[str, str],
        cookies: Mapping[str, str],
        query: Mapping[str, str],
        *,
        needs_origin: bool,
        has_data: bool = True,
    ) -> str | None:
        """Reason for refusing a request, in one line, or None. Headers have lower-case names.

        A socket must say its origin; other requests may, and then it must be ours too. Answers with
        data of the scene (`has_data`) are refused to other sites, which browsers name in Sec-Fetch-Site,
        also as
        images.
        """
        host = headers.get("host", "")
        if not self._is_ours(host):
            return f"this editor does not answer to {host!r}; open the link that `cagefield view` printed"
        origin = headers.get("origin")
        if (origin is not None or needs_origin) and not _same_origin(origin, host):
            return f"the page at {origin!r} may not talk to this editor; open the link that was printed"
        if has_data and headers.get("sec-fetch-site", "none") not in ("same-origin", "none"):
            return "another site's page asked for this; open the link that `cagefield view` printed"
        if self.role(self.given(headers, cookies, query)) is None:
            return (
                "the token is missing or wrong; open the link that `cagefield view` printed, ?token= included"
            )
        return None

    def given(self, headers: Mapping[str, str], cookies: Mapping[str, str], query: Mapping[str, str]) -> str:
        """The token that a request has, "" for none."""
        bearer = headers.get("authorization", "").removeprefix("Bearer ")
        return query.get("token") or cookies.get(self.cookie) or bearer

    def role(self, given: str) -> Role | None:
        """Permission of a token's holder; None for a wrong token."""
        if self.token is None or hmac.compare_digest(given.encode(), self.token.encode()):
            return "edit"
        if self.look_token is not None and hmac.compare_digest(given.encode(), self.look_token.encode()):
            return "look"
        return None

    @property
    def can_be_guessed(self) -> bool:
        """Whether a token is so short that it must not be tried often."""
        return any(token is not None and len(token) < _LEAST for token in (self.token, self.look_token))

    def _is_ours(self, host: str) -> bool:
        try:
            parts = urlsplit(f"//{host}")
            name, port = parts.hostname, parts.port
        except ValueError:
            return False
        if name is None or (port is not None and port != self.port):
            return False
        if is_loopback(self.host):
            return is_loopback(name)
        return name in (*LOOPBACK, self.host.lower(), socket.gethostname().lower()) or _is_address(name)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _same_origin(origin: str | None, host: str) -> bool:
    if not origin:
        return False
    try:
        parts = urlsplit(origin)
    except ValueError:
        return False
    return parts.scheme in ("http", "https") and parts.netloc.lower() == host.lower()


@dataclass
class Allowance:
    """A bucket that fills at `rate` messages a second up to `burst`; every message takes one out."""

    rate: float = 400.0
    burst: float = 800.0
    level: float = 800.0
    last: float | None = None

    def take(self, now: float, amount: float = 1.0) -> bool:
        """True where one more message, or that much of it, may be heard now, in seconds of any clock."""
        if self.last is not None:
            self.level = min(self.burst, self.level + self.rate * (now - self.last))
        self.last = now
        if self.level < amount:
            return False
        self.level -= amount
        return True


class Attempts:
    """Wrong tokens by address: a few at once, then one in five seconds."""

    MOST_ADDRESSES = 10_000

    def __init__(self) -> None:
        self._buckets: dict[str, Allowance] = {}

    def wrong(self, address: str, now: float) -> bool:
        """One wrong token; False where there were too many."""
        while len(self._buckets) >= self.MOST_ADDRESSES and address not in self._buckets:
            self._buckets.pop(next(iter(self._buckets)))
        return self._buckets.setdefault(address, Allowance(0.2, 20.0, 20.0)).take(now)

    def is_locked(self, address: str, now: float) -> bool:
        """Whether tokens of this address are not looked at for now."""
        bucket = self._buckets.get(address)
        if bucket is None:
            return False
        bucket.take(now, 0.0)  # it fills meanwhile
        return bucket.level < 1.0
