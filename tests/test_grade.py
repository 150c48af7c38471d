"""Grades of edits: the color transform, its falloff, and every renderer against the sampled oracle."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.edits import Edit, EditStack, Grade, KernelMap, dump_edits, parse_edits
from cagefield.edits.edit_map import EditMap
from cagefield.edits.grade import GAMMA, LUMA, grade_sh
from cagefield.edits.partial_edit import partial_edit
from cagefield.errors import EditError, EditFileError
from cagefield.fields.sh import sh_basis
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.images.metrics import psnr
from cagefield.pages.page_splat_edits import COLOR_RANGES, decode_colors, encode_colors
from cagefield.rendering.edited_field import EditedField
from cagefield.rendering.reference_renderer import render_sampled
from cagefield.rendering.splats.bake_splats import baked_splats
from cagefield.rendering.splats.raster_splats import deformed_splats
from cagefield.rendering.splats.reference_raster_splats import deformed_splats_reference
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from splat_scenes import random_splats
from tiers import nightly_except

INNER = Cage.box((0.1, 0.0, 0.0), (0.7, 0.8, 0.6), rotation=(0.1, 0.2, 0.3))
OUTER = INNER.grown(0.4)
GRADE = Grade(exposure=-0.4, temperature=0.7, tint=-0.3, saturation=1.3, hue_deg=70.0, opacity=0.4)
CAMERA = Camera.look_at((2.2, -1.6, 1.1), (0, 0, 0), width=20, height=18, fov_x=0.75)

STACKS: dict[str, list[Edit]] = {
    "grade alone": [Edit.continuous(INNER, OUTER, grading=GRADE)],
    "turned": [Edit.continuous(INNER, OUTER, grading=GRADE).rotate((0.2, 0.1, 0.6))],
    "turned, lattice": [Edit.continuous(INNER, OUTER, lattice=48, grading=GRADE).rotate((0.2, 0.1, 0.6))],
    "bent": [Edit.continuous(INNER, OUTER, grading=GRADE).move_corner(7, (0.1, 0.15, 0.1))],
    "move": [Edit.move(INNER, grading=GRADE, fill="none", relight="none").translate((0.3, 0.2, 0.1))],
    "copy in place": [Edit.copy(INNER, grading=GRADE, fill="none", relight="none")],
    "two": [
        Edit.continuous(INNER, OUTER, grading=Grade(hue_deg=100.0)).translate((0.1, 0.0, 0.0)),
        Edit.copy(INNER, grading=Grade(saturation=0.2, opacity=2.0)).translate((0.3, -0.3, 0.0)),
    ],
}


def fog(degree: int = 1, size: int = 24, seed: int = 3) -> VoxelField:
    """Field of smooth random density and color, all colors inside (0, 1)."""
    rng = np.random.default_rng(seed)
    axis = np.linspace(-1, 1, size)
    p = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    density = 2.0 * np.exp(-2.0 * (p**2).sum(axis=1))
    sh = 0.06 * rng.normal(size=(len(p), (degree + 1) ** 2, 3))
    sh[:, 0] = 0.7 * np.sin(2.0 * p + rng.normal(size=3))
    box = np.array([[-1.0] * 3, [1.0] * 3])
    return VoxelField(box, (size,) * 3, np.arange(len(p)), density.astype(np.float32), sh.astype(np.float32))


def test_exposure_scales_linear_light_and_keeps_gray_gray() -> None:
    half = Grade(exposure=1.0).matrix @ np.full(3, 0.5)
    np.testing.assert_allclose(half**GAMMA, 2.0 * 0.5**GAMMA, rtol=1e-12)
    for grade in (Grade(saturation=0.0), Grade(hue_deg=133.0), Grade(saturation=3.0)):
        np.testing.assert_allclose(grade.matrix @ np.full(3, 0.4), 0.4, rtol=1e-12)


def test_white_balance_keeps_the_luminance_of_white() -> None:
    warm = Grade(temperature=1.0, tint=0.5).matrix @ np.ones(3)
    assert warm[0] > warm[2]
    np.testing.assert_allclose(warm**GAMMA @ LUMA, 1.0, rtol=1e-12)
    np.testing.assert_allclose(GAMMA * np.log2(warm[0] / warm[2]), 1.0, rtol=1e-12)


def test_hue_takes_red_to_green_and_saturation_keeps_luma() -> None:
    np.testing.assert_allclose(Grade(hue_deg=120.0).matrix @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(Grade(saturation=0.3).matrix.T @ LUMA, LUMA, atol=1e-12)
    turns = Grade(hue_deg=90.0).matrix @ Grade(hue_deg=30.0).matrix
    np.testing.assert_allclose(turns, Grade(hue_deg=120.0).matrix, atol=1e-12)


def test_graded_harmonics_are_the_harmonics_of_graded_colors() -> None:
    rng = np.random.default_rng(0)
    sh = rng.normal(size=(5, 16, 3)).astype(np.float32)
    d = rng.normal(size=(5, 3))
    basis = sh_basis(d / np.linalg.norm(d, axis=1, keepdims=True), 3)
    matrices = GRADE.matrices(rng.random(5))
    before, after = (0.5 + np.einsum("nk,nkc->nc", basis, values) for values in (sh, grade_sh(sh, matrices)))
    np.testing.assert_allclose(after, np.einsum("nij,nj->ni", matrices, before), atol=2e-6)


def test_the_falloff_is_one_inside_zero_outside_and_monotonous() -> None:
    edit = Edit.continuous(INNER, OUTER, grading=GRADE)
    inside = np.zeros(400, bool)
    u = np.random.default_rng(1).random((400, 3))
    points = INNER.corners[0] + u @ (INNER.corners[[1, 2, 4]] - INNER.corners[0])
    assert (edit.grade_weights(points, inside) == 1.0).all()
    face = OUTER.corners[0] + u * [1, 1, 0] @ (OUTER.corners[[1, 2, 4]] - OUTER.corners[0])
    assert edit.grade_weights(face, inside).max() < 1e-6
    for end in face[:20]:
        way = INNER.center + np.linspace(0, 1, 200)[:, None] * (end - INNER.center)
        steps = np.diff(edit.grade_weights(way, np.zeros(200, bool)))
        assert (steps <= 1e-12).all()
        assert np.abs(steps).max() < 0.1


@pytest.mark.parametrize("name", nightly_except(STACKS, "grade alone", "two"))
def test_the_kernels_grade_is_the_references(name: str) -> None:
    stack = EditStack(STACKS[name])
    rng = np.random.default_rng(2)
    p = rng.uniform(-1, 1, (4000, 3))
    d = rng.normal(size=p.shape)
    exact, kernel = stack.to_canonical(p, d).grade, KernelMap(stack).to_canonical(p, d).grade
    assert exact is not None and kernel is not None
    assert np.abs(exact.colors - np.eye(3)).max() > 0.1
    # Samples within rounding of a face may fall on either side.
    off = np.abs(kernel.colors - exact.colors).max(axis=(1, 2))
    assert np.quantile(off, 0.999) < 2e-3 if "lattice" in name else np.quantile(off, 0.999) < 1e-4
    assert np.quantile(np.abs(kernel.density - exact.density), 0.999) < 2e-3


@pytest.mark.parametrize("name", nightly_except(STACKS, "two"))
def test_voxels_match_the_plain_renderer(name: str) -> None:
    field, stack = fog(), EditStack(STACKS[name])
    fast = VoxelRenderer(field, stack, step=0.25).render(CAMERA)
    plain = render_sampled(field, CAMERA, edits=stack, samples=200)
    neutral = EditStack(edit.replace(grading=Grade()) for edit in stack)
    ungraded = render_sampled(field, CAMERA, edits=neutral, samples=200)
    assert psnr(plain.rgb, ungraded.rgb) < 35.0, "the grade is seen"
    assert psnr(fast.rgb, plain.rgb) > 45.0


@pytest.mark.nightly
def test_a_uniform_grade_is_the_matrix_on_the_picture() -> None:
    field = fog()
    everything = Cage.box((0, 0, 0), 4.0)
    stack = EditStack([Edit.copy(everything, grading=Grade(hue_deg=40.0, saturation=0.6))])
    stacks = EditStack(), stack
    before, after = (VoxelRenderer(field, edits).render(CAMERA, background="none") for edits in stacks)
    visible = before.opacity > 0.05
    expected = before.rgb[visible] @ stack[0].grading.matrix.T
    assert np.abs(after.rgb[visible] - expected).max() < 5e-3


@pytest.mark.parametrize("preserve_opacity", [True, False])
@pytest.mark.parametrize("name", STACKS)
def test_splats_match_the_oracle(name: str, preserve_opacity: bool) -> None:
    field, stack = random_splats(400, seed=5, degree=2), EditStack(STACKS[name])
    fast = deformed_splats(field, stack, preserve_opacity=preserve_opacity)
    oracle = deformed_splats_reference(field, stack, preserve_opacity=preserve_opacity)
    order, other = (np.lexsort(np.round(each.means, 4).T) for each in (fast, oracle))
    np.testing.assert_allclose(fast.means[order], oracle.means[other], atol=1e-4)
    np.testing.assert_allclose(fast.sh[order], oracle.sh[other], atol=2e-4)
    np.testing.assert_allclose(fast.opacities[order], oracle.opacities[other], atol=2e-4)
    assert np.abs(oracle.opacities - field.opacities[0]).max() > 0.0


@pytest.mark.parametrize("name", ["grade alone", "turned", "copy in place"])
def test_baked_splats_look_as_the_graded_ones(name: str) -> None:
    field, stack = random_splats(300, seed=6, degree=1), EditStack(STACKS[name])
    shown = SplatRenderer(field, stack).render(CAMERA)
    baked = SplatRenderer(baked_splats(field, stack)).render(CAMERA)
    assert psnr(shown.rgb, baked.rgb) > 80.0
    assert psnr(shown.rgb, SplatRenderer(field).render(CAMERA).rgb) < 60.0


@pytest.mark.parametrize("name", ["turned, lattice", "move", "two"])
def test_networks_are_graded_as_the_reference(name: str) -> None:
    torch = pytest.importorskip("torch")
    from cagefield.rendering.nerf.torch_edit_map import TensorMap

    field, stack = fog(), EditStack(STACKS[name])
    rng = np.random.default_rng(8)
    p, d = (rng.uniform(-0.9, 0.9, (2000, 3)).astype(np.float32) for _ in range(2))
    d /= np.linalg.norm(d, axis=1, keepdims=True)

    def network(points: Any, viewdirs: Any) -> tuple[Any, Any]:
        return tuple(torch.from_numpy(values) for values in field(points.numpy(), viewdirs.numpy()))  # type: ignore[return-value]

    mapped = TensorMap(stack, torch.device("cpu"))
    found = mapped.evaluated(torch.from_numpy(p), torch.from_numpy(d), network)
    expected = EditedField(field, stack, field.bounds)(p, d)
    for ours, theirs in zip(found, expected, strict=True):
        assert np.quantile(np.abs(ours.numpy() - theirs), 0.995) < 5e-3
    ungraded = EditedField(field, EditStack(edit.ungraded for edit in stack), field.bounds)(p, d)
    assert np.abs(ungraded[1] - expected[1]).max() > 0.1


def test_the_optical_depth_of_a_splat_is_multiplied() -> None:
    field = random_splats(50, seed=7, degree=0)
    stack = EditStack([Edit.copy(Cage.box((0, 0, 0), 20.0)).grade(opacity=2.5)])
    baked = baked_splats(field, stack, split=False)
    depths = (-np.log1p(-each.opacities.astype(np.float64)) for each in (field, baked))
    before, after = depths
    np.testing.assert_allclose(after, 2.5 * before, rtol=1e-3)
    assert not len(baked) or np.array_equal(baked.sh, field.sh)


def test_neutral_values_change_no_bit() -> None:
    field = fog()
    moved = Edit.continuous(INNER, OUTER, lattice=32).translate((0.1, 0.0, 0.0))
    neutral = moved.grade(exposure=0.0, saturation=1.0, opacity=1.0)
    assert neutral == moved
    pictures = [VoxelRenderer(field, EditStack([edit])).render(CAMERA) for edit in (moved, neutral)]
    assert np.array_equal(pictures[0].rgb, pictures[1].rgb)
    still = EditStack([Edit.continuous(INNER, OUTER).grade(hue_deg=0.0)])
    assert still.active == ()
    bare = VoxelRenderer(field, EditStack()).render(CAMERA)
    assert np.array_equal(VoxelRenderer(field, still).render(CAMERA).rgb, bare.rgb)


def test_an_edit_that_only_grades_moves_no_sample() -> None:
    stack: EditMap = EditStack(STACKS["grade alone"])
    p = np.random.default_rng(3).uniform(-1, 1, (500, 3)).astype(np.float32)
    d = np.tile(np.array([0, 0, 1], np.float32), (500, 1))
    samples = KernelMap(stack).to_canonical(p, d)
    assert np.array_equal(samples.points, p)
    assert np.abs(stack.to_canonical(p, d).points - p).max() < 1e-12


def test_edit_files_keep_grades() -> None:
    text = """
    - inner: {center: [0, 0, 0], size: 1}
      outer: {margin: 0.5}
      grade: {exposure: 0.5, saturation: 1.2}
    """
    stack = parse_edits(text)
    assert stack[0].grading == Grade(exposure=0.5, saturation=1.2)
    for edits in STACKS.values():
        assert parse_edits(dump_edits(EditStack(edits))) == EditStack(edits)
    with pytest.raises(EditFileError, match=r"unknown key.*did you mean"):
        parse_edits(text.replace("saturation", "saturatoin"))
    with pytest.raises(EditFileError, match=r"opacity of a grade must be 0 to 100, got -1"):
        parse_edits(text.replace("exposure: 0.5", "opacity: -1"))
    with pytest.raises(EditFileError, match="a delete shows nothing to grade"):
        parse_edits(text.replace("outer: {margin: 0.5}", "delete: true"))


def test_errors_name_the_fault() -> None:
    with pytest.raises(EditError, match="saturation of a grade must be 0 to 4, got -1"):
        Edit.copy(INNER).grade(saturation=-1.0)
    with pytest.raises(EditError, match="not contrast"):
        Edit.copy(INNER).grade(contrast=1.0)
    with pytest.raises(EditError, match="control points have no inside to grade"):
        Edit.points([[0, 0, 0]], radius=0.5).grade(exposure=1.0)


def test_a_share_of_an_edit_has_a_share_of_its_grade() -> None:
    edit = Edit.move(INNER, grading=GRADE).translate((1.0, 0.0, 0.0))
    half = partial_edit(edit, 0.5)
    assert half is not None
    assert half.grading == Grade(-0.2, 0.35, -0.15, 1.15, 35.0, 0.7)
    assert partial_edit(edit, 1.0) is edit


@pytest.mark.parametrize("largest", [1.0, 1.9, 5.0, 20.0])
def test_matrices_of_pages_keep_their_entries(largest: float) -> None:
    """Nine entries of 14 bits, to half a step of the range that holds the largest one."""
    matrices = np.random.default_rng(0).uniform(-largest, largest, (500, 3, 3)).astype(np.float32)
    reach = next(value for value in COLOR_RANGES[1:] if value >= largest)
    np.testing.assert_allclose(decode_colors(encode_colors(matrices)), matrices, atol=0.51 * reach / 8191)
