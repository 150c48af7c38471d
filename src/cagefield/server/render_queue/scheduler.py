"""Scheduler of images: the next one, its page and its size. A state machine without clock, web and renderer:
its inputs are events with their times, its output the next image.

- While anything moves (a camera, a drag) pictures of the whole view come at the resolution that the measured
  speed allows; each shows the newest input, older input that no picture showed is passed over.
- At rest the view is rendered at full resolution in tiles, the middle first, and again for each refinement
  that changes it; they are abandoned the moment anything changes.
- Where the camera is the one of the last whole picture, only the part that the edits change is rendered.
- A page is owed a picture only while none of its pictures is on its way; at rest, fewer than two.
- A page that draws itself is owed the edits instead, the newest of a drag, and no images during motion.
"""

from __future__ import annotations

import math

from cagefield.server.protocol.common import DrawnHere
from cagefield.server.render_queue.damage import (
    WHOLE,
    Differing,
    Rect,
    everywhere,
    pixels,
    tiles,
    union,
)
from cagefield.server.render_queue.frame_cost import FrameCost
from cagefield.server.render_queue.moving_resolution import MOVING_SECONDS, moving_scale
from cagefield.server.render_queue.page_state import PageState
from cagefield.server.render_queue.requests import EditsRequest, Request
from cagefield.server.render_worker.refinement import FINAL, Refinement
from cagefield.server.render_worker.view import Display, Region

MOST_UNSHOWN, MOST_MOVING = 2, 1
"""Pictures sent and not yet shown, at most, per page; and while something moves: another one would be older
than it had to be, and would be rendered while the page has the one before to draw."""

TILE_SECONDS = 0.25
"""Time that a tile may take at rest; each costs the page a frame. Abandoned ones end sooner."""

SETTLE_SECONDS = 0.12
"""Time without a change after which the view counts as at rest."""

DRAG_SETTLE_SECONDS = 0.25
"""`SETTLE_SECONDS` during a drag: a slow hand moves on before a whole picture is there."""

MAX_TILES = 9
"""Tiles of a view, at most."""


class Scheduler:
    """See the module. Times are seconds of any one clock."""

    def __init__(self, differing: Differing = everywhere, *, whole_at_rest: bool = False) -> None:
        """`differing` gives the part of a page's image in which two revisions differ.

        Where it may miss a little, all of a picture is drawn anew at rest (`whole_at_rest`).
        """
        self._differing = differing
        self.whole_at_rest = whole_at_rest
        self._pages: dict[int, PageState] = {}
        self._numbers = 0
        self._cost = FrameCost()
        self._overhead = 0.0
        self._dragging = False
        self._is_drag_measured = False
        """Whether a picture of a drag was measured: pictures without edits, before, cost less."""
        self._revision = 0
        self._known = Refinement.DRAFT
        """Last refinement of the revision that was rendered: it costs nothing to have it again."""
        self._running: tuple[Request | EditsRequest, int] | None = None
        self.generation = 0
        """Grows when a tile that is being rendered is no longer wanted."""

    # ---- what happens ----

    def join(self, page: int) -> None:
        """A page is open."""
        self._pages[page] = PageState()

    def leave(self, page: int) -> None:
        """A page is closed."""
        self._pages.pop(page, None)
        if self._running is not None and self._running[0].page == page:
            self.generation += 1

    def camera(self, page: int, seq: int, width: int, height: int, moving: bool, now: float) -> None:
        """A page looks from another camera, or its camera stops."""
        p = self._pages[page]
        if p.camera == seq and (p.width, p.height) == (width, height):
            p.moving = moving
            return
        p.camera, p.width, p.height, p.moving = seq, width, height, moving
        self._changed(page, now)

    def display(self, page: int, display: Display, now: float) -> None:
        """A page shows another view."""
        p = self._pages[page]
        if p.display != display:
            p.display = display
            if p.draws != "nothing":
                p.showing.lost()
            self._changed(page, now)

    def edits(self, revision: int, dragging: bool, now: float) -> None:
        """The edits' picture is another one, or a drag begins or ends.

        Where a drag begins nothing has to be drawn. Where it ends nothing has to settle: the fine picture
        comes as soon as a quick one shows the drag, or at once where that is shown already, or on a fine
        picture.
        """
        if revision == self._revision and dragging == self._dragging:
            return
        let_go, same = self._dragging and not dragging, revision == self._revision
        if not same:
            self._known = Refinement.DRAFT
        self._revision, self._dragging = revision, dragging
        for page, p in self._pages.items():
            was_shown = same and p.shown_version == p.version
            if was_shown and not let_go and p.tiles == [] and self._running is None:
                continue  # a drag begins on a whole picture
            self._changed(page, now)
            if let_go:
                p.changed = -math.inf
            if was_shown or (let_go and p.showing.exact):
                p.shown_version = p.version

    def drawing(self, page: int, here: DrawnHere, now: float) -> None:
        """A page draws pictures itself, or no more; of one that begins nothing is known that it has."""
        p = self._pages[page]
        if p.draws == "nothing" or here == "nothing":
            p.edits = None
        if here != p.draws:
            p.draws = here
            p.showing.lost()
            self._changed(page, now)

    def presented(self, page: int, picture: int) -> None:
        """A page has shown a picture, and all that were sent before it."""
        p = self._pages.get(page)
        if p is not None:
            p.unshown = [number for number in p.unshown if number > picture]

    def finished(
        self, request: Request, rays: int, seconds: float, overhead: float, attained: Refinement
    ) -> None:
        """The picture was rendered and sent; `overhead` of the seconds went into the edits' map.

        `attained` is the last refinement that it has.
        """
        running, self._running = self._running, None
        if request.revision == self._revision:
            self._known = max(self._known, attained)
        region = request.region
        whole = (region.width, region.height) == (region.full_width, region.full_height)
        if request.moving:
            self._cost.add(rays, seconds - overhead)
            self._is_drag_measured |= self._dragging
            self._overhead += 0.5 * (min(overhead, MOVING_SECONDS) - self._overhead)
        page = self._pages.get(request.page)
        if page is not None:
            page.unshown.append(request.number)
            if running is not None and page.version == running[1] and not request.moving:
                page.attained = min(page.attained, attained)
                count, sum_rays, sum_seconds = page.tiles_spent
                page.tiles_spent = count + 1, sum_rays + rays, sum_seconds + seconds - overhead
                if request.last and page.whole:
                    # A single tile may be empty, and says nothing of how long the whole picture takes.
                    count, sum_rays, sum_seconds = page.tiles_spent
                    self._cost.add(sum_rays, sum_seconds, count)
            page.showing.drawn(
                (request.camera, request.display),
                request.revision,
                (
                    region.x / region.full_width,
                    region.y / region.full_height,
                    (region.x + region.width) / region.full_width,
                    (region.y + region.height) / region.full_height,
                ),
                whole=whole or (request.complete and page.whole and not request.moving),
                all_wanting=request.complete,
                exact=attained == FINAL and not request.moving,
                moving=request.moving,
            )

    def sent(self, request: EditsRequest, attained: Refinement) -> None:
        """The edits were made and sent, with a refinement that they have at least."""
        self._running = None
        page = self._pages.get(request.page)
        if page is not None:
            page.unshown.append(request.number)
            if page.edits == (request.revision, request.refinement, request.moving):
                page.edits = request.revision, attained, request.moving

    def abandoned(self, request: Request | EditsRequest, again: bool) -> None:
        """The picture was not rendered: stopped or lost, and is wanted `again`, or not possible at all."""
        running, self._running = self._running, None
        page = self._pages.get(request.page)
        if again and page is not None and isinstance(request, EditsRequest):
            page.edits = None
        if again and page is not None and running is not None and page.version == running[1]:
            page.tiles, page.shown_version = None, -1

    def refresh(self, now: float) -> None:
        """Everything is to be rendered anew."""
        for page, p in self._pages.items():
            p.showing.lost()
            self._changed(page, now)

    # ---- what is next ----

    def next(self, now: float) -> Request | EditsRequest | None:
        """The picture to render, or edits to make, now; None where nothing is owed, or one is under way."""
        if self._running is not None:
            return None
        waiting = sorted(
            (not (self._owes_moving(p) or self._owes_edits(p)), p.served, page)
            for page, p in self._pages.items()
            if p.camera >= 0 and self._has_room(p)
        )
        for _, _, page in waiting:
            request = self._edits(page) if self._owes_edits(self._pages[page]) else self._request(page, now)
            if request is not None:
                self._pages[page].served = now
                self._running = (request, self._pages[page].version)
                return request
        return None

    def wake(self, now: float) -> float | None:
        """Seconds until `next` may have something without anything happening; None: not before."""
        if self._running is not None:
            return None
        waits = [
            p.changed + self._settle_seconds - now
            for p in self._pages.values()
            if p.camera >= 0 and self._owes_tiles(p) and not p.moving and self._has_room(p)
        ]
        return max(0.0, min(waits)) if waits else None

    def remembered(self) -> set[int]:
        """The revisions that `differing` may still be asked about."""
        found = {self._revision}
        if self._running is not None:
            found.add(self._running[0].revision)
        for p in self._pages.values():
            found |= p.showing.later | ({p.showing.base} if p.showing.base is not None else set())
        return found

    def unshown(self, page: int) -> int:
        """How many pictures are on their way to a page."""
        return len(self._pages[page].unshown)

    def idle(self) -> bool:
        """True where nothing moves, and no page waits for a picture or can be sent one.

        Background tasks and jobs pause during drags.
        """
        return (self._running is None and not self._dragging) and all(
            p.camera < 0
            or (not p.moving and (not (self._owes_tiles(p) or self._owes_edits(p)) or not self._has_room(p)))
            for p in self._pages.values()
        )

    # ---- inside ----

    @property
    def _settle_seconds(self) -> float:
        return DRAG_SETTLE_SECONDS if self._dragging else SETTLE_SECONDS

    def _changed(self, page: int, now: float) -> None:
        p = self._pages[page]
        p.changed = now
        p.version += 1
        p.tiles = None
        if self._running is not None and not self._running[0].moving and self._running[0].page == page:
            self.generation += 1

    def _has_room(self, p: PageState) -> bool:
        return len(p.unshown) < (MOST_MOVING if p.moving or self._dragging else MOST_UNSHOWN)

    def _owes_moving(self, p: PageState) -> bool:
        return p.shown_version != p.version

    def _owes_edits(self, p: PageState) -> bool:
        if p.draws == "nothing":
            return False
        if p.edits is None or p.edits[0] != self._revision:
            return True
        if self._dragging or p.edits[2]:
            return not self._dragging
        if p.edits[1] == FINAL:
            return False
        return p.draws == "all" or not self._owes_tiles(p)

    def _owes_tiles(self, p: PageState) -> bool:
        """Whether tiles are still to come, or to be cut: of this refinement or the next."""
        if p.draws == "all":
            return p.tiles is None
        return p.tiles != [] or (p.attained < FINAL and not self._dragging)

    def _edits(self, page: int) -> EditsRequest:
        p = self._pages[page]
        before = p.edits
        refinement = Refinement.DRAFT
        if before is not None and before[0] == self._revision:
            refinement = Refinement(min(before[1] + 1, FINAL))
        p.edits = self._revision, refinement, self._dragging
        # The page draws them over what it shows.
        p.showing.lost()
        self._numbers += 1
        return EditsRequest(self._numbers, page, self._revision, refinement, self._dragging)

    def _request(self, page: int, now: float) -> Request | None:
        p = self._pages[page]
        if p.draws != "nothing":
            p.shown_version = p.version
            if p.draws == "all":
                p.tiles = []
            if p.draws == "all" or p.moving or self._dragging:
                return None
        elif self._owes_moving(p):
            rect = p.showing.wanting(page, (p.camera, p.display), self._revision, self._differing)
            scale = self._scale(p, rect)
            p.shown_version = p.version
            if scale < 1.0 or p.moving or self._dragging:
                return self._picture(page, scale, rect)
            self._cut(page, self._known)
        if p.tiles is None:
            if p.moving or now - p.changed < self._settle_seconds:
                return None
            self._cut(page, self._known)
        elif not p.tiles and p.attained < FINAL and not self._dragging:
            self._cut(page, Refinement(p.attained + 1))
        if not p.tiles:
            return None
        region = p.tiles.pop(0)
        last = not p.tiles
        return self._ask(page, region, p.refinement, moving=False, last=last, complete=last)

    def _picture(self, page: int, scale: float, rect: Rect | None) -> Request:
        p = self._pages[page]
        width, height = (max(16, 2 * round(n * scale / 2)) for n in (p.width, p.height))
        region = Region(*pixels(rect, width, height), width, height)
        return self._ask(page, region, Refinement.DRAFT, moving=True, last=False, complete=True)

    def _ask(
        self, page: int, region: Region, refinement: Refinement, *, moving: bool, last: bool, complete: bool
    ) -> Request:
        p = self._pages[page]
        self._numbers += 1
        return Request(
            self._numbers,
            page,
            p.camera,
            self._revision,
            p.display,
            region,
            moving,
            refinement,
            last,
            complete,
        )

    def _scale(self, p: PageState, rect: Rect | None) -> float:
        part = pixels(rect, p.width, p.height)[2:]
        is_first_drag = self._dragging and not self._is_drag_measured
        return moving_scale(self._cost, self._overhead, part, (p.width, p.height), is_first_drag)

    def _cut(self, page: int, refinement: Refinement) -> None:
        """Divide the damaged part of the view into tiles of about TILE_SECONDS."""
        p = self._pages[page]
        exact = not self._dragging
        view = p.camera, p.display
        rect = p.showing.wanting(page, view, self._revision, self._differing, exact=exact)
        if exact and self.whole_at_rest and rect is not None:
            rect = WHOLE
        elif not exact:
            # Parts of coarse pictures are larger, by their pixels, than what they had to show.
            rect = union(rect, p.showing.coarse)
        part = pixels(rect, p.width, p.height)
        p.whole = part == (0, 0, p.width, p.height)
        count = min(
            max(1.0, part[2] * part[3] / self._cost.rays(TILE_SECONDS, 0.4 * TILE_SECONDS)), MAX_TILES
        )
        p.tiles = [Region(*tile, p.width, p.height) for tile in tiles(part, count)]
        p.refinement, p.attained, p.tiles_spent = refinement, FINAL, (0, 0, 0.0)
