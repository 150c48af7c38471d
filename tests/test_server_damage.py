"""Which part of a page's picture is rendered anew, and that it is enough."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.completion.lighting.ambient_occlusion import LightModel, occlusion_radii
from cagefield.completion.patch_stages import PatchStage
from cagefield.compute import devices
from cagefield.edits import Edit, EditStack
from cagefield.geometry.cage import Cage
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from cagefield.scene.scene import Scene
from cagefield.server.render_queue.damage import WHOLE, Rect, Showing, pixels, screen_bounds, tiles, union
from cagefield.server.render_queue.patch_extent import PatchExtent
from cagefield.server.render_queue.requests import Request
from cagefield.server.render_queue.scheduler import SETTLE_SECONDS, Scheduler
from cagefield.server.render_worker.refinement import FINAL
from cagefield.server.render_worker.renderer_cache import RendererCache
from cagefield.server.render_worker.tasks import PictureDone, PictureTask, Shown, Stopped, values_of
from cagefield.server.render_worker.view import Display, Region
from scenes import ball_field, ball_scene
from sent_pictures import pixels_of
from tiers import nightly_after_first, nightly_except

SIDE = 64
CAMERA = Camera.look_at((0.6, -3.4, 0.9), (0, 0, 0), width=SIDE, height=SIDE, fov_x=0.8)
PART = Edit.continuous(Cage.box((0.5, 0, 0.2), 0.4), Cage.box((0.5, 0, 0.2), 0.9), lattice=24)
OTHER = Edit.continuous(Cage.box((-0.2, 0, 0.2), 0.5), Cage.box((-0.2, 0, 0.2), 1.1), lattice=24).rotate(
    (0, 0, 0.5)
)
COPY = Edit.copy(Cage.box((0.4, 0, 0), 0.5)).translate((-0.6, 0, 0.6))


# ---- rectangles ----


def test_boxes_are_seen_within_their_rectangle() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        low = rng.uniform(-1, 0.5, (2, 3))
        boxes = np.stack([low, low + rng.uniform(0.1, 0.8, (2, 3))], axis=1)
        rect = screen_bounds(CAMERA, boxes)
        assert rect is not None
        p = rng.uniform(boxes[:, :1], boxes[:, 1:], (2, 400, 3)).reshape(-1, 3)
        at = CAMERA.project(p)[0] / SIDE
        inside = ((at >= 0) & (at <= 1)).all(axis=1)
        assert (at[inside] >= np.array(rect[:2]) - 1e-9).all() and (
            at[inside] <= np.array(rect[2:]) + 1e-9
        ).all()
        # As small as the boxes' corners allow.
        corners = np.array([[x, y, z] for b in boxes for x in b[:, 0] for y in b[:, 1] for z in b[:, 2]])
        at = CAMERA.project(corners)[0] / SIDE
        expected = (*np.clip(at.min(axis=0), 0, 1), *np.clip(at.max(axis=0), 0, 1))
        assert rect == pytest.approx(expected)


def test_boxes_beside_and_behind_a_camera_are_not_seen_and_around_it_everywhere() -> None:
    eye = CAMERA.origin
    behind = eye - 3.0 * (np.zeros(3) - eye)
    assert screen_bounds(CAMERA, np.array([[behind - 0.1, behind + 0.1]])) is None
    assert screen_bounds(CAMERA, np.array([[[40.0, 0, 0], [40.5, 1, 1]]])) is None
    assert screen_bounds(CAMERA, np.array([[eye - 0.1, eye + 0.1]])) == WHOLE
    assert screen_bounds(CAMERA, np.zeros((0, 2, 3))) is None


@pytest.mark.parametrize(
    "rect", [None, WHOLE, (0.3, 0.0, 0.31, 0.2), (0.95, 0.95, 1.0, 1.0), (0.2, 0.3, 0.6, 0.9)]
)
def test_pixels_hold_the_rectangle_and_tiles_are_all_of_them(rect: Rect | None) -> None:
    for width, height in ((200, 120), (754, 532), (10, 12)):
        x, y, w, h = pixels(rect, width, height)
        assert x >= 0 and y >= 0 and x + w <= width and y + h <= height and w > 0 and h > 0
        if rect is not None:
            assert x <= rect[0] * width and x + w >= rect[2] * width
            assert y <= rect[1] * height and y + h >= rect[3] * height
        count = np.zeros((height, width), int)
        for tile in tiles((x, y, w, h), 7):
            count[tile[1] : tile[1] + tile[3], tile[0] : tile[0] + tile[2]] += 1
        assert count[y : y + h, x : x + w].min() == 1 == count.max() and count.sum() == w * h


# ---- what a page shows: a canvas of numbers ----


class Played:
    """A page's canvas. Revision r shows r in its own rectangle, and 0 elsewhere."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.rects: dict[int, Rect] = {}
        self.canvas = np.full((SIDE, SIDE), -1)
        self.fine = np.zeros((SIDE, SIDE), bool)
        self.showing = Showing()
        self.view = "first"
        self.revision = 0

    def picture(self, revision: int) -> np.ndarray[Any, Any]:
        found = np.full((SIDE, SIDE), 1000 if self.view == "first" else 2000)
        x, y, w, h = self.exactly(self.rects.get(revision))
        found[y : y + h, x : x + w] += revision
        return found

    def exactly(self, rect: Rect | None) -> tuple[int, int, int, int]:
        if rect is None:
            return 0, 0, 0, 0
        x, y, right, bottom = (round(SIDE * value) for value in rect)
        return x, y, right - x, bottom - y

    def differing(self, page: int, one: int, another: int) -> Rect | None:
        return union(self.rects.get(one), self.rects.get(another))

    def edit(self) -> None:
        self.revision += 1
        low = self.rng.integers(0, SIDE - 8, 2) / SIDE
        high = low + self.rng.integers(1, 9, 2) / SIDE
        self.rects[self.revision] = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))

    def paint(self, part: tuple[int, int, int, int], fine: bool) -> Rect:
        """The area painted with the revision as it is."""
        x, y, w, h = part
        self.canvas[y : y + h, x : x + w] = self.picture(self.revision)[y : y + h, x : x + w]
        self.fine[y : y + h, x : x + w] = fine
        return x / SIDE, y / SIDE, (x + w) / SIDE, (y + h) / SIDE


EVENTS = {"edit": 0.4, "moving": 0.35, "rest": 0.1, "broken off": 0.11, "view": 0.02, "lost": 0.02}


@pytest.mark.parametrize("seed", range(20))
def test_a_page_shows_what_it_should_once_what_it_wants_is_drawn(seed: int) -> None:
    played = Played(seed)
    parts = 0
    for _ in range(300):
        event = played.rng.choice(list(EVENTS), p=list(EVENTS.values()))
        if event == "edit":
            played.edit()
            continue
        if event == "view":
            played.view = "second" if played.view == "first" else "first"
            continue
        if event == "lost":
            played.canvas[:] = -1
            played.showing.lost()
            continue
        view, showing = played.view, played.showing
        exact = event != "moving"
        rect = showing.wanting(1, view, played.revision, played.differing, exact=exact)
        # Moving pictures have fewer pixels, and a part's edges lie further out then.
        coarseness = 1 if exact else int(played.rng.choice([1, 2, 4]))
        x, y, w, h = (coarseness * n for n in pixels(rect, SIDE // coarseness, SIDE // coarseness))
        part = x, y, w, h
        whole = part == (0, 0, SIDE, SIDE)
        parts += not whole
        pieces = tiles(part, 4) if exact else [part]
        if event == "broken off":
            pieces = pieces[: len(pieces) // 2]
            for piece in pieces:
                area = played.paint(piece, exact)
                showing.drawn(view, played.revision, area, whole=False, all_wanting=False, exact=exact)
            continue
        for number, piece in enumerate(pieces, start=1):
            area = played.paint(piece, exact)
            last = number == len(pieces)
            showing.drawn(view, played.revision, area, whole=whole and last, all_wanting=last, exact=exact)
        assert np.array_equal(played.canvas, played.picture(played.revision))
        assert played.fine.all() or not exact
    assert parts > 20


# ---- the scheduler ----


class Bench:
    """A scheduler whose page shows what it is sent at once, with edits that change an eighth of its view."""

    def __init__(self) -> None:
        self.scheduler = Scheduler(lambda page, one, another: (0.25, 0.5, 0.5, 1.0))
        self.now = 0.0
        self.scheduler.join(1)
        self.display(1)

    def display(self, seq: int) -> None:
        self.scheduler.camera(1, seq, 800, 800, False, self.now)

    def all(self) -> list[Request]:
        found = []
        for _ in range(2):
            while (request := self.scheduler.next(self.now)) is not None:
                self.now += 0.02
                rays = request.region.width * request.region.height
                self.scheduler.finished(request, rays, rays / 1e6, 0.0, FINAL)
                self.scheduler.presented(1, request.number)
                found.append(request)
            self.now += SETTLE_SECONDS + 1e-3
        return found


def share(requests: list[Request]) -> float:
    """The share of the view that the requests cover."""
    return sum(
        r.region.width * r.region.height / (r.region.full_width * r.region.full_height) for r in requests
    )


def test_a_drag_renders_the_part_that_it_changes_and_rest_too() -> None:
    bench = Bench()
    assert share(bench.all()[1:]) == pytest.approx(1.0)
    bench.scheduler.edits(1, True, bench.now)
    moving = bench.all()
    assert moving[0].moving and 0.125 <= share(moving[:1]) < 0.16
    bench.scheduler.edits(2, True, bench.now)
    bench.scheduler.edits(2, False, bench.now)
    rest = [request for request in bench.all() if not request.moving]
    assert 0.125 <= share(rest) < 0.14 and rest[-1].last
    assert bench.scheduler.idle()
    # A part has more pixels than it would have in a picture of everything.
    assert moving[0].region.full_width > 1.2 * Bench().all()[0].region.full_width


@pytest.mark.parametrize("what", ["camera", "display", "renderer lost"])
def test_another_view_is_rendered_as_a_whole(what: str) -> None:
    bench = Bench()
    bench.all()
    bench.scheduler.edits(1, True, bench.now)
    bench.all()
    if what == "camera":
        bench.display(2)
    elif what == "display":
        bench.scheduler.display(1, Display("depth"), bench.now)
    else:
        bench.scheduler.refresh(bench.now)
    assert share(bench.all()[:1]) == 1.0
    bench.scheduler.edits(2, True, bench.now)
    assert share(bench.all()[:1]) < 0.16


def test_revisions_that_a_page_may_show_are_remembered() -> None:
    bench = Bench()
    bench.all()
    bench.scheduler.edits(1, True, bench.now)
    request = bench.scheduler.next(bench.now)
    assert request is not None and request.revision == 1
    for revision in (2, 3):
        bench.scheduler.edits(revision, True, bench.now)
        assert bench.scheduler.remembered() == {0, 1, revision}
    bench.scheduler.finished(request, 1000, 0.01, 0.0, FINAL)
    assert bench.scheduler.remembered() == {0, 1, 3}


# ---- pictures ----


@pytest.fixture(scope="module")
def renderers() -> RendererCache:
    devices.start()
    return RendererCache(ball_scene())


STACKS = {
    "continuous": ((PART,), (PART.translate((0.1, 0, 0.05)),)),
    "under another": ((PART, OTHER), (PART.translate((0.1, 0, 0.05)), OTHER)),
    "over another": ((OTHER, PART), (OTHER, PART.translate((0.1, 0, 0.05)))),
    "a copy": ((PART,), (PART, COPY)),
    "under a copy": ((PART, COPY), (PART.rotate((0, 0, 0.6)), COPY)),
    "order": ((PART.scale(1.2), OTHER), (OTHER, PART.scale(1.2))),
}


@pytest.mark.parametrize("name", nightly_after_first(STACKS))
def test_pictures_are_the_same_outside_what_is_rendered(renderers: RendererCache, name: str) -> None:
    before, after = (EditStack(stack) for stack in STACKS[name])
    first, second = (renderers.plain.with_edits(stack).render(CAMERA) for stack in (before, after))
    assert first is not None and second is not None
    x, y, w, h = pixels(screen_bounds(CAMERA, after.changed_boxes(before)), SIDE, SIDE)
    difference = np.abs(first.rgb - second.rgb).max(axis=2)
    assert difference.max() > 0.1  # the change shows
    difference[y : y + h, x : x + w] = 0.0
    # Samples may lie elsewhere along a ray where the edits reach beyond the grid; nothing else differs.
    assert difference.max() < 0.02 and w * h < 0.9 * SIDE * SIDE


PART_OF_BALL = Cage.box((0.4, 0, 0.25), (0.3, 0.3, 0.25))
PATCHED = {
    "delete": Edit.delete(PART_OF_BALL),
    "move": Edit.move(PART_OF_BALL).translate((0.3, 0, 0.1)),
    "copy": Edit.copy(PART_OF_BALL).translate((0.2, 0, 0.15)),
}


@pytest.fixture(scope="module")
def shaded() -> Scene:
    """A ball of small voxels, whose colors are said to follow its openness."""
    field = ball_field(resolution=65)
    scene = Scene(field)
    scene.patcher.__dict__["light_model"] = LightModel(occlusion_radii(field), (0.1, 0.2, 0.2, 0.2, 0.2))
    return scene


@pytest.mark.nightly
@pytest.mark.parametrize("name", PATCHED)
def test_switching_fill_and_light_changes_pictures_where_patches_reach(shaded: Scene, name: str) -> None:
    patched = PATCHED[name]
    bare = patched.replace(fill="none", relight="none", feather=0.0)
    extent = PatchExtent(shaded.field)
    region = shaded.patcher.prepare([patched])[0].boxes
    assert (extent.boxes(patched).min(axis=(0, 1)) <= region.min(axis=(0, 1))).all()
    assert (extent.boxes(patched).max(axis=(0, 1)) >= region.max(axis=(0, 1))).all()
    assert np.array_equal(extent.boxes(bare), bare.boxes)
    first, second = (shaded.with_edits(EditStack([edit])).render(CAMERA).rgb for edit in (bare, patched))
    changed = EditStack([patched]).changed_boxes(EditStack([bare]), lambda step: extent.boxes(step.edit))
    x, y, w, h = pixels(screen_bounds(CAMERA, changed), SIDE, SIDE)
    difference = np.abs(first - second).max(axis=2)
    assert difference.max() > 0.1
    difference[y : y + h, x : x + w] = 0.0
    assert difference.max() < 1e-3 and w * h < 0.5 * SIDE * SIDE


@pytest.mark.nightly
def test_edits_that_stay_keep_their_shadows_while_another_moves(shaded: Scene) -> None:
    edits = [PATCHED["copy"], PATCHED["move"]]
    settled = shaded.patcher.prepare(edits)
    moved = [edits[0], edits[1].translate((0, 0, 0.1))]
    moving = shaded.patcher.prepare(moved, stage=PatchStage.INPAINTED)
    assert moving[0].patch is settled[0].patch is not None
    assert moving[1].patch is not None and moving[1].patch.part is None
    assert (
        shaded.patcher.prepare([edits[0].translate((0, 0, 0.1))], stage=PatchStage.INPAINTED)[0].patch is None
    )


@pytest.mark.parametrize("view", nightly_except(["color", "depth", "opacity", "normals"], "color", "depth"))
def test_a_part_over_the_last_picture_is_the_whole_picture(renderers: RendererCache, view: Any) -> None:
    before, after = STACKS["under another"]
    display = Display(view, split=0.55)

    def shown(edits: tuple[Edit, ...], region: Region) -> np.ndarray[Any, Any]:
        task = PictureTask(1, Shown(values_of(edits)), CAMERA, region, display, False, FINAL, 0)
        done = renderers.picture(task, lambda: False)
        assert isinstance(done, PictureDone)
        return pixels_of(done.picture, done.format, region.width, region.height).astype(float)

    whole = Region(0, 0, SIDE, SIDE, SIDE, SIDE)
    x, y, w, h = pixels(screen_bounds(CAMERA, EditStack(after).changed_boxes(EditStack(before))), SIDE, SIDE)
    composed = shown(before, whole)
    composed[y : y + h, x : x + w] = shown(after, Region(x, y, w, h, SIDE, SIDE))
    expected = shown(after, whole)
    assert np.abs(composed - shown(before, whole)).max() > 20
    # JPEG codes blocks of 8 by 8 pixels, which the part cuts elsewhere: a few values off at edges.
    assert np.abs(composed - expected).mean() < 1.0 and np.abs(composed - expected).max() < 40


def test_a_refresh_that_is_given_up_leaves_nothing_half_done() -> None:
    renderers = RendererCache(ball_scene())
    edits = tuple(edit.replace(relight="none") for edit in (PART.translate((0.12, 0, 0)), OTHER))
    whole = Region(0, 0, SIDE, SIDE, SIDE, SIDE)
    task = PictureTask(1, Shown(values_of(edits)), CAMERA, whole, Display(), False, FINAL, 0)
    expected = VoxelRenderer(renderers.scene.field, EditStack(edits))
    for looks in range(1, 6):
        left = looks

        def stop() -> bool:
            nonlocal left
            left -= 1
            return left <= 0

        assert isinstance(renderers.picture(task, stop), Stopped)
        if looks <= 4:  # between the passes; later, between bands of the picture
            assert renderers.edited.final == []
    done = renderers.picture(task, lambda: False)
    assert isinstance(done, PictureDone)
    assert np.array_equal(renderers.edited.final[-1].occupancy.codes, expected.occupancy.codes)
