"""Keyframed camera paths: what lies between the keys, and nerfstudio's files."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cagefield.cameras.camera_paths import load_camera_path
from cagefield.cameras.keyframe_files import dump_path, is_path, load_keys
from cagefield.cameras.keyframes import Keyframe, Timeline, stills
from cagefield.errors import CameraError


def key(x: float, turn_deg: float = 0.0, fov: float = 50.0, seconds: float = 1.0, **parts: float) -> Keyframe:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("z", turn_deg, degrees=True).as_matrix()
    pose[0, 3] = x
    return Keyframe(tuple(pose.reshape(-1)), fov, seconds, {int(k[1:]): v for k, v in parts.items()})


def test_the_path_goes_through_every_key_at_its_time() -> None:
    keys = [key(0.0, 0, 40.0, 1.0), key(1.0, 30, 50.0, 2.0), key(4.0, 90, 60.0)]
    found = stills(keys, loop=False, fps=10.0, width=80, height=40)
    assert len(found) == 31
    for n, k in ((0, keys[0]), (10, keys[1]), (30, keys[2])):
        np.testing.assert_allclose(found[n].camera.c2w, k.pose, atol=1e-9)
        fov = 2.0 * math.atan(0.5 * 40 / found[n].camera.fy)
        assert math.degrees(fov) == pytest.approx(k.fov_y_deg)


def test_between_keys_the_path_is_smooth() -> None:
    keys = [key(0.0), key(1.0), key(0.0), key(2.0)]
    found = stills(keys, loop=False, fps=200.0, width=8, height=8)
    x = np.array([still.camera.c2w[0, 3] for still in found])
    jumps = np.abs(np.diff(x, 2))
    # A corner at a key would show as a second difference of its change of speed, over 2 / 200; a smooth path
    # has the acceleration over 200^2, here below 30 / 200^2.
    assert jumps.max() < 30.0 / 200.0**2


def test_turning_is_even_between_two_keys() -> None:
    found = stills([key(0.0, 0), key(0.0, 80)], loop=False, fps=4.0, width=8, height=8)
    angles = [math.degrees(math.atan2(s.camera.c2w[1, 0], s.camera.c2w[0, 0])) for s in found]
    np.testing.assert_allclose(angles, [0, 20, 40, 60, 80], atol=1e-6)


@pytest.mark.parametrize("loop", [False, True])
def test_the_camera_rests_between_two_keys_of_one_pose_and_eases_to_it(loop: bool) -> None:
    keys = [key(0.0), key(1.0, 30), key(1.0, 30, seconds=2.0), key(3.0, 80), key(4.0, 200)]
    line = Timeline(keys, loop=loop)
    times = np.linspace(0.0, line.seconds, round(line.seconds * 200) + 1)
    poses = line.poses(times)
    rest = (times >= 1.0) & (times <= 2.0)
    np.testing.assert_array_equal(poses[rest], np.broadcast_to(keys[1].pose, (rest.sum(), 4, 4)))
    at = np.cumsum([0.0] + [k.seconds for k in keys[:-1]])
    np.testing.assert_allclose(line.poses(at), [k.pose for k in keys], atol=1e-9)
    if loop:
        np.testing.assert_allclose(line.poses(np.array([line.seconds]))[0], keys[0].pose, atol=1e-9)
        poses = np.concatenate([poses, poses[1:3]])
    # No corner anywhere: second differences of a path with one would be of its speed, over 200.
    flat = poses[:, :3].reshape(len(poses), -1)
    assert np.abs(np.diff(flat, 2, axis=0)).max() < 30.0 / 200.0**2


def test_a_still_camera_stays_exactly_where_it_is() -> None:
    keys = [key(0.3, 20, e1=part) for part in (0.0, 1.0, 0.5)]
    for loop in (False, True):
        poses = Timeline(keys, loop=loop).poses(np.linspace(0.0, 2.0, 21))
        np.testing.assert_array_equal(poses, np.broadcast_to(keys[0].pose, (21, 4, 4)))


def test_parts_of_edits_are_blended_and_never_leave_their_keys() -> None:
    keys = [key(0, e1=0.0), key(0, e1=0.0), key(0, e1=1.0), key(0, e1=1.0)]
    parts = [still.parts[1] for still in stills(keys, loop=False, fps=20.0, width=8, height=8)]
    assert min(parts) == 0.0 and max(parts) == 1.0 and (np.diff(parts) >= 0.0).all()
    assert set(parts[:21]) == {0.0} and 0.45 < parts[30] < 0.55


def test_an_edit_that_a_key_does_not_name_has_gone_all_the_way() -> None:
    found = stills([key(0, e3=0.0), key(0)], loop=False, fps=2.0, width=8, height=8)
    assert [still.parts for still in found][::2] == [{3: 0.0}, {3: 1.0}]


def test_a_loop_closes_smoothly_and_shows_the_first_key_once() -> None:
    angles = (0, 90, 180, 270)
    keys = [key(math.cos(math.radians(a)), a) for a in angles]
    found = stills(keys, loop=True, fps=50.0, width=8, height=8)
    assert len(found) == 200
    x = np.array([still.camera.c2w[0, 3] for still in found])
    around = np.concatenate([x, x[:3]])
    # As above: no corner, at the seam neither.
    assert np.abs(np.diff(around, 2)).max() < 6.0 / 50.0**2
    turn = Rotation.from_matrix(found[-1].camera.c2w[:3, :3].T @ found[0].camera.c2w[:3, :3])
    assert math.degrees(turn.magnitude()) == pytest.approx(90 / 50, rel=1e-3)


def test_one_key_is_one_picture_and_none_is_an_error() -> None:
    assert len(stills([key(1.0)], loop=True, fps=24.0, width=8, height=8)) == 1
    with pytest.raises(CameraError, match="needs at least one keyframe"):
        stills([], loop=False, fps=24.0, width=8, height=8)
    with pytest.raises(CameraError, match="make it shorter"):
        stills([key(0, seconds=3600.0), key(1)], loop=False, fps=120.0, width=8, height=8)


def test_files_are_nerfstudio_camera_paths_and_give_the_keys_back(tmp_path: Path) -> None:
    keys = (key(0.0, 10, 40.0, 1.5, e1=0.25), key(1.0, 20, 45.0, 0.5))
    file = tmp_path / "path.json"
    file.write_text(dump_path(keys, loop=True, fps=10.0, width=64, height=32))
    assert load_keys(file) == (keys, True)
    path = load_camera_path(file)
    expected = stills(keys, loop=True, fps=10.0, width=64, height=32)
    assert path.fps == 10.0 and len(path.cameras) == len(expected)
    for camera, still in zip(path.cameras, expected, strict=True):
        np.testing.assert_allclose(camera.c2w, still.camera.c2w, atol=1e-12)
        assert camera.fx == pytest.approx(still.camera.fx)
    file.write_text(dump_path((), loop=False))
    assert load_keys(file) == ((), False)


def test_times_are_read_as_nerfstudio_means_them(tmp_path: Path) -> None:
    document = json.loads(dump_path((key(0.0), key(1.0), key(2.0)), loop=False))
    first, second, third = document["keyframes"]
    first |= {"override_transition_enabled": False, "override_transition_sec": None}
    second |= {"override_transition_enabled": True, "override_transition_sec": 0.5}
    third |= {"override_transition_enabled": False, "override_transition_sec": 9.0}
    document["default_transition_sec"] = 3.0
    file = tmp_path / "path.json"
    file.write_text(json.dumps(document))
    # A key's own time is the one in front of it: 0 to 1 takes 0.5 s, 1 to 2 the usual 3 s.
    assert [k.seconds for k in load_keys(file)[0]] == [0.5, 3.0, 3.0]


@pytest.mark.parametrize("text", ["[]", "{}", "nothing", '{"keyframes": 3}', '{"keyframes": [', "[" * 10**5])
def test_a_file_without_keys_says_so(tmp_path: Path, text: str) -> None:
    file = tmp_path / "path.json"
    file.write_text(text)
    with pytest.raises(CameraError, match=r"path\.json.* write the camera path again.*remove it") as caught:
        load_keys(file)
    assert "\n" not in str(caught.value)


POSE = np.eye(4).ravel().tolist()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"matrix": [1.0]}, r'keyframes\[1\]: "matrix" must hold 16 numbers'),
        ({"matrix": [*POSE[:15], "one"]}, r'keyframes\[1\]: "matrix" must hold 16 numbers'),
        ({"matrix": [math.nan, *POSE[1:]]}, r'keyframes\[1\]: "matrix" must hold 16 numbers'),
        (
            {"matrix": [2.0, *POSE[1:]]},
            r"keyframes\[1\]: c2w is not a rigid motion.*take scale and shear out",
        ),
        ({"fov": None}, r'keyframes\[1\]: "fov" must be a number, got nothing'),
        ({"fov": 180}, r"keyframes\[1\]: the field of view is 180; give 0.2 to 178 degrees"),
        (
            {"override_transition_sec": "soon"},
            r'keyframes\[1\]: "override_transition_sec" must be .* got "soon"',
        ),
        (
            {"override_transition_sec": 0},
            r"keyframes\[0\]: the time to the next key is 0 s; give 0.01 to 3600",
        ),
        ({"cagefield_parts": [1]}, r'keyframes\[1\]: "cagefield_parts" must give numbers from 0 to 1'),
        ({"cagefield_parts": {"arm": 1}}, r'keyframes\[1\]: "cagefield_parts" must give numbers from 0 to 1'),
        ({"cagefield_parts": {"3": 7}}, r"keyframes\[1\]: the part of edit 3 is 7; give 0 to 1"),
        (
            {"cagefield_parts": {"0": 1}},
            r"keyframes\[1\]: a part of edit 0 is given; edits are numbered from 1",
        ),
    ],
)
def test_a_bad_value_in_a_file_is_named_with_its_cure(
    tmp_path: Path, change: dict[str, object], message: str
) -> None:
    document = json.loads(dump_path((key(0.0), key(1.0)), loop=False))
    document["keyframes"][1] |= change
    file = tmp_path / "path.json"
    file.write_text(json.dumps(document))
    with pytest.raises(CameraError, match=r"path\.json: " + message):
        load_keys(file)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"keyframes": [3]}, r'keyframes\[0\]: a keyframe must have the keys "matrix" and "fov", got 3'),
        ({"default_transition_sec": "x"}, '"default_transition_sec" must be a number, got "x"'),
        ({"is_cycle": 1}, '"is_cycle" is 1; give true or false'),
    ],
)
def test_a_bad_value_beside_the_keys_is_named(
    tmp_path: Path, change: dict[str, object], message: str
) -> None:
    document = json.loads(dump_path((key(0.0), key(1.0)), loop=False)) | change
    file = tmp_path / "path.json"
    file.write_text(json.dumps(document))
    with pytest.raises(CameraError, match=message):
        load_keys(file)


def test_a_camera_path_is_told_from_edits_even_when_damaged() -> None:
    text = dump_path((key(0.0),), loop=False)
    assert is_path(text) and is_path(text[:60])
    assert not is_path('{"edits": [{"name": "camera_path"}]}') and not is_path("edits: []")


def test_impossible_keys_are_refused() -> None:
    pose = tuple(POSE)
    with pytest.raises(CameraError, match="16 finite numbers"):
        Keyframe((1.0,), 50.0)
    with pytest.raises(CameraError, match="not a rigid motion"):
        Keyframe((0.0,) * 15 + (1.0,), 50.0)
    with pytest.raises(CameraError, match=r"field of view is 180; give 0.2 to 178 degrees"):
        Keyframe(pose, 180.0)
    for seconds in (0.0, math.inf, math.nan):
        with pytest.raises(CameraError, match="the time to the next key is"):
            Keyframe(pose, 50.0, seconds)
    with pytest.raises(CameraError, match="part of edit 2 is -1; give 0 to 1"):
        Keyframe(pose, 50.0, 1.0, {2: -1.0})


def test_the_files_aspect_is_the_pictures(tmp_path: Path) -> None:
    document = json.loads(dump_path((key(0),), loop=False, width=200, height=100))
    assert document["camera_path"][0]["aspect"] == document["keyframes"][0]["aspect"] == 2.0


def test_a_timeline_is_where_the_stills_are_at_any_time() -> None:
    keys = [key(0.0, 0, 40.0, 1.0, e2=0.0), key(1.0, 30, 50.0, 2.0), key(4.0, 90, 60.0, 0.5)]
    for loop, seconds in ((False, 3.0), (True, 3.5)):
        line = Timeline(keys, loop=loop)
        assert line.seconds == seconds
        found = stills(keys, loop=loop, fps=10.0, width=80, height=40)
        at = np.arange(len(found)) / 10.0
        np.testing.assert_allclose(line.poses(at), [still.camera.c2w for still in found], atol=1e-12)
        np.testing.assert_allclose(line.fovs_y_deg(at), [still.fov_y_deg for still in found])
        np.testing.assert_allclose(line.parts(at)[2], [still.parts[2] for still in found])
    for few in ([], keys[:1]):
        with pytest.raises(CameraError, match=f"with {len(few)} keyframes does not move; record at least"):
            Timeline(few, loop=True)
