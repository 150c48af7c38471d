"""Work that is given up before it is done, because nobody wants it any more."""

from __future__ import annotations

from collections.abc import Callable

Stop = Callable[[], bool]
"""True once the result under construction is no longer wanted."""


class GivenUpError(Exception):
    """Cancellation: the result under construction is no longer wanted."""


def cancellation_check(stop: Stop) -> Callable[[], None]:
    """A `proceed` callback that raises GivenUpError once `stop` returns True."""

    def proceed() -> None:
        if stop():
            raise GivenUpError

    return proceed
