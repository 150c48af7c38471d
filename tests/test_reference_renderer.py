"""The plain renderer against closed forms: Beer-Lambert, expected depth, order of convergence, edits."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.edits import Edit, EditStack
from cagefield.errors import FieldError
from cagefield.fields.analytic import AnalyticField, GaussianBlob, UniformBox, UniformSphere
from cagefield.geometry.cage import Cage
from cagefield.rendering import compositing
from cagefield.rendering.reference_renderer import intersect_box, render_sampled


def camera(size: int = 12, eye: tuple[float, float, float] = (3.0, 1.0, 0.8), fov_x: float = 0.5) -> Camera:
    return Camera.look_at(eye, (0, 0, 0), width=size, height=size, fov_x=fov_x)


def test_uniform_box_is_exact():
    """Opacity 1 - exp(-tau) for any number of samples, since sigma is constant inside the bounds."""
    field = AnalyticField([UniformBox((0, 0, 0), (0.8, 1.0, 0.6), 1.7, (0.9, 0.3, 0.1))])
    view = camera()
    tau = field.optical_depth(*view.rays()).reshape(12, 12)
    frame = render_sampled(field, view, samples=16, background="black")
    assert (tau > 0.5).sum() > 20
    # float32 sums of 16 terms
    np.testing.assert_allclose(frame.opacity, 1 - np.exp(-tau), atol=3e-6)
    np.testing.assert_allclose(frame.rgb, frame.opacity[..., None] * np.array([0.9, 0.3, 0.1]), atol=3e-6)
    assert np.isinf(frame.depth[tau == 0]).all()


def test_depth_of_a_uniform_box_converges_with_order_two():
    """Expected depth of a truncated exponential: enter + 1/sigma - L exp(-sigma L) / (1 - exp(-sigma L))."""
    sigma = 3.0
    box = UniformBox((0, 0, 0), (1.2, 1.2, 1.2), sigma)
    view = camera(6, fov_x=0.2)
    enter, leave = (x.astype(np.float64) for x in intersect_box(*view.rays(), box.bounds))
    length = leave - enter
    expected = enter + 1 / sigma - length * np.exp(-sigma * length) / (1 - np.exp(-sigma * length))
    counts = np.array([4, 8, 16, 32])
    errors = [
        np.abs(render_sampled(AnalyticField([box]), view, samples=int(n)).depth.ravel() - expected).mean()
        for n in counts
    ]
    # at 32 samples the error is 2e-4, hundred times the rounding of float32 at distance 3
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.1)


def test_optical_depth_of_a_smooth_field_converges_with_order_two():
    """A blob cut at `far` has a slope at the end of the interval, which midpoints integrate to order two."""
    field = AnalyticField([GaussianBlob((0, 0, 0), 0.4, 2.0)])
    view = camera(6, fov_x=0.2)
    far = float(np.linalg.norm(view.origin)) + 0.3
    expected = 1 - np.exp(-field.optical_depth(*view.rays(), 2.0, far))
    counts = np.array([8, 16, 32])
    errors = [
        np.abs(
            render_sampled(field, view, samples=int(n), near=2.0, far=far).opacity.ravel() - expected
        ).mean()
        for n in counts
    ]
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.15)


def test_a_jump_of_sigma_converges_with_order_one():
    field = AnalyticField([UniformSphere((0, 0, 0), 0.45, 2.0)])
    view = camera(24, fov_x=0.25)
    expected = 1 - np.exp(-field.optical_depth(*view.rays()))
    counts = np.array([16, 32, 64, 128])
    errors = [
        np.abs(render_sampled(field, view, samples=int(n)).opacity.ravel() - expected).mean() for n in counts
    ]
    # where the jump falls within a step is random, so the mean over 576 rays is only about of order one
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(1.0, abs=0.15)


def test_view_dependence_backgrounds_and_chunks():
    field = AnalyticField([UniformBox((0, 0, 0), (2, 2, 2), 50.0, 0.5)], view_slope=0.3 * np.eye(3))
    view = camera(8, fov_x=0.3)
    frame = render_sampled(field, view, samples=64, background="none")
    np.testing.assert_allclose(frame.rgb.reshape(-1, 3), 0.5 + 0.3 * view.rays()[1], atol=1e-5)
    small = render_sampled(field, view, samples=64, background="none", chunk=64 * 5)
    np.testing.assert_allclose(small.rgb, frame.rgb, atol=1e-6)
    thin = AnalyticField([UniformBox((0, 0, 0), (0.2, 0.2, 0.2), 1.0, (1, 0, 0))])
    white, black = (render_sampled(thin, view, samples=8, background=b) for b in ("white", "black"))
    np.testing.assert_allclose(
        white.rgb - black.rgb, np.repeat(1 - white.opacity[..., None], 3, -1), atol=1e-6
    )


def test_near_and_far_cut_the_ray():
    box = UniformBox((0, 0, 0), (1, 1, 1), 2.0)
    view = camera(8, fov_x=0.2)
    tau = AnalyticField([box]).optical_depth(*view.rays(), 3.0, 3.4).reshape(8, 8)
    frame = render_sampled(AnalyticField([box]), view, samples=8, near=3.0, far=3.4)
    np.testing.assert_allclose(frame.opacity, 1 - np.exp(-tau), atol=3e-6)


def test_field_without_bounds_needs_far():
    def fog(positions, viewdirs):
        return np.full(len(positions), 0.5, np.float32), np.ones((len(positions), 3), np.float32)

    with pytest.raises(FieldError, match=r"field has no bounds, so far must be given"):
        render_sampled(fog, camera())
    frame = render_sampled(fog, camera(), near=1.0, far=3.0, samples=4, normals=True)
    np.testing.assert_allclose(frame.opacity, 1 - np.exp(-0.5 * 2.0), atol=1e-6)
    np.testing.assert_array_equal(frame.normals, 0)

    fog.bounds = np.array([[-np.inf] * 3, [np.inf] * 3])
    with pytest.raises(FieldError, match="field has infinite bounds"):
        render_sampled(fog, camera())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"samples": 0}, "samples must be at least 1, not 0"),
        ({"near": 2.0, "far": 1.0}, "0 <= near < far < inf, not near=2.0, far=1.0"),
        ({"near": -1.0}, "not near=-1.0"),
    ],
)
def test_impossible_options(options, message):
    with pytest.raises(FieldError, match=message):
        render_sampled(AnalyticField([UniformSphere(0, 1, 1)]), camera(), **options)


def test_wrong_shapes_from_a_field_are_named():
    def broken(positions, viewdirs):
        return np.zeros((len(positions), 1), np.float32), np.zeros((len(positions), 3), np.float32)

    with pytest.raises(FieldError, match=r"must return sigma \[\d+\] and rgb"):
        render_sampled(broken, camera(), far=2.0)


def test_normals_of_a_soft_half_space():
    """sigma falls along +x only, so every normal is +x, whatever the ray."""

    def half_space(positions, viewdirs):
        sigma = 40 / (1 + np.exp(positions[:, 0] / 0.05))
        return sigma.astype(np.float32), np.zeros((len(positions), 3), np.float32)

    half_space.bounds = np.array([[-0.6, -0.6, -0.6], [0.6, 0.6, 0.6]])
    frame = render_sampled(half_space, camera(8, fov_x=0.2), samples=200, normals=True)
    assert frame.opacity.min() > 0.999
    # central differences of float32 sigma at a step of 2e-3: rounding of 1e-6 of 40 over 4e-3 of slope 100
    np.testing.assert_allclose(
        frame.normals, np.broadcast_to(np.float32([1, 0, 0]), frame.normals.shape), atol=2e-3
    )


def shifted_box(center):
    return AnalyticField([UniformBox(center, (0.5, 0.5, 0.5), 3.0, (0.2, 0.6, 0.9))])


def test_moved_box_looks_like_a_box_elsewhere():
    cage = Cage.box((0, 0, 0), (0.7, 0.7, 0.7))
    stack = EditStack([Edit.move(cage).translate((0.1, 0.8, -0.2))])
    view = camera(16, fov_x=0.7)
    moved = render_sampled(shifted_box((0, 0, 0)), view, samples=300, edits=stack)
    truth = render_sampled(shifted_box((0.1, 0.8, -0.2)), view, samples=300)
    # the two sample different intervals; each places a jump of sigma 3 to half a step, 1.5 / 300, twice
    np.testing.assert_allclose(moved.opacity, truth.opacity, atol=3 * 1.5 / 300 * 2)
    np.testing.assert_allclose(moved.rgb, truth.rgb, atol=3 * 1.5 / 300 * 2)
    assert truth.opacity.max() > 0.7


def test_empty_stack_changes_nothing():
    view = camera()
    plain = render_sampled(shifted_box((0, 0, 0)), view, samples=20)
    same = render_sampled(shifted_box((0, 0, 0)), view, samples=20, edits=EditStack())
    np.testing.assert_array_equal(same.rgb, plain.rgb)


def test_emptied_samples_and_stretch():
    """A stand-in map that squeezes x by two and empties x < 0: half the box is left."""

    def to_canonical(points, viewdirs=None):
        along = viewdirs * [2.0, 1.0, 1.0]
        stretch = np.linalg.norm(along, axis=1)
        points = np.where(points[:, :1] < 0, np.nan, points * [2.0, 1.0, 1.0])
        return SimpleNamespace(
            points=points,
            viewdirs=along / stretch[:, None],
            stretch=stretch,
            layer=np.where(np.isnan(points[:, 0]), -1, 0),
            grade=None,
        )

    squeeze = SimpleNamespace(bounds=None, layers=(), to_canonical=to_canonical)
    view = camera(10, fov_x=0.3)
    half_box = AnalyticField([UniformBox((0.125, 0, 0), (0.25, 1, 1), 2.0)])
    field = AnalyticField([UniformBox((0, 0, 0), (1, 1, 1), 2.0)])
    tau = half_box.optical_depth(*view.rays()).reshape(10, 10)
    plain = render_sampled(field, view, samples=2000, edits=squeeze, preserve_opacity=False)
    # jumps of sigma 2 placed to half a step of 1.7 / 2000, twice
    np.testing.assert_allclose(plain.opacity, 1 - np.exp(-tau), atol=2 * 1.7 / 2000)
    kept = render_sampled(field, view, samples=2000, edits=squeeze)
    stretch = np.linalg.norm(view.rays()[1] * [2.0, 1.0, 1.0], axis=1).reshape(10, 10)
    np.testing.assert_allclose(kept.opacity, 1 - np.exp(-tau * stretch), atol=2 * 2 * 1.7 / 2000)


def test_compositing_is_the_recursion():
    """Front to back, sample by sample, in plain Python."""
    rng = np.random.default_rng(3)
    sigma, delta = rng.uniform(0, 5, (4, 9)), rng.uniform(0.01, 0.2, (4, 9))
    rgb, t = rng.uniform(size=(4, 9, 3)), np.cumsum(delta, axis=1)
    sums = compositing.composite(sigma, rgb, t, delta)
    for ray in range(4):
        light, color, depth = 1.0, np.zeros(3), 0.0
        for k in range(9):
            alpha = 1 - np.exp(-sigma[ray, k] * delta[ray, k])
            assert sums.weights[ray, k] == pytest.approx(light * alpha, rel=1e-12)
            color, depth = color + light * alpha * rgb[ray, k], depth + light * alpha * t[ray, k]
            light *= 1 - alpha
        np.testing.assert_allclose(sums.premultiplied[ray], color, rtol=1e-12)
        assert sums.opacity[ray] == pytest.approx(1 - light, rel=1e-12)
        assert sums.depth[ray] == pytest.approx(depth / (1 - light), rel=1e-12)


def test_compositing_keeps_float32_and_empty_rays():
    zeros = np.zeros((2, 3), np.float32)
    sums = compositing.composite(zeros, np.zeros((2, 3, 3), np.float32), zeros, zeros)
    assert sums.premultiplied.dtype == sums.opacity.dtype == np.float32
    assert np.isinf(sums.depth).all()
