"""A page plays the camera path: what pictures then show, when it is over, and what pages are told."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cagefield.cameras.keyframes import Keyframe, stills
from cagefield.edits import Edit, EditStack, Translate, dump_edits
from cagefield.errors import CagefieldError, CameraError, EditError
from cagefield.geometry.cage import Cage
from cagefield.server.editor.document import Document
from cagefield.server.editor.path_edits import edits_at_time
from cagefield.server.editor.session import Session
from cagefield.server.protocol import client_messages, common
from cagefield.server.protocol.conversion import MOST_STILLS, STILLS_PER_SECOND, stills_of
from cagefield.server.render_worker.refinement import Refinement
from cagefield.server.render_worker.tasks import PictureTask, Shown, values_of
from cagefield.server.web.handlers import MessageHandlers
from cagefield.server.web.launch import open_scene
from cagefield.server.web.websocket import ReceiveQueue
from scenes import ball_scene

BOUNDS = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])
INNER = Cage.box((0, 0, 0), 0.4)
ARM = Edit.continuous(INNER, INNER.grown(0.3), lattice=16, name="arm").translate((0.2, 0, 0))
STILL = Edit.move(Cage.box((0.8, 0, 0), 0.2), name="still").translate((0, 0.2, 0))
TURNED = Edit.continuous(INNER, INNER.grown(0.075), lattice=16, name="turned").rotate((0, 0, 90))
"""A cube that fits into its outer cage at its beginning and its end, and not halfway."""

Act = Callable[[Session], object]


def key(x: float, seconds: float = 2.0, **parts: float) -> Keyframe:
    pose = np.eye(4)
    pose[0, 3] = x
    return Keyframe(tuple(pose.reshape(-1)), 50.0, seconds, {int(k[1:]): v for k, v in parts.items()})


KEYS = (key(0.0, e1=0.0), key(1.0))


def session(*edits: Edit, keys: tuple[Keyframe, ...] = KEYS, loop: bool = False) -> Session:
    return Session(Document.from_edits(edits, keys=keys, loop=loop), BOUNDS, 0.01)


# ---- the session ----


@pytest.mark.parametrize("loop", [False, True])
def test_the_preview_shows_the_edits_of_the_videos_pictures(loop: bool) -> None:
    keys = (key(0.0, 0.5, e1=0.0), key(1.0, 0.25, e1=0.8), key(2.0, 0.5, e2=0.3))
    s = session(ARM, STILL, keys=keys, loop=loop)
    s.play_begin(1, 1)
    fps = 16.0
    for n, still in enumerate(stills(keys, loop=loop, fps=fps, width=8, height=8)):
        s.play(1, 1, n / fps)
        expected = edits_at_time(s.document, still.parts)
        assert len(s.drawn()) == len(expected)
        for found, edit in zip(s.drawn(), expected, strict=True):
            np.testing.assert_allclose(found.deformed.corners, edit.deformed.corners, atol=1e-12)


def test_the_preview_begins_at_the_beginning_and_ends_at_the_end() -> None:
    s = session(ARM, STILL)
    s.play_begin(1, 1)
    assert s.drawn() == (STILL,) and s.moving
    s.play(1, 1, 1.0)
    assert 0.08 < s.drawn()[0].deformed.pivot[0] < 0.12  # about half of 0.2
    s.play(1, 1, 99.0)
    assert s.drawn() == (ARM, STILL)


def test_the_preview_is_no_change_of_the_document() -> None:
    s = session(ARM)
    before = s.document
    s.play_begin(1, 1)
    s.play(1, 1, 1.0)
    assert s.document is before and s.shown is before and s.saved
    revision = s.revision
    s.play_end(1, 1)
    assert s.drawn() == (ARM,) and not s.moving and s.revision > revision
    assert s.history.names == ("Open",) and s.document is before


@pytest.mark.parametrize(
    "act",
    [
        lambda s: s.apply(1, "field", Translate((0.01, 0, 0))),
        lambda s: s.undo(),
        lambda s: s.redo(),
        lambda s: s.go_to(0),
        lambda s: s.load_edits(dump_edits(EditStack([STILL])), append=False),
        lambda s: s.set_path((), False),
        lambda s: s.change(1, enabled=False),
        lambda s: s.drag_begin(2, 1, 1, "field"),
        lambda s: s.play_end(1),
    ],
    ids=["edit", "undo", "redo", "go to", "load", "path", "hide", "drag", "leave"],
)
def test_the_preview_is_over_with_any_change_and_drag(act: Act) -> None:
    s = session(ARM)
    s.change(1, name="leg")
    s.undo()
    s.play_begin(1, 1)
    s.play(1, 1, 1.0)
    act(s)
    assert s.preview is None
    s.play(1, 1, 1.5)  # was on its way
    assert s.preview is None
    assert [edit.deformed for edit in s.drawn()] == [
        entry.edit.deformed for entry in s.document.entries if entry.edit.enabled
    ]


def test_what_changes_nothing_of_the_document_does_not_end_the_preview() -> None:
    s = session(ARM, STILL)
    s.play_begin(1, 1)
    s.select(1)
    s.mark_saved()
    s.play_end(2, 1)
    s.play_end(1, 7)
    with pytest.raises(EditError, match="edit 9 is not there any more"):
        s.remove(9)
    assert s.preview is not None


def test_another_pages_preview_takes_over() -> None:
    s = session(ARM, STILL)
    s.play_begin(1, 1)
    s.play_begin(2, 1)
    s.play(1, 1, 2.0)
    assert s.drawn() == (STILL,)
    s.play(2, 1, 2.0)
    assert s.drawn() == (ARM, STILL)


def test_nothing_is_played_while_anybody_drags_nor_without_two_keys() -> None:
    s = session(ARM)
    s.drag_begin(1, 1, 1, "field")
    with pytest.raises(EditError, match="being dragged; play the camera path when the drag is over"):
        s.play_begin(2, 1)
    assert s.drags and s.preview is None
    for keys in ((), (key(0.0),)):
        with pytest.raises(CameraError, match=f"path with {len(keys)} keyframes does not move; record"):
            session(ARM, keys=keys).play_begin(1, 1)


def test_where_an_edit_is_not_possible_the_preview_stops_with_the_jobs_line() -> None:
    s = session(TURNED)
    s.play_begin(1, 1)
    with pytest.raises(
        CagefieldError, match='edit "turned" is not possible at 50%: the inner cage must'
    ) as at:
        s.play(1, 1, 1.0)
    assert s.preview is None and s.drawn() == (TURNED,)
    with pytest.raises(CagefieldError) as job:
        edits_at_time(s.document, {1: 0.5})
    assert str(at.value) == str(job.value)


# ---- what pages are told ----


def test_pages_are_told_the_cameras_of_the_video() -> None:
    keys = (key(0.0, 0.5), key(1.0, 0.5), key(-2.0, 0.5))
    for loop in (False, True):
        told = stills_of(keys, loop)
        expected = stills(keys, loop=loop, fps=STILLS_PER_SECOND, width=64, height=48)
        assert len(told) == len(expected) + loop
        for one, still in zip(told, expected, strict=False):
            np.testing.assert_allclose(np.reshape(one.c2w, (4, 4)), still.camera.c2w, atol=1e-12)
            assert one.fov_y_deg == pytest.approx(50.0)
        end = keys[0] if loop else keys[-1]
        np.testing.assert_allclose(told[-1].c2w, end.c2w, atol=1e-12)
    assert len(stills_of((key(0.0, 3600.0), key(1.0)), False)) == MOST_STILLS
    assert len(stills_of((key(0.0, 0.01), key(1.0)), False)) == 2
    with pytest.raises(CameraError, match="record at least two"):
        stills_of((key(0.0),), False)


class Played:
    """A coordinator with two pages that look at a ball, and no renderer."""

    def __init__(self, path: Path) -> None:
        self.coordinator, self.hello = open_scene(path, "cpu")
        self.pages = [self.coordinator.join(self.hello) for _ in range(2)]
        self.speakers = [MessageHandlers(self.coordinator, page) for page in self.pages]
        for n in range(2):
            self.say(n, "camera", **{**self.hello.start.model_dump(exclude={"type"}), "seq": 1})
        self.heard()

    def say(self, page: int, kind: str, **values: Any) -> None:
        message = client_messages.page_messages.validate_python({"type": kind, **values})
        rest = self.speakers[page].handle(message)
        assert rest is None

    def heard(self) -> list[list[dict[str, Any]]]:
        """What each page was told since it was asked last."""
        return [
            [json.loads(asyncio.run(page.send_queue.get())) for _ in range(len(page.send_queue))]
            for page in self.pages
        ]

    def previews(self) -> list[list[tuple[int, int, bool]]]:
        return [
            [(m["page"], m["play"], m["on"]) for m in messages if m["type"] == "preview"]
            for messages in self.heard()
        ]

    def rendered(self) -> PictureTask:
        """The next picture, which is not rendered."""
        request = self.coordinator.dispatcher.scheduler.next(1e9)
        assert request is not None
        task, stamp = self.coordinator.picture_task(request, 0)
        assert stamp.revision == self.coordinator.session.revision
        self.coordinator.dispatcher.scheduler.abandoned(request, again=False)
        return task


@pytest.fixture
def played(tmp_path: Path) -> Played:
    ball_scene().with_edits(EditStack([ARM, STILL])).save(tmp_path / "ball")
    found = Played(tmp_path / "ball")
    found.coordinator.session.set_path(KEYS, False)
    found.coordinator.changed()
    found.heard()
    return found


def test_all_pages_show_the_preview_and_are_told_of_its_beginning_and_its_end(played: Played) -> None:
    coordinator = played.coordinator
    played.say(0, "play_begin", play=4)
    assert played.previews() == [[(1, 4, True)]] * 2
    played.say(0, "play", play=4, seconds=1.0)
    assert played.previews() == [[], []]
    expected = Shown(values_of(edits_at_time(coordinator.session.document, {1: 0.5})))
    assert coordinator.shown() != Shown(values_of((ARM, STILL)))
    np.testing.assert_allclose(
        [e.fields["operations"][0].by for e in coordinator.shown().edits],
        [e.fields["operations"][0].by for e in expected.edits],
    )
    for task in (played.rendered(), played.rendered()):  # one for each page
        assert task.shown == coordinator.shown() and task.moving and task.refinement == Refinement.DRAFT
    late = coordinator.join(played.hello)
    told = [json.loads(asyncio.run(late.send_queue.get())) for _ in range(len(late.send_queue))]
    assert [m["play"] for m in told if m["type"] == "preview"] == [4]
    played.say(0, "play_end", play=4)
    assert coordinator.shown() == Shown(values_of((ARM, STILL)))
    (state,) = [m for m in played.heard()[1] if m["type"] == "state"]
    assert state["pictured"] == state["revision"] and state["history"] == ["Open", "Camera path"]


def test_chores_wait_for_the_preview(played: Played) -> None:
    scheduler = played.coordinator.dispatcher.scheduler
    for page in played.pages:
        scheduler.leave(page.number)
    assert scheduler.idle()
    played.coordinator.session.play_begin(1, 1)
    played.coordinator.pages.clear()
    played.coordinator.pump()
    assert not scheduler.idle()
    played.coordinator.session.play_end(1)
    played.coordinator.pump()
    assert scheduler.idle()


@pytest.mark.parametrize("how", ["undo", "drag", "taken over", "leaves"])
def test_pages_are_told_that_something_else_has_ended_it(played: Played, how: str) -> None:
    played.say(0, "play_begin", play=1)
    played.heard()
    if how == "undo":
        played.say(1, "command", name="undo")
    elif how == "drag":
        played.say(1, "drag_begin", drag=1, edit=1, target="field")
    elif how == "taken over":
        played.say(1, "play_begin", play=1)
    else:
        played.coordinator.leave(played.pages[0])
    more = [(2, 1, True)] if how == "taken over" else []
    assert played.previews()[1] == [(1, 1, False), *more]


def test_a_page_whose_preview_cannot_begin_or_go_on_is_told(played: Played) -> None:
    played.say(1, "drag_begin", drag=1, edit=1, target="field")
    played.heard()
    with pytest.raises(EditError, match="being dragged"):
        played.say(0, "play_begin", play=2)
    assert played.previews() == [[(1, 2, False)], []]
    played.say(1, "drag_cancel", drag=1)
    played.coordinator.session.load_edits(dump_edits(EditStack([TURNED])), append=False)
    number = played.coordinator.session.document.entries[0].id
    played.coordinator.session.set_path((key(0.0), key(1.0, **{f"e{number}": 0.0})), False)
    played.coordinator.changed()
    played.say(0, "play_begin", play=3)
    played.heard()
    with pytest.raises(CagefieldError, match="is not possible at 50%"):
        played.say(0, "play", play=3, seconds=1.0)
    assert played.previews() == [[(1, 3, False)]] * 2


def test_of_messages_on_the_way_along_the_path_only_the_newest_wait() -> None:
    receive_queue = ReceiveQueue()
    pose = np.eye(4).reshape(-1).tolist()

    def camera(seq: int) -> common.CameraMessage:
        return common.CameraMessage(seq=seq, c2w=pose, width=64, height=64, fov_y_deg=50.0, moving=True)

    begin, end = client_messages.PlayBegin(play=1), client_messages.PlayEnd(play=1)
    for message in (
        begin,
        *(m for n in range(5) for m in (client_messages.Play(play=1, seconds=n), camera(n))),
        end,
        camera(9),
    ):
        receive_queue.put(message)
    waiting = list(receive_queue.waiting)
    assert waiting == [begin, client_messages.Play(play=1, seconds=4), camera(4), end, camera(9)]
