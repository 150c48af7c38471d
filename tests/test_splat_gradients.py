"""Gradients and curvatures of all parameters of splats against finite differences of the float64 oracle.

The loss is L = |picture over a background - target|^2 / 2, summed over pixels and channels. A splat's opacity
changes what the background shows, so the background is in the color that the kernels get.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from cagefield.geometry.quaternions import rotation_matrices
from cagefield.rendering.splats import reference_rasterizer as reference
from cagefield.rendering.splats.rasterizer import (
    intrinsics,
)
from cagefield.training.splats.kernels.splat_backward import build_covariances
from splat_gradients import PARTS, Values, analytic, differences, moved, pictures, scene
from splat_views import LENSES, NEAR, camera, covariances, parameters, splats_of
from tiers import nightly_except

EVERY_RUN = (0, "pinhole", False), (2, "opencv", True), (4, "opencv_fisheye", False), (2, "pinhole", True)
"""Each lens, degree and filter once at least."""


@pytest.mark.parametrize(
    ("degree", "lens", "antialiased"),
    nightly_except(product([0, 2, 4], LENSES, [False, True]), *EVERY_RUN),
)
def test_gradients_are_those_of_the_oracle(lens: str, antialiased: bool, degree: int) -> None:
    view = camera(lens, 40, 27)
    values, target, background = scene(view, antialiased, degree, seed=degree + 5)
    gradients, _, drawn = analytic(values, view, target, background, antialiased)
    picture = pictures(view, background, antialiased)
    residual = picture(values) - target
    assert {0, 1, 2, 3} <= set(drawn.tolist())
    for name, (first, count) in PARTS.items():
        want = np.array(
            [
                [np.sum(residual * differences(picture, values, name, n, axis)) for axis in range(count)]
                for n in drawn
            ]
        )
        got = gradients[drawn, first : first + count].copy()
        if name == "color":
            # Before the clamp at 0, as `chain` says: where it holds, the oracle's is 0.
            held = np.abs(want) < 1e-12
            assert held.any()
            got[held] = 0.0
        # Kernels blend in float32.
        error = np.linalg.norm(got - want, axis=1)
        size = np.linalg.norm(want, axis=1)
        assert (error < 1e-4 * size + 1e-4 * np.median(size)).all(), (name, got, want)


@pytest.mark.parametrize("antialiased", [False, True])
@pytest.mark.parametrize("lens", LENSES)
def test_curvatures_are_sums_of_squared_slopes(lens: str, antialiased: bool) -> None:
    """Gauss-Newton's blocks of one splat alone: means (through its projection alone), scales, turn, logit."""
    view = camera(lens, 40, 27)
    values, target, background = scene(view, antialiased, 0, seed=2)
    for n in (4, 5, 6, 7):
        alone = {name: part[n : n + 1] for name, part in values.items()}
        _, curvatures, drawn = analytic(alone, view, target, background, antialiased)
        assert drawn.tolist() == [0]
        picture = pictures(view, background, antialiased)

        def slopes(name: str, alone: Values = alone, picture=picture) -> NDArray:
            count = PARTS[name][1]
            return np.stack([differences(picture, alone, name, 0, axis).ravel() for axis in range(count)])

        def block(J: NDArray) -> NDArray:
            full = J @ J.T
            return full[np.triu_indices(len(full))]

        H = curvatures[0].astype(np.float64)
        want = block(slopes("log_scales"))
        np.testing.assert_allclose(H[6:12], want, atol=1e-4 * np.abs(want).max())
        want = (slopes("quaternions") ** 2).sum(axis=1)
        np.testing.assert_allclose(H[12:15], want, atol=1e-4 * np.abs(want).max())
        np.testing.assert_allclose(H[15], (slopes("logits") ** 2).sum(), rtol=1e-4)
        want = block(slopes("means"))
        # The mean's block leaves out that the shape changes with the mean.
        np.testing.assert_allclose(H[:6], want, atol=0.1 * np.abs(want).max())


def test_weights_and_errors_of_splats() -> None:
    """Gradient entries 13 to 15: the screen gradient's length, the sum of weights, and of weighted errors."""
    view = camera("pinhole", 40, 27)
    values, target, background = scene(view, False, 0, seed=4)
    gradients = analytic(values, view, target, background, False)[0]
    limits = intrinsics(view).limits
    seen = reference.project(splats_of(values), view, NEAR, limits)
    color, through, _ = reference.blend(seen, view.width, view.height)
    residual = color + through[..., None] * background - target
    x, y = np.meshgrid(np.arange(view.width) + 0.5, np.arange(view.height) + 0.5)
    left = np.ones_like(through)
    for k, n in enumerate(seen.rows):
        d = np.stack([x, y], axis=-1) - seen.means[k]
        alpha = seen.opacities[k] * np.exp(-0.5 * np.einsum("hwi,ij,hwj->hw", d, seen.conics[k], d))
        alpha = np.where(alpha < reference.ALPHA_MIN, 0.0, np.minimum(alpha, reference.ALPHA_MAX))
        weight = alpha * left
        left = left * (1.0 - alpha)
        np.testing.assert_allclose(gradients[n, 14], weight.sum(), rtol=1e-4, atol=1e-4)
        error = (weight * np.square(residual).sum(axis=-1)).sum()
        np.testing.assert_allclose(gradients[n, 15], error, rtol=1e-4, atol=1e-4)


def test_shapes_of_parameters() -> None:
    values = parameters(50)
    six, opacities = np.empty((50, 6), np.float32), np.empty(50, np.float32)
    single_values = {name: part.astype(np.float32) for name, part in values.items()}
    build_covariances(
        single_values["log_scales"], single_values["quaternions"], single_values["logits"], six, opacities
    )
    want = covariances(values["quaternions"], values["log_scales"])
    np.testing.assert_allclose(six, want, atol=1e-6)
    np.testing.assert_allclose(opacities, 1.0 / (1.0 + np.exp(-values["logits"])), atol=1e-6)
    # A turn of `moved` is one about the splat's own axis: R <- R exp([turn]x).
    turned = moved(values, "quaternions", 3, 2, 1e-6)["quaternions"]
    R = rotation_matrices(values["quaternions"])[3]
    change = R.T @ rotation_matrices(turned)[3]
    np.testing.assert_allclose(change, [[1, -1e-6, 0], [1e-6, 1, 0], [0, 0, 1]], atol=1e-11)
