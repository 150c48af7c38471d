"""Mirrored parts: the map, every renderer, harmonics by parity, and that two mirrors are none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.edits import (
    Edit,
    EditStack,
    KernelMap,
    Mirror,
    PreparedEdit,
    PreparedStack,
    dump_edits,
    parse_edits,
)
from cagefield.edits.partial_edit import partial_edit
from cagefield.errors import EditError, EditFileError
from cagefield.fields.sh import sh_basis
from cagefield.fields.sh_rotation import rotate_sh
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.cage import Cage
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.images.metrics import psnr
from cagefield.pages.page_splat_edits import decode_page_splat_edits, encode_page_splat_edits
from cagefield.pages.path_states import stack_at
from cagefield.rendering.reference_renderer import render_sampled
from cagefield.rendering.splats.bake_splats import baked_splats
from cagefield.rendering.splats.raster_splats import changed_splats, deformed_splats
from cagefield.rendering.splats.reference_raster_splats import deformed_splats_reference
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from splat_scenes import random_splats
from test_grade import fog

CAGE = Cage.box((0.1, -0.1, 0.0), (0.8, 0.7, 0.6), rotation=(0.2, 0.1, 0.4))
EVERYTHING = Cage.box((0, 0, 0), 20.0)
CAMERA = Camera.look_at((2.2, -1.6, 1.1), (0, 0, 0), width=20, height=18, fov_x=0.75)
BARE: dict[str, Any] = {"fill": "none", "relight": "none", "feather": 0.0}

EDITS = {
    "in place": Edit.move(CAGE, **BARE).mirror("x"),
    "copied": Edit.copy(CAGE, **BARE).mirror("y").translate((0.5, 0.3, 0.0)),
    "turned": Edit.move(CAGE, **BARE).rotate((0.3, 0.0, 0.5)).mirror("z"),
    "bent": Edit.move(CAGE, **BARE).mirror("x").move_corner(7, (0.2, 0.1, 0.1)),
    "along two axes": Edit.copy(CAGE, **BARE).mirror("x").mirror("z").translate((0.0, 0.6, 0.0)),
}


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_point_is_shown_at_its_reflection_in_the_cage(axis: str) -> None:
    edit = Edit.move(CAGE, **BARE).mirror(axis)
    u = np.random.default_rng(0).random((50, 3))
    flipped = u.copy()
    flipped[:, "xyz".index(axis)] = 1.0 - flipped[:, "xyz".index(axis)]
    frame = CAGE.corners[[1, 2, 4]] - CAGE.corners[0]
    there, from_ = (CAGE.corners[0] + each @ frame for each in (u, flipped))
    mapped = EditStack([edit]).to_canonical(there)
    np.testing.assert_allclose(mapped.points, from_, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(mapped.jacobian), -1.0, atol=1e-9)


def test_mirrored_twice_is_the_identity() -> None:
    edit = Edit.move(CAGE).mirror("y").mirror("y")
    assert not edit.changes_anything
    turned = Edit.copy(CAGE, **BARE).mirror("x").rotate((0.1, 0.2, 0.3)).mirror("x")
    plain = Edit.copy(CAGE, **BARE).rotate((0.1, 0.2, 0.3))
    p = np.random.default_rng(1).uniform(-1, 1, (500, 3))
    ours, theirs = (EditStack([each]).to_canonical(p, p) for each in (turned, plain))
    assert np.array_equal(ours.points, theirs.points)
    assert np.array_equal(ours.jacobian, theirs.jacobian)
    # Mirrored splats, baked, and mirrored again are the first ones.
    field = random_splats(200, degree=3, seed=2)
    mirror = EditStack([Edit.move(EVERYTHING, **BARE).mirror("x")])
    back = baked_splats(baked_splats(field, mirror, split=False), mirror, split=False)
    order, other = (np.lexsort(np.round(each.means, 3).T) for each in (field, back))
    np.testing.assert_allclose(back.means[other], field.means[order], atol=1e-5)
    np.testing.assert_allclose(back.sh[other], field.sh[order], atol=1e-5)
    np.testing.assert_allclose(_covariances(back)[other], _covariances(field)[order], atol=1e-5)


def _covariances(field: SplatField) -> np.ndarray:
    axes = rotation_matrices(field.quaternions.astype(np.float64))
    axes = axes * np.exp(field.log_scales.astype(np.float64))[:, None]
    return axes @ axes.transpose(0, 2, 1)


@pytest.mark.parametrize("axis", range(3))
def test_harmonics_are_reflected_by_parity(axis: int) -> None:
    reflection = np.eye(3)
    reflection[axis, axis] = -1.0
    rng = np.random.default_rng(3)
    d = rng.normal(size=(64, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    # Each basis function is even or odd along the axis: its coefficient stays, or changes its sign.
    parity = np.sign((sh_basis(d @ reflection, 3) * sh_basis(d, 3)).sum(axis=0))
    np.testing.assert_allclose(sh_basis(d @ reflection, 3), parity * sh_basis(d, 3), atol=1e-12)
    sh = rng.normal(size=(5, 16, 3)).astype(np.float32)
    np.testing.assert_allclose(rotate_sh(sh, reflection), parity[:, None] * sh, atol=2e-6)


@pytest.mark.parametrize("name", EDITS)
def test_the_kernels_map_is_the_references(name: str) -> None:
    stack = EditStack([EDITS[name]])
    rng = np.random.default_rng(4)
    p = rng.uniform(-1, 1, (4000, 3))
    d = rng.normal(size=p.shape)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    exact, kernel = stack.to_canonical(p, d), KernelMap(stack).to_canonical(p, d)
    same = exact.layer == kernel.layer
    assert same.mean() > 0.999
    assert exact.viewdirs is not None
    assert np.quantile(np.abs(exact.points - kernel.points)[same], 0.999) < 1e-5
    assert np.quantile(np.abs(exact.viewdirs - kernel.viewdirs)[same], 0.999) < 1e-5


@pytest.mark.parametrize("name", ["in place", "copied", "bent"])
def test_voxels_match_the_plain_renderer(name: str) -> None:
    field, stack = fog(), EditStack([EDITS[name]])
    plain = render_sampled(field, CAMERA, edits=stack, samples=200)
    assert psnr(VoxelRenderer(field, stack, step=0.25).render(CAMERA).rgb, plain.rgb) > 50.0
    unmirrored = EDITS[name].replace(
        operations=[each for each in EDITS[name].operations if not isinstance(each, Mirror)]
    )
    assert (
        psnr(render_sampled(field, CAMERA, edits=EditStack([unmirrored]), samples=200).rgb, plain.rgb) < 48.0
    )


@pytest.mark.parametrize("name", EDITS)
def test_splats_match_the_oracle(name: str) -> None:
    field, stack = random_splats(400, seed=5, degree=2), EditStack([EDITS[name]])
    fast, oracle = deformed_splats(field, stack), deformed_splats_reference(field, stack)
    order, other = (np.lexsort(np.round(each.means, 4).T) for each in (fast, oracle))
    np.testing.assert_allclose(fast.means[order], oracle.means[other], atol=1e-4)
    np.testing.assert_allclose(fast.covariances[order], oracle.covariances[other], atol=1e-5)
    assert fast.rotations is not None and oracle.rotations is not None
    np.testing.assert_allclose(fast.rotations[order], oracle.rotations[other], atol=1e-4)


def test_the_picture_of_a_mirrored_scene_is_the_mirrored_picture() -> None:
    field = random_splats(300, seed=6, degree=3)
    stack = EditStack([Edit.move(EVERYTHING, **BARE).mirror("x")])
    ahead = Camera.look_at((0.0, -4.0, 0.0), (0, 0, 0), width=48, height=40, fov_x=0.6)
    plain = SplatRenderer(field).render(ahead)
    for renderer in (SplatRenderer(field, stack), SplatRenderer(baked_splats(field, stack, split=False))):
        assert psnr(renderer.render(ahead).rgb, plain.rgb[:, ::-1]) > 50.0
    voxels = fog()
    plain = VoxelRenderer(voxels, step=0.25).render(ahead)
    shown = VoxelRenderer(voxels, stack, step=0.25).render(ahead)
    assert psnr(shown.rgb, plain.rgb[:, ::-1]) > 50.0


def test_a_page_has_the_reflection_of_each_splat() -> None:
    field = random_splats(100, seed=7, degree=2)
    changed = changed_splats(field, EditStack([EDITS["copied"]]))
    decoded = decode_page_splat_edits(encode_page_splat_edits(field, changed))
    assert decoded.mirrored is not None and changed.splats.rotations is not None
    assert decoded.mirrored.all()
    turns = -rotation_matrices(decoded.turns.astype(np.float64))
    np.testing.assert_allclose(turns, changed.splats.rotations, atol=1e-3)


def test_files_and_errors() -> None:
    stack = EditStack(EDITS.values())
    assert parse_edits(dump_edits(stack)) == stack
    text = """
    - inner: {center: [0, 0, 0], size: 1}
      adjustment: discrete
      operations: [{mirror: x}]
    """
    assert parse_edits(text)[0].operations == (Mirror("x"),)
    with pytest.raises(EditFileError, match="must be x or y or z"):
        parse_edits(text.replace("mirror: x", "mirror: w"))
    with pytest.raises(EditFileError, match="make the edit a move or a copy"):
        parse_edits(text.replace("adjustment: discrete", "outer: {margin: 0.5}"))
    with pytest.raises(EditError, match="along x, y or z"):
        Edit.move(CAGE).mirror("up")


def test_a_mirrored_part_keeps_its_opacity_and_color() -> None:
    field = random_splats(50, seed=8, degree=0)
    baked = baked_splats(field, EditStack([Edit.move(EVERYTHING, **BARE).mirror("z")]), split=False)
    np.testing.assert_allclose(np.sort(baked.opacities), np.sort(field.opacities), atol=1e-6)
    assert sorted(baked.sh[:, 0, 0].tolist()) == sorted(field.sh[:, 0, 0].tolist())


def test_a_mirrored_copy_is_nothing_before_it_begins_and_mirrored_on_its_way() -> None:
    edit = Edit.copy(CAGE, **BARE).mirror("x").translate((0.4, 0.0, 0.0))
    assert partial_edit(edit, 0.0) is None
    assert partial_edit(edit, 0.25) == Edit.copy(CAGE, **BARE).mirror("x").translate((0.1, 0.0, 0.0))
    whole = PreparedStack([PreparedEdit(edit)])
    assert [len(stack_at(whole, (part,)).edits) for part in (0.0, 0.5)] == [0, 1]
