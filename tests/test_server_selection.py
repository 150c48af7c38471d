"""Selected elements in the editor: session, rendering process, messages and highlights."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from cagefield.cameras.camera import Camera
from cagefield.compute import devices
from cagefield.edits import Edit, Translate
from cagefield.errors import CagefieldError
from cagefield.geometry.cage import Cage
from cagefield.scene.scene import Scene
from cagefield.selection import Selection
from cagefield.selection.brush_and_lasso import Rectangle, Stroke
from cagefield.server.editor.document import Document
from cagefield.server.editor.session import Session
from cagefield.server.protocol.client_messages import page_messages
from cagefield.server.protocol.conversion import state_of
from cagefield.server.protocol.message_queues import SendQueue
from cagefield.server.render_queue.highlights import Highlights
from cagefield.server.render_worker.picks import (
    EveryPick,
    FloaterPick,
    FloodPick,
    Highlight,
    NeighborPick,
    Pick,
    RangePick,
    RegionPick,
)
from cagefield.server.render_worker.refinement import FINAL
from cagefield.server.render_worker.renderer_cache import RendererCache
from cagefield.server.render_worker.task_handlers import TaskHandlers
from cagefield.server.render_worker.tasks import (
    Answered,
    BoxTask,
    HighlightTask,
    HistogramTask,
    PageEditsTask,
    PickTask,
    PictureDone,
    PictureTask,
    Shown,
    Stopped,
    values_of,
)
from cagefield.server.render_worker.view import Display, Region
from cagefield.typing import Array, Mask
from sent_pictures import pixels_of
from splat_scenes import BALL_RADIUS, ball_and_floor

BOUNDS = np.array([[-1.0] * 3, [1.0] * 3])
BALL = 800
COUNT = 1376
INNER = Cage.box((0, 0, 0), 0.6)
MOVED = Edit.move(INNER, name="ball").translate((0.6, 0, 0))
CAMERA = Camera.look_at((0.0, -3.0, 0.9), (0, 0, 0), width=320, height=230, fov_x=0.8)


@pytest.fixture(scope="module")
def handlers() -> TaskHandlers:
    devices.start()
    return TaskHandlers(RendererCache(Scene(ball_and_floor())))


def answered(handlers: TaskHandlers, task: Any) -> Any:
    result = handlers.do(task, lambda generation: False)
    assert isinstance(result, Answered)
    return result.value


def picked(handlers: TaskHandlers, pick: Pick, *edits: Edit) -> Mask:
    found = answered(handlers, PickTask(1, Shown(values_of(edits)), pick))
    assert isinstance(found, Selection) and found.total == COUNT
    return found.mask


def around(x: float, tolerance: float | None = None) -> RegionPick:
    """The rectangle around the ball moved by `x`."""
    corners = CAMERA.project(Cage.box((x, 0, 0), 2.1 * BALL_RADIUS).corners)[0] / (
        CAMERA.width,
        CAMERA.height,
    )
    region = Rectangle(tuple(corners.min(axis=0)), tuple(corners.max(axis=0)))
    return RegionPick(region, CAMERA, tolerance)


# ---- the rendering process ----


def test_regions_pick_the_visible_or_all(handlers: TaskHandlers) -> None:
    through = picked(handlers, around(0.0))
    assert through[:BALL].all()
    visible = picked(handlers, around(0.0, 1.5))[:BALL]
    facing = ball_and_floor().means[:BALL] @ CAMERA.forward / BALL_RADIUS
    assert visible[facing < -0.5].mean() > 0.97 and not visible[facing > 0.8].any()


def test_regions_pick_where_edits_show_things(handlers: TaskHandlers) -> None:
    assert picked(handlers, around(0.6), MOVED)[:BALL].all()
    assert not picked(handlers, around(0.0), MOVED)[:BALL].any()
    brushed = picked(handlers, RegionPick(around(0.6).region, CAMERA, 1.5), MOVED)
    assert 200 < brushed[:BALL].sum() < 600


def test_other_picks(handlers: TaskHandlers) -> None:
    at = CAMERA.project(np.zeros((1, 3)))[0][0] / (CAMERA.width, CAMERA.height)
    flooded = picked(handlers, FloodPick(CAMERA, *at, 0.3, None))
    np.testing.assert_array_equal(flooded, np.arange(COUNT) < BALL)
    moved = CAMERA.project(np.array([[0.6, 0, 0]]))[0][0] / (CAMERA.width, CAMERA.height)
    np.testing.assert_array_equal(picked(handlers, FloodPick(CAMERA, *moved, 0.3, None), MOVED), flooded)
    np.testing.assert_array_equal(picked(handlers, RangePick("opacity", 0.75, 0.85)), flooded)
    ball = Selection.from_mask(flooded)
    np.testing.assert_array_equal(picked(handlers, NeighborPick(ball, -1)), flooded)
    some = Selection.from_mask(np.arange(COUNT) < 1)
    assert 1 < picked(handlers, NeighborPick(some, 1)).sum() < 100
    assert picked(handlers, EveryPick()).all()
    assert not picked(handlers, FloaterPick(0.5)).any()
    with pytest.raises(CagefieldError, match="no surface under the mouse"):
        picked(handlers, FloodPick(CAMERA, 0.01, 0.01, 0.3, None))
    with pytest.raises(CagefieldError, match="of 7 elements, this one has 1376"):
        picked(handlers, NeighborPick(Selection.none(7), 1))


def test_the_box_is_around_the_selection_as_it_is_seen(handlers: TaskHandlers) -> None:
    ball = Selection.from_mask(np.arange(COUNT) < BALL)
    box = answered(handlers, BoxTask(1, Shown(values_of((MOVED,))), ball, 0.0))
    np.testing.assert_allclose(box.center, (0.6, 0, 0), atol=0.02)
    lengths = np.linalg.norm(box.affine[0], axis=0)
    assert (lengths > 2.0 * BALL_RADIUS).all() and (lengths < 2.5 * BALL_RADIUS).all()
    deleted = Shown(values_of((Edit.delete(INNER),)))
    with pytest.raises(CagefieldError, match="nothing of the selection is to be seen"):
        answered(handlers, BoxTask(1, deleted, ball, 0.0))


def test_highlights_are_where_edits_show_the_elements(handlers: TaskHandlers) -> None:
    ball = Selection.from_mask(np.arange(COUNT) < BALL)
    shown = Shown(values_of((MOVED,)))
    found = answered(handlers, HighlightTask(1, shown, ball, 0))
    assert isinstance(found, Highlight) and found.count == BALL
    low, high = np.array(found.low), np.array(found.high)
    points = low + np.frombuffer(found.points, "<u2").reshape(-1, 3) / 65535.0 * (high - low)
    np.testing.assert_allclose(points, ball_and_floor().means[:BALL] + np.array([0.6, 0, 0]), atol=1e-5)
    none = answered(handlers, HighlightTask(1, Shown(values_of((Edit.delete(INNER),))), ball, 0))
    assert none.count == 0 and none.points == b""
    continuous = Edit.continuous(INNER, INNER.grown(0.3)).rotate((0.0, 0.0, 0.3))
    stopped = handlers.do(HighlightTask(1, Shown(values_of((continuous,))), ball, 0), lambda generation: True)
    assert isinstance(stopped, Stopped)


def test_histograms(handlers: TaskHandlers) -> None:
    ball = Selection.from_mask(np.arange(COUNT) < BALL)
    found = answered(handlers, HistogramTask(1, "opacity", ball))
    assert sum(found.counts) == COUNT and sum(found.selected) == BALL
    assert sum(answered(handlers, HistogramTask(1, "hue", None)).selected) == 0


# ---- the session ----


def session() -> Session:
    return Session(Document.from_edits([MOVED]), BOUNDS, 0.01)


def test_a_selection_is_undone_and_is_not_saved() -> None:
    s = session()
    first, second = (Selection.from_mask(np.arange(10) < n) for n in (3, 6))
    s.pick("Select by brush", first)
    s.pick("Select by brush", second, "subtract")
    assert s.document.selection is None  # nothing is left
    s.undo()
    assert s.document.selection == first and s.saved
    s.pick("Select by lasso", second, "intersect")
    assert s.history.entry == 1, "no entry where nothing changes"
    s.apply(1, "field", Translate((0.1, 0, 0)))
    assert s.document.selection == first and not s.saved
    s.mark_saved()
    s.select_elements("Select none", None)
    assert s.saved
    s.undo()
    assert s.document.selection == first and s.saved
    assert state_of(s, "scene", 1, {}).selection.model_dump() == {"count": 3, "total": 10}  # type: ignore[union-attr]


def test_a_cage_around_the_selection_is_an_edit() -> None:
    s = session()
    inner = Cage.box((0, 0, 0), (0.2, 0.2, 1.0))
    number = s.place_around_selection(inner)
    edit = s.document.entry(number).edit
    assert s.selected == number and edit.inner == inner
    outer = edit.shell_settings.outer
    assert outer is not None and outer.contains(inner.corners).all()
    np.testing.assert_allclose(outer.aabb[1], inner.aabb[1] + 0.12, atol=1e-9)
    assert s.history.names[-1] == "Cage around the selection"
    s.undo()
    assert not s.document.has(number)


# ---- messages ----


@pytest.mark.parametrize(
    "message",
    [
        {"type": "select_region", "shape": "lasso", "points": []},
        {"type": "select_region", "shape": "lasso", "points": [[0.0, float("nan")]]},
        {"type": "select_region", "shape": "brush", "points": [[0, 0]] * 4097},
        {"type": "select_region", "shape": "circle", "points": [[0, 0]]},
        {"type": "select_region", "shape": "brush", "points": [[0, 0]], "radius": 0.0},
        {"type": "select_range", "attribute": "weight", "low": 0, "high": 1},
        {"type": "select_range", "attribute": "size", "low": 0, "high": float("inf")},
        {"type": "select_flood", "x": 2, "y": 0},
        {"type": "select_floaters", "strength": 1.5},
        {"type": "change_selection", "change": "clear"},
        {"type": "selection_cage", "margin": -1},
    ],
)
def test_impossible_messages_are_refused(message: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        page_messages.validate_python(message)


def test_a_waiting_highlight_is_replaced() -> None:
    queue = SendQueue()
    queue.put_picture(b"picture")
    queue.put_highlight(b"first")
    queue.put_highlight(b"second")
    assert [content for _, content in queue.waiting] == [b"picture", b"second"]


def test_highlights_are_computed_once_for_each_change() -> None:
    s, sent = session(), []
    revision = 1
    highlights = Highlights(s, lambda: (revision, Shown(())), sent.append)
    assert highlights.next(0) is None
    s.pick("Select by brush", Selection.from_mask(np.arange(10) < 3))
    task = highlights.next(5)
    assert task is not None
    made = task.make(-1)
    assert isinstance(made, HighlightTask) and made.generation == 5
    task.done(Stopped(-1))
    again = highlights.next(5)
    assert again is not None and not sent
    again.done(Answered(-1, Highlight((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), b"\0" * 6, 1, 0.1)))
    assert len(sent) == 1 and highlights.message == sent[0] and sent[0].endswith(b"\0" * 6)
    assert highlights.next(5) is None
    revision = 2
    assert highlights.next(5) is not None, "edits have changed"
    s.drag_begin(1, 1, 1, "field")
    assert highlights.next(5) is None, "while something is dragged"


def test_documents_compare_without_their_selection_where_saved() -> None:
    document = Document.from_edits([MOVED])
    chosen = replace(document, selection=Selection.from_mask(np.ones(3, bool)))
    assert chosen != document and chosen.saved_part == document


def test_strokes_on_the_ball(handlers: TaskHandlers) -> None:
    at = tuple(CAMERA.project(np.zeros((1, 3)))[0][0] / (CAMERA.width, CAMERA.height))
    few = picked(handlers, RegionPick(Stroke((at,), 0.03), CAMERA, 1.5))
    more = picked(handlers, RegionPick(Stroke((at,), 0.1), CAMERA, 1.5))
    assert 0 < few.sum() < more.sum() < 400 and not (few & ~more).any() and not more[BALL:].any()


# ---- isolation ----


def test_isolated_elements_are_shown_alone(handlers: TaskHandlers) -> None:
    ball = Selection.from_mask(np.arange(COUNT) < BALL)
    region = Region(0, 0, CAMERA.width, CAMERA.height, CAMERA.width, CAMERA.height)

    def pixels(shown: Shown) -> Array:
        task = PictureTask(1, shown, CAMERA, region, Display(), False, FINAL, 0)
        done = handlers.do(task, lambda generation: False)
        assert isinstance(done, PictureDone) and done.refinement == FINAL
        return pixels_of(done.picture, done.format, CAMERA.width, CAMERA.height) / 255.0

    isolated = pixels(Shown(values_of((MOVED,)), True, ball))
    everything = pixels(Shown(values_of((MOVED,))))
    # Floor and all, and the ball alone, at the same place.
    gray = np.array([0.4] * 3)
    assert (np.abs(everything - gray).max(axis=2) < 0.1).mean() > 0.2
    assert (np.abs(isolated - gray).max(axis=2) < 0.1).mean() < 0.01
    red = np.argwhere((isolated[..., 0] > 0.7) & (isolated[..., 1] < 0.4))
    center = CAMERA.project(np.array([[0.6, 0, 0]]))[0][0]
    np.testing.assert_allclose(red.mean(axis=0)[::-1], center, atol=3.0)
    # Through the picture only isolated elements are picked.
    every = answered(handlers, PickTask(1, Shown((), True, ball), EveryPick()))
    np.testing.assert_array_equal(every.mask, np.arange(COUNT) < BALL)
    with pytest.raises(CagefieldError, match="the server draws them"):
        handlers.do(PageEditsTask(1, Shown((), True, ball), FINAL, (), 0), lambda generation: False)


def test_isolation_is_shared_and_no_entry_of_the_history() -> None:
    s = session()
    with pytest.raises(CagefieldError, match=r"nothing is selected; paint with the brush \(M\)"):
        s.isolate(True)
    chosen = Selection.from_mask(np.arange(10) < 3)
    s.pick("Select by brush", chosen)
    s.isolate(True)
    s.select_elements("Select none", None)
    assert s.isolated == chosen and s.history.entry == 2
    assert state_of(s, "scene", 1, {}).isolated
    s.isolate(False)
    assert s.isolated is None and s.saved
