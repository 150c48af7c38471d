"""Hotspots that follow the edits: positions and cameras against closed forms, in files and the editor."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cagefield import Cage, Edit, EditStack, Hotspot, Scene
from cagefield.cameras.camera import Camera
from cagefield.cameras.keyframes import Keyframe, Timeline, stills
from cagefield.errors import EditError
from cagefield.pages.page_hotspots import hotspot_entries
from cagefield.scene.hotspot_motion import following, shown_hotspots, visible_hotspots
from cagefield.scene.hotspots import view_of_camera
from cagefield.server.editor.document import Document
from cagefield.server.editor.edit_texts import ReadEdits
from cagefield.server.editor.hotspot_tracks import hotspot_tracks
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.session import Session
from cagefield.server.protocol.client_messages import page_messages
from cagefield.server.protocol.conversion import state_of
from cagefield.server.web.hotspot_handlers import change_hotspots
from commands import printed, refused
from scenes import ball_scene

INNER = Cage.box((0, 0, 0), 0.4)
CAMERA = Camera.look_at((2, 0, 1), (0.1, 0, 0), (0, 0, 1), width=80, height=60, fov_x=0.9)
SPOT = Hotspot("spot", (0.1, 0.0, 0.0), "text", view_of_camera(CAMERA), follows=True)


def pose(hotspot: Hotspot | None) -> Any:
    assert hotspot is not None and hotspot.view is not None
    return np.array(hotspot.view.c2w).reshape(4, 4)


def test_a_hotspot_in_a_cage_goes_with_it_and_so_does_its_camera() -> None:
    turned = Edit.continuous(INNER, Cage.box((0, 0, 0), 1.6)).rotate((0, 0, 0.7)).translate((0.2, 0.1, 0))
    (seen,) = shown_hotspots([SPOT], [turned])
    c, s = np.cos(0.7), np.sin(0.7)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    moved = R @ (0.1, 0, 0) + (0.2, 0.1, 0)
    assert seen is not None and not seen.follows and seen.text == "text"
    np.testing.assert_allclose(seen.position, moved, atol=1e-12)
    np.testing.assert_allclose(pose(seen)[:3, :3], R @ CAMERA.c2w[:3, :3], atol=1e-9)
    np.testing.assert_allclose(pose(seen)[:3, 3], moved + R @ (CAMERA.origin - (0.1, 0, 0)), atol=1e-9)
    back = following(seen, [turned])
    assert back is not None and back.follows
    np.testing.assert_allclose(back.position, SPOT.position, atol=1e-12)
    np.testing.assert_allclose(pose(back), pose(SPOT), atol=1e-9)


def test_one_that_does_not_follow_stays_and_so_does_one_around_no_edit() -> None:
    moved = Edit.move(INNER).translate((1, 0, 0))
    fixed, far = dataclasses.replace(SPOT, follows=False), dataclasses.replace(SPOT, position=(0, 3, 0))
    shown = shown_hotspots([fixed, far], [moved])
    assert shown == (fixed, dataclasses.replace(far, follows=False))


def test_discrete_edits_take_it_along_delete_it_and_cover_it() -> None:
    (seen,) = shown_hotspots([SPOT], [Edit.move(INNER).translate((1, 0, 0))])
    assert seen is not None and seen.position == pytest.approx((1.1, 0.0, 0.0))
    assert shown_hotspots([SPOT], [Edit.delete(INNER)]) == (None,)
    other = Edit.move(Cage.box((1, 0, 0), 0.4)).translate((-1, 0, 0))
    assert shown_hotspots([SPOT], [other]) == (None,)
    # The place that the edit has left is empty: nothing there to follow.
    assert following(SPOT, [Edit.move(INNER).translate((1, 0, 0))]) is None


def test_stacked_edits_carry_it_one_after_the_other() -> None:
    first = Edit.move(INNER).translate((1, 0, 0))
    second = Edit.move(Cage.box((1, 0, 0), 0.6)).scale(2.0)
    (seen,) = shown_hotspots([SPOT], [first, second])
    assert seen is not None and seen.position == pytest.approx((1.2, 0.0, 0.0))


def test_scenes_pages_and_tours_show_them_where_they_are_carried(tmp_path: Path) -> None:
    edits = EditStack([Edit.move(INNER).translate((0, 0, 0.3))])
    gone = Hotspot("gone", (0.0, 0.0, 0.3), follows=True)  # covered by what is moved
    scene = dataclasses.replace(ball_scene(), hotspots=(SPOT, gone)).with_edits(edits)
    scene.save(tmp_path / "scene")
    opened = Scene.open(tmp_path / "scene")
    assert opened.hotspots == (SPOT, gone)
    shown = visible_hotspots(opened)
    assert [hotspot.title for hotspot in shown] == ["spot"]
    (entry,) = hotspot_entries(opened, ())
    assert entry["position"] == pytest.approx([0.1, 0.0, 0.3])
    assert np.array(entry["view"]["c2w"]).reshape(4, 4)[2, 3] == pytest.approx(1.3)


def test_the_command_places_followers_in_the_edited_scene(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "scene"
    ball_scene().with_edits(EditStack([Edit.move(INNER).translate((1, 0, 0))])).save(folder)
    text = printed(capsys, "hotspot", folder, "--add", "a", "--at", 1.1, 0, 0, "--follow", "yes")
    assert "1   a  (1.1, 0, 0), follows the edits" in text
    assert Scene.open(folder).hotspots[0].position == pytest.approx((0.1, 0, 0))
    assert "(1.1, 0, 0)" in printed(capsys, "hotspot", folder, "--change", "a", "--text", "b")
    printed(capsys, "hotspot", folder, "--change", "a", "--follow", "no")
    (fixed,) = Scene.open(folder).hotspots
    assert not fixed.follows and fixed.position == pytest.approx((1.1, 0, 0)) and fixed.text == "b"
    said = refused(capsys, "hotspot", folder, "--add", "b", "--at", 0, 0, 0, "--follow", "yes")
    assert "leave nothing at --at" in said


def say(session: Session, **message: Any) -> None:
    change_hotspots(session, page_messages.validate_python(message))  # type: ignore[arg-type]


def load(session: Session, edits: list[Edit]) -> None:
    session.take_edits(ReadEdits(tuple(edits), (), ()), append=False)


def test_the_editor_carries_them_with_an_edit_and_back_by_undo(tmp_path: Path) -> None:
    folder = tmp_path / "scene"
    ball_scene().save(folder)
    scene = Scene.open(folder)
    session = Session(SceneStore(scene, folder).document(), scene.field.bounds, scene.field.sample_spacing)

    def seen() -> list[tuple[float, bool]]:
        shown = state_of(session, "scene", 1, {}).hotspots
        return [(round(each.position[0], 9), each.hidden) for each in shown]

    say(session, type="put_hotspot", title="a", position=[0.1, 0, 0])
    say(session, type="put_hotspot", title="b", position=[0.1, 0, 0], follows=False)
    load(session, [Edit.move(INNER).translate((1, 0, 0))])
    assert seen() == [(1.1, False), (0.1, False)]
    say(session, type="put_hotspot", hotspot=1, title="renamed", position=[1.1, 0, 0])
    assert session.document.hotspots[0].hotspot.position == pytest.approx((0.1, 0, 0))
    with pytest.raises(EditError, match="leave nothing there to follow"):
        say(session, type="put_hotspot", title="c", position=[0, 0, 0])
    session.undo()
    session.undo()
    assert seen() == [(0.1, False), (0.1, False)]
    load(session, [Edit.delete(INNER)])
    assert seen() == [(0.1, True), (0.1, False)]
    # Its title may be written while it is hidden, and it keeps its place.
    say(session, type="put_hotspot", hotspot=1, title="hidden", position=[0.1, 0, 0])
    assert session.document.hotspots[0].hotspot.position == (0.1, 0, 0)


def test_the_preview_of_a_path_has_them_where_the_parts_of_the_edits_carry_them() -> None:
    """A move that is done evenly, a deletion from one half on: closed forms at each moment."""
    c2w = tuple(np.eye(4).ravel())
    keys = tuple(
        Keyframe(tuple(CAMERA.c2w.ravel()) if part else c2w, 40.0, 1.0, {1: part, 2: part})
        for part in (0.0, 1.0)
    )
    edits = (
        Edit.move(INNER).translate((1, 0, 0)),
        Edit.delete(Cage.box((0, 2, 0), 0.4)),
    )
    hotspots = (
        SPOT,
        dataclasses.replace(SPOT, position=(0.0, 2.0, 0.0)),
        dataclasses.replace(SPOT, follows=False),
    )
    document = Document.from_edits(edits, keys=keys, hotspots=hotspots)
    tracks = hotspot_tracks(document, lambda edit: None)
    assert sorted(tracks) == [1, 2] and {len(track) for track in tracks.values()} == {13}
    parts = Timeline(keys, loop=False).parts(np.linspace(0.0, 1.0, 13))
    np.testing.assert_allclose(np.array(tracks[1])[:, 0], 0.1 + parts[1], atol=1e-9)
    assert [place is None for place in tracks[2]] == (parts[2] >= 0.5).tolist()
    still = Document.from_edits(edits, keys=tuple(dataclasses.replace(k, parts={}) for k in keys))
    assert hotspot_tracks(dataclasses.replace(still, hotspots=document.hotspots), lambda edit: None) == {}


def test_a_page_never_marks_on_its_path_what_the_whole_edits_hide() -> None:
    scene = dataclasses.replace(ball_scene(), hotspots=(SPOT,)).with_edits(EditStack([Edit.delete(INNER)]))
    pictures = stills(
        [Keyframe(tuple(CAMERA.c2w.ravel()), 40.0, 1.0, {1: part}) for part in (0.0, 1.0)],
        loop=False, fps=4, width=100, height=100,
    )  # fmt: skip
    assert hotspot_entries(scene, pictures) == []
