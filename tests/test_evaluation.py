"""Figures of views: closed forms of pictures that differ from photos in a known way."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from cagefield.cameras.camera import Camera
from cagefield.datasets.views import PhotoMask, View
from cagefield.training.evaluation import (
    Evaluation,
    ViewMetrics,
    composite_on_white,
    evaluate_image,
    evaluate_views,
)


def photo_view(folder: Path, name: str, pixels: np.ndarray, mask: np.ndarray | None = None) -> View:
    height, width = pixels.shape[:2]
    Image.fromarray(pixels).save(folder / name)
    camera = Camera.look_at((3, 0, 1), (0, 0, 0), width=width, height=height, fov_x=0.7)
    if mask is None:
        return View(name, camera, folder / name)
    Image.fromarray(np.where(mask, 255, 0).astype(np.uint8)).save(folder / f"mask_{name}")
    return View(name, camera, folder / name, mask=PhotoMask(folder / f"mask_{name}"))


def test_means_and_the_worst_view():
    views = (
        ViewMetrics("a", 30.0, 31.0, 0.9),
        ViewMetrics("b", 20.0, 26.0, float("nan")),
        ViewMetrics("c", 25.0, 25.5, 0.8),
    )
    total = Evaluation(views)
    assert (total.psnr, total.corrected, total.ssim) == pytest.approx((25.0, 27.5, 0.85))
    assert total.worst is views[1]
    assert str(total) == "25.00 dB (27.50 color-corrected), SSIM 0.8500, worst view b 20.00 dB"
    assert np.isnan(Evaluation().psnr) and Evaluation().worst is None
    assert str(Evaluation(views[1:2])) == "20.00 dB (26.00 color-corrected), worst view b 20.00 dB"


def test_a_picture_in_another_exposure_differs_by_that_alone():
    photo = np.random.default_rng(0).uniform(0.2, 0.8, (20, 24, 3))
    figures = evaluate_image("a", photo - 0.1, photo)
    assert figures is not None and figures.psnr == pytest.approx(20.0) and figures.corrected > 100
    # rgb above 1 is shown as 1
    assert evaluate_image("a", photo + 5, photo) == evaluate_image("a", np.ones_like(photo), photo)
    assert evaluate_image("a", photo, photo, np.zeros((20, 24), bool)) is None


def test_cut_outs_are_composited_on_white():
    pixels = np.zeros((1, 3, 4), np.uint8)
    pixels[0, :, 0], pixels[0, :, 3] = 255, (0, 51, 255)
    expected = [[[1, 1, 1], [1, 0.8, 0.8], [1, 0, 0]]]
    np.testing.assert_allclose(composite_on_white(pixels), expected, atol=1e-6)


def test_views_are_compared_without_excluded_pixels_over_their_own_background(tmp_path, monkeypatch):
    """A field that is gray everywhere: .5 on black photos with a masked white square, .75 on a cut-out."""
    asked = []

    def render(camera: Camera, background: str) -> Any:
        asked.append(background)
        gray = 0.5 if background == "black" else 0.75
        return SimpleNamespace(rgb=np.full((camera.height, camera.width, 3), gray, np.float32))

    monkeypatch.setattr(
        "cagefield.rendering.renderers.renderer_of", lambda field: SimpleNamespace(render=render)
    )
    black, mask = np.zeros((16, 16, 3), np.uint8), np.ones((16, 16), bool)
    black[4:9, 3:8], mask[4:9, 3:8] = 255, False
    clear = np.zeros((16, 16, 4), np.uint8)
    views = [photo_view(tmp_path, "a.png", black, mask), photo_view(tmp_path, "b.png", clear)]
    hidden = photo_view(tmp_path, "c.png", black, np.zeros((16, 16), bool))
    found = evaluate_views(SimpleNamespace(), views)  # type: ignore[arg-type]
    # a difference of 1/2, and of 1/4 from white
    expected = [-20 * np.log10(0.5), -20 * np.log10(0.25)]
    assert [view.psnr for view in found.views] == pytest.approx(expected, abs=1e-5)
    assert asked == ["black", "white"]
    with pytest.warns(
        UserWarning, match="1 of 3 photos are left out of the figures, their masks leave no pixel"
    ):
        again = evaluate_views(SimpleNamespace(), [*views, hidden])  # type: ignore[arg-type]
    assert again == found
