"""Addresses of schedulers: read from a scheduler file, and tried before dask waits for a reply.

dask tries an address again and again until its time is over, silently, also where nobody listens there.
"""

from __future__ import annotations

import socket
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeoutError
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar
from urllib.parse import urlsplit

from cagefield.errors import CagefieldError
from cagefield.files import json_text
from cagefield.files.safe_open import read_bytes

_Result = TypeVar("_Result")

CONNECTION_NOTICE_SECONDS = 2.0
"""Time without a scheduler before a warning."""
REFUSED_SECONDS = 5.0
"""Time of refused connections after which nobody listens: a scheduler begins in two to three seconds."""
_AGAIN_SECONDS = 0.1


def read_scheduler_file(path: Path) -> str:
    """Address in the scheduler file that `dask scheduler --scheduler-file` writes.

    Raises CagefieldError for a missing file, and for one without an address.
    """
    try:
        address = json_text.loads(read_bytes(path))["address"]
    except FileNotFoundError:
        raise CagefieldError(f"--cluster: there is no scheduler file {path}; give its path") from None
    except OSError as error:
        raise CagefieldError(f"--cluster {path}: {error.strerror or error}; give a scheduler file") from None
    except (ValueError, TypeError, KeyError):
        address = None
    if isinstance(address, str) and address.isprintable() and _host_and_port(address) is not None:
        return address
    raise CagefieldError(
        f"--cluster {path} is no scheduler file with an address; give one that `dask scheduler` wrote"
    )


@contextmanager
def announced_wait(address: str, seconds: float) -> Iterator[None]:
    """Context of a wait for a scheduler; after CONNECTION_NOTICE_SECONDS a warning names address and time."""
    text = f"waiting for a scheduler at {address}, {seconds:.0f} s at most"
    timer = threading.Timer(CONNECTION_NOTICE_SECONDS, warnings.warn, (text,))
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def call_within(seconds: float, make: Callable[[], _Result]) -> _Result:
    """Result of `make`, which runs in a thread of its own.

    Raises its error, or TimeoutError after `seconds`; the thread is then left alone. dask's own limit ends
    before the handshake: something that listens and is silent would be waited for without an end.
    """
    result: Future[_Result] = Future()

    def run() -> None:
        try:
            result.set_result(make())
        except BaseException as error:
            result.set_exception(error)

    threading.Thread(target=run, daemon=True).start()
    try:
        return result.result(seconds)
    except FutureTimeoutError:
        if result.done():
            raise
        raise TimeoutError(f"no reply in {seconds:.0f} s") from None


def wait_for_listener(address: str, seconds: float) -> None:
    """Returns once something listens at `address`, PROTOCOL://HOST:PORT.

    Raises CagefieldError with the reason after REFUSED_SECONDS of failures, such as refused connections or
    a name without a host, and after `seconds` without any reply.
    """
    target = _host_and_port(address)
    if target is None:
        return
    begun = time.monotonic()
    failed_since: float | None = None
    while True:
        left = max(begun + seconds - time.monotonic(), _AGAIN_SECONDS)
        try:
            with socket.create_connection(target, timeout=left):
                return
        except (OSError, UnicodeError) as error:  # UnicodeError of a host whose name cannot be one
            now = time.monotonic()
            failed_since = now if failed_since is None else failed_since
            over = now - begun >= seconds
            if over or (now - failed_since >= REFUSED_SECONDS and not isinstance(error, TimeoutError)):
                reason = "no reply" if isinstance(error, TimeoutError) else _reason(error)
                raise CagefieldError(
                    f"no scheduler listens at {address} ({reason}, {now - begun:.0f} s); "
                    "check the address, or start one with `dask scheduler`"
                ) from None
        time.sleep(_AGAIN_SECONDS)


def _reason(error: OSError | UnicodeError) -> str:
    if isinstance(error, ConnectionRefusedError):
        return "connection refused"
    if isinstance(error, (socket.gaierror, UnicodeError)):
        return "no host of this name is known"
    return error.strerror or type(error).__name__


def _host_and_port(address: str) -> tuple[str, int] | None:
    try:
        parts = urlsplit(address)
        return (parts.hostname, parts.port) if parts.hostname and parts.port else None
    except ValueError:
        return None
