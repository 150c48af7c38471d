"""Resolution of the pictures that are shown while something moves, by their measured cost."""

from __future__ import annotations

import math

from cagefield.server.render_queue.frame_cost import FrameCost

MOVING_SECONDS = 0.05
"""Time that a picture may take while something moves."""

MOVING_WIDTH_PX, MAX_MOVING_SECONDS = 400, 0.1
"""Width that it has if that takes at most so long: smaller ones are too blurred to judge an edit by."""

MIN_SIDE_PX = 80
"""Shorter side of the smallest moving picture, pixels."""

RESOLUTION_SCALES = (1.0, 0.8, 0.65, 0.5, 0.4, 0.32, 0.25, 0.2, 0.16, 0.125)
"""Resolutions of moving pictures as shares of the full one: a few, since each has its own ray directions."""


def moving_scale(
    cost: FrameCost,
    overhead: float,
    part: tuple[int, int],
    size: tuple[int, int],
    is_first_drag: bool,
) -> float:
    """Scale of a moving picture as a share of the full resolution.

    part: (width, height) that is drawn anew, of a picture of the full `size`, pixels; overhead: seconds for
    the map of the edits. In the first drag no picture of an edit has been measured: those before cost less.
    """
    wanted, longest = (
        math.sqrt(cost.rays(seconds - overhead, 0.4 * MOVING_SECONDS) / (part[0] * part[1]))
        for seconds in (MOVING_SECONDS, MAX_MOVING_SECONDS)
    )
    legible = MOVING_WIDTH_PX / size[0]
    if wanted < legible:
        wanted = min(legible, longest)
    elif is_first_drag:
        wanted = legible
    least = min(1.0, MIN_SIDE_PX / min(size))
    if legible <= wanted < RESOLUTION_SCALES[0]:
        least = max(least, legible)
    return max(next((s for s in RESOLUTION_SCALES if s <= wanted), RESOLUTION_SCALES[-1]), least)
