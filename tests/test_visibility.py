"""What the photos of a scene showed of its surfaces, on a box on a plate."""

from __future__ import annotations

import numpy as np
from benchmarks.captures.visibility import uncovered_pixels, unseen_pixels

from cagefield.cameras.camera import Camera, turntable
from cagefield.procedural.parts import Part, Primitive, pose_matrix
from cagefield.procedural.scene import ProceduralScene
from cagefield.procedural.shapes import Box
from cagefield.procedural.textures import Plain

GREY = Plain(np.array([0.5, 0.5, 0.5]))


def box_on_plate() -> ProceduralScene:
    plate = Part("plate", (Primitive(Box((0.8, 0.8, 0.1), 0.01), GREY, pose_matrix((0, 0, -0.1))[None]),))
    box = Part("box", (Primitive(Box((0.2, 0.2, 0.2), 0.01), GREY, pose_matrix((0, 0, 0.2))[None]),))
    return ProceduralScene("box on plate", (plate, box))


def photos() -> tuple[Camera, ...]:
    return turntable((0, 0, 0), 4.0, 12, elevation=0.6, width=32, height=32, fov_x=0.7)


def above() -> Camera:
    return Camera.look_at((0, 0.01, 4.0), (0, 0, 0), width=80, height=80, fov_x=0.5)


def test_nothing_is_unseen_where_nothing_moved() -> None:
    scene = box_on_plate()
    assert not unseen_pixels(scene, above(), scene, photos()).any()


def test_ground_under_a_moved_box_is_unseen() -> None:
    scene = box_on_plate()
    hidden = unseen_pixels(scene.move("box", translate=(0.0, 0.55, 0.0)), above(), scene, photos())
    # the box's foot, 0.4 x 0.4 of a picture 2 * 4 * tan(0.25) wide, less the rows the box now hides: none
    share = 0.4**2 / (8 * np.tan(0.25)) ** 2
    np.testing.assert_allclose(hidden.mean(), share, rtol=0.15)


def test_foot_of_a_turned_box_is_unseen() -> None:
    scene = box_on_plate()
    lying = scene.move("box", rotate=(np.pi, 0.0, 0.0), translate=(0, 0, 0.3), pivot=(0, 0, 0.2))
    hidden = unseen_pixels(lying, above(), scene, photos())
    assert hidden[40, 40]
    assert not hidden[8, 8]


def test_only_pixels_of_the_mask_are_looked_at() -> None:
    scene = box_on_plate()
    moved = scene.move("box", translate=(0.0, 0.55, 0.0))
    where = np.zeros((80, 80), bool)
    where[:, :40] = True
    everywhere = unseen_pixels(moved, above(), scene, photos())
    np.testing.assert_array_equal(unseen_pixels(moved, above(), scene, photos(), where), everywhere & where)


def test_ground_seen_through_a_hair_thin_gap_is_unseen() -> None:
    # low cameras see far under a box that hovers; a gap of 0.004 is under a pixel, one of 0.1 is not
    low = turntable((0, 0, 0), 4.0, 24, elevation=np.radians(4.0), width=32, height=32, fov_x=0.7)
    shares = {}
    for gap in (0.004, 0.1):
        hovering = box_on_plate().move("box", translate=(0.0, 0.0, gap))
        gone = hovering.remove("box")
        shares[gap] = unseen_pixels(gone, above(), hovering, (*photos(), *low)).mean()
    foot = 0.4**2 / (8 * np.tan(0.25)) ** 2
    # the foot less a rim of the box's rounding and a voxel, 0.02 wide on every side
    assert 0.75 * foot < shares[0.004] < 1.15 * foot
    assert shares[0.1] < 0.2 * foot


def test_what_a_part_hid_is_uncovered_where_it_was() -> None:
    scene = box_on_plate()
    moved = scene.move("box", translate=(0.0, 0.55, 0.0))
    uncovered = uncovered_pixels(moved, above(), scene)
    # the box's top, .4 above the plate and so nearer: its picture is the larger by 4 / 3.6
    share = (0.4 / 3.6) ** 2 / (2 * np.tan(0.25)) ** 2
    np.testing.assert_allclose(uncovered.mean(), share, rtol=0.15)
    assert uncovered[40, 40] and not uncovered[8, 8]
    np.testing.assert_array_equal(uncovered, uncovered_pixels(scene.remove("box"), above(), scene))


def test_a_part_that_covers_its_own_place_or_was_copied_uncovers_nothing() -> None:
    scene = box_on_plate()
    assert not uncovered_pixels(scene, above(), scene).any()
    assert not uncovered_pixels(scene.duplicate("box", translate=(0, 0.55, 0)), above(), scene).any()
    turned = scene.move("box", rotate=(np.pi, 0.0, 0.0), translate=(0, 0, 0.3), pivot=(0, 0, 0.2))
    assert not uncovered_pixels(turned, above(), scene).any()
    # behind the plate's edge there is nothing to uncover
    beside = Camera.look_at((0, -4.0, 0.3), (0, 0, 0.3), width=40, height=40, fov_x=0.3)
    assert not uncovered_pixels(scene.remove("box"), beside, scene)[:15].any()
