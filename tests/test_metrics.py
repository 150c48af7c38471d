"""Image metrics against closed forms and a brute-force window loop."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from cagefield.errors import CagefieldError
from cagefield.images.metrics import correct_colors, fit_colors, gradient_ratio, mse, psnr, ssim


def pair(shape: tuple[int, ...], noise: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    first = rng.uniform(size=shape)
    return first, np.clip(first + noise * rng.normal(size=shape), 0, 1)


def brute_force_ssim(a: np.ndarray, b: np.ndarray) -> float:
    """Equations 13 to 16 of Wang et al., window by window."""
    axis = np.arange(11) - 5
    window = np.exp(-(axis[:, None] ** 2 + axis**2) / (2 * 1.5**2))
    window /= window.sum()
    values = []
    for channel in range(a.shape[2]):
        for i in range(a.shape[0] - 10):
            for j in range(a.shape[1] - 10):
                x, y = (im[i : i + 11, j : j + 11, channel] for im in (a, b))
                mx, my = (window * x).sum(), (window * y).sum()
                vx, vy = (window * (x - mx) ** 2).sum(), (window * (y - my) ** 2).sum()
                vxy = (window * (x - mx) * (y - my)).sum()
                c1, c2 = 0.01**2, 0.03**2
                values.append((2 * mx * my + c1) * (2 * vxy + c2) / ((mx**2 + my**2 + c1) * (vx + vy + c2)))
    return float(np.mean(values))


@pytest.mark.parametrize("noise", [0.02, 0.3])
def test_ssim_is_the_mean_over_windows(noise):
    a, b = pair((18, 15, 3), noise)
    # both in float64: only the order of summation differs
    assert ssim(a, b) == pytest.approx(brute_force_ssim(a, b), abs=1e-10)


def test_ssim_of_constant_images_is_the_luminance_term():
    a, b = np.full((12, 12), 0.4), np.full((12, 12), 0.6)
    expected = (2 * 0.4 * 0.6 + 1e-4) / (0.4**2 + 0.6**2 + 1e-4)
    assert ssim(a, b) == pytest.approx(expected, abs=1e-9)


def test_ssim_of_equal_images_is_one():
    a, _ = pair((20, 20, 3), 0)
    assert ssim(a, a) == pytest.approx(1.0, abs=1e-12)


def test_psnr_of_a_constant_difference():
    a = np.full((4, 5, 3), 0.5)
    assert psnr(a, a + 0.1) == pytest.approx(20.0, abs=1e-9)
    assert mse(a, a + 0.1) == pytest.approx(0.01)
    assert psnr(a, a) == np.inf


def test_uint8_and_float_images_agree():
    a, b = (np.round(x * 255).astype(np.uint8) for x in pair((16, 16, 3), 0.1))
    assert psnr(a, b) == pytest.approx(psnr(a / 255.0, b / 255.0), abs=1e-9)
    assert ssim(a, b) == pytest.approx(ssim(a / 255.0, b), abs=1e-9)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: psnr(np.zeros((2, 2)), np.zeros((2, 3))),
            r"same, non-empty shape, not \[2, 2\] and \[2, 3\]",
        ),
        (lambda: psnr(np.zeros((0, 3)), np.zeros((0, 3))), "non-empty"),
        (lambda: ssim(np.zeros((10, 20)), np.zeros((10, 20))), r"at least 11x11 pixels, not \[10, 20\]"),
    ],
)
def test_errors_name_the_shapes(call, message):
    with pytest.raises(CagefieldError, match=message):
        call()


def test_color_correction_undoes_an_affine_change_of_each_channel():
    photo, _ = pair((20, 30, 3), 0)
    photo = 0.1 + 0.6 * photo
    gain, offset = np.array([0.8, 1.2, 0.9]), np.array([0.05, -0.08, 0.02])
    picture = (photo - offset) / gain
    fit = fit_colors(picture, photo)
    np.testing.assert_allclose(fit.gain, gain, rtol=1e-9)
    np.testing.assert_allclose(fit.offset, offset, atol=1e-9)
    # the picture itself is float32
    np.testing.assert_allclose(correct_colors(picture, photo), photo, atol=1e-6)


def test_color_correction_is_the_regression_of_the_photo_on_the_picture():
    picture, photo = pair((40, 40, 3), 0.05)
    picture, photo = 0.2 + 0.5 * picture, 0.2 + 0.5 * photo
    fit = fit_colors(picture, photo)
    for channel in range(3):
        slope, offset = np.polyfit(picture[..., channel].ravel(), photo[..., channel].ravel(), 1)
        assert (fit.gain[channel], fit.offset[channel]) == pytest.approx((slope, offset), abs=1e-9)


def test_saturated_pixels_take_no_part_in_the_color_fit_and_the_result_is_clipped():
    truth = np.repeat(np.linspace(0.0, 1.0, 400).reshape(20, 20, 1), 3, 2)
    photo = np.clip(1.5 * truth, 0, 1)
    fit = fit_colors(truth, photo)
    np.testing.assert_allclose(fit.gain, 1.5, rtol=1e-9)
    np.testing.assert_allclose(fit.offset, 0.0, atol=1e-9)
    np.testing.assert_allclose(fit(truth), photo, atol=1e-6)


def test_a_channel_of_one_value_gets_an_offset_and_a_saturated_one_stays():
    picture, photo = np.full((12, 12, 3), 0.4), np.full((12, 12, 3), 0.5)
    picture[..., 2] = 0.0
    np.testing.assert_allclose(correct_colors(picture, photo)[0, 0], [0.5, 0.5, 0.0], atol=1e-7)


def test_excluded_pixels_have_no_part_in_any_figure():
    a, b = pair((24, 26, 3), 0.1)
    valid = np.ones((24, 26), bool)
    valid[3:12, 5:20] = False
    noise = np.random.default_rng(1).uniform(size=(2, *a.shape))
    c, d = (np.where(valid[..., None], x, y) for x, y in zip((a, b), noise, strict=True))
    assert mse(c, d, valid) == pytest.approx(np.mean((a - b)[valid] ** 2), abs=1e-12)
    assert psnr(c, d, valid) == psnr(a, b, valid) != psnr(a, b)
    # windows across the mask's border add up in another order
    assert ssim(c, d, valid) == pytest.approx(ssim(a, b, valid), abs=1e-12)
    np.testing.assert_array_equal(fit_colors(c, d, valid).gain, fit_colors(a, b, valid).gain)
    assert ssim(a, b, np.ones((24, 26), bool)) == ssim(a, b)


def test_ssim_of_a_mask_is_the_mean_over_windows_about_its_valid_pixels():
    """Valid on the left, far from which the windows are whole: those of the left part alone."""
    a, b = pair((20, 40, 3), 0.1)
    valid = np.zeros((20, 40), bool)
    valid[:, :18] = True
    one = np.zeros((20, 40), bool)
    one[10, 10] = True
    window = brute_force_ssim(a[5:16, 5:16], b[5:16, 5:16])
    assert window == pytest.approx(ssim(a[5:16, 5:16], b[5:16, 5:16]), abs=1e-10)
    # of one valid pixel there is no variance: only the luminance is compared
    x, y = a[10, 10], b[10, 10]
    luminance = (2 * x * y + 1e-4) / (x**2 + y**2 + 1e-4)
    assert ssim(a, b, one) == pytest.approx(luminance.mean(), abs=1e-9)
    changed = b.copy()
    changed[:, 18:] = 0.5
    assert ssim(a, changed, valid) == pytest.approx(ssim(a, b, valid), abs=1e-12)
    corner = np.zeros((20, 40), bool)
    corner[0, 0] = True
    assert np.isnan(ssim(a, b, corner))


@pytest.mark.parametrize(
    ("valid", "message"),
    [(np.ones((3, 4), bool), r"must be \[4, 3\], not \[3, 4\]"), (np.zeros((4, 3), bool), "no pixel of the")],
)
def test_masks_that_do_not_fit_are_refused(valid, message):
    with pytest.raises(CagefieldError, match=message):
        psnr(np.zeros((4, 3, 3)), np.ones((4, 3, 3)), valid)


def test_gradient_ratio_is_the_contrast_of_a_picture_and_falls_as_it_is_blurred():
    photo, _ = pair((30, 40, 3), 0)
    assert gradient_ratio(photo, photo) == 1.0
    assert gradient_ratio(0.2 + 0.5 * photo, photo) == pytest.approx(0.5)
    # a wave of period 8 keeps the share exp(-(2 pi / 8)^2 sigma^2 / 2) under a Gaussian blur
    wave = 0.5 + 0.4 * np.sin(2 * np.pi * np.arange(160) / 8) * np.ones((40, 1))
    blurred = gaussian_filter(wave, 1.5, mode="wrap")
    assert gradient_ratio(blurred, wave) == pytest.approx(np.exp(-((np.pi / 4 * 1.5) ** 2) / 2), rel=0.01)
    valid = np.ones((30, 40), bool)
    valid[10:20, 10:20] = False
    changed = np.where(valid[..., None], photo, 0.0)
    assert gradient_ratio(changed, photo, valid) == 1.0 != gradient_ratio(changed, photo)
    assert np.isnan(gradient_ratio(photo, np.full_like(photo, 0.5)))
