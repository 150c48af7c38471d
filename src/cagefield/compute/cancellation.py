"""Cancellation of long computations from within: a scope names the check, deep functions call it.

A drag cancels the inpainting or the light that the rendering process computes. These are made of many
functions, none of which has to pass the check on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_check: ContextVar[Callable[[], None] | None] = ContextVar("cancellation_check", default=None)


@contextmanager
def cancellable(proceed: Callable[[], None] | None) -> Iterator[None]:
    """Scope in which `check_cancelled` calls `proceed`, which cancels by raising; None: nothing cancels."""
    token = _check.set(proceed)
    try:
        yield
    finally:
        _check.reset(token)


def check_cancelled() -> None:
    """Raises the cancellation of the scope around the caller, if its result is no longer wanted."""
    proceed = _check.get()
    if proceed is not None:
        proceed()
