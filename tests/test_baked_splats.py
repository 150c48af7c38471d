"""Splats with their edits baked in, against pictures and closed forms of the edits as they are."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cagefield.cameras.camera import turntable
from cagefield.edits import Edit, EditStack
from cagefield.fields.sh import sh_basis
from cagefield.geometry.cage import Cage
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.images.metrics import psnr
from cagefield.rendering.renderers import renderer_of
from cagefield.rendering.splats.bake_splats import baked_splats
from splat_scenes import random_splats
from tiers import nightly_after_first

INNER = Cage.box((0, 0, 0), (1.2, 1.0, 1.4))
CONTINUOUS = (
    Edit.continuous(INNER, INNER.grown(0.5))
    .rotate((0.1, 0.3, -0.2))
    .scale((1.2, 0.8, 1.1))
    .translate((0.05, 0, 0))
)
TURNED = Edit.move(INNER).rotate((0.0, 0.0, math.pi / 2))
COPIED = Edit.copy(INNER).translate((0, 1.5, 0))


@pytest.mark.parametrize("preserve", nightly_after_first([True, False]))
@pytest.mark.parametrize("stack", [[CONTINUOUS], [TURNED, COPIED], [CONTINUOUS, Edit.delete(INNER)]])
def test_pictures_are_those_of_the_edits(stack: list[Edit], preserve: bool) -> None:
    field = random_splats(200, degree=3)
    edits = EditStack(stack)
    edited = renderer_of(field, edits, preserve_opacity=preserve)
    baked = renderer_of(baked_splats(field, edits, preserve_opacity=preserve))
    for camera in turntable((0, 0, 0), 4.0, 3, elevation=0.4, width=64, height=64, fov_x=0.8):
        a, b = edited.render(camera), baked.render(camera)
        assert a is not None and b is not None
        # The rasterizer's own pictures are within 50 dB of its reference.
        assert psnr(a.rgb, b.rgb) > 50.0


def test_splats_beyond_the_edits_are_the_fields_own() -> None:
    field = random_splats(300, degree=1)
    small = Cage.box((0.6, 0, 0), 0.3)
    baked = baked_splats(
        field, EditStack([Edit.continuous(small, small.grown(0.2)).rotate((0, 0, 0.4))]), split=False
    )
    outside = ~small.grown(0.2).contains(field.means.astype(float))
    count = int(outside.sum())
    assert 200 < count < 300 == len(baked)
    for name in ("means", "log_scales", "opacities", "sh"):
        values, own = getattr(baked, name), getattr(field, name)[outside]
        # Splats in the outer cage's box that do not move stay among them.
        assert {row.tobytes() for row in own} <= {row.tobytes() for row in values}
    assert baked_splats(field, EditStack()) is field


def test_a_rotation_turns_axes_and_colors_and_keeps_scales() -> None:
    field = random_splats(100, degree=3)
    whole = Cage.box((0, 0, 0), 10.0)
    turn = Rotation.from_euler("xyz", (0.3, -0.7, 1.1)).as_matrix()
    angles = Rotation.from_matrix(turn).as_euler("XYZ")
    baked = baked_splats(field, EditStack([Edit.move(whole).rotate(angles)]), split=False)
    np.testing.assert_allclose(baked.means, field.means @ turn.T, atol=1e-5)
    np.testing.assert_allclose(np.sort(baked.log_scales), np.sort(field.log_scales), atol=1e-5)
    before, after = (
        rotation_matrices(splats.quaternions.astype(float)) * np.exp(splats.log_scales)[:, None]
        for splats in (field, baked)
    )
    expected = turn @ before @ before.transpose(0, 2, 1) @ turn.T
    np.testing.assert_allclose(after @ after.transpose(0, 2, 1), expected, atol=1e-6)
    d = np.random.default_rng(1).normal(size=(50, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    seen = np.einsum("dk,nkc->ndc", sh_basis(d @ turn, 3), field.sh)
    np.testing.assert_allclose(np.einsum("dk,nkc->ndc", sh_basis(d, 3), baked.sh), seen, atol=1e-5)
