"""A hand on a touch screen that Chromium emulates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

Point = tuple[float, float]


class Hand:
    """Fingers on a page whose context has `has_touch`."""

    def __init__(self, page: Any) -> None:
        self._session = page.context.new_cdp_session(page)

    def move(self, first: Sequence[Point], last: Sequence[Point], steps: int = 5) -> None:
        """Puts fingers down, moves them straight and lifts them."""
        self._send("touchStart", first)
        for n in range(1, steps + 1):
            share = n / steps
            self._send(
                "touchMove",
                [
                    (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]))
                    for a, b in zip(first, last, strict=True)
                ],
            )
        self._send("touchEnd", ())

    def _send(self, kind: str, fingers: Sequence[Point]) -> None:
        points = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(fingers)]
        self._session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
