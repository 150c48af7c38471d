"""Edits on splats: against the float64 oracle, finite differences, a moved camera, and sampled densities."""

from __future__ import annotations

import dataclasses
import gc
import weakref
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cagefield.cameras.camera import Camera
from cagefield.completion.splat_patch import build_splat_patch
from cagefield.edits import Edit, EditStack, Flow, PreparedEdit, PreparedStack, Trilinear
from cagefield.errors import EditError
from cagefield.fields.splat_field import SplatField
from cagefield.geometry import hexahedron
from cagefield.geometry.cage import Cage, rotation_matrix
from cagefield.rendering.reference_renderer import render_sampled
from cagefield.rendering.splats.kernels.deformation import polar_rotation
from cagefield.rendering.splats.raster_splats import DeformedSplats, deformed_splats, rotation_matrices
from cagefield.rendering.splats.reference_raster_splats import deformed_splats_reference
from cagefield.rendering.splats.splat_motion import moved_splats
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.warps import forward
from splat_scenes import random_splats
from tiers import nightly_except

INNER = Cage.box((0, 0, 0), 0.6)
OUTER = INNER.grown(0.5)
BENT = OUTER.move_corner(7, (0.3, 0.2, 0.2))
EVERYTHING = Cage.box((0, 0, 0), 20.0)
CAMERA = Camera.look_at((2.6, -1.9, 1.4), (0, 0, 0), width=48, height=40, fov_x=0.75)
ELSEWHERE = Cage.box((0.5, 0.2, 0.0), 0.4)

EDITS = {
    "translate": [Edit.continuous(INNER, OUTER).translate((0.2, 0.1, 0.0))],
    "rotate": [Edit.continuous(INNER, OUTER).rotate((0.5, 0.3, 1.2))],
    "scale": [Edit.continuous(INNER, OUTER, shell=Flow(falloff="linear", width=0.7)).scale((1.0, 0.8, 1.5))],
    "corner": [Edit.continuous(INNER, OUTER).translate((0.1, 0.0, 0.0)).move_corner(7, (0.15, 0.1, 0.1))],
    "bent outer": [Edit.continuous(INNER, BENT).rotate((0.0, 0.4, 0.4)).move_corner(0, (0.1, 0.1, 0.1))],
    "trilinear": [Edit.continuous(INNER, OUTER, shell=Trilinear()).translate((0.1, 0.1, 0.0))],
    "lattice": [Edit.continuous(INNER, OUTER, lattice=16).rotate((0.0, 0.0, 0.5))],
    "points": [Edit.points([[0, 0, 0]], radius=0.5).translate((0.3, 0.1, 0.0)).rotate((0, 0, 1.0))],
    "points apart": [
        Edit.points([[0.1, 0, 0], [-0.2, 0.2, 0]], radius=0.4, falloff="root")
        .move_point(0, (0.1, -0.1, 0.1))
        .move_point(1, (-0.1, 0.1, 0))
    ],
    "move": [Edit.move(INNER).translate((0.5, 0.0, 0.0)).rotate((0, 0, 0.5))],
    "bent move": [Edit.move(INNER).move_corner(7, (0.4, 0.3, 0.2))],
    "copy": [Edit.copy(INNER).translate((0.4, 0.0, 0.0))],
    "delete": [Edit.delete(INNER)],
    "disabled": [Edit.delete(INNER).replace(enabled=False)],
    "nothing": [Edit.continuous(INNER, OUTER)],
}
EDITS["copy, then move"] = [
    *EDITS["copy"],
    Edit.move(Cage.box((0.2, 0, 0), (1.4, 0.4, 1.0))).translate((0, 0, 0.7)),
]
EDITS["copy of a copy"] = [
    *EDITS["copy"],
    Edit.copy(Cage.box((0.2, 0, 0), (1.2, 0.5, 0.6))).translate((0.0, 0.7, 0.0)),
]
EDITS["turn, copy, scale"] = [
    *EDITS["rotate"],
    *EDITS["copy"],
    Edit.continuous(ELSEWHERE, ELSEWHERE.grown(0.25)).scale((1.0, 1.3, 1.0)),
]


def posed(camera: Camera, rotation: np.ndarray, origin: np.ndarray) -> Camera:
    """The camera with other axes [3,3] and another place."""
    c2w = np.eye(4)
    c2w[:3, :3], c2w[:3, 3] = rotation, origin
    return camera.with_c2w(c2w)


def near_splats(count: int, seed: int = 0) -> SplatField:
    """Random splats, all of them around the cages."""
    field = random_splats(count, seed=seed)
    return SplatField(0.7 * field.means, field.log_scales, field.quaternions, field.opacities, field.sh)


def sorted_rows(splats: DeformedSplats) -> np.ndarray:
    """All numbers of each splat in a row [N,...], float64, the rows in the order of their means."""
    rotations = splats.rotations if splats.rotations is not None else np.eye(3)[None].repeat(len(splats), 0)
    parts = (splats.means, splats.covariances, splats.opacities, splats.sh, rotations)
    rows = np.concatenate([part.reshape(len(splats), -1).astype(np.float64) for part in parts], axis=1)
    # float32's rounding must not decide the order.
    return rows[np.lexsort(np.round(rows[:, :3], 4).T)]


@pytest.mark.parametrize(
    ("preserve_opacity", "name"),
    nightly_except(
        product([True, False], EDITS), *product([True], EDITS), (False, "corner"), (False, "copy, then move")
    ),
)
def test_splats_are_those_of_the_oracle(name, preserve_opacity):
    field, edits = near_splats(250), EditStack(EDITS[name])
    got = sorted_rows(deformed_splats(field, edits, preserve_opacity=preserve_opacity))
    expected = sorted_rows(deformed_splats_reference(field, edits, preserve_opacity=preserve_opacity))
    assert got.shape == expected.shape
    # float32, 4e-7 of the scene; in the Jacobian 1e-5, and 3e-5
    # for a linear falloff, whose kinks cost the integration its order.
    np.testing.assert_allclose(got, expected, rtol=5e-5, atol=5e-5)
    np.testing.assert_allclose(got[:, :3], expected[:, :3], atol=2e-6)


@pytest.mark.parametrize("name", ["rotate", "scale", "corner", "trilinear", "move"])
def test_covariances_follow_finite_differences_of_the_map(name):
    field, edits = near_splats(200), EditStack(EDITS[name])
    moved = moved_splats(field, edits)
    got = deformed_splats(field, edits)
    assert len(moved.source) >= 10
    p, h = field.means[moved.source].astype(np.float64), 1e-6
    steps = np.concatenate([p + h * axis for axis in np.eye(3)] + [p - h * axis for axis in np.eye(3)])
    ends = edits.to_deformed(steps).points.reshape(6, -1, 3)
    J = np.transpose((ends[:3] - ends[3:]) / (2.0 * h), (1, 2, 0))
    smooth = np.abs(J - moved.jacobian).max(axis=(1, 2)) < 1e-4  # but for those within h of a kink
    assert smooth.mean() > 0.95
    axes = rotation_matrices(field.quaternions.astype(np.float64))[moved.source]
    axes = J @ (axes * np.exp(field.log_scales.astype(np.float64))[moved.source][:, None, :])
    C = (axes @ axes.transpose(0, 2, 1)).reshape(-1, 9)[:, [0, 1, 2, 4, 5, 8]]
    rows = np.concatenate([np.flatnonzero(~moved.left), moved.source])
    place = np.empty(len(rows), np.int64)
    # A splat's row: its own where each is shown once, else after those that stayed.
    place[:] = rows if moved.is_whole else np.arange(len(rows))
    shown = got.covariances[place[len(rows) - len(p) :]]
    # The central difference is off by rounding / h, 1e-9, and by half a jump of the slope beside a kink.
    np.testing.assert_allclose(shown[smooth], C[smooth], rtol=5e-4, atol=1e-6)


def test_an_empty_stack_returns_the_same_arrays():
    field = random_splats(50)
    plain = deformed_splats(field, EditStack())
    far = Cage.box((9, 9, 9), 0.5)
    for edits in (
        EditStack(EDITS["nothing"]),
        EditStack([Edit.continuous(far, far.grown(0.5)).translate((0.1, 0, 0))]),
    ):
        assert deformed_splats(field, edits) is plain
    assert plain.means is field.means and plain.sh is field.sh and plain.rotations is None


def test_what_no_edit_reaches_stays_bit_for_bit_and_shares_its_colors():
    field, edits = random_splats(400), EditStack(EDITS["rotate"])
    plain, got = deformed_splats(field, EditStack()), deformed_splats(field, edits)
    outside = ~OUTER.contains(field.means)
    assert 50 < outside.sum() < 350
    for name in ("means", "covariances"):
        assert np.array_equal(getattr(got, name)[outside], getattr(plain, name)[outside])
        assert not np.array_equal(getattr(got, name), getattr(plain, name))
    assert got.sh is field.sh and got.opacities is field.opacities
    assert np.array_equal(got.rotations[outside], np.broadcast_to(np.eye(3), (outside.sum(), 3, 3)))


def test_a_rigid_motion_of_everything_is_a_motion_of_the_camera():
    field, turn, shift = random_splats(60), np.array([0.3, -0.4, 0.9]), np.array([0.5, 0.2, -0.3])
    edit = Edit.move(EVERYTHING).rotate(turn).translate(shift)
    R = rotation_matrix(turn)
    camera = posed(CAMERA, R @ CAMERA.c2w[:3, :3], R @ CAMERA.origin + shift)
    still = SplatRenderer(field).render(CAMERA)
    moved = SplatRenderer(field, EditStack([edit])).render(camera)
    # Rounding of float32 in covariances and means, times the 48 pixels of the picture.
    np.testing.assert_allclose(moved.rgb, still.rgb, atol=3e-4)
    assert np.abs(SplatRenderer(field, EditStack([edit])).render(CAMERA).rgb - still.rgb).max() > 0.1


def test_scaling_everything_is_a_nearer_camera():
    field = random_splats(60)
    edit = Edit.move(EVERYTHING).scale(2.0)
    camera = posed(CAMERA, CAMERA.c2w[:3, :3], 2.0 * CAMERA.origin)
    still = SplatRenderer(field).render(CAMERA)
    scaled = SplatRenderer(field, EditStack([edit])).render(camera)
    np.testing.assert_allclose(scaled.rgb, still.rgb, atol=3e-4)
    np.testing.assert_allclose(scaled.opacity, still.opacity, atol=3e-4)


def blob(scales=(0.12, 0.08, 0.05), depth: float = 0.3, at=(0.1, 0.0, 0.05)) -> tuple[SplatField, object]:
    """One gray splat, and the density of the same Gaussian whose rays through the mean lose as much.

    The density is -log(1 - o) times the Gaussian over its line integral along the ray: that is what the
    picture of a splat means, and it depends on the ray's direction.
    """
    opacity = 1.0 - np.exp(-depth)
    quaternion = np.array([[0.8, 0.3, -0.4, 0.33]])
    field = SplatField(np.array([at]), np.log([scales]), quaternion, np.array([opacity]), np.zeros((1, 1, 3)))
    R = rotation_matrices(field.quaternions.astype(np.float64))[0]
    precision = R @ np.diag(np.array(scales) ** -2.0) @ R.T

    def density(points, viewdirs):
        offset = points - at
        along = np.sqrt(np.einsum("ni,ij,nj->n", viewdirs, precision, viewdirs))
        gauss = np.exp(-0.5 * np.einsum("ni,ij,nj->n", offset, precision, offset))
        sigma = depth * along / np.sqrt(2.0 * np.pi) * gauss
        return sigma.astype(np.float32), np.full((len(points), 3), 0.5, np.float32)

    return field, density


AFFINE = {
    "turn": Edit.move(Cage.box((0, 0, 0), 1.4)).rotate((0.4, 0.2, 0.8)),
    "stretch": Edit.move(Cage.box((0, 0, 0), 1.4)).scale((1.8, 1.0, 0.6)),
    "shear": Edit.move(Cage.box((0, 0, 0), 1.4)).shear(xy=0.7, zx=-0.4),
    "continuous": Edit.continuous(
        Cage.box((0, 0, 0), 1.4), Cage.box((0, 0, 0), 3.2), shell=Trilinear()
    ).scale((1.3, 0.8, 1.6)),
    "copy": Edit.copy(Cage.box((0.1, 0, 0), (0.8, 1.4, 1.4))).translate((0.9, 0, 0)),
    "delete": Edit.delete(Cage.box((0, 0, 0), 1.4)),
}


@pytest.mark.parametrize("name", AFFINE)
def test_a_blob_under_an_affine_edit_is_the_sampled_density(name):
    field, density = blob()
    edits = EditStack([AFFINE[name]])
    camera = Camera.look_at((9.0, -6.0, 4.0), (0.2, 0, 0), width=64, height=56, fov_x=0.18)
    got = SplatRenderer(field, edits).render(camera, background="black").opacity
    truth = render_sampled(
        density, camera, near=10.2, far=12.8, samples=130, edits=edits, background="black"
    ).opacity
    # o g is less than 1 - (1 - o)^g by depth^2 / 8 = .011 at most; alphas under 1/255 are cut; .3 pixels^2 of
    # blur beside variances of 30 and more; perspective across a blob of a fortieth of the distance.
    assert np.abs(got - truth).max() < 0.025
    assert truth.max() > 0.2 or name == "delete"
    if name not in ("delete", "copy"):
        still = SplatRenderer(field).render(camera, background="black").opacity
        assert np.abs(still - truth).max() > 0.06, "the edit must show"


def test_a_splat_in_a_covered_place_is_hidden():
    field, _ = blob(at=(1.0, 0.0, 0.0))
    onto = Edit.move(Cage.box((0, 0, 0), 0.5)).translate((1.0, 0.0, 0.0))
    for edit in (onto, Edit.copy(onto.inner, operations=onto.operations)):
        assert len(deformed_splats(field, EditStack([edit]))) == 0
        # One that reaches over is split: its part beside the cage stays. This one does not.
        small = dataclasses.replace(field, log_scales=np.full_like(field.log_scales, np.log(0.02)))
        assert not SplatRenderer(small, EditStack([edit])).render(CAMERA, background="black").opacity.any()
    # What is emptied first, and filled by the next edit, shows the later one.
    elsewhere, _ = blob(at=(0.0, 0.0, 0.0))
    assert len(deformed_splats(elsewhere, EditStack([onto]))) == 1


def test_a_copy_is_shown_twice_and_a_moved_copy_leaves_the_original():
    field, _ = blob(at=(0.0, 0.0, 0.0))
    copy = Edit.copy(Cage.box((0, 0, 0), 0.5)).translate((1, 0, 0))
    move = Edit.move(Cage.box((1, 0, 0), 0.5)).translate((0, 2, 0))
    means = deformed_splats(field, EditStack([copy, move])).means
    np.testing.assert_allclose(means[np.argsort(means[:, 1])], [[0, 0, 0], [1, 2, 0]], atol=1e-6)
    assert len(deformed_splats(field, EditStack([copy, Edit.delete(Cage.box((0, 0, 0), 0.5))]))) == 1


def test_a_copy_onto_itself_covers_the_part_that_it_lies_on():
    field = random_splats(3000)
    edit = Edit.copy(INNER).translate((0.2, 0, 0))
    got = deformed_splats(field, EditStack([edit])).means
    inside, target = INNER.contains(field.means), edit.deformed.contains(field.means)
    expected = np.concatenate([field.means[~target], field.means[inside] + np.float32([0.2, 0, 0])])
    assert (inside & target).any()
    order, want = np.lexsort(np.round(got, 4).T), np.lexsort(np.round(expected, 4).T)
    np.testing.assert_allclose(got[order], expected[want], atol=1e-6)


def test_opacity_without_preserving_it_is_what_a_uniform_scale_makes_of_the_ray():
    field, density = blob((0.06,) * 3, at=(0.0, 0.0, 0.0))
    edits = EditStack([Edit.move(Cage.box((0, 0, 0), 0.9)).scale(2.0)])
    camera = Camera.look_at((9.0, -6.0, 4.0), (0, 0, 0), width=41, height=41, fov_x=0.1)
    truth = render_sampled(
        density, camera, near=10.5, far=12.5, samples=130, edits=edits, background="black",
        preserve_opacity=False,
    ).opacity  # fmt: skip
    got = SplatRenderer(field, edits, preserve_opacity=False).render(camera, background="black")
    # Through the mean the two agree but for the filter's blur: .3 beside 150 pixels^2.
    assert got.opacity[20, 20] == pytest.approx(1.0 - np.exp(-0.6), abs=3e-3)
    assert truth[20, 20] == pytest.approx(1.0 - np.exp(-0.6), abs=3e-3)
    kept = SplatRenderer(field, edits).render(camera, background="black").opacity[20, 20]
    assert kept == pytest.approx(1.0 - np.exp(-0.3), abs=3e-3)
    other = SplatRenderer(field).with_edits(edits, preserve_opacity=False)
    assert np.array_equal(
        other.splats.opacities, deformed_splats(field, edits, preserve_opacity=False).opacities
    )


def test_flat_and_tiny_splats_stay_positive():
    count = 2000
    chance = np.random.default_rng(3)
    scales = 10.0 ** chance.uniform(-9.0, -0.5, (count, 3))
    field = SplatField(
        chance.uniform(-0.9, 0.9, (count, 3)),
        np.log(scales),
        chance.normal(size=(count, 4)),
        np.full(count, 0.5),
        np.zeros((count, 1, 3)),
    )
    for name in ("rotate", "scale", "bent move"):
        edits = EditStack(EDITS[name])
        moved, got = moved_splats(field, edits), deformed_splats(field, edits)
        rows = moved.source if moved.is_whole else np.arange(len(got) - len(moved.source), len(got))
        full = got.covariances[rows][:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3).astype(np.float64)
        values = np.linalg.eigvalsh(full)
        assert len(rows) > 50
        assert (values[:, 0] > 0.0).all()
        # And not made fat: no more than the slack, which is 2e-7 of the largest variance, and rounding.
        sizes = np.linalg.svd(moved.jacobian, compute_uv=False)[:, 0] * scales[moved.source].max(axis=1)
        assert (np.sqrt(values[:, 2]) < sizes * (1.0 + 1e-5)).all()


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.05, 4.0))
def test_polar_rotations_are_those_of_the_singular_value_decomposition(seed, spread):
    chance = np.random.default_rng(seed)
    U, _, V = np.linalg.svd(chance.normal(size=(3, 3)))
    J = (U * np.exp(chance.normal(size=3) * spread * 0.5)) @ V
    if np.linalg.det(J) < 0.0:
        J = -J
    R = np.empty((3, 3))
    polar_rotation(J, R)
    A, s, B = np.linalg.svd(J)
    # The rotation's condition is 2 / (the sum of the two least singular values).
    np.testing.assert_allclose(R, A @ B, atol=1e-12 * s[0] / s[1])
    assert np.linalg.det(R) == pytest.approx(1.0)


def test_a_singular_jacobian_turns_nothing():
    R = np.empty((3, 3))
    polar_rotation(np.diag([1.0, 1.0, 0.0]), R)
    assert np.array_equal(R, np.eye(3))


@pytest.mark.parametrize("name", ["translate", "rotate", "corner", "bent outer", "turn, copy, scale"])
def test_coarse_splats_are_near_the_exact_ones(name):
    field, edits = near_splats(300), EditStack(EDITS[name])
    coarse, exact = moved_splats(field, edits, coarse=True), moved_splats(field, edits)
    inside = np.isin(coarse.source, exact.source)
    assert inside.mean() > 0.99
    if name != "turn, copy, scale":
        # Steps of strain 1: 2e-3 of the scene for turns of 140 degrees, these are of 77 at most.
        np.testing.assert_allclose(coarse.points, exact.points, atol=2e-3)


def test_the_forward_flow_converges_with_the_fourth_order():
    shell = EDITS["rotate"][0].exact_warp.shell
    points = np.random.default_rng(0).uniform(-0.79, 0.79, (500, 3))
    points = points[OUTER.contains(points) & ~INNER.contains(points)]

    def ends(strain: float) -> tuple[np.ndarray, int]:
        finer = shell.with_strain(strain)
        return forward._ForwardFlow(finer, False).to_deformed(points)[0], len(finer.knots) - 1

    # The float64 reference: the inverse of its way back.
    truth = shell.with_strain(0.03).to_deformed(points)[0]
    errors, steps = zip(*((np.abs(got - truth).max(), n) for got, n in map(ends, (0.8, 0.3))), strict=True)
    order = np.log(errors[0] / errors[1]) / np.log(steps[1] / steps[0])
    assert 3.5 < order < 5.0
    # And it is the flow of the reference, up to float32.
    np.testing.assert_allclose(ends(0.05)[0], truth, atol=4e-7)


def test_points_whose_coordinates_are_lost_are_mapped_by_the_reference(monkeypatch):
    edit = EDITS["bent outer"][0]
    shell = edit.exact_warp.shell
    points = np.random.default_rng(1).uniform(-0.7, 0.7, (60, 3))
    points = points[OUTER.contains(points) & ~INNER.contains(points)]
    asked = []
    original = type(shell).to_deformed
    monkeypatch.setattr(
        type(shell), "to_deformed", lambda self, p: (asked.append(len(p)), original(self, p))[1]
    )
    from cagefield.warps.kernels import flow_forward

    march = flow_forward.march

    def all_lost(*args):
        march(*args[:5], -1.0, *args[6:])

    monkeypatch.setattr(flow_forward, "march", all_lost)
    got = forward._ForwardFlow(shell, False).to_deformed(points)
    assert asked == [len(points)]
    np.testing.assert_array_equal(got[0], original(shell, points)[0])


def test_a_longer_stack_begins_where_the_shorter_one_ended(monkeypatch):
    from cagefield.rendering.splats import splat_motion as module

    calls = []
    original = module.to_deformed
    monkeypatch.setattr(module, "to_deformed", lambda *a, **k: (calls.append(1), original(*a, **k))[1])
    field = SplatSet.from_field(random_splats(200))
    edits = EDITS["turn, copy, scale"]
    whole = deformed_splats(field, EditStack(edits))
    assert len(calls) == 3
    assert np.array_equal(deformed_splats(field, EditStack(edits)).means, whole.means)
    assert len(calls) == 3
    # Another last edit, as while it is dragged; quick ones take what is exact, exact ones nothing quick.
    other = EditStack([*edits[:2], edits[2].translate((0.05, 0, 0))])
    quick = deformed_splats(field, other, coarse=True)
    assert len(calls) == 4
    exact = deformed_splats(field, other)
    assert len(calls) == 5
    assert not np.array_equal(quick.means, exact.means)
    np.testing.assert_allclose(quick.means, exact.means, atol=2e-3)
    for n in range(20):
        deformed_splats(field, EditStack([edits[0].translate((1e-3 * n, 0, 0))]))
    assert len(module._known_stacks(field)) <= module.KEPT_STACKS


def test_what_is_kept_of_a_field_ends_with_it():
    splats = SplatSet.from_field(random_splats(20))
    patch = build_splat_patch(splats, EditStack(), Edit.delete(INNER), None)
    deformed_splats(splats, PreparedStack([PreparedEdit(Edit.delete(INNER), patch)]))
    gone = weakref.ref(splats.field)
    del splats, patch
    gc.collect()
    assert gone() is None


def test_proceed_gives_the_work_up(monkeypatch):
    monkeypatch.setattr(forward, "POINTS_PER_STEP", 100)
    field, calls = random_splats(1000), []

    class EnoughError(Exception):
        pass

    def proceed():
        calls.append(1)
        if len(calls) == 3:
            raise EnoughError

    with pytest.raises(EnoughError):
        deformed_splats(field, EditStack(EDITS["rotate"]), proceed=proceed)
    assert len(calls) == 3
    # Parts or one piece, the map is the same.
    parts = deformed_splats(field, EditStack(EDITS["rotate"]))
    monkeypatch.setattr(forward, "POINTS_PER_STEP", 10**6)
    whole = deformed_splats(field.take(np.arange(1000)), EditStack(EDITS["rotate"]))
    assert np.array_equal(parts.means, whole.means)


def test_an_edit_that_cannot_be_evaluated_is_an_error():
    edit = Edit.continuous(INNER, OUTER, name="door").translate((5.0, 0, 0))
    with pytest.raises(EditError, match=r'edit "door": .* is safe'):
        deformed_splats(random_splats(5), EditStack([edit]))


def test_a_field_without_splats():
    field = random_splats(3).take(np.zeros(0, int))
    for name in ("rotate", "copy", "delete"):
        assert len(deformed_splats(field, EditStack(EDITS[name]))) == 0


@pytest.mark.parametrize("is_turned", [False, True])
def test_regions_of_straight_cages_are_those_of_the_reference(is_turned: bool) -> None:
    """Corners, points on faces and beside them, inside and outside: the same region, to rounding the same."""
    inner = Cage.box((3.1, -0.2, 0.4), (0.5, 0.7, 0.3))
    if is_turned:
        inner = inner.rotate((0.3, -0.5, 0.2))
    edit = Edit.continuous(inner, inner.grown(0.4)).translate((0.05, 0.02, -0.1)).rotate((0.1, 0.0, 0.2))
    rng = np.random.default_rng(0)
    u = np.concatenate([hexahedron.BITS, rng.uniform(-0.6, 1.6, (3000, 3)), rng.uniform(0, 1, (600, 3))])
    u[-600:][np.arange(600), rng.integers(0, 3, 600)] = rng.choice([0.0, 1.0, -1e-9, 1.0 + 1e-9], 600)
    points = np.concatenate([hexahedron.points(cage.corners, u) for cage in (edit.inner, edit.outer)])
    found, expected = forward.to_deformed(edit.exact_warp, points), edit.exact_warp.to_deformed(points)
    in_outer, in_inner = edit.outer.contains(points), edit.inner.contains(points)
    assert 500 < in_inner.sum() < in_outer.sum() < len(points) - 500
    np.testing.assert_array_equal(found.points[~in_outer], points[~in_outer])
    np.testing.assert_array_equal(found.jacobian[~in_outer], expected.jacobian[~in_outer])
    np.testing.assert_allclose(found.points[in_inner], expected.points[in_inner], atol=1e-12)
    np.testing.assert_allclose(found.jacobian[in_inner], expected.jacobian[in_inner], atol=1e-12)
    # The shell's steps are those of float32.
    np.testing.assert_allclose(found.points, expected.points, atol=1e-5)
