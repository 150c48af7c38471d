"""Closed forms of the analytic fields against direct quadrature of what they return when sampled."""

from __future__ import annotations

import numpy as np
import pytest

from cagefield.errors import FieldError
from cagefield.fields.analytic import AnalyticField, GaussianBlob, UniformBox, UniformSphere
from cagefield.fields.protocol import Field

BOX = UniformBox((0.1, -0.2, 0.3), (0.8, 0.6, 1.0), 2.5, (0.9, 0.1, 0.2))
SPHERE = UniformSphere((-0.2, 0.1, 0.0), 0.6, 4.0, (0.2, 0.7, 0.3))
BLOB = GaussianBlob((0.2, 0.3, -0.1), 0.15, 12.0, (0.1, 0.2, 0.9))


def rays(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Rays from a sphere of radius 2 towards points near the origin."""
    rng = np.random.default_rng(seed)
    origins = rng.normal(size=(count, 3))
    origins *= 2 / np.linalg.norm(origins, axis=1, keepdims=True)
    directions = rng.uniform(-0.5, 0.5, (count, 3)) - origins
    return origins, directions / np.linalg.norm(directions, axis=1, keepdims=True)


@pytest.mark.parametrize(
    ("component", "tolerance"),
    # jumps of sigma: each of the two ends is placed to half a step of 4/20000, times the density
    [(BOX, 2.5 * 2e-4), (SPHERE, 4 * 2e-4), (BLOB, 1e-9)],
    ids=["box", "sphere", "blob"],
)
@pytest.mark.parametrize(("near", "far"), [(0.0, 4.0), (1.9, 2.3)])
def test_optical_depth_is_the_integral_of_sigma(component, tolerance, near, far):
    origins, directions = rays(40)
    count = 20000
    t = near + (np.arange(count) + 0.5) * (far - near) / count
    points = origins[:, None] + t[:, None] * directions[:, None]
    expected = component.sigma(points).sum(1) * (far - near) / count
    field = AnalyticField([component])
    assert (expected > 0.05).sum() >= 10
    np.testing.assert_allclose(field.optical_depth(origins, directions, near, far), expected, atol=tolerance)


def test_ray_inside_a_face_and_ray_past_the_box():
    box = AnalyticField([UniformBox((0, 0, 0), (2, 2, 2), 3.0)])
    origins = np.array([[-5.0, 0.0, 0.0], [-5.0, 1.5, 0.0], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(box.optical_depth(origins, [1.0, 0.0, 0.0]), [6.0, 0.0, 3.0])


def test_sigma_adds_up_and_color_is_the_weighted_mean():
    field = AnalyticField([BOX, SPHERE])
    both, only_box, neither = (0.1, 0.0, 0.1), (0.45, -0.4, 0.7), (3.0, 3.0, 3.0)
    sigma, rgb = field(np.array([both, only_box, neither], np.float32), np.zeros((3, 3), np.float32))
    np.testing.assert_allclose(sigma, [6.5, 2.5, 0.0])
    mixed = (2.5 * np.array(BOX.rgb) + 4 * np.array(SPHERE.rgb)) / 6.5
    np.testing.assert_allclose(rgb, [mixed, BOX.rgb, (0, 0, 0)], atol=1e-6)


def test_slopes_follow_position_and_view_direction_and_are_clipped():
    view_slope = np.diag([0.1, 0.2, 0.9])
    field = AnalyticField(
        [UniformSphere((0, 0, 0), 2, 1, 0.5)], position_slope=0.1 * np.eye(3), view_slope=view_slope
    )
    position, viewdir = np.array([[0.5, -1.0, 0.2]], np.float32), np.array([[0.6, 0.0, 0.8]], np.float32)
    _, rgb = field(position, viewdir)
    np.testing.assert_allclose(rgb[0], [0.5 + 0.05 + 0.06, 0.5 - 0.1, 1.0], atol=1e-6)


def test_bounds_hold_the_density():
    field = AnalyticField([BOX, SPHERE, BLOB])
    points = np.random.default_rng(1).uniform(-2, 2, (20000, 3))
    low, high = field.bounds
    outside = ((points < low) | (points > high)).any(1)
    sigma, _ = field(points[outside].astype(np.float32), np.zeros((outside.sum(), 3), np.float32))
    # the blob is cut at 5 deviations: 12 exp(-12.5)
    assert sigma.max() < 5e-5
    assert isinstance(field, Field)


def test_dtypes_are_float32():
    sigma, rgb = AnalyticField([BLOB])(np.zeros((2, 3), np.float32), np.zeros((2, 3), np.float32))
    assert sigma.dtype == rgb.dtype == np.float32


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: UniformBox((0, 0), 1, 1), "center must be a number or 3 numbers"),
        (lambda: UniformBox(0, (1, 0, 1), 1), "size must be finite and in"),
        (lambda: UniformSphere(0, -1, 1), "radius must be positive and finite, not -1"),
        (lambda: GaussianBlob(0, 1, np.inf), "density must be positive and finite"),
        (lambda: GaussianBlob(0, 1, 1, (0, 2, 0)), r"rgb must be finite and in \[0, 1\]"),
        (lambda: AnalyticField([]), "at least one component"),
        (lambda: AnalyticField([BLOB], view_slope=np.zeros(3)), r"view_slope must be a finite \[3,3\] array"),
    ],
)
def test_errors_name_the_value(build, message):
    with pytest.raises(FieldError, match=message):
        build()
