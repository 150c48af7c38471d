"""Splats at points: a density that integrates to what pictures show; closed forms and a plain sum."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cagefield.errors import FieldError
from cagefield.fields import sh
from cagefield.fields.protocol import Field
from cagefield.fields.splat_field import SplatField
from cagefield.fields.splat_mixture import MAX_OPACITY, MIN_RAY_OPACITY
from cagefield.geometry.quaternions import rotation_matrices
from splat_scenes import random_splats
from tiers import nightly_except


def plain_sum(field: SplatField, points: np.ndarray, along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(sigma [P], rgb [P,3]) from the definition: one splat after the other, Li_1/2 by its series."""
    k = np.arange(1, 3001)
    total, color = np.zeros(len(points)), np.zeros((len(points), 3))
    rotations = rotation_matrices(field.quaternions.astype(float))
    for n in range(len(field)):
        inverse = rotations[n] @ np.diag(np.exp(-2.0 * field.log_scales[n].astype(float))) @ rotations[n].T
        offset = points - field.means[n]
        z = min(field.opacities[n], MAX_OPACITY) * np.exp(
            -0.5 * np.einsum("pi,ij,pj->p", offset, inverse, offset)
        )
        # 0.99^3000 is 1e-13
        li = np.where(z < MIN_RAY_OPACITY, 0.0, (z[:, None] ** k / np.sqrt(k)).sum(axis=1))
        sigma = li * np.sqrt(np.einsum("pi,ij,pj->p", along, inverse, along) / (2.0 * np.pi))
        shown = 0.5 + np.einsum("pt,tc->pc", sh.sh_basis(along, field.sh_degree), field.sh[n].astype(float))
        total += sigma
        color += sigma[:, None] * np.maximum(shown, 0.0)
    return total, np.clip(color / np.maximum(total, 1e-30)[:, None], 0.0, 1.0)


def unit(values: np.ndarray) -> np.ndarray:
    return values / np.linalg.norm(values, axis=-1, keepdims=True)


@pytest.mark.parametrize("degree", nightly_except([0, 3, 4], 3))
def test_sums_over_all_splats(degree: int) -> None:
    chance = np.random.default_rng(1)
    field = random_splats(60, degree)
    assert isinstance(field, Field)
    # needles and flakes, from a thousandth of the scene to beyond all of it
    field = replace(field, log_scales=np.log(10.0 ** chance.uniform(-3.0, 0.7, (60, 3))))
    points = np.concatenate(
        [chance.uniform(-1.2, 1.2, (400, 3)), field.means, 3.0 * chance.normal(size=(50, 3))]
    )
    along = unit(chance.normal(size=points.shape))
    points, along = points.astype(np.float32), along.astype(np.float32)
    sigma, rgb = field(points, along)
    expected, color = plain_sum(field, points.astype(float), along.astype(float))
    assert (expected > 0).mean() > 0.8
    # float32 positions against splats of a thousandth: 1e-4 of their size
    np.testing.assert_allclose(sigma, expected, rtol=2e-3, atol=2e-3)
    np.testing.assert_allclose(rgb[expected > 1e-2], color[expected > 1e-2], atol=2e-3)


def test_many_points_at_once_are_the_same_as_few() -> None:
    chance = np.random.default_rng(2)
    field = random_splats(30, 1)
    points = chance.uniform(-1.0, 1.0, (20_000, 3)).astype(np.float32)
    along = unit(chance.normal(size=(20_000, 2, 3))).astype(np.float32)
    sigma, rgb = field(points, along[:, 1])
    rows = np.arange(0, 20_000, 997)
    few = field(points[rows], along[rows, 1])
    np.testing.assert_array_equal(sigma[rows], few[0])
    np.testing.assert_array_equal(rgb[rows], few[1])
    mean, seen = field.evaluate_directions(points, along)
    np.testing.assert_array_equal(seen[:, 1], rgb)
    np.testing.assert_allclose(mean, 0.5 * (sigma + field(points, along[:, 0])[0]), rtol=1e-6)


@pytest.mark.parametrize("opacity", [0.01, 0.5, 0.9, 0.99])
def test_a_ray_loses_what_a_picture_shows(opacity: float) -> None:
    """exp(-integral of sigma) = 1 - o g on any ray, near the mean and beside it, for any shape of splat."""
    chance = np.random.default_rng(3)
    for _ in range(12):
        splat = SplatField(
            np.zeros((1, 3)), np.log(chance.uniform(0.05, 1.0, (1, 3))), chance.normal(size=(1, 4)),
            np.array([opacity]), np.zeros((1, 1, 3)),
        )  # fmt: skip
        direction = unit(chance.normal(size=3))
        origin = chance.normal(size=3) * 0.2
        rotation = rotation_matrices(splat.quaternions.astype(float))[0]
        inverse = rotation @ np.diag(np.exp(-2.0 * splat.log_scales[0].astype(float))) @ rotation.T
        nearest = -(direction @ inverse @ origin) / (direction @ inverse @ direction)
        width = (direction @ inverse @ direction) ** -0.5
        at = origin + nearest * direction
        g = np.exp(-0.5 * at @ inverse @ at)
        # Where sigma peaks, over sqrt(-ln o) of the width, 4000 steps of a 400th are many.
        t = nearest + width * (np.arange(-2000, 2000) + 0.5) / 400.0
        points = (origin + t[:, None] * direction).astype(np.float32)
        sigma, _ = splat(points, np.tile(direction.astype(np.float32), (len(t), 1)))
        lost = 1.0 - np.exp(-sigma.astype(float).sum() * width / 400.0)
        # what falls below MIN_RAY_OPACITY is left out on the flanks
        assert lost == pytest.approx(opacity * g, abs=1.5 * MIN_RAY_OPACITY)


def test_rays_through_many_splats_lose_the_product() -> None:
    """Transmittances multiply, in whatever order the splats are met."""
    from cagefield.rendering.compositing import composite

    chance = np.random.default_rng(4)
    field = random_splats(25, 0)
    field = replace(field, log_scales=np.log(chance.uniform(0.1, 0.4, (25, 3))))
    origin = np.array([0.1, -0.2, 0.3])
    for direction in unit(chance.normal(size=(6, 3))):
        left = 1.0
        for n in range(25):
            rotation = rotation_matrices(field.quaternions[n : n + 1].astype(float))[0]
            inverse = rotation @ np.diag(np.exp(-2.0 * field.log_scales[n].astype(float))) @ rotation.T
            offset = origin - field.means[n]
            nearest = -(direction @ inverse @ offset) / (direction @ inverse @ direction)
            at = offset + nearest * direction
            left *= 1.0 - min(field.opacities[n], MAX_OPACITY) * np.exp(-0.5 * at @ inverse @ at)
        t = np.linspace(-4.0, 4.0, 16_001)[:-1] + 2.5e-4
        sigma, rgb = field(
            (origin + t[:, None] * direction).astype(np.float32),
            np.tile(direction.astype(np.float32), (len(t), 1)),
        )
        sums = composite(sigma[None], rgb[None], t[None].astype(np.float32), np.float32(5e-4))
        # 25 splats, each off by MIN_RAY_OPACITY at most, few of them by that much
        assert sums.opacity[0] == pytest.approx(1.0 - left, abs=4 * MIN_RAY_OPACITY)


@pytest.mark.parametrize("opacity", [0.3, 0.99])
def test_grids_may_sample_what_a_ray_across_a_flat_splat_loses(opacity: float) -> None:
    chance = np.random.default_rng(7)
    for seed in range(5):
        splat = replace(random_splats(1, 0, seed), opacities=np.array([opacity]))
        scales = np.exp(splat.log_scales[0].astype(float))
        axes = rotation_matrices(splat.quaternions.astype(float))[0]
        thin = int(scales.argmin())
        # A ray along the thinnest axis, beside the mean by a part of the other two scales.
        beside = chance.normal(size=3) * 0.7
        beside[thin] = 0.0
        origin = splat.means[0] + axes @ (beside * scales)
        lost = -np.log1p(-opacity * np.exp(-0.5 * beside @ beside))
        mean = np.sqrt((scales**-2.0).mean()) * scales[thin]
        for phase in (0.0, 0.3, 0.5):
            t = 2.0 * scales[thin] * (np.arange(-6, 7) + phase)
            sigma = splat.grid_sigma(origin + t[:, None] * axes[:, thin])
            # Samples two scales apart: 2 exp(-2 pi^2 / 4) = 1.4 %; the ends at MIN_RAY_OPACITY cost more.
            assert sigma.sum() * 2.0 * scales[thin] == pytest.approx(
                mean * lost, rel=0.025, abs=4 * MIN_RAY_OPACITY
            )


def test_units_do_not_matter() -> None:
    chance = np.random.default_rng(5)
    field = random_splats(50, 1)
    large = SplatField(
        field.means * 100.0, field.log_scales + np.log(100.0), field.quaternions, field.opacities, field.sh
    )
    points = chance.uniform(-1.0, 1.0, (500, 3))
    along = unit(chance.normal(size=(500, 3)))
    sigma, rgb = field(points, along)
    scaled, color = large(100.0 * points, along)
    np.testing.assert_allclose(scaled * 100.0, sigma, rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(color, rgb, atol=1e-3)


def test_no_splats_and_splats_that_nobody_sees_are_nothing() -> None:
    field = random_splats(20)
    for empty in (field.take(np.zeros(20, bool)), replace(field, opacities=np.zeros(20))):
        sigma, rgb = empty(field.means, np.tile([0.0, 0.0, 1.0], (20, 1)))
        assert not sigma.any() and not rgb.any() and not empty.grid_sigma(field.means).any()


def test_wrong_shapes_are_named() -> None:
    field = random_splats(5)
    with pytest.raises(FieldError, match=r"positions must be \[N,3\], got \[5, 2\]"):
        field(np.zeros((5, 2)), np.zeros((5, 3)))
    with pytest.raises(FieldError, match=r"viewdirs must be \[5, K, 3\], got \[4, 1, 3\]"):
        field(np.zeros((5, 3)), np.zeros((4, 3)))
