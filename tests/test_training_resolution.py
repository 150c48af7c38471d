"""Training resolution: any whole factor, by the photos' size, their number and the time."""

from __future__ import annotations

import numpy as np
import pytest

import posed_photos
from cagefield.datasets import load_dataset
from cagefield.datasets.training_resolution import (
    describe_resolution,
    shrink_to_training_resolution,
    training_factor,
)
from posed_photos import textured_capture


@pytest.mark.parametrize(
    ("side", "photos", "minutes", "factor"),
    [
        (1920, 80, 5.0, 3),
        (1920, 80, 10.0, 2),
        (1280, 70, 5.0, 2),
        (4032, 100, 5.0, 6),
        (4032, 100, 20.0, 3),
        (640, 60, 2.0, 1),
        (1280, 200, 1.0, 2),
        (300, 60, 5.0, 1),
        (1920, 80, 60.0, 1),
    ],
)
def test_the_factor_is_the_whole_number_nearest_to_the_side_that_the_time_allows(
    side, photos, minutes, factor
):
    assert training_factor(side, photos, minutes) == factor


def test_the_data_set_is_shrunk_from_whole_photos_and_said(tmp_path, monkeypatch):
    plain = lambda camera, _: np.full((camera.height, camera.width, 3), (90, 120, 200), np.uint8)  # noqa: E731
    monkeypatch.setattr(posed_photos, "photo_of_textures", plain)  # whose noise takes seconds a photo
    textured_capture(tmp_path, 2, size=(2000, 1500))
    found = shrink_to_training_resolution(load_dataset(tmp_path), 5.0)
    camera = found.train[0].camera
    assert (camera.width, camera.height) == (1000, 750) and found.train[0].load().shape == (750, 1000, 3)
    assert (found.train[0].load() == (90, 120, 200)).all()
    assert describe_resolution(found) == "photos of 2000x1500 are trained at 1000x750 (--downscale 2)"
