"""The scheduler of pictures, with a clock that the tests turn."""

from __future__ import annotations

import pytest

from cagefield.server.protocol.common import DrawnHere
from cagefield.server.render_queue.damage import WHOLE, Differing, Rect, everywhere
from cagefield.server.render_queue.moving_resolution import (
    MAX_MOVING_SECONDS,
    MOVING_SECONDS,
    MOVING_WIDTH_PX,
)
from cagefield.server.render_queue.requests import EditsRequest, Request
from cagefield.server.render_queue.scheduler import (
    DRAG_SETTLE_SECONDS,
    MAX_TILES,
    MOST_MOVING,
    SETTLE_SECONDS,
    Scheduler,
)
from cagefield.server.render_worker.refinement import FINAL, Refinement
from cagefield.server.render_worker.view import Display

SIDE = 800
RATE = 1e6


class Bench:
    """A scheduler with a renderer of RATE rays a second, and pages that show pictures when told to."""

    def __init__(
        self,
        rate: float = RATE,
        differing: Differing = everywhere,
        least: Refinement = FINAL,
        fixed: float = 0.0,
    ) -> None:
        """`least`: refinement of a draft, as where nothing refines it; `fixed`: seconds before the rays."""
        self.least, self.fixed = least, fixed
        self.scheduler = Scheduler(differing)
        self.now = 0.0
        self.rate = rate
        self.sent: list[Request] = []

    def open(self, page: int, seq: int = 1, side: int = SIDE) -> None:
        self.scheduler.join(page)
        self.camera(page, seq, side=side)

    def open_whole(self) -> None:
        """Opens page 1, until it shows its whole picture."""
        self.open(1)
        self.step()
        self.settle()
        self.finish()

    def camera(self, page: int, seq: int, moving: bool = False, side: int = SIDE) -> None:
        self.scheduler.camera(page, seq, side, side, moving, self.now)

    def render(self, request: Request, overhead: float = 0.0) -> None:
        rays = request.region.width * request.region.height
        seconds = self.fixed + rays / self.rate + overhead
        self.now += seconds
        self.scheduler.finished(request, rays, seconds, overhead, max(self.least, request.refinement))
        self.sent.append(request)

    def show(self, page: int) -> None:
        for request in self.sent:
            if request.page == page:
                self.scheduler.presented(page, request.number)

    def step(self, overhead: float = 0.0) -> Request | None:
        """Renders one picture, if one is owed, and has it shown."""
        request = self.scheduler.next(self.now)
        assert not isinstance(request, EditsRequest)
        if request is not None:
            self.render(request, overhead)
            self.show(request.page)
        return request

    def turn(self, seqs: range) -> int:
        """Width of the last picture while the camera of page 1 moves."""
        width = 0
        for seq in seqs:
            self.camera(1, seq, moving=True)
            request = self.step()
            assert request is not None
            width = request.region.full_width
            self.now += 0.002
        return width

    def edits(self) -> EditsRequest | None:
        """Makes the edits that are owed, if any are, and leaves them unshown."""
        request = self.scheduler.next(self.now)
        if not isinstance(request, EditsRequest):
            return None
        self.scheduler.sent(request, max(self.least, request.refinement))
        return request

    @property
    def is_dragging(self) -> bool:
        return self.scheduler._dragging

    def settle(self) -> None:
        self.now += (DRAG_SETTLE_SECONDS if self.is_dragging else SETTLE_SECONDS) + 1e-3

    def finish(self) -> list[Request]:
        """Everything that is owed, shown as it comes."""
        found = []
        while (request := self.step()) is not None:
            found.append(request)
        return found


def pixels(requests: list[Request]) -> list[tuple[int, int]]:
    return [
        (request.region.x + x, request.region.y + y)
        for request in requests
        for x in range(request.region.width)
        for y in range(request.region.height)
    ]


def test_a_new_page_gets_a_quick_picture_and_then_the_whole_one_in_tiles() -> None:
    b = Bench()
    b.open(1)
    first = b.step()
    assert first is not None and first.moving and first.region.full_width < SIDE
    assert b.step() is None
    b.settle()
    tiles = b.finish()
    assert all(tile.region.full_width == SIDE and not tile.moving for tile in tiles)
    assert [tile.last for tile in tiles] == [False] * (len(tiles) - 1) + [True]
    assert 1 < len(tiles) <= MAX_TILES
    covered = pixels(tiles)
    assert len(covered) == SIDE * SIDE == len(set(covered))
    assert b.scheduler.idle()


def test_the_middle_tile_comes_first() -> None:
    b = Bench()
    b.open(1)
    b.step()
    b.settle()
    tile = b.finish()[0].region
    assert tile.x <= SIDE / 2 <= tile.x + tile.width and tile.y <= SIDE / 2 <= tile.y + tile.height


@pytest.mark.parametrize("rate", [2e5, 1e6, 4e6])
def test_moving_pictures_take_the_time_they_may(rate: float) -> None:
    b = Bench(rate)
    b.open(1)
    seconds, width = 0.0, 0
    for seq in range(2, 60):
        b.camera(1, seq, moving=True)
        began = b.now
        request = b.step()
        assert request is not None
        seconds, width = b.now - began, request.region.full_width
        b.now += 0.002
    # Twice as long where that makes it legible.
    assert seconds <= (MOVING_SECONDS if width > MOVING_WIDTH_PX else MAX_MOVING_SECONDS) * 1.001
    # A step of RESOLUTION_SCALES is at most a factor of 0.78 in the side.
    assert seconds >= 0.5 * MOVING_SECONDS


@pytest.mark.parametrize(("rate", "legible"), [(5e5, False), (1.7e6, True), (3e6, True), (8e6, True)])
def test_moving_pictures_are_legible_where_speed_allows_it(rate: float, legible: bool) -> None:
    b = Bench(rate)
    b.open(1)
    assert (b.turn(range(2, 60)) >= MOVING_WIDTH_PX) == legible


def test_fixed_costs_make_no_picture_small_and_no_view_many_tiles() -> None:
    """Splats: a tenth of a second before the first pixel, then 5 million pixels a second."""
    b = Bench(5e6, fixed=0.1)
    b.open_whole()
    assert (
        b.turn(range(2, 40)) >= 250
    )  # 0.4 of MOVING_SECONDS buys 316 pixels, less a step of RESOLUTION_SCALES
    b.camera(1, 99)
    b.step()
    b.settle()
    assert len(b.finish()) <= 2


def test_time_that_goes_into_the_map_is_taken_off_the_rays() -> None:
    sides = []
    for overhead in (0.0, 0.03):
        b = Bench(1e7)
        b.open(1)
        for seq in range(2, 40):
            b.camera(1, seq, moving=True)
            request = b.step(overhead)
            assert request is not None
        sides.append(request.region.width)
    assert sides[1] < sides[0]


def test_a_fast_renderer_skips_the_small_picture() -> None:
    b = Bench(1e9)
    b.open(1, side=64)
    tile = b.step()
    assert tile is not None and not tile.moving and tile.region.full_width == 64


def test_older_input_is_passed_over() -> None:
    b = Bench()
    b.open(1)
    first = b.scheduler.next(b.now)
    assert first is not None and first.camera == 1
    for seq in range(2, 9):
        b.camera(1, seq, moving=True)
    assert b.scheduler.next(b.now) is None
    b.render(first)
    b.show(1)
    second = b.step()
    assert second is not None and second.camera == 8
    assert b.step() is None


def test_never_more_than_two_pictures_are_on_their_way() -> None:
    b = Bench()
    b.open(1)
    b.finish()
    b.settle()
    while (request := b.scheduler.next(b.now)) is not None:
        b.render(request)
    assert b.scheduler.unshown(1) == 2


def test_while_something_moves_the_next_picture_waits_for_the_one_before() -> None:
    b = Bench()
    b.open(1)
    b.show(1)
    most = 0
    for seq in range(2, 200):
        b.camera(1, seq, moving=True)
        request = b.scheduler.next(b.now)
        if request is not None:
            b.render(request)
        most = max(most, b.scheduler.unshown(1))
        if seq % 17 == 0 and b.sent:
            b.scheduler.presented(1, b.sent[0].number)
            b.sent.pop(0)
        b.now += 0.01
    assert most == 1


def test_a_page_that_shows_nothing_gets_one_and_then_what_is_newest() -> None:
    b = Bench()
    b.open(1)
    for seq in range(2, 10):
        b.camera(1, seq, moving=True)
        request = b.scheduler.next(b.now)
        if request is not None:
            b.render(request)
    assert len(b.sent) == MOST_MOVING
    b.show(1)
    newest = b.step()
    assert newest is not None and newest.camera == 9


def test_a_change_abandons_a_tile_and_starts_over() -> None:
    b = Bench()
    b.open(1)
    b.step()
    b.settle()
    b.step()
    tile = b.scheduler.next(b.now)
    assert tile is not None and not tile.moving
    generation = b.scheduler.generation
    b.camera(1, 2, moving=True)
    assert b.scheduler.generation > generation
    b.scheduler.abandoned(tile, again=True)
    after = b.step()
    assert after is not None and after.moving and after.camera == 2


def test_a_moving_picture_is_not_abandoned() -> None:
    b = Bench()
    b.open(1)
    picture = b.scheduler.next(b.now)
    generation = b.scheduler.generation
    b.camera(1, 2, moving=True)
    assert picture is not None and picture.moving and b.scheduler.generation == generation


def test_a_lost_picture_is_rendered_again_and_an_impossible_one_is_not() -> None:
    b = Bench()
    b.open(1)
    picture = b.scheduler.next(b.now)
    assert picture is not None
    b.scheduler.abandoned(picture, again=True)
    again = b.scheduler.next(b.now)
    assert again is not None and again.moving
    b.scheduler.abandoned(again, again=False)
    assert b.scheduler.next(b.now) is None


def test_a_drag_that_begins_on_a_whole_picture_draws_nothing() -> None:
    b = Bench()
    b.open_whole()
    b.scheduler.edits(0, True, b.now)
    assert b.step() is None
    b.now += 10.0 * DRAG_SETTLE_SECONDS
    assert b.step() is None
    b.scheduler.edits(1, True, b.now)
    picture = b.step()
    assert picture is not None and picture.moving and picture.revision == 1


def test_a_drag_abandons_a_refinement_and_does_not_draw_before_it_moves() -> None:
    b = Bench(least=Refinement.DRAFT)
    b.open(1)
    b.step()
    b.settle()
    tile = b.scheduler.next(b.now)
    assert isinstance(tile, Request) and not tile.moving
    generation = b.scheduler.generation
    b.scheduler.edits(0, True, b.now)
    assert b.scheduler.generation > generation
    b.scheduler.abandoned(tile, again=True)
    b.scheduler.edits(1, True, b.now)
    picture = b.step()
    assert picture is not None and picture.moving and picture.revision == 1


@pytest.mark.parametrize("rate", [3e6, 3e7])
def test_the_first_picture_of_the_first_drag_is_as_small_as_is_legible(rate: float) -> None:
    """Pictures without edits were measured, which cost less."""
    b = Bench(rate)
    b.open_whole()
    widths = []
    for revision in (1, 2, 3, 4):
        b.scheduler.edits(revision, True, b.now)
        picture = b.step()
        assert picture is not None and picture.moving
        widths.append(picture.region.full_width)
    assert widths[0] == MOVING_WIDTH_PX == min(widths)
    assert (max(widths) > MOVING_WIDTH_PX) == (rate > 1e7)


def test_a_slow_hand_is_not_followed_by_whole_pictures() -> None:
    b = Bench(2e7)
    b.open_whole()
    for revision in range(1, 8):
        b.scheduler.edits(revision, True, b.now)
        assert [picture.moving for picture in b.finish()] == [True]
        b.now += 0.6 * DRAG_SETTLE_SECONDS
        assert b.step() is None
    b.now += DRAG_SETTLE_SECONDS
    assert [picture.moving for picture in b.finish()] == [False]


def test_while_a_drag_goes_on_pictures_are_quick_and_tiles_too() -> None:
    b = Bench(least=Refinement.DRAFT)
    b.open(1)
    b.step()
    b.scheduler.edits(1, True, b.now)
    picture = b.step()
    assert picture is not None and picture.moving and picture.revision == 1
    b.settle()
    assert {tile.refinement for tile in b.finish()} == {Refinement.DRAFT}
    b.scheduler.edits(1, False, b.now)
    tiles = b.finish()
    assert not any(tile.moving for tile in tiles) and tiles[-1].last
    assert [tile.refinement for tile in tiles] == sorted(tile.refinement for tile in tiles)
    assert {tile.refinement for tile in tiles} == set(Refinement)


@pytest.mark.parametrize("changed", [(0.313, 0.427, 0.619, 0.773), WHOLE])
def test_tiles_of_a_held_drag_cover_its_coarse_pictures(changed: Rect) -> None:
    bench = Bench(5e5, lambda page, one, another: changed if one != another else None)
    bench.open(1)
    bench.finish()
    bench.settle()
    bench.finish()
    bench.scheduler.edits(1, True, bench.now)
    quick = bench.step()
    assert quick is not None and quick.moving and quick.region.full_width < SIDE
    bench.settle()
    tiles = bench.finish()
    assert tiles and not any(tile.moving for tile in tiles)
    r, size = quick.region, SIDE / quick.region.full_width
    # The quick picture's part in pixels of the whole view: wider than what it shows, by its own large pixels.
    assert min(t.region.x for t in tiles) <= r.x * size
    assert min(t.region.y for t in tiles) <= r.y * size
    assert max(t.region.x + t.region.width for t in tiles) >= (r.x + r.width) * size
    assert max(t.region.y + t.region.height for t in tiles) >= (r.y + r.height) * size


def test_a_drag_that_ends_with_something_new_shows_it_quickly_first() -> None:
    b = Bench()
    b.open(1)
    b.step()
    b.scheduler.edits(1, True, b.now)
    b.step()
    b.scheduler.edits(2, False, b.now)
    picture = b.step()
    assert picture is not None and picture.moving and picture.revision == 2
    # And then nothing has to settle: nothing moves any more.
    assert {tile.moving for tile in b.finish()} == {False}


def test_an_edit_is_shown_on_every_page_and_a_camera_on_its_own() -> None:
    b = Bench()
    b.open(1)
    b.open(2)
    b.settle()
    b.finish()
    b.settle()
    b.finish()
    assert b.scheduler.idle()
    b.scheduler.edits(1, True, b.now)
    assert {b.step().page, b.step().page} == {1, 2}  # type: ignore[union-attr]
    b.settle()
    b.finish()
    b.camera(2, 9, moving=True)
    request = b.step()
    assert request is not None and request.page == 2
    assert b.step() is None


def test_what_moves_goes_before_tiles_of_other_pages() -> None:
    b = Bench()
    b.open(1)
    b.open(2)
    b.finish()
    b.settle()
    b.step()
    b.camera(2, 2, moving=True)
    request = b.step()
    assert request is not None and request.page == 2 and request.moving


def test_another_view_is_another_picture() -> None:
    b = Bench()
    b.open(1)
    b.finish()
    b.scheduler.display(1, Display("depth", True, 0.5), b.now)
    request = b.step()
    assert request is not None and request.display == Display("depth", True, 0.5)
    b.scheduler.display(1, Display("depth", True, 0.5), b.now)
    assert b.step() is None


def test_wake_says_when_the_view_counts_as_at_rest() -> None:
    b = Bench()
    b.open(1)
    b.step()
    wait = b.scheduler.wake(b.now)
    assert wait is not None and 0.0 < wait <= SETTLE_SECONDS
    b.now += wait + 1e-6
    assert b.scheduler.next(b.now) is not None


def test_a_page_that_left_is_not_rendered_for() -> None:
    b = Bench()
    b.open(1)
    request = b.scheduler.next(b.now)
    assert request is not None
    b.scheduler.leave(1)
    b.scheduler.finished(request, 100, 0.1, 0.0, FINAL)
    assert b.scheduler.next(b.now) is None and b.scheduler.wake(b.now) is None


def test_nothing_else_is_done_between_the_pictures_of_a_drag() -> None:
    b = Bench()
    b.open(1)
    b.finish()
    b.settle()
    b.finish()
    assert b.scheduler.idle()
    b.scheduler.edits(1, True, b.now)
    request = b.scheduler.next(b.now)
    assert request is not None
    b.render(request)
    assert b.scheduler.unshown(1) == MOST_MOVING and b.scheduler.next(b.now) is None
    assert not b.scheduler.idle()


def drawing(here: DrawnHere, differing: Differing = everywhere) -> Bench:
    """A page that shows the whole picture, and from then on draws some of its pictures itself."""
    b = Bench(differing=differing)
    b.open_whole()
    b.scheduler.drawing(1, here, b.now)
    return b


def test_a_page_that_draws_gets_the_edits_of_a_drag_one_at_a_time_and_no_pictures() -> None:
    b = drawing("moving")
    first = b.edits()
    assert first is not None and not first.moving
    b.scheduler.presented(1, first.number)
    b.finish()
    b.scheduler.edits(2, True, b.now)
    one = b.edits()
    assert one is not None and (one.revision, one.moving) == (2, True)
    # The page has not shown it yet: newer ones wait, and the older of them are passed over.
    b.scheduler.edits(3, True, b.now)
    b.scheduler.edits(4, True, b.now)
    assert b.scheduler.next(b.now) is None
    b.scheduler.presented(1, one.number)
    two = b.edits()
    assert two is not None and two.revision == 4
    b.scheduler.presented(1, two.number)
    b.settle()
    assert b.scheduler.next(b.now) is None
    # Let go: the edits with their own lattices, then the whole picture, for all of it is the page's own.
    b.scheduler.edits(4, False, b.now)
    last = b.edits()
    assert last is not None and (last.revision, last.moving) == (4, False)
    b.scheduler.presented(1, last.number)
    b.settle()
    tiles = b.finish()
    assert not any(tile.moving for tile in tiles)
    assert len(set(pixels(tiles))) == SIDE * SIDE
    assert b.scheduler.idle()


def test_a_page_that_draws_all_gets_no_picture_until_it_draws_no_more() -> None:
    b = drawing("all")
    edits = b.edits()
    assert edits is not None
    b.scheduler.presented(1, edits.number)
    b.camera(1, 2)
    b.settle()
    assert b.scheduler.next(b.now) is None and b.scheduler.idle()
    b.scheduler.drawing(1, "nothing", b.now)
    first = b.step()
    assert first is not None and first.moving
    b.settle()
    assert b.finish()[-1].last


def test_edits_that_were_lost_are_made_again_and_refused_ones_are_not() -> None:
    b = drawing("all")
    request = b.scheduler.next(b.now)
    assert isinstance(request, EditsRequest)
    b.scheduler.abandoned(request, again=True)
    again = b.edits()
    assert again is not None and again.revision == request.revision
    b.scheduler.presented(1, again.number)
    assert b.scheduler.next(b.now) is None


def nowhere(page: int, one: int, another: int) -> None:
    """Revisions of the edits that all look the same."""


@pytest.mark.parametrize("cancelled", [False, True])
def test_a_drag_that_the_page_drew_leaves_the_whole_picture_to_be_drawn(cancelled: bool) -> None:
    b = drawing("moving", nowhere)
    shown(b)
    b.scheduler.edits(2, True, b.now)
    assert shown(b)
    b.scheduler.edits(0 if cancelled else 2, False, b.now)
    assert shown(b)
    assert len(set(pixels(b.finish()))) == SIDE * SIDE


def test_a_drag_of_cages_alone_needs_no_edits_and_no_pictures() -> None:
    b = drawing("moving", nowhere)
    shown(b)
    b.finish()
    b.scheduler.edits(0, True, b.now)
    b.settle()
    assert b.scheduler.next(b.now) is None
    b.scheduler.edits(0, False, b.now)
    b.settle()
    # A few pixels, which say that this is the picture.
    tiles = b.finish()
    assert tiles[-1].last and len(pixels(tiles)) < 2000


def test_a_view_that_was_another_for_a_moment_is_drawn_anew_where_the_page_drew_it() -> None:
    b = drawing("moving")
    shown(b)
    b.finish()
    for before in (True, False):
        b.scheduler.display(1, Display(before=before), b.now)
    b.settle()
    assert len(set(pixels(b.finish()))) == SIDE * SIDE


def shown(b: Bench) -> bool:
    """Has the page show the edits that it is owed; whether there were any. The view then rests."""
    request = b.edits()
    if request is not None:
        b.scheduler.presented(1, request.number)
    b.settle()
    return request is not None


def refined(b: Bench) -> list[Refinement]:
    """Refinements of the pictures that come at rest, once each."""
    return list(dict.fromkeys(request.refinement for request in b.finish()))


def test_a_picture_is_refined_step_by_step_and_a_camera_does_not_begin_anew() -> None:
    b = Bench(least=Refinement.DRAFT)
    b.open(1)
    b.scheduler.edits(1, False, b.now)
    b.step()
    b.settle()
    assert refined(b) == [*Refinement]
    assert b.scheduler.idle()
    b.camera(1, 2)
    b.step()
    b.settle()
    # Light is known, and does not come and go as the camera turns.
    assert refined(b) == [FINAL]
    b.scheduler.edits(2, False, b.now)
    b.step()
    b.settle()
    assert refined(b) == [*Refinement]


def test_refinements_that_change_nothing_are_passed_over() -> None:
    b = Bench(least=Refinement.INPAINTED)
    b.open(1)
    b.scheduler.edits(1, False, b.now)
    b.step()
    b.settle()
    assert refined(b) == [Refinement.INPAINTED, Refinement.EXACT, FINAL]


def test_a_gesture_cancels_the_refinement() -> None:
    b = Bench(least=Refinement.DRAFT)
    b.open(1)
    b.scheduler.edits(1, False, b.now)
    b.step()
    b.settle()
    while (request := b.scheduler.next(b.now)) is not None and request.refinement < Refinement.EXACT:
        assert not isinstance(request, EditsRequest)
        b.render(request)
        b.show(1)
    generation = b.scheduler.generation
    b.scheduler.edits(2, True, b.now)
    assert b.scheduler.generation > generation
    assert request is not None
    b.scheduler.abandoned(request, again=True)
    picture = b.step()
    assert picture is not None and picture.moving and picture.refinement == Refinement.DRAFT


@pytest.mark.parametrize("here", ["moving", "all"])
def test_a_page_that_draws_gets_the_edits_with_each_refinement(here: DrawnHere) -> None:
    b = Bench(least=Refinement.DRAFT)
    b.open_whole()
    b.scheduler.drawing(1, here, b.now)
    found: list[tuple[str, Refinement]] = []
    b.settle()
    while (request := b.scheduler.next(b.now)) is not None:
        if isinstance(request, EditsRequest):
            b.scheduler.sent(request, request.refinement)
            b.scheduler.presented(1, request.number)
            found.append(("edits", request.refinement))
        else:
            b.render(request)
            b.show(1)
            found.append(("picture", request.refinement))
    edits, pictures = ([r for kind, r in found if kind == which] for which in ("edits", "picture"))
    assert edits == [*Refinement] and b.scheduler.idle()
    # The whole picture does not wait for edits that only the next motion needs.
    assert not pictures if here == "all" else found.index(("picture", FINAL)) < found.index(("edits", FINAL))
