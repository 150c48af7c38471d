"""Procedural scenes: shapes and tracing against closed forms, moved parts against moved cameras."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.datasets import load_dataset
from cagefield.edits import Edit, EditStack
from cagefield.errors import DatasetError, SceneError
from cagefield.geometry.cage import Cage
from cagefield.images.image_files import read_image
from cagefield.images.metrics import psnr
from cagefield.procedural import SCENES, ProceduralScene, make_scene, procedural_scene, viewpoints
from cagefield.procedural.parts import Part, Primitive, affine_matrix, pose_matrix
from cagefield.procedural.shapes import (
    Box,
    Cylinder,
    Extrusion,
    Leaf,
    Revolution,
    Sphere,
    Torus,
    Tube,
    polygon_distance,
)
from cagefield.procedural.textures import Plain
from cagefield.rendering.reference_renderer import render_sampled
from tiers import nightly_after_first

ELL = ((-0.4, -0.3), (0.4, -0.3), (0.4, 0.0), (0.0, 0.0), (0.0, 0.35), (-0.4, 0.35))
LATHE = ((0.0, -0.4), (0.3, -0.4), (0.15, 0.0), (0.35, 0.4), (0.0, 0.4))
EXACT = {
    "sphere": Sphere(0.4),
    "box": Box((0.3, 0.4, 0.2)),
    "rounded box": Box((0.3, 0.4, 0.2), 0.1),
    "cylinder": Cylinder(0.3, 0.4, 0.05),
    "torus": Torus(0.3, 0.1),
    "tube": Tube(((-0.3, 0.0, -0.2), (0.1, 0.2, 0.0), (0.3, -0.1, 0.3)), (0.1,)),
    "extrusion": Extrusion(ELL, 0.2, 0.03),
    "revolution": Revolution(LATHE, 0.02),
}
PLAIN = Plain((0.7, 0.5, 0.3))


@pytest.fixture(scope="module", params=sorted(SCENES))
def scene(request) -> ProceduralScene:
    return procedural_scene(request.param)


def one(shape, pose=None, name="thing") -> ProceduralScene:
    """A scene with a single primitive."""
    pose = np.eye(4) if pose is None else pose
    return ProceduralScene("one", (Part(name, (Primitive(shape, PLAIN, pose[None]),)),))


def view(size: int = 40, eye=(3.0, -1.5, 1.2), fov_x: float = 0.5) -> Camera:
    return Camera.look_at(eye, (0, 0, 0), width=size, height=size, fov_x=fov_x)


@pytest.mark.parametrize("name", EXACT)
def test_distance_is_euclidean(name):
    """Never more than the distance to any point further in, and reached: p - d grad d lies on the surface."""
    shape = EXACT[name]
    rng = np.random.default_rng(0)
    p, q = rng.uniform(-1, 1, (2, 3, 4000)).astype(np.float32)
    d = shape.distance(p)
    assert (np.abs(d - shape.distance(q)) <= np.linalg.norm(p - q, axis=0) + 1e-6).all()
    outside = d > 0.02
    p, d, h = p[:, outside].astype(np.float64), d[outside], 1e-3
    gradient = np.stack(
        [
            (shape.distance((p + e).astype(np.float32)) - shape.distance((p - e).astype(np.float32)))
            / (2 * h)
            for e in h * np.eye(3)[:, :, None]
        ]
    )
    smooth = np.abs(np.linalg.norm(gradient, axis=0) - 1) < 1e-3
    assert smooth.mean() > 0.9
    foot = (p - d * gradient)[:, smooth].astype(np.float32)
    # float32 differences over 2e-3 give the direction to 1e-4 times a distance of up to 1.5
    assert np.abs(shape.distance(foot)).max() < 1e-3


def test_profiles_agree_with_the_closed_forms():
    """A square extruded is a box, a half square turned is a cylinder: inside, outside, and on the axis."""
    points = np.random.default_rng(3).uniform(-0.8, 0.8, (3, 4000)).astype(np.float32)
    points[:2, :100] = 0
    rectangle = ((-0.25, -0.35), (0.25, -0.35), (0.25, 0.35), (-0.25, 0.35))
    box, slab = Box((0.3, 0.4, 0.2), 0.05), Extrusion(rectangle, 0.15, 0.05)
    np.testing.assert_allclose(slab.distance(points), box.distance(points), atol=1e-6)
    half = ((0.0, -0.35), (0.25, -0.35), (0.25, 0.35), (0.0, 0.35))
    cylinder, turned = Cylinder(0.3, 0.4, 0.05), Revolution(half, 0.05)
    np.testing.assert_allclose(turned.distance(points), cylinder.distance(points), atol=1e-6)


@pytest.mark.parametrize(
    ("name", "point", "distance"),
    [
        ("sphere", (0, 0, 0.1), -0.3),
        ("box", (0.05, 0, 0.1), -0.1),
        ("rounded box", (0, 0, 0), -0.2),
        ("cylinder", (0.1, 0, 0), -0.2),
        ("torus", (0, 0.3, 0), -0.1),
        ("tube", (0.1, 0.2, 0), -0.1),
    ],
)
def test_distance_inside(name, point, distance):
    at_point = EXACT[name].distance(np.array([point], np.float32).T)
    assert at_point[0] == pytest.approx(distance, abs=1e-6)


@pytest.mark.parametrize("name", EXACT)
def test_extent_holds_the_shape_and_touches_it(name):
    shape = EXACT[name]
    axis = np.linspace(-0.6, 0.6, 61, dtype=np.float32)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij")).reshape(3, -1)
    inside = points[:, shape.distance(points) <= 0]
    reach = np.abs(inside).max(1)
    # the lattice misses the surface by up to its spacing of .02
    assert (reach <= np.array(shape.extent) + 1e-6).all()
    assert (reach >= np.array(shape.extent) - 0.02 - 1e-6).all()


def test_leaf_is_a_lower_bound_with_the_right_surface():
    leaf = Leaf(0.5, 0.2, 0.02, bend=0.8)
    on_axis = np.array([[0.0, 0.0, 0.02], [0.25, 0.0, -0.8 * 0.25**2 + 0.02], [0, 0.12, 0]], np.float32).T
    np.testing.assert_allclose(leaf.distance(on_axis), 0, atol=1e-6)
    p, q = np.random.default_rng(1).uniform(-0.4, 0.4, (2, 3, 4000)).astype(np.float32)
    q = p + 0.05 * q
    near = (np.abs(p[0]) < 0.25) & (np.abs(q[0]) < 0.25)
    change = np.abs(leaf.distance(p) - leaf.distance(q))
    assert (change <= np.linalg.norm(p - q, axis=0) + 1e-6)[near].all()


def test_polygon_inside_matches_the_winding_number():
    points = np.random.default_rng(2).uniform(-0.6, 0.6, (2, 3000)).astype(np.float32)
    corners = np.array(ELL)[:, :, None] - points
    angle = np.arctan2(corners[:, 1], corners[:, 0])
    turn = np.diff(np.concatenate([angle, angle[:1]]), axis=0)
    winding = np.round(((turn + np.pi) % (2 * np.pi) - np.pi).sum(0) / (2 * np.pi))
    np.testing.assert_array_equal(polygon_distance(ELL, *points) < 0, winding != 0)


def hits_of(scene: ProceduralScene, camera: Camera) -> np.ndarray:
    return scene.photograph(camera, supersample=1).depth


def test_traced_sphere_is_where_the_quadratic_says():
    center, radius = np.array([0.2, 0.1, -0.1]), 0.45
    camera = view()
    to_center, directions = center - camera.origin, camera.rays()[1].astype(np.float64)
    middle = directions @ to_center
    square = radius**2 - to_center @ to_center + middle**2
    expected = np.where(square > 0, middle - np.sqrt(np.maximum(square, 0)), np.inf).reshape(40, 40)
    depth = hits_of(one(Sphere(radius), pose_matrix(center)), camera)
    # a ray arrives within 2e-4 of the surface; where it grazes it, that is up to sqrt(2 radius 2e-4) early
    clear = (np.abs(square) > 0.02).reshape(40, 40)
    np.testing.assert_array_equal(np.isfinite(depth)[clear], np.isfinite(expected)[clear])
    seen = clear & np.isfinite(expected)
    np.testing.assert_allclose(depth[seen], expected[seen], atol=2e-4 * radius / np.sqrt(0.02) + 2e-5)
    assert seen.sum() > 250


def test_traced_stretched_sphere_is_an_ellipsoid():
    """Rays meet the ellipsoid where they meet the unit sphere in its own frame."""
    pose = pose_matrix((0.1, 0, 0), (20, 30, 40), (0.5, 0.3, 0.15))
    camera = view()
    inverse = np.linalg.inv(pose)
    origin = inverse[:3, :3] @ camera.origin + inverse[:3, 3]
    directions = camera.rays()[1].astype(np.float64) @ inverse[:3, :3].T
    a, b, c = (directions**2).sum(1), directions @ origin, origin @ origin - 1
    square = b**2 - a * c
    expected = ((-b - np.sqrt(np.maximum(square, 0))) / a).reshape(40, 40)
    seen = (square / a > 0.05).reshape(40, 40)
    depth = hits_of(one(Sphere(), pose), camera)
    assert seen.sum() > 150
    np.testing.assert_allclose(depth[seen], expected[seen], atol=2e-3)
    assert np.isinf(depth[(square < -0.05).reshape(40, 40)]).all()


@pytest.mark.parametrize("order", [1, -1])
def test_nearest_instance_hides_the_other(order):
    poses = np.stack([pose_matrix((0.8, 0, 0)), pose_matrix((-0.8, 0, 0))])[::order]
    pair = ProceduralScene("pair", (Part("balls", (Primitive(Sphere(0.3), PLAIN, poses),)),))
    camera = view(21, eye=(4, 0, 0), fov_x=0.3)
    assert hits_of(pair, camera)[10, 10] == pytest.approx(4 - 0.8 - 0.3, abs=1e-3)


def test_field_distance_is_euclidean_for_uniform_scales():
    ball = one(Sphere(0.5), pose_matrix((0.1, 0.2, 0), scale=0.4))
    points = np.random.default_rng(0).uniform(-0.3, 0.5, (3000, 3)).astype(np.float32)
    expected = np.linalg.norm(points - np.float32([0.1, 0.2, 0]), axis=1) - 0.2
    distance, owner, _ = ball.field(eps=0.01).distance(points)
    near = expected < 0.06 - 1e-4
    np.testing.assert_allclose(distance[near], expected[near], atol=1e-6)
    assert np.isinf(distance[expected > 0.06 + 1e-4]).all()
    np.testing.assert_array_equal(owner >= 0, np.isfinite(distance))


def test_field_distance_is_first_order_for_stretched_parts():
    pose = pose_matrix((0, 0, 0), (20, 30, 40), (0.5, 0.3, 0.1))
    u = np.random.default_rng(0).normal(size=(500, 3))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    normals = u @ np.linalg.inv(pose[:3, :3])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = (u @ pose[:3, :3].T + 0.001 * normals).astype(np.float32)
    distance, _, _ = one(Sphere(), pose).field(eps=0.01).distance(points)
    # curvature of the ellipsoid, up to .5 / .1^2 = 50 per unit, times (.001)^2 / 2
    np.testing.assert_allclose(distance, 0.001, atol=1e-4)


def test_opacity_of_an_antialiased_edge_is_the_covered_share():
    """A box face that covers the left part of the picture, seen by a nearly parallel camera."""
    camera = Camera.look_at((0, -200, 0), (0, 0, 0), width=20, height=20, fov_x=0.01)
    width = 200 * 2 * np.tan(0.005)
    edge = 0.3 / 20 * width
    frame = one(Box((1.2, 0.5, 1.2)), pose_matrix((edge - 1.2, 0, 0))).photograph(camera, supersample=8)
    # columns 0 to 9 and three tenths of column 10, in steps of an eighth; the near face is 0.25 % larger
    np.testing.assert_allclose(frame.opacity[:, :10], 1)
    np.testing.assert_allclose(frame.opacity[:, 10], 0.3, atol=0.5 / 8 + 0.01)
    np.testing.assert_allclose(frame.opacity[:, 11:], 0)
    np.testing.assert_allclose(frame.normals[:, :10], np.broadcast_to([0, -1, 0], (20, 10, 3)), atol=1e-4)
    np.testing.assert_allclose(frame.depth[:, :11], 199.5, atol=0.01)
    assert np.isinf(frame.depth[:, 11:]).all()
    # straight color: the edge column has the color of the face, not a mixture with black
    np.testing.assert_allclose(frame.rgb[:, 10], frame.rgb[:, 9], atol=0.03)


def test_scenes_fit_the_frame_and_show_every_part(scene):
    assert np.abs(scene.bounds).max() < 1.1
    cameras = viewpoints(8, 40, lowest=scene.lowest)
    frames = [scene.photograph(camera, supersample=1) for camera in cameras]
    shares = [frame.opacity.mean() for frame in frames]
    assert min(shares) > 0.03
    assert max(shares) < 0.6
    for frame in frames:
        border = np.concatenate([frame.opacity[[0, -1]].ravel(), frame.opacity[:, [0, -1]].ravel()])
        assert border.max() == 0
    for name in scene.part_names:
        without = scene.remove(name)
        shown = (
            (frame.depth != without.photograph(c, supersample=1).depth).any()
            for c, frame in zip(cameras, frames, strict=True)
        )
        assert any(shown), f"{name} is in none of the pictures"


def test_part_bounds_hold_what_is_traced(scene):
    camera = viewpoints(1, 80, lowest=scene.lowest)[0]
    for part in scene.parts:
        alone = ProceduralScene("alone", (part,))
        depth = hits_of(alone, camera).ravel()
        seen = np.isfinite(depth)
        points = camera.origin + depth[seen, None] * camera.rays()[1][seen]
        low, high = scene.part_bounds(part.name)
        assert seen.any()
        assert ((points > low - 1e-3) & (points < high + 1e-3)).all()


def test_whole_scene_moved_looks_like_the_camera_moved(scene):
    """Carried colors: a rigid motion of everything equals the inverse motion of the camera."""
    camera = view(48, eye=(2.5, -2.6, 1.7), fov_x=0.7)
    motion = affine_matrix((0.1, -0.05, 0.08), (0.3, -0.2, 0.5))
    angles, offset = (0.3, -0.2, 0.5), (0.1, -0.05, 0.08)
    moved = scene.move(
        scene.part_names, translate=offset, rotate=angles, pivot=(0, 0, 0)
    ).with_modeled_light()
    seen_by_moved = camera.with_c2w(motion @ camera.c2w)
    still, turned = scene.photograph(camera), moved.photograph(seen_by_moved)
    # rays and distances are rounded differently, so single subsamples at silhouettes and texture edges change
    assert psnr(still.over("white").rgb, turned.over("white").rgb) > 38
    assert np.abs(still.opacity - turned.opacity).mean() < 2e-3


def test_translated_part_keeps_its_colors():
    """Directional light: relit or not, a translation changes no color."""
    ball = one(Sphere(0.4))
    offset = np.array([0.2, 0.3, -0.25])
    moved = ball.move("thing", translate=offset)
    camera = view()
    shifted = camera.with_c2w(affine_matrix(offset) @ camera.c2w)
    np.testing.assert_allclose(moved.photograph(shifted).rgb, ball.photograph(camera).rgb, atol=2e-3)


def test_turned_part_is_relit_unless_it_carries_its_light():
    box = one(Box((0.4, 0.4, 0.4)))
    turned = box.move("thing", rotate=(np.pi, 0, 0))
    camera = view(fov_x=0.3)
    upside_down = camera.with_c2w(affine_matrix(rotate=(np.pi, 0, 0)) @ camera.c2w)
    original = box.photograph(camera).rgb
    carried = turned.with_modeled_light().photograph(upside_down).rgb
    np.testing.assert_allclose(carried, original, atol=0.02)
    assert np.abs(turned.photograph(upside_down).rgb - original).max() > 0.1


def test_move_scales_about_the_centre_of_the_part():
    box = one(Box((0.2, 0.1, 0.3)), pose_matrix((0.5, 0, 0.1)))
    low, high = box.move("thing", translate=(0, 0.2, 0), scale=(1, 2, 0.5)).part_bounds("thing")
    np.testing.assert_allclose((low + high) / 2, (0.5, 0.2, 0.1), atol=1e-9)
    np.testing.assert_allclose(high - low, (0.4, 0.4, 0.3), atol=1e-9)
    center, size = box.part_box("thing", margin=0.05)
    np.testing.assert_allclose(center, (0.5, 0, 0.1))
    np.testing.assert_allclose(size, (0.5, 0.3, 0.7))


def test_moves_compose_and_copies_stay():
    box = one(Box((0.2, 0.1, 0.3)))
    twice = box.move("thing", translate=(0.1, 0, 0)).move("thing", translate=(0.1, 0, 0))
    np.testing.assert_allclose(twice.part_bounds("thing")[0], (0, -0.1, -0.3), atol=1e-9)
    pair = box.duplicate("thing", translate=(0, 0.5, 0))
    assert pair.part_names == ("thing", "thing copy")
    np.testing.assert_allclose(pair.part_bounds("thing copy").mean(0), (0, 0.5, 0), atol=1e-9)
    np.testing.assert_allclose(pair.part_bounds(["thing", "thing copy"])[1], (0.2, 0.6, 0.3), atol=1e-9)
    assert pair.remove("thing").part_names == ("thing copy",)
    assert box.part_names == ("thing",)


def test_occlusion_is_open_on_a_ball_and_darker_in_a_corner():
    ball = one(Sphere(0.3))
    directions = np.random.default_rng(0).normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    normals = directions.astype(np.float32)
    # distances are interpolated on a lattice of .025, which a ball of .3 bends by about .025^2 / .3 = .002
    assert ball.occlusion(0.3 * normals.T, normals.T).min() > 0.93
    floor = Part("floor", (Primitive(Box((1, 1, 0.1)), PLAIN, pose_matrix((0, 0, -0.1))[None]),))
    wall = Part("wall", (Primitive(Box((0.1, 1, 0.5)), PLAIN, pose_matrix((-0.1, 0, 0.5))[None]),))
    corner = ProceduralScene("corner", (floor, wall))
    points = np.array([[0.02, 0, 0], [0.1, 0, 0], [0.6, 0, 0]], np.float32)
    up = np.tile(np.float32([0, 0, 1]), (3, 1))
    near, between, far = corner.occlusion(points.T, up.T)
    assert near < between - 0.05 < far - 0.1
    assert far > 0.95
    assert corner.remove("wall").occlusion is corner.occlusion


def test_a_flattened_ball_darkens_what_is_as_near_as_it_is_and_no_box_around_it():
    plate = Part("plate", (Primitive(Box((0.9, 0.9, 0.1)), PLAIN, pose_matrix((0, 0, -0.1))[None]),))
    disc = pose_matrix((0, 0, 0.05), scale=(0.1, 0.1, 0.01))
    still = ProceduralScene("still", (plate, Part("disc", (Primitive(Sphere(), PLAIN, disc[None]),))))
    # the disc's edge is as far away as its height in the first, and further than every tap in the others
    points = np.array([[0.15, 0, 0], [0.42, 0, 0], [0.3, 0.3, 0]], np.float32).T
    up = np.tile(np.float32([[0], [0], [1]]), 3)
    near, far, corner = still.occlusion(points, up)
    assert near < 0.85 and min(far, corner) > 0.97


def test_occlusion_anew_is_of_the_parts_where_they_stand():
    plate = Part("plate", (Primitive(Box((0.9, 0.9, 0.1)), PLAIN, pose_matrix((0, 0, -0.1))[None]),))
    box = Part("box", (Primitive(Box((0.1, 0.1, 0.1)), PLAIN, pose_matrix((-0.4, 0.013, 0.11))[None]),))
    still = ProceduralScene("still", (plate, box))
    anew = still.move("box", translate=(0.85, 0, 0)).with_new_occlusion()
    points = np.array([[-0.55, 0.013, 0], [0.3, 0.013, 0], [-0.1, -0.8, 0]], np.float32).T
    up = np.tile(np.float32([[0], [0], [1]]), 3)
    left, come, far = anew.occlusion(points, up)
    were = still.occlusion(points, up)
    # beside the box by .05, as it was modelled and as it stands, and away from both
    assert left > were[0] + 0.1 and come < were[1] - 0.1 and far == were[2]
    # as if the box had never stood elsewhere, but for the lattice, .25 of whose spacing it is off
    poses = box.primitives[0].poses.copy()
    poses[:, 0, 3] += 0.85
    there = ProceduralScene("there", (plate, Part("box", (replace(box.primitives[0], poses=poses),))))
    np.testing.assert_allclose(there.occlusion(points, up), (left, come, far), atol=0.02)
    again = anew.move("box", translate=(-0.85, 0, 0))
    assert again.occlusion is anew.occlusion
    np.testing.assert_allclose(again.with_new_occlusion().occlusion(points, up), were, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "part"), nightly_after_first([("digger", "cone"), ("microphone", "base"), ("plant", "flower")])
)
def test_occlusion_anew_changes_nothing_far_from_what_moved(name, part):
    scene = procedural_scene(name)
    camera = viewpoints(1, 64, lowest=scene.lowest)[0]
    photo = scene.photograph(camera, background="white").rgb
    np.testing.assert_allclose(
        scene.with_new_occlusion().photograph(camera, background="white").rgb, photo, atol=1e-5
    )
    old, new = (
        each.photograph(camera, background="white").rgb
        for each in (scene.remove(part), scene.remove(part).with_new_occlusion())
    )
    changed = np.abs(old - new).max(-1) > 4 / 255
    # though the box of the parts, where the lattice of distances begins, is another without the part
    assert 0.0005 < changed.mean() < 0.1
    assert (new - old).min() > -1e-4, "taking a part away darkens nothing"


@pytest.mark.parametrize(
    ("name", "part"), [("digger", "cone"), ("digger", "bucket"), ("chair", "cushion"), ("plant", "pinecone")]
)
def test_boxes_around_free_standing_parts_hold_nothing_else(name, part):
    """A discrete edit with such a cage moves the part and no more."""
    scene = procedural_scene(name)
    low, high = scene.part_bounds(part)
    points = np.random.default_rng(0).uniform(low - 0.003, high + 0.003, (20000, 3)).astype(np.float32)
    distance, _, _ = scene.remove(part).field(eps=1e-3).distance(points)
    assert distance.min() > 0


@pytest.mark.parametrize(
    ("name", "part", "motion"),
    [
        ("digger", "cone", {"translate": (0.0, -1.0, 0.1)}),
        ("chair", "cushion", {"translate": (0.0, 0.0, 0.5), "scale": 0.8}),
        ("plant", "pinecone", {"translate": (-0.3, -0.2, 0.3), "rotate": (0.2, 0.4, 0.9)}),
    ],
)
def test_really_moved_part_is_what_a_discrete_edit_makes(name, part, motion):
    """The field of the moved scene, its light carried along, equals the field seen through the edit."""
    scene = procedural_scene(name)
    center, size = scene.part_box(part, margin=0.002)
    edit = Edit.move(Cage.box(center, size)).scale(motion.get("scale", 1.0))
    edit = edit.rotate(motion.get("rotate", (0, 0, 0))).translate(motion["translate"])
    moved = scene.move(part, **motion).with_modeled_light()
    low, high = moved.part_bounds(part) - 0.05 * np.array([[1], [-1]])
    rng = np.random.default_rng(0)
    points = rng.uniform(np.minimum(low, center - size), np.maximum(high, center + size), (30000, 3))
    viewdirs = rng.normal(size=points.shape)
    viewdirs /= np.linalg.norm(viewdirs, axis=1, keepdims=True)
    # shells so thin that the neighbors' do not reach into the cage
    eps = 2e-4
    seen = EditStack([edit]).to_canonical(points, viewdirs)
    sigma, rgb = scene.field(eps)(seen.points, seen.viewdirs)
    sigma = np.where(seen.emptied, 0, sigma)
    truth_sigma, truth_rgb = moved.field(eps)(points, viewdirs)
    full = 1 / (eps * np.log(2))
    # float32 positions are rounded by 1e-7, and a scaled part has scaled shells: only the shells may differ
    solid, empty = truth_sigma > 0.9999 * full, truth_sigma == 0
    assert solid.sum() > 500
    assert (solid | empty).mean() > 0.97
    np.testing.assert_allclose(sigma[solid], full, rtol=1e-2)
    assert (sigma[empty] < 1e-2 * full).all()
    skin = solid & (scene.field(0.004).distance(seen.points.astype(np.float32))[0] > -0.01)
    np.testing.assert_allclose(rgb[skin], truth_rgb[skin], atol=0.02)
    assert skin.sum() > 50


def test_field_agrees_with_the_photographs(scene):
    """Volume rendered soft shells against traced surfaces: 26 to 28 dB, the outlines are what differs."""
    camera = viewpoints(3, 48, lowest=scene.lowest)[2]
    photograph = scene.photograph(camera, supersample=1, background="white")
    frame = render_sampled(scene.field(eps=0.004), camera, samples=400)
    assert psnr(frame.rgb, photograph.rgb) > 25
    both = (photograph.opacity == 1) & (frame.opacity > 0.99)
    # optical depth 1 lies .008 below a surface that is met head on, and above it where it is grazed
    assert np.median(np.abs(frame.depth[both] - photograph.depth[both])) < 0.008


def test_make_scene_is_a_nerf_synthetic_data_set(tmp_path):
    scene = procedural_scene("microphone")
    steps = []
    out = make_scene(
        "microphone", tmp_path / "mic", views=3, size=32, test_views=2, progress=lambda *x: steps.append(x)
    )
    assert steps == [(k, 6) for k in range(1, 7)]
    data = load_dataset(out)
    assert [len(split) for split in (data.train, data.val, data.test)] == [3, 1, 2]
    expected = viewpoints(3, 32, lowest=scene.lowest)
    for shot, camera in zip(data.train, expected, strict=True):
        np.testing.assert_allclose(shot.camera.c2w, camera.c2w, atol=1e-12)
        assert shot.camera.fx == pytest.approx(camera.fx)
        np.testing.assert_array_equal(shot.load(), scene.photograph(camera).rgba8())
    depth = np.load(out / "test" / "r_1_depth.npy")
    truth = scene.photograph(data.test[1].camera).depth
    np.testing.assert_array_equal(depth, truth)
    assert depth.dtype == np.float32
    low, high = json.loads((out / "transforms_train.json").read_text())["aabb"]
    assert (np.array(low) < scene.bounds[0]).all()
    assert (np.array(high) > scene.bounds[1]).all()
    rgba = read_image(out / "train" / "r_0.png")
    assert rgba.shape == (32, 32, 4)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mic"]


@pytest.mark.parametrize(
    ("depth", "splits"),
    nightly_after_first([("all", ["test", "train", "val"]), ("test", ["test"]), ("none", [])]),
)
def test_make_scene_writes_the_depth_that_is_asked_for(tmp_path, depth, splits):
    out = make_scene("plant", tmp_path / "plant", views=1, size=12, test_views=1, depth=depth)
    written = sorted(out.rglob("*_depth.npy"))
    assert [path.parent.name for path in written] == splits
    scene, data = procedural_scene("plant"), load_dataset(out)
    for path in written:
        truth = scene.photograph(getattr(data, path.parent.name)[0].camera).depth
        np.testing.assert_array_equal(np.load(path), truth)


def test_make_scene_of_a_moved_scene_and_other_seeds(tmp_path):
    scene = procedural_scene("plant").remove("pinecone")
    out = make_scene("plant", tmp_path / "bare", views=1, size=24, test_views=1, seed=5, scene=scene)
    camera = viewpoints(1, 24, lowest=scene.lowest, seed=5)[0]
    np.testing.assert_array_equal(read_image(out / "train" / "r_0.png"), scene.photograph(camera).rgba8())


def test_make_scene_refuses_what_is_there_and_leaves_no_half(tmp_path):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").write_text("mine")
    with pytest.raises(DatasetError, match=r"full is not empty; give another folder"):
        make_scene("chair", tmp_path / "full", views=1, size=8)
    with pytest.raises(SceneError, match="no built-in scene 'sofa'; choose one of digger, chair"):
        make_scene("sofa", tmp_path / "a")
    with pytest.raises(DatasetError, match="views must be at least 1, not 0"):
        make_scene("chair", tmp_path / "a", views=0)
    with pytest.raises(DatasetError, match="depth must be one of all, test, none, not 'train'"):
        make_scene("chair", tmp_path / "a", depth="train")

    def interrupt(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_scene("chair", tmp_path / "a", views=1, size=8, progress=interrupt)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["full"]
    (tmp_path / "empty").mkdir()
    make_scene("chair", tmp_path / "empty", views=1, size=8, test_views=1)
    assert (tmp_path / "empty" / "transforms_test.json").exists()


def test_viewpoints_differ_between_splits_and_cover_the_dome():
    train, test = (viewpoints(50, 8, lowest=-10, split=split) for split in ("train", "test"))
    eyes = np.stack([camera.origin for camera in (*train, *test)])
    np.testing.assert_allclose(np.linalg.norm(eyes, axis=1), 4.0)
    gaps = np.linalg.norm(eyes[:, None] - eyes, axis=-1) + 10 * np.eye(100)
    assert gaps.min() > 0.01
    # fifty evenly spread views leave no direction of the dome further than about 25 degrees away: 1.7 units
    dome = np.stack([camera.origin for camera in viewpoints(400, 8, lowest=-10, seed=1)])
    assert np.linalg.norm(dome[:, None] - eyes[:50], axis=-1).min(1).max() < 1.7
    elevation = np.degrees(np.arcsin(eyes[:, 2] / 4))
    assert elevation.min() > -10
    assert elevation.max() < 80


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda s: s.move("wheel"), "scene chair has no part 'wheel'; its parts are seat, cushion"),
        (lambda s: s.move(()), r"has no part \(\)"),
        (
            lambda s: s.move("seat", scale=(1, 0, 1)),
            r"scale must be positive, one number or three, not \(1, 0, 1\)",
        ),
        (lambda s: s.move("seat", scale=(1, 2)), "scale must be positive, one number or three"),
        (lambda s: s.remove(s.part_names), "scene chair must keep at least one part"),
        (lambda s: s.duplicate("seat").duplicate("seat"), "part names must differ; seat copy is used twice"),
        (lambda s: s.photograph(view(8), supersample=0), "supersample must be at least 1, not 0"),
        (lambda s: s.field(eps=0), "eps must be positive, not 0"),
    ],
)
def test_errors_name_the_value(call, message):
    with pytest.raises(SceneError, match=message):
        call(procedural_scene("chair"))
