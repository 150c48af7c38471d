"""Work that is given up before it is done, because nobody wants it any more."""

from __future__ import annotations

from collections.abc import Callable

Stop = Callable[[], bool]
"""Whether what is being made is not wanted any more."""


class GivenUpError(Exception):
    """What was being made is not wanted any more."""


def giving_up(stop: Stop) -> Callable[[], None]:
    """A `proceed` that gives up what is being made where `stop` says so, by raising GivenUpError."""

    def proceed() -> None:
        if stop():
            raise GivenUpError

    return proceed
