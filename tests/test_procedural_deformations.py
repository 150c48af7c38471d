"""Bends, twists and pulls of procedural parts: inverses, distances, light, and what is drawn of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cagefield.cameras.camera import Camera
from cagefield.errors import SceneError
from cagefield.procedural import ProceduralScene
from cagefield.procedural.deformations import ArcBend, AxialTwist, Deformation, PointPull
from cagefield.procedural.deformed_parts import deform_part
from cagefield.procedural.parts import Part, PlacedPrimitive, Primitive, pose_matrix
from cagefield.procedural.shapes import Box, Cylinder, Sphere
from cagefield.procedural.textures import Checker, Plain
from cagefield.procedural.tracing import points_along_rays, trace

BEND = ArcBend((0.1, 0.0, -0.5), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), 0.8, np.radians(70))
SLANTED = ArcBend((0.0, 0.1, 0.0), (1.0, 1.0, 0.2), (0.0, -1.0, 1.0), 1.1, np.radians(60))
TWIST = AxialTwist((0.05, 0.0, -0.4), (0.0, 0.0, 1.0), 0.9, np.radians(110))
LEANING = AxialTwist((0.0, 0.0, -0.4), (0.3, -0.2, 1.0), 0.9, np.radians(-80))
PULL = PointPull((0.1, 0.05, 0.4), (0.15, 0.05, 0.2), 0.5)
ALL = (BEND, SLANTED, TWIST, LEANING, PULL)

ROD = Part("rod", (Primitive(Box((0.05, 0.08, 0.45), 0.01), Plain((0.5, 0.5, 0.5))),))
STUDS = Part(
    "studs",
    (
        Primitive(Sphere(), Plain((0.5, 0.4, 0.3)), np.stack([
            pose_matrix((0.05, 0.0, z), (20, 0, 30), (0.12, 0.06, 0.08)) for z in (-0.3, 0.0, 0.25)
        ])),
    ),
)  # fmt: skip


def cloud(count: int, seed: int = 0, half: float = 0.3) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-half, half, (3, count)) * [[1], [1], [2]]


@pytest.mark.parametrize("deformation", ALL)
def test_inverse_is_the_inverse_both_ways(deformation: Deformation) -> None:
    p = cloud(4000)
    np.testing.assert_allclose(deformation.inverse(deformation.forward(p)), p, atol=1e-8)
    np.testing.assert_allclose(deformation.forward(deformation.inverse(p)), p, atol=1e-8)
    assert np.abs(deformation.forward(p) - p).max() > 0.1


@pytest.mark.parametrize("deformation", ALL)
def test_jacobian_is_that_of_the_inverse(deformation: Deformation) -> None:
    p, h = cloud(2000, 1), 1e-6
    columns = [
        (deformation.inverse(p + h * e) - deformation.inverse(p - h * e)) / (2 * h)
        for e in np.eye(3)[:, :, None]
    ]
    wrong = np.abs(np.stack(columns, 1) - deformation.inverse_jacobian(p)).max((0, 1))
    # where the straight and the bent pieces meet, differences take some of both
    assert np.quantile(wrong, 0.995) < 1e-6


def test_bent_line_is_an_arc_of_its_own_length() -> None:
    s = np.linspace(0, BEND.length, 2001)
    line = np.array(BEND.start)[:, None] + np.array(BEND.axis)[:, None] * s
    arc = BEND.forward(line)
    assert np.linalg.norm(np.diff(arc), axis=0).sum() == pytest.approx(BEND.length, rel=1e-6)
    center = np.array(BEND.start) + BEND.radius * np.array(BEND.towards)
    np.testing.assert_allclose(np.linalg.norm(arc - center[:, None], axis=0), BEND.radius, rtol=1e-12)
    end = np.diff(arc)[:, -1] / np.linalg.norm(np.diff(arc)[:, -1])
    assert np.degrees(np.arccos(end[2])) == pytest.approx(70, abs=0.05) and end[0] > 0.9


def test_a_bend_leaves_what_is_before_it_and_carries_on_behind_it() -> None:
    before = np.array([[0.2, 0.0], [0.0, 0.1], [-0.6, -0.9]])
    np.testing.assert_allclose(BEND.forward(before), before, atol=1e-12)
    behind = np.array([[0.0, 0.2], [0.0, 0.1], [0.4, 0.9]])
    there = BEND.forward(behind)
    assert np.linalg.norm(there[:, 0] - there[:, 1]) == pytest.approx(np.linalg.norm([0.2, 0.1, 0.5]))


def test_a_twist_turns_right_handed_in_proportion() -> None:
    p = np.array([[0.15] * 3, [0.0] * 3, [-0.4, 0.05, 0.5]])
    x, y, z = TWIST.forward(p)
    np.testing.assert_allclose(np.degrees(np.arctan2(y, x - 0.05)), [0, 55, 110], atol=1e-9)
    np.testing.assert_allclose(z, p[2], atol=1e-12)


def test_a_pull_is_the_flow_of_its_velocity() -> None:
    point, by = np.array(PULL.point), np.array(PULL.by)

    def velocity(t: float, x: np.ndarray) -> np.ndarray:
        g = np.linalg.norm(x - point - t * by) / PULL.radius
        return by * (1 - 3 * g**2 + 2 * g**3 if g < 1 else 0.0)

    p = cloud(30, 3)
    for start, end in zip(p.T, PULL.forward(p).T, strict=True):
        truth = solve_ivp(velocity, (0, 1), start, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
        np.testing.assert_allclose(end, truth, atol=2e-7)
    np.testing.assert_allclose(PULL.forward(point[:, None])[:, 0], point + by, atol=1e-12)


# -- parts -------------------------------------------------------------------------------------------------


def surface(part: Part, deformation: Deformation | None, count: int = 30_000) -> np.ndarray:
    """Points [3,N] on the outlines of a part's primitives: of those within 2e-3, moved onto them."""
    found = []
    rng = np.random.default_rng(5)
    for primitive in part.primitives:
        item = PlacedPrimitive.build(part, primitive)
        for k in range(len(item.shift)):
            half = np.abs(item.linear[k]) @ item.extent + 0.02
            p = (item.shift[k][:, None] + half[:, None] * rng.uniform(-1, 1, (3, count))).astype(np.float32)
            which = np.full(p.shape[1], k)
            p = p[:, np.abs(item.distance(p, which)) < 0.03]
            for _ in range(12):
                which = np.full(p.shape[1], k)
                gradient = item.world_gradient(item.local_gradient(item.local(p, which), which), which)
                square = np.maximum((gradient**2).sum(0), 1e-3)
                p = p - item.primitive.shape.distance(item.local(p, which)) * gradient / square
            found.append(p[:, np.abs(item.distance(p, which)) < 1e-4])
    joined = np.concatenate(found, axis=1).astype(np.float64)
    return joined if deformation is None else deformation.forward(joined)


@pytest.mark.parametrize("part", [ROD, STUDS], ids=["rod", "studs"])
@pytest.mark.parametrize("deformation", ALL)
def test_distances_are_lower_bounds_with_the_right_surface(deformation: Deformation, part: Part) -> None:
    from scipy.spatial import cKDTree

    outline = surface(part, deformation)
    tree = cKDTree(outline.T)
    deformed = deform_part(part, deformation)
    p = cloud(4000, 7, 0.6).astype(np.float32)
    distances = []
    for primitive in deformed.primitives:
        item = PlacedPrimitive.build(deformed, primitive)
        distances.append(item.distance(p, np.zeros(p.shape[1], np.intp)))
        low, high = item.shift[0] - item.extent, item.shift[0] + item.extent
        assert (high > low).all()
    bound, truth = np.min(distances, axis=0), tree.query(p.T)[0]
    outside = bound > 0
    # the outline is sampled, so the true distance is a little less than the nearest sample's
    assert (bound - truth)[outside].max() < 2e-3
    assert np.abs(bound)[truth < 2e-3].max(initial=0.0) < 4e-3
    q = outline[:, ::37].astype(np.float32)
    on = np.min(
        [
            np.abs(PlacedPrimitive.build(deformed, item).distance(q, np.zeros(q.shape[1], np.intp)))
            for item in deformed.primitives
        ],
        axis=0,
    )
    assert on.max() < 3e-4


@pytest.mark.parametrize("part", [ROD, STUDS], ids=["rod", "studs"])
@pytest.mark.parametrize("deformation", ALL)
def test_bounds_hold_the_deformed_part(deformation: Deformation, part: Part) -> None:
    low, high = deform_part(part, deformation).bounds
    outline = surface(part, deformation, 5000)
    assert (outline.min(1) > low - 1e-4).all() and (outline.max(1) < high + 1e-4).all()


@pytest.mark.parametrize("deformation", ALL)
def test_traced_rays_meet_the_deformed_surface(deformation: Deformation) -> None:
    scene = ProceduralScene("test", (ROD,)).deform("rod", deformation)
    camera = Camera.look_at((1.6, -2.2, 0.8), (0, 0, 0), width=64, height=64, fov_x=0.6)
    origins, directions = camera.rays()
    d = np.ascontiguousarray(directions.T, np.float32)
    hits = trace(scene.placed, origins[0].astype(np.float64), d)
    met = np.isfinite(hits.t)
    assert met.sum() > 100
    points = points_along_rays(origins[0].astype(np.float64), d, hits.t)[:, met]
    canonical = deformation.inverse(points)
    assert np.abs(ROD.primitives[0].shape.distance(canonical)).max() < 2e-3
    # every ray with a dense sample inside is met, and no other
    t = np.linspace(1.5, 4.0, 2500, dtype=np.float32)
    for row in range(0, len(d.T), 41):
        samples = origins[0].astype(np.float32)[:, None] + d[:, row : row + 1] * t
        least = ROD.primitives[0].shape.distance(deformation.inverse(samples)).min()
        if abs(least) > 2e-3:
            assert met[row] == (least < 0)


@pytest.mark.parametrize("deformation", [BEND, TWIST, PULL])
def test_color_travels_with_the_surface(deformation: Deformation) -> None:
    checks = Checker((0.9, 0.8, 0.1), (0.1, 0.2, 0.6), 0.1, (0, 2))
    rod = Part("rod", (Primitive(Cylinder(0.08, 0.4, 0.01), checks),))
    still = ProceduralScene("test", (rod,))
    moved = still.with_modeled_light().deform("rod", deformation)
    angle = np.linspace(0, 6, 400)
    p = np.stack([0.08 * np.cos(angle), 0.08 * np.sin(angle), np.linspace(-0.37, 0.37, 400)])
    viewdirs = np.tile([[0.6], [0.0], [-0.8]], 400)
    there = deformation.forward(p)
    forward_jacobian = np.linalg.inv(np.moveaxis(deformation.inverse_jacobian(there), 2, 0))
    turned = np.einsum("nij,jn->in", forward_jacobian, viewdirs)
    turned /= np.linalg.norm(turned, axis=0)

    def colors(scene: ProceduralScene, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
        _, rgb = scene.field(0.004)(points.T.astype(np.float32), directions.T.astype(np.float32))
        return rgb

    expected = colors(still, p, viewdirs)
    assert expected.std(axis=0).max() > 0.1
    # normals are differences over 4e-4 in float32
    assert np.quantile(np.abs(colors(moved, there, turned) - expected), 0.98) < 0.02


def test_lit_anew_unless_the_light_is_carried_along() -> None:
    still = ProceduralScene("test", (ROD,))
    bent, carried = still.deform("rod", BEND), still.with_modeled_light().deform("rod", BEND)
    camera = Camera.look_at((0.3, -3.0, 0.2), (0.1, 0, 0), width=32, height=32, fov_x=0.5)
    a, b = (scene.photograph(camera, background="white").rgb for scene in (bent, carried))
    assert np.abs(a - b).max() > 0.02
    assert np.array_equal((a < 1).any(-1), (b < 1).any(-1))


def test_a_deformed_part_is_moved_and_darkened_anew() -> None:
    bent = ProceduralScene("test", (ROD,)).deform("rod", BEND)
    moved = bent.move("rod", translate=(0.2, 0, 0))
    np.testing.assert_allclose(
        moved.part_bounds("rod"), bent.part_bounds("rod") + np.array([0.2, 0, 0]), atol=1e-12
    )
    anew = moved.with_new_occlusion()
    assert anew.modeled[0].deformation is None
    np.testing.assert_allclose(anew.part_bounds("rod"), moved.part_bounds("rod"), atol=1e-12)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: ArcBend((0, 0, 0), (0, 0, 1), (0, 0, 2), 1, 1), "two different directions"),
        (lambda: ArcBend((0, 0, 0), (0, 0, 1), (1, 0, 0), 0, 1), "length of a bend must be positive"),
        (lambda: ArcBend((0, 0, 0), (0, 0, 1), (1, 0, 0), 1, -1), "angle of a bend"),
        (lambda: AxialTwist((0, 0, 0), (0, 0, 1), 1, np.inf), "angle of a twist must be finite"),
        (lambda: deform_part(deform_part(ROD, BEND), TWIST), "deform it first, once"),
        (
            lambda: deform_part(ROD, ArcBend((0, 0, -0.5), (0, 0, 1), (1, 0, 0), 0.1, 2.5)),
            "past its radius",
        ),
    ],
)
def test_errors_name_the_cure(call: Callable[[], object], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        call()
