"""State of a page as the scheduler of its images knows it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from cagefield.server.protocol.common import DrawnHere
from cagefield.server.render_queue.damage import Showing
from cagefield.server.render_worker.refinement import FINAL, Refinement
from cagefield.server.render_worker.view import Display, Region


@dataclass
class PageState:
    """View of a page, its tiles that are to come, and the images and edits that it was sent."""

    width: int = 0
    height: int = 0
    camera: int = -1
    moving: bool = False
    display: Display = field(default_factory=Display)
    unshown: list[int] = field(default_factory=list)
    changed: float = -math.inf
    """When its view changed last."""
    version: int = 0
    """Counts changes of the view."""
    shown_version: int = -1
    """The version that the last picture of the whole view shows."""
    tiles: list[Region] | None = None
    """Tiles of the present version that are still to come; None before they are cut."""
    whole: bool = False
    """Whether those tiles are of the whole view."""
    showing: Showing = field(default_factory=Showing)
    refinement: Refinement = Refinement.DRAFT
    """Refinement of those tiles."""
    attained: Refinement = FINAL
    """Refinement that all of those tiles have that were rendered."""
    tiles_spent: tuple[int, int, float] = (0, 0, 0.0)
    """Number, rays and seconds of the tiles that were rendered."""
    served: float = -math.inf
    draws: DrawnHere = "nothing"
    """Which pictures the page draws itself."""
    edits: tuple[int, Refinement, bool] | None = None
    """Edits that the page was sent last: revision, refinement, and whether they were those of a drag."""
