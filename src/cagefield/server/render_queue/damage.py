"""Damage tracking: the part of a page's image that must be rendered anew.

A page draws arriving images over its present one. After a whole picture, its *base*, it shows the base
everywhere,
but where later pictures of parts were drawn; those show other revisions of the edits, the *later* ones. Two
revisions have equal images outside a rectangle. So to show a revision it is enough to render the difference
between the base and that one, and between the base and each of the later ones. At rest the parts drawn
coarsely are drawn anew, too.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from cagefield.cameras.camera import Camera
from cagefield.typing import Array

Rect: TypeAlias = tuple[float, float, float, float]
"""Left, top, right, bottom, as shares of the picture's width and height."""

WHOLE: Rect = (0.0, 0.0, 1.0, 1.0)

Differing: TypeAlias = Callable[[int, int, int], Rect | None]
"""(page, one revision, another) -> where they may differ in the page's picture; None for nowhere."""

MIN_PART_SIDE_PX = 16
"""Least width and height of a part that is rendered, pixels."""

PART_MARGIN_PX = 2.0
"""Margin of a part on each side, pixels: enlarging a coarse image smooths its edge."""


_CORNERS = np.array([[k >> 2, k >> 1 & 1, k & 1] for k in range(8)])
"""[8,3] which of (min, max) each corner of a box has along each axis."""


def everywhere(page: int, one: int, another: int) -> Rect | None:
    """The whole picture."""
    return WHOLE


def union(a: Rect | None, b: Rect | None) -> Rect | None:
    """The rectangle around both."""
    if a is None or b is None:
        return b if a is None else a
    return min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3])


def screen_bounds(camera: Camera, boxes: Array) -> Rect | None:
    """The rectangle in which a camera without distortion sees boxes [B,2,3] (min, max); None for nowhere."""
    found: Rect | None = None
    corners = boxes[:, _CORNERS, [0, 1, 2]] - camera.origin  # [B,8,3]
    inside = (corners.reshape(-1, 3) @ camera.c2w[:3, :3]).reshape(corners.shape)
    depth, sizes = -inside[..., 2], np.abs(inside).max(axis=(1, 2))
    seen = np.flatnonzero((depth > 0.0).any(axis=1))
    if (depth[seen].min(axis=1) <= 1e-6 * sizes[seen]).any():
        return WHOLE
    x = (camera.cx + camera.fx * inside[seen, :, 0] / depth[seen]) / camera.width
    y = (camera.cy - camera.fy * inside[seen, :, 1] / depth[seen]) / camera.height
    sides = np.stack([x.min(axis=1), y.min(axis=1), x.max(axis=1), y.max(axis=1)], axis=1)
    for left, top, right, bottom in sides.tolist():
        if left < 1.0 and right > 0.0 and top < 1.0 and bottom > 0.0:
            found = union(found, (max(left, 0.0), max(top, 0.0), min(right, 1.0), min(bottom, 1.0)))
    return found


def pixels(rect: Rect | None, width: int, height: int) -> tuple[int, int, int, int]:
    """(x, y, width, height) in pixels of a part of a picture that holds a rectangle; of a few for None."""
    spans = []
    for low, high, n in ((0, 2, width), (1, 3, height)):
        a, b = (0.5, 0.5) if rect is None else (rect[low], rect[high])
        # Even, since of distances every other one is sent.
        first = min(
            max(0, 2 * math.floor((a * n - PART_MARGIN_PX) / 2)), max(0, 2 * ((n - MIN_PART_SIDE_PX) // 2))
        )
        last = max(min(n, 2 * math.ceil((b * n + PART_MARGIN_PX) / 2)), min(n, first + MIN_PART_SIDE_PX))
        spans.append((first, last - first))
    return spans[0][0], spans[1][0], spans[0][1], spans[1][1]


def tiles(part: tuple[int, int, int, int], count: float) -> list[tuple[int, int, int, int]]:
    """A part (x, y, width, height) of a picture cut into about `count` tiles, the middle ones first."""
    x, y, width, height = part
    side = math.sqrt(width * height / max(count, 1.0))
    columns, rows = max(1, round(width / side)), max(1, round(height / side))
    xs = [x + 8 * round(width * n / columns / 8) for n in range(columns)] + [x + width]
    ys = [y + 8 * round(height * n / rows / 8) for n in range(rows)] + [y + height]
    found = [
        (x0, y0, x1 - x0, y1 - y0)
        for x0, x1 in itertools.pairwise(xs)
        for y0, y1 in itertools.pairwise(ys)
        if x1 > x0 and y1 > y0
    ]

    def off_center(tile: tuple[int, int, int, int]) -> float:
        dx = (tile[0] + 0.5 * tile[2] - x) / width - 0.5
        dy = (tile[1] + 0.5 * tile[3] - y) / height - 0.5
        return dx * dx + dy * dy

    return sorted(found, key=off_center)


@dataclass
class Showing:
    """Contents of a page: a view (camera and display), the base's revision, and the later ones.

    `coarse` is where it was drawn coarsely since the base.
    """

    view: object = None
    base: int | None = None
    exact: bool = False
    """Whether the base is as fine as it can be."""
    later: set[int] = field(default_factory=set)
    coarse: Rect | None = None
    _differences: dict[int, Rect | None] = field(default_factory=dict)
    """Where the base differs from revisions that were asked about last."""

    def wanting(
        self, page: int, view: object, revision: int, differing: Differing, *, exact: bool = False
    ) -> Rect | None:
        """Where the page must be drawn anew to show a revision in a view; None for nowhere.

        With `exact`, to show it as fine as can be.
        """
        if self.base is None or view != self.view or (exact and not self.exact):
            return WHOLE
        found = self.coarse if exact else None
        known = self._differences
        self._differences = {
            other: known[other] if other in known else differing(page, self.base, other)
            for other in {revision, *self.later} - {self.base}
        }
        for rect in self._differences.values():
            found = union(found, rect)
        return found

    def drawn(
        self,
        view: object,
        revision: int,
        area: Rect,
        *,
        whole: bool,
        all_wanting: bool,
        exact: bool,
        moving: bool = False,
    ) -> None:
        """A picture was drawn in an area: the `whole` one, `all_wanting` (the last part of it), or less.

        `moving`: with as many pixels as the speed allowed.
        """
        if whole:
            self.view, self.base, self.exact, self.later = view, revision, exact, set()
            self.coarse = WHOLE if moving else None
            self._differences = {}
            return
        if view != self.view or self.base is None:
            self.base = None
            return
        if not exact:
            self.coarse = union(self.coarse, area)
        if all_wanting and exact and self.exact:
            self.base, self.later, self.coarse, self._differences = revision, set(), None, {}
        elif all_wanting:
            self.later = {revision} - {self.base}
        else:
            self.later = self.later | ({revision} - {self.base})

    def lost(self) -> None:
        """Mark the page's contents as unknown."""
        self.base = None
