"""Hotspots: their values, files, commands, the editor's session, and the cameras of a tour."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cagefield import Hotspot, HotspotView, Scene
from cagefield.cameras.camera import Camera
from cagefield.cameras.keyframe_files import load_keys
from cagefield.cameras.keyframes import Timeline
from cagefield.errors import CagefieldError, EditError, SceneError
from cagefield.scene.hotspot_tour import FLIGHT_SECONDS, between, pose_of, tour_cameras, tour_keys
from cagefield.scene.hotspots import (
    MAX_HOTSPOTS,
    MAX_TEXT_CHARACTERS,
    MAX_TITLE_CHARACTERS,
    find_hotspot,
    hotspots_from_value,
    resolved_view,
    view_of_camera,
)
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.session import Session
from cagefield.server.protocol.client_messages import page_messages
from cagefield.server.protocol.conversion import state_of
from cagefield.server.protocol.hotspot_messages import TourPath
from cagefield.server.web.hotspot_handlers import change_hotspots, set_tour
from commands import printed, refused
from scenes import ball_scene

HOSTILE = '<img src=x onerror="document.title=1"></script><script>document.title = "taken"</script>'
UP = (0.0, 0.0, 1.0)


def camera(eye: tuple[float, float, float] = (3.0, 1.0, 2.0)) -> Camera:
    return Camera.look_at(eye, (0, 0, 0), UP, width=80, height=60, fov_x=0.9)


def hotspots() -> tuple[Hotspot, ...]:
    return (
        Hotspot("Top", (0.0, 0.0, 0.5), "first line\nsecond line", view_of_camera(camera())),
        Hotspot(HOSTILE, (0.5, 0.0, 0.0), HOSTILE),
    )


def test_values_come_back_from_files() -> None:
    values = json.loads(json.dumps([hotspot.to_dict() for hotspot in hotspots()]))
    assert hotspots_from_value(values) == hotspots()


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ({"title": "a", "position": [0, 0, float("nan")]}, "hotspot 1: the position .* finite"),
        ({"title": "a", "position": [0, 0, 1e12]}, "finite numbers up to 1e\\+09"),
        ({"title": "a", "position": [0, True, 0]}, "3 finite numbers"),
        ({"title": "a", "position": [0, 10**400, 0]}, "3 finite numbers"),
        ({"title": "a", "position": "123"}, "3 finite numbers"),
        ({"title": " ", "position": [0, 0, 0]}, "title of a hotspot is empty"),
        ({"title": "a\x00", "position": [0, 0, 0]}, "control character, U\\+0000"),
        ({"title": "a\nb", "position": [0, 0, 0]}, "control character, U\\+000A"),
        ({"title": "a" * (MAX_TITLE_CHARACTERS + 1), "position": [0, 0, 0]}, "at most 120; shorten"),
        ({"title": "a", "text": "b" * (MAX_TEXT_CHARACTERS + 1), "position": [0, 0, 0]}, "at most 2000"),
        ({"title": "a", "text": 3, "position": [0, 0, 0]}, "must be text"),
        ({"position": [0, 0, 0]}, "lacks title or position"),
        ({"title": "a", "position": [0, 0, 0], "html": "x"}, "must have title and position"),
        ({"title": "a", "position": [0, 0, 0], "camera": {"c2w": [0.0] * 16, "fov_y_deg": 40.0}}, "camera"),
        ({"title": "a", "position": [0, 0, 0], "camera": {"c2w": "x", "fov_y_deg": 40.0}}, "c2w must be 16"),
        ("text", "a hotspot is 'text'"),
    ],
)  # fmt: skip
def test_impossible_values_are_refused(value: object, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        hotspots_from_value([value])


def test_their_number_is_limited() -> None:
    many = [Hotspot(f"h{n}", (0.0, 0.0, 0.0)).to_dict() for n in range(MAX_HOTSPOTS + 1)]
    assert len(hotspots_from_value(many[1:])) == MAX_HOTSPOTS
    with pytest.raises(SceneError, match="201 hotspots; a scene has at most 200"):
        hotspots_from_value(many)


def test_a_scene_keeps_them(tmp_path: Path) -> None:
    scene = dataclasses.replace(ball_scene(), hotspots=hotspots())
    scene.save(tmp_path / "scene")
    opened = Scene.open(tmp_path / "scene")
    assert opened.hotspots == hotspots() == opened.with_edits(opened.edits).hotspots
    manifest = json.loads((tmp_path / "scene" / "scene.json").read_text())
    manifest["hotspots"][1]["position"] = [0, 0]
    (tmp_path / "scene" / "scene.json").write_text(json.dumps(manifest))
    with pytest.raises(SceneError, match=r"scene\.json: hotspot 2: the position"):
        Scene.open(tmp_path / "scene")


def test_a_view_without_camera_looks_at_the_hotspot() -> None:
    hotspot, first = Hotspot("a", (0.2, 0.3, 0.1)), camera()
    view = resolved_view(hotspot, first, UP)
    pose = np.array(view.c2w).reshape(4, 4)
    ray = np.array(hotspot.position) - pose[:3, 3]
    # On the axis, half as far as the first view, on the line to its eye.
    np.testing.assert_allclose(ray / np.linalg.norm(ray), -pose[:3, 2], atol=1e-12)
    np.testing.assert_allclose(pose[:3, 3], 0.5 * (first.origin + hotspot.position), atol=1e-12)
    above = Camera.look_at((0, 0, 3), (0, 0, 0), (0, 1, 0), width=10, height=10, fov_x=1.0)
    from_above = np.array(resolved_view(Hotspot("a", (0, 0, 0)), above, UP).c2w).reshape(4, 4)
    np.testing.assert_allclose(from_above[:3, 3], (0, 0, 1.5), atol=1e-12)


def test_a_flight_starts_ends_and_turns_evenly() -> None:
    one = pose_of(view_of_camera(camera((2.0, 0.0, 0.0))), (0, 0, 0))
    other = pose_of(view_of_camera(camera((0.0, 8.0, 0.0))), (0, 0, 0))
    for t, pose in ((0.0, one), (1.0, other)):
        np.testing.assert_allclose(between(one, other, t, UP).eye, pose.eye, atol=1e-9)
    middle = between(one, other, 0.5, UP)
    # Half of the quarter turn, at the geometric mean of the distances.
    np.testing.assert_allclose(middle.eye, 4.0 * np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0), atol=1e-9)
    back = pose_of(view_of_camera(camera((-2.0, 0.0, 0.0))), (0, 0, 0))
    np.testing.assert_allclose(between(one, back, 0.5, UP).eye, (0, 2, 0), atol=1e-9)  # about the vertical


def test_a_tour_stops_at_each_hotspot() -> None:
    first = camera()
    cameras = tour_cameras(hotspots(), first, UP, stop_seconds=1.0, fps=4.0, width=64, height=48)
    assert len(cameras) == 4 + round(4.0 * FLIGHT_SECONDS) + 4
    eyes = np.array([one.origin for one in cameras])
    assert (np.ptp(eyes[:4], axis=0) == 0.0).all() and (np.ptp(eyes[-4:], axis=0) == 0.0).all()
    np.testing.assert_allclose(eyes[0], first.origin, atol=1e-9)
    assert (np.linalg.norm(np.diff(eyes[3:-3], axis=0), axis=1) > 0.0).all()
    assert cameras[0].fx == pytest.approx(0.5 * 48 / np.tan(0.5 * np.radians(hotspots()[0].view.fov_y_deg)))
    with pytest.raises(SceneError, match="has no hotspots"):
        tour_cameras((), first, UP, stop_seconds=1.0, fps=4.0, width=64, height=48)
    with pytest.raises(SceneError, match="the stop is nan"):
        tour_cameras(hotspots(), first, UP, stop_seconds=float("nan"), fps=4.0, width=64, height=48)


def test_a_tour_as_a_camera_path_flies_as_its_video_and_rests_at_each_hotspot() -> None:
    first = camera()
    spots = (*hotspots(), Hotspot("Behind", (0.0, -0.5, 0.0)))
    timeline = Timeline(tour_keys(spots, first, UP, stop_seconds=1.0), loop=False)
    assert timeline.seconds == pytest.approx(3 * 1.0 + 2 * FLIGHT_SECONDS)
    fps = 10.0
    cameras = tour_cameras(spots, first, UP, stop_seconds=1.0, fps=fps, width=64, height=64)
    rests = np.array([0.0, 0.3, 1.0, 3.5, 4.5, 7.0, 8.0])
    poses = timeline.poses(rests)
    np.testing.assert_allclose(poses[[1, 4, 6]], poses[[0, 3, 5]], atol=1e-9)
    np.testing.assert_allclose(poses[2], poses[0], atol=1e-9)
    times = 1.0 + FLIGHT_SECONDS * np.arange(1, 26) / 26  # the pictures of the first flight
    eyes = np.array([one.origin for one in cameras[10:35]])
    length = np.linalg.norm(eyes[-1] - eyes[0])
    off = np.linalg.norm(timeline.poses(times)[:, :3, 3] - eyes, axis=1)
    assert off.max() < 0.02 * length
    many = tour_keys([Hotspot(str(n), (0.1 * n, 0, 0)) for n in range(200)], first, UP, stop_seconds=1.0)
    assert len(many) == 400
    with pytest.raises(SceneError, match="has no hotspots"):
        tour_keys((), first, UP, stop_seconds=1.0)
    with pytest.raises(SceneError, match=r"the stop is 0 s; give 0.01 to 600"):
        tour_keys(spots, first, UP, stop_seconds=0.0)


def test_the_command_writes_the_tour_as_a_camera_path(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = dataclasses.replace(ball_scene(), hotspots=hotspots())
    scene.save(tmp_path / "scene")
    words = ["hotspot", str(tmp_path / "scene"), "--tour"]
    text = printed(capsys, *words, str(tmp_path / "tour.json"), "--stop", "2")
    assert f"a camera path of 2 stops, 6.5 s, written to {tmp_path / 'tour.json'}" in text
    keys, loop = load_keys(tmp_path / "tour.json")
    expected = tour_keys(hotspots(), scene.first_camera, scene.up, stop_seconds=2.0)
    assert not loop and [key.seconds for key in keys[:-1]] == [key.seconds for key in expected[:-1]]
    np.testing.assert_allclose([key.c2w for key in keys], [key.c2w for key in expected], atol=1e-9)
    assert "exists already" in refused(capsys, *words, str(tmp_path / "tour.json"))
    assert "is a .json file" in refused(capsys, *words, str(tmp_path / "tour.mp4"))
    ball_scene().save(tmp_path / "bare")
    assert "has no hotspots" in refused(
        capsys, "hotspot", str(tmp_path / "bare"), "--tour", str(tmp_path / "x.json")
    )


def test_names_and_numbers_find_hotspots() -> None:
    both = (
        Hotspot("2", (0, 0, 0)),
        Hotspot("a", (0, 0, 0)),
        Hotspot("b", (0, 0, 0)),
        Hotspot("b", (1, 0, 0)),
    )
    assert [find_hotspot(both, name) for name in ("2", "a", "3")] == [0, 1, 2]
    with pytest.raises(SceneError, match='2 hotspots have the title "b"; give one of 3, 4'):
        find_hotspot(both, "b")
    with pytest.raises(SceneError, match='"9" is no hotspot'):
        find_hotspot(both, "9")


def test_the_command_adds_changes_orders_and_removes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "scene"
    ball_scene().save(folder)
    edits = (folder / "edits.yaml").read_bytes()
    add = ["hotspot", str(folder), "--add", "Top", "--at", "0", "0", "0.5", "--text", "a\\nb"]
    printed(capsys, *add, "--camera", "test", "0")
    text = printed(capsys, "hotspot", str(folder), "--add", "Side", "--at", "0.5", "0", "0")
    assert "1   Top  (0, 0, 0.5), camera" in text and "2   Side  (0.5, 0, 0)" in text
    scene = Scene.open(folder)
    assert scene.hotspots[0].text == "a\nb"
    assert scene.hotspots[0].view == view_of_camera(scene.cameras["test"][0])
    printed(capsys, "hotspot", str(folder), "--change", "2", "--title", "Flank", "--text", "c")
    printed(capsys, "hotspot", str(folder), "--order", "Flank", "Top")
    printed(capsys, "hotspot", str(folder), "--dump", str(tmp_path / "h.yaml"))
    assert [h.title for h in Scene.open(folder).hotspots] == ["Flank", "Top"]
    printed(capsys, "hotspot", str(folder), "--remove", "1")
    assert [h.title for h in Scene.open(folder).hotspots] == ["Top"]
    printed(capsys, "hotspot", str(folder), "--load", str(tmp_path / "h.yaml"))
    assert [h.title for h in Scene.open(folder).hotspots] == ["Flank", "Top"]
    assert (folder / "edits.yaml").read_bytes() == edits
    for arguments, message in (
        (["--add", "x"], "needs a position"),
        (["--at", "0", "0", "0"], "are for --add and --change"),
        (["--add", "x", "--at", "nan", "0", "0"], "3 finite numbers"),
        (["--add", "x", "--at", "0", "0", "0", "--camera", "test", "99"], "is no camera of the scene"),
        (["--remove", "nothing"], "is no hotspot of the scene"),
        (["--order", "Top"], "each of the 2 hotspots once"),
        (["--dump", str(tmp_path / "h.yaml")], "exists already"),
        (["--load", str(folder / "cameras.json")], "a list with the key hotspots"),
    ):
        assert message in refused(capsys, "hotspot", str(folder), *arguments)
    assert [h.title for h in Scene.open(folder).hotspots] == ["Flank", "Top"]


def opened(folder: Path) -> tuple[SceneStore, Session]:
    scene = Scene.open(folder)
    store = SceneStore(scene, folder)
    return store, Session(store.document(), scene.field.bounds, scene.field.sample_spacing)


def say(session: Session, **message: Any) -> None:
    change_hotspots(session, page_messages.validate_python(message))  # type: ignore[arg-type]


def titles(session: Session) -> list[str]:
    return [entry.title for entry in state_of(session, "scene", 1, {}).hotspots]


def test_a_session_places_changes_and_undoes(tmp_path: Path) -> None:
    folder = tmp_path / "scene"
    ball_scene().save(folder)
    store, session = opened(folder)
    view = view_of_camera(camera())
    seen = {"c2w": list(view.c2w), "fov_y_deg": view.fov_y_deg}
    say(session, type="put_hotspot", title="a", position=[0, 0, 1], text="one\ntwo", camera=seen)
    say(session, type="put_hotspot", title="b", position=[0, 0, 2])
    assert titles(session) == ["a", "b"] and not session.saved
    say(session, type="move_hotspot", hotspot=2, to=0)
    assert titles(session) == ["b", "a"]
    say(session, type="put_hotspot", hotspot=1, title="renamed", position=[0, 0, 1])
    say(session, type="move_hotspot", hotspot=2)
    assert titles(session) == ["renamed"]
    with pytest.raises(EditError, match="hotspot 2 is not there any more"):
        say(session, type="put_hotspot", hotspot=2, title="late", position=[0, 0, 1])
    with pytest.raises(CagefieldError, match="camera of a hotspot"):
        bad = {"c2w": [0.0] * 16, "fov_y_deg": 40.0}
        say(session, type="put_hotspot", title="c", position=[0, 0, 1], camera=bad)
    for _ in range(2):
        session.undo()
    assert titles(session) == ["b", "a"]
    # A number that is undone is not given out again.
    say(session, type="put_hotspot", title="c", position=[0, 0, 3])
    assert [entry.id for entry in session.document.hotspots] == [2, 1, 3]
    store.autosave(session)
    fresh, _ = opened(folder)
    recovered = fresh.recovered()
    assert recovered is not None
    assert [entry.hotspot for entry in recovered.hotspots] == [e.hotspot for e in session.document.hotspots]
    store.save(session)
    assert session.saved
    assert [h.title for h in Scene.open(folder).hotspots] == ["b", "a", "c"]
    assert Scene.open(folder).hotspots[1].view == HotspotView(view.c2w, view.fov_y_deg)


def test_a_session_takes_the_tour_as_its_path_and_undoes_it(tmp_path: Path) -> None:
    scene = dataclasses.replace(ball_scene(), hotspots=hotspots())
    scene.save(tmp_path / "scene")
    store, session = opened(tmp_path / "scene")
    set_tour(session, TourPath(stop=1.5), scene.first_camera, scene.up)
    assert session.document.keys == tour_keys(hotspots(), scene.first_camera, scene.up, stop_seconds=1.5)
    store.save(session)
    saved = load_keys(tmp_path / "scene" / "camera_path.json")[0]
    assert [key.seconds for key in saved[:2]] == [1.5, 0.5]
    session.undo()
    assert session.document.keys == ()
    for number in (1, 2):
        session.remove_hotspot(number)
    with pytest.raises(SceneError, match="has no hotspots"):
        set_tour(session, TourPath(), scene.first_camera, scene.up)


def test_a_full_list_takes_no_more(tmp_path: Path) -> None:
    dataclasses.replace(
        ball_scene(), hotspots=tuple(Hotspot(f"h{n}", (0, 0, 0)) for n in range(MAX_HOTSPOTS))
    ).save(tmp_path / "scene")
    _, session = opened(tmp_path / "scene")
    with pytest.raises(EditError, match="at most 200 hotspots"):
        say(session, type="put_hotspot", title="one more", position=[0, 0, 0])


def test_a_save_keeps_what_another_program_wrote_meanwhile(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "scene"
    ball_scene().save(folder)
    store, session = opened(folder)
    printed(capsys, "align", str(folder), "--meters-per-unit", "2.5", "--up", "0,0.1,1")
    printed(capsys, "hotspot", str(folder), "--add", "late", "--at", "0", "0", "0")
    session.preserve_opacity(False)
    store.save(session)
    scene = Scene.open(folder)
    assert scene.alignment.meters_per_unit == 2.5 and scene.alignment.up is not None
    assert [h.title for h in scene.hotspots] == ["late"] and not scene.preserve_opacity
    # The session has them now: the next save writes them again, and undo takes them back.
    assert session.document.meters_per_unit == 2.5 and session.saved
    store.save(session)
    assert Scene.open(folder).alignment.meters_per_unit == 2.5
    session.undo()
    assert session.document.meters_per_unit is None and session.document.hotspots == ()


def test_a_value_that_both_changed_is_replaced_at_the_second_save(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "scene"
    ball_scene().save(folder)
    store, session = opened(folder)
    session.set_scale(7.0)
    printed(capsys, "align", str(folder), "--meters-per-unit", "2.5", "--up", "0,0.1,1")
    with pytest.raises(
        SceneError, match=r"scene\.json was changed by another program, and so were the scale"
    ):
        store.save(session)
    assert Scene.open(folder).alignment.meters_per_unit == 2.5
    store.save(session)
    scene = Scene.open(folder)
    assert scene.alignment.meters_per_unit == 7.0
    np.testing.assert_allclose(scene.alignment.up, np.array([0.0, 0.1, 1.0]) / np.sqrt(1.01), atol=1e-12)
    store.save(session)  # no notice without another change
