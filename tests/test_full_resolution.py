"""Figures at full size: cameras of reduced photos grown back, pictures of known sharpness."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from benchmarks.captures.full_resolution import full_camera, measure, table
from PIL import Image
from scipy.ndimage import gaussian_filter

from cagefield.cameras.camera import Camera
from cagefield.datasets import View
from cagefield.errors import CagefieldError

WIDTH, HEIGHT = 61, 47


def views(folder: Path, count: int = 2) -> list[View]:
    """Photos of smooth noise, between .2 and .8."""
    found = []
    for index in range(count):
        noise = gaussian_filter(np.random.default_rng(index).normal(size=(HEIGHT, WIDTH, 3)), (1, 1, 0))
        photo = np.clip(0.5 + 0.1 * noise / noise.std(), 0.2, 0.8)
        path = folder / f"{index}.png"
        Image.fromarray((photo * 255 + 0.5).astype(np.uint8)).save(path)
        eye = (3.0 + index, 0.5, 1.0)
        camera = Camera.look_at(eye, (0, 0, 0), width=WIDTH, height=HEIGHT, fov_x=0.7)
        camera = dataclasses.replace(camera, cx=29.3, model="opencv", distortion=(0.05, 0.0, 0.0, 0.0))
        found.append(View(path.name, camera, path))
    return found


@pytest.mark.parametrize("factor", [1, 2, 3, 4])
def test_a_reduced_camera_grows_back_to_the_photos_size(tmp_path, factor):
    view = views(tmp_path, 1)[0]
    grown, true = full_camera(view.camera.downscaled(factor), view), view.camera
    for name in ("width", "height", "fx", "fy", "cx", "cy", "distortion"):
        assert getattr(grown, name) == pytest.approx(getattr(true, name), rel=1e-12)
    np.testing.assert_array_equal(grown.c2w, true.c2w)
    tiny = dataclasses.replace(view.camera, width=7, height=9)
    assert full_camera(tiny.downscaled(3), dataclasses.replace(view, camera=tiny)).fx == pytest.approx(
        tiny.fx
    )
    refined = view.camera.downscaled(factor).with_c2w(np.eye(4))
    np.testing.assert_array_equal(full_camera(refined, view).c2w, np.eye(4))


def test_figures_are_those_of_the_pictures_in_any_exposure(tmp_path):
    photos = views(tmp_path)
    cameras = [view.camera.downscaled(2) for view in photos]
    sigmas = iter((0.0, 2.0))

    def show(camera: Camera) -> np.ndarray:
        assert (camera.width, camera.height) == (WIDTH, HEIGHT)
        (view,) = (view for view in photos if np.array_equal(view.camera.c2w, camera.c2w))
        sigma = next(sigmas)
        return (0.8 * gaussian_filter(view.load() / 255.0, (sigma, sigma, 0))).astype(np.float32)

    sharp, soft = measure(show, cameras, photos)
    mean = np.mean((views(tmp_path)[0].load() / 255.0) ** 2)
    assert sharp.figures.psnr == pytest.approx(-10 * np.log10(0.04 * mean), abs=1e-3)
    assert sharp.sharpness == pytest.approx(1.0, abs=1e-5) and sharp.figures.corrected > 100
    # the fit has the same variance left as the blur takes away, at most
    assert soft.sharpness < 0.6 and soft.figures.ssim < sharp.figures.ssim
    assert (sharp.size, sharp.trained_size) == ((61, 47), (30, 23))
    rows = [
        [c.strip() for c in line.strip("|").split("|")]
        for line in table([sharp, soft]).markdown().splitlines()
    ]
    mean_row = next(row for row in rows if row[0] == "mean")
    worst = next(row for row in rows if row[0] == "worst")
    assert float(mean_row[6]) == pytest.approx((sharp.sharpness + soft.sharpness) / 2, abs=1e-3)
    assert float(worst[6]) == pytest.approx(soft.sharpness, abs=1e-3) and worst[7] == "-"
    assert float(worst[3]) == pytest.approx(min(sharp.figures.psnr, soft.figures.psnr), abs=0.01)


def test_another_data_set_is_refused(tmp_path):
    photos = views(tmp_path)
    small = [dataclasses.replace(view.camera, width=40) for view in photos]
    with pytest.raises(CagefieldError, match=r"photo 0.png is 61x47, the scene's camera 40x47: no whole"):
        list(measure(lambda camera: np.zeros(1), small, photos))
    with pytest.raises(CagefieldError, match="has 1 test cameras, the data set 2 test photos"):
        list(measure(lambda camera: np.zeros(1), small[:1], photos))
