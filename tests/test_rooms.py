"""Rooms and captures: the mirror against a mirrored scene, photos against models of light and noise."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.datasets import load_dataset
from cagefield.errors import DatasetError, SceneError
from cagefield.images.image_files import read_image
from cagefield.procedural import CAPTURES, ProceduralScene, capture, make_capture
from cagefield.procedural.hand_held import Phone, develop_photo, exposure_gains, render_image
from cagefield.procedural.parts import Part, Primitive, pose_matrix
from cagefield.procedural.room_light import Room
from cagefield.procedural.rooms import ROOMS
from cagefield.procedural.shapes import Box, Sphere
from cagefield.procedural.srgb import decode_srgb, encode_srgb
from cagefield.procedural.textures import Plain
from cagefield.procedural.tracks import OBSERVATION_NOISE_PIXELS, simulate_tracks

RED, GREY = Plain((0.8, 0.1, 0.1), 0.0), Plain((0.3, 0.3, 0.3), 0.0)


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """A capture of 16 small photos of the digger's room."""
    return make_capture("room-digger", tmp_path_factory.mktemp("room") / "d", views=16, size=160, depth="all")


def board(mirror: float) -> Part:
    """A polished slab whose top face is z = 0."""
    slab = Primitive(Box((2.0, 2.0, 0.1)), GREY, pose_matrix((0, 0, -0.1))[None], (0.0, 8.0), mirror=mirror)
    return Part("board", (slab,))


def ball(height: float) -> Part:
    lit = Primitive(Sphere(0.3), RED, pose_matrix((0, 0, height))[None], luminous=1.0)
    return Part("ball", (lit,))


def test_a_polished_face_shows_the_mirror_image_by_schlicks_share():
    """What is reflected is what a camera sees of the scene mirrored below the face, without the face."""
    camera = Camera.look_at((2.0, -1.0, 1.2), (0, 0, 0), width=60, height=60, fov_x=0.8)
    polished = ProceduralScene("polished", (board(0.3), ball(0.5))).photograph(camera, supersample=1)
    dull = ProceduralScene("dull", (board(0.0), ball(0.5))).photograph(camera, supersample=1)
    mirrored = ProceduralScene("mirrored", (ball(-0.5),)).photograph(camera, supersample=1)
    directions = camera.rays()[1].reshape(60, 60, 3)
    on_board = dull.normals[..., 2] > 0.9999
    on_board &= dull.rgb[..., 0] < 0.6
    share = 0.3 + 0.7 * (1 - np.abs(directions[..., 2])) ** 5
    expected = dull.rgb * (1 - share[..., None]) + share[..., None] * mirrored.premultiplied()
    seen = on_board & (mirrored.opacity == 1)
    assert seen.sum() > 20
    np.testing.assert_allclose(polished.rgb[on_board], expected[on_board], atol=2e-3)
    np.testing.assert_array_equal(polished.depth, dull.depth)


def test_a_luminous_surface_sends_out_its_texture_times_its_factor():
    lit = Primitive(Sphere(0.3), RED, luminous=1.5)
    scene = ProceduralScene("lamp", (Part("lamp", (lit,)),))
    rgb = scene.shoot(np.array([0.0, -2.0, 0.0]), np.array([[0], [1], [0]], np.float32))[0]
    np.testing.assert_allclose(rgb, [[1.2, 0.15, 0.15]], rtol=1e-6)


@pytest.mark.parametrize("name", ROOMS)
def test_every_ray_ends_and_the_walls_are_smooth_but_not_of_one_color(name):
    plan = capture(name)
    cameras = plan.cameras(plan.phone.resized(64), 5, 0)
    for camera in cameras:
        low, high = np.array(plan.scene.room.low), np.array(plan.scene.room.high)
        assert (camera.origin > low).all() and (camera.origin < high).all()
    rgb, distance = render_image(plan.scene, cameras[0])
    assert np.isfinite(distance).all() and distance.min() > 0.1
    assert rgb.min() >= 0 and rgb.std() > 0.05
    scene, room = plan.scene, plan.scene.room
    # the -y wall, a metre from the edges: shaded, yet without steps
    x = np.linspace(room.low[0] + 1, room.high[0] - 1, 40)
    eye = np.array([(room.low[0] + room.high[0]) / 2, room.high[1] - 0.3, room.high[2] - 0.3])
    toward = np.stack([x, np.full(40, room.low[1]), np.full(40, room.high[2] - 1.0)], 1) - eye
    toward = (toward / np.linalg.norm(toward, axis=1, keepdims=True)).astype(np.float32)
    wall = scene.shoot(eye, np.ascontiguousarray(toward.T))[0].mean(1)
    assert 0.01 < np.ptp(wall) < 0.4
    assert np.abs(np.diff(wall)).max() < 0.05


def test_light_falls_from_the_window_and_things_cast_a_shadow():
    room = Room((-4, -4, 0), (4, 4, 5), ((-1, 2), (1, 4)), ("floor",))
    floor = Part("floor", (Primitive(Box((5, 5, 0.2)), GREY, pose_matrix((0, 0, -0.2))[None], (0, 8)),))
    post = Part("post", (Primitive(Box((0.3, 0.1, 0.8)), GREY, pose_matrix((0, 1.0, 0.8))[None], (0, 8)),))
    down = np.array([[0, 0, 0], [0, 0, 0], [-1, -1, -1]], np.float32)[:, :1]

    def floor_at(scene: ProceduralScene, x: float, y: float) -> float:
        return float(scene.shoot(np.array([x, y, 1.9]), down)[0].mean())

    lit = ProceduralScene("lit", (floor, Part("far", (dataclasses.replace(
        post.primitives[0], poses=pose_matrix((3.5, -3.5, 0.8))[None]),))), room=room)  # fmt: skip
    shaded = ProceduralScene("shaded", (floor, post), room=room)
    assert floor_at(lit, 0, 2.0) > floor_at(lit, 0, -3.0) + 0.02
    # behind the post, seen from the window, and beside it
    assert floor_at(shaded, 0, 0.4) < 0.9 * floor_at(lit, 0, 0.4)
    assert floor_at(shaded, 2.5, 0.4) == pytest.approx(floor_at(lit, 2.5, 0.4), abs=1e-3)
    # the light stays as modelled where the post is moved
    moved = shaded.move("post", translate=(2.0, 0, 0))
    assert floor_at(moved, 0, 0.4) == floor_at(shaded, 0, 0.4)


def test_edges_are_looked_at_more_closely_and_plain_parts_once():
    plan = capture("room-chair")
    camera = plan.cameras(plan.phone.resized(96), 3, 0)[1]
    scene = plan.scene
    rgb, distance = render_image(scene, camera)
    fine, once = scene.photograph(camera, supersample=2).rgb, scene.photograph(camera, supersample=1)
    np.testing.assert_array_equal(distance, once.depth)
    edge = np.abs(rgb - once.rgb).max(-1) > 0
    assert 0.02 < edge.mean() < 0.6
    # 8 bits of a photo resolve .004; what was looked at once changes little within a pixel
    assert np.abs(rgb - fine).mean() < 0.002
    np.testing.assert_allclose(rgb[edge], fine[edge], atol=1e-5)


def test_a_photo_is_linear_in_the_exposure_and_as_noisy_as_stated():
    values = np.linspace(0, 1, 11)
    np.testing.assert_allclose(encode_srgb(decode_srgb(values)), values, atol=1e-12)
    np.testing.assert_allclose(decode_srgb(np.array([0.5])), 0.21404114, rtol=1e-6)
    rng = np.random.RandomState(0)
    gray = np.full((200, 200, 3), 0.6, np.float32)
    bright = develop_photo(gray, np.float32([1.3, 1.3, 1.3]), rng) / 255
    assert bright.mean() == pytest.approx(encode_srgb(1.3 * decode_srgb(np.array(0.6))), abs=2e-3)
    assert 0.003 < bright.std() < 0.02
    pictures = [gray, np.full_like(gray, 0.7), np.full_like(gray, 0.5)]
    gains = exposure_gains(pictures, 1.0, rng)
    after = [decode_srgb(np.float64(p)).mean() * g.mean() for p, g in zip(pictures, gains, strict=True)]
    # chance of .04 and color of .012 are left
    assert np.ptp(np.log(after)) < 0.3
    assert np.exp(np.log(exposure_gains(pictures, 0.0, rng)).mean()) == pytest.approx(1.0, abs=0.05)


@pytest.mark.nightly
def test_a_capture_is_read_as_photos_without_alpha_in_the_rooms_world(small):
    data = load_dataset(small)
    assert data.unbounded and not data.white_background
    assert len(data.train) == 14 and [v.name for v in data.test] == [
        "images/frame_00001.jpg",
        "images/frame_00009.jpg",
    ]
    plan = capture("room-digger")
    cameras = plan.cameras(plan.phone.resized(160), 16, 0)
    read = data.test[1].camera
    assert np.array_equal(read.c2w, cameras[8].c2w) and (read.fx, read.cy) == (cameras[8].fx, 80.0)
    assert read_image(data.test[0].image_path).shape == (160, 90, 3)
    truth = np.load(small / "depth/frame_00009.npy")
    np.testing.assert_array_equal(truth, render_image(plan.scene, cameras[8])[1])
    assert data.test[0].camera.distortion[:2] == (0.045, -0.02)
    values = json.loads((small / "transforms.json").read_text())
    assert values["camera_model"] == "OPENCV" and values["frames"][0]["colmap_im_id"] == 1


@pytest.mark.nightly
def test_the_colmap_model_beside_agrees_with_transforms_and_knows_who_sees_what(small):
    pytest.importorskip("pycolmap")
    data = load_dataset(small)
    model = load_dataset(small / "colmap/sparse/0/cameras.txt")
    back = np.linalg.inv(model.source_to_world)
    for ours, theirs in zip((*data.test, *data.train), (*model.test, *model.train), strict=True):
        np.testing.assert_allclose(back @ theirs.camera.c2w, ours.camera.c2w, atol=1e-9)
        assert theirs.camera.fx == ours.camera.fx and theirs.camera.distortion == ours.camera.distortion[:4]
    points = model.points
    assert points is not None and len(points) > 40
    np.testing.assert_allclose(points.positions @ back[:3, :3].T, data.points.positions, atol=1e-5)
    assert all(len(names) >= 3 for names in points.seen_by)
    # a point lies near the surface that a photo which sees it shows, as near as .7 pixels allow
    view = model.train[0]
    mine = np.array([view.name in names for names in points.seen_by])
    pixels, _ = view.camera.project(points.positions[mine])
    depth = np.load(small / "depth" / f"{view.name[:-4]}.npy")
    column, row = pixels.astype(int).T
    distance = np.linalg.norm(points.positions[mine] - view.camera.origin, axis=1)
    error = np.abs(depth[row, column] - distance) / distance
    assert mine.sum() > 10 and np.median(error) < 0.02


def test_tracks_have_the_stated_noise_and_ignore_what_is_plain():
    """A wall with spots seen from a row of cameras: points on the wall, at spots alone."""
    rng = np.random.RandomState(1)
    cameras = [
        Camera.look_at((x, -4.0, 0.3 * x), (0, 0, 0), width=120, height=120, fov_x=0.7)
        for x in np.linspace(-1, 1, 7)
    ]
    spots = rng.uniform(-1, 1, (40, 2))
    spots = spots[np.abs(spots[:, 0]) > 0.3]
    photos, depths = [], []
    for camera in cameras:
        origins, directions = camera.rays()
        t = -origins[:, 1] / directions[:, 1]
        wall = (origins + t[:, None] * directions)[:, [0, 2]]
        ink = np.exp(-((wall[:, None] - spots) ** 2).sum(-1) / (2 * 0.03**2)).max(1)
        photos.append(np.repeat((230 - 200 * ink).astype(np.uint8).reshape(120, 120, 1), 3, 2))
        depths.append(t.reshape(120, 120).astype(np.float32))
    found = simulate_tracks(photos, depths, cameras, seed=0)
    assert len(spots) / 2 < len(found) < 3 * len(spots)
    assert np.abs(found.positions[:, 0]).min() > 0.15
    # .7 pixels of .024 units each, over at least three rays that cross at up to 28 degrees
    assert np.abs(found.positions[:, 1]).max() < 1.0 and np.median(np.abs(found.positions[:, 1])) < 0.1
    square = []
    for view, camera in enumerate(cameras):
        mine = found.view == view
        at, _ = camera.project(found.positions[found.point[mine]])
        square.append((at - found.pixel[mine]) ** 2)
    # triangulation takes up three degrees of freedom of a point's 2 k
    rms = np.sqrt(np.concatenate(square).mean())
    assert 0.5 * OBSERVATION_NOISE_PIXELS < rms < 1.05 * OBSERVATION_NOISE_PIXELS
    assert found.errors.mean() == pytest.approx(np.sqrt(2) * rms, rel=0.2)
    plain = [np.full((120, 120, 3), 200, np.uint8)] * 7
    assert len(simulate_tracks(plain, depths, cameras)) == 0


def test_captures_of_a_moved_part_differ_where_it_was():
    plan = capture("room-digger")
    camera = plan.cameras(plan.phone.resized(64), 8, 0)[3]
    still, moved = plan.scene, plan.scene.move("cone", translate=(0, -0.97, 0))
    before, after = render_image(still, camera)[0], render_image(moved, camera)[0]
    changed = np.abs(before - after).max(-1) > 0.05
    assert 0 < changed.mean() < 0.1


def test_a_phone_keeps_its_view_when_its_photos_are_resized():
    phone = Phone(distortion=(0.05, 0.0, 0.0, 0.0))
    large, small = (
        phone.camera((0, -3, 0), (0, 0, 0), 7.0),
        phone.resized(320).camera((0, -3, 0), (0, 0, 0), 7.0),
    )
    points = np.array([[0.2, 0.1, 0.4], [-0.3, 0, -0.6]])
    np.testing.assert_allclose(large.project(points)[0] / 2, small.project(points)[0], atol=1e-9)
    assert large.c2w[2, 0] == pytest.approx(np.sin(np.radians(7.0)))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"views": 1}, "views must be at least 2, not 1"),
        ({"size": 8}, "size must be at least 32, not 8"),
        ({"depth": "some"}, "depth must be one of all, test, none, not 'some'"),
    ],
)
def test_impossible_captures_are_refused(tmp_path, options, message):
    with pytest.raises(DatasetError, match=message):
        make_capture("room-digger", tmp_path / "d", **options)
    assert not (tmp_path / "d").exists()


def test_unknown_rooms_and_full_folders_are_refused(tmp_path):
    with pytest.raises(
        SceneError, match="choose one of room-digger, room-chair, room-microphone, room-plant"
    ):
        capture("room-piano")
    (tmp_path / "note").write_text("mine")
    with pytest.raises(DatasetError, match="is not empty"):
        make_capture("room-digger", tmp_path)
    assert set(CAPTURES) == set(ROOMS)
