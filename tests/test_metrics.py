"""Image metrics against closed forms and a brute-force window loop."""

from __future__ import annotations

import numpy as np
import pytest

from cagefield.errors import CagefieldError
from cagefield.rendering.metrics import mse, psnr, ssim


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
