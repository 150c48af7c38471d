"""Masks of photos: conventions, sizes, shrinking."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from cagefield.cameras.camera import Camera
from cagefield.datasets.views import PhotoMask, View
from cagefield.errors import DatasetError

WIDTH, HEIGHT = 12, 8


def _view(folder: Path, mask: np.ndarray | None, excluded: str = "black") -> View:
    photo = folder / "photo.png"
    Image.fromarray(np.zeros((HEIGHT, WIDTH, 3), np.uint8)).save(photo)
    camera = Camera(np.eye(4), WIDTH, HEIGHT, 10.0, 10.0, 6.0, 4.0)
    if mask is None:
        return View("photo.png", camera, photo)
    Image.fromarray(mask).save(folder / "mask.png")
    return View("photo.png", camera, photo, mask=PhotoMask(folder / "mask.png", excluded))  # type: ignore[arg-type]


def test_photo_without_mask_is_valid_everywhere(tmp_path: Path) -> None:
    assert _view(tmp_path, None).valid_pixels() is None
    assert _view(tmp_path, np.full((HEIGHT, WIDTH), 255, np.uint8)).valid_pixels() is None


def test_black_mask_excludes_values_below_128(tmp_path: Path) -> None:
    mask = np.full((HEIGHT, WIDTH), 128, np.uint8)
    mask[2:4, 3:7] = 127
    valid = _view(tmp_path, mask).valid_pixels()
    assert valid is not None
    np.testing.assert_array_equal(valid, mask == 128)


def test_white_mask_excludes_every_value_but_zero(tmp_path: Path) -> None:
    mask = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    mask[5, 1] = (0, 0, 1)
    valid = _view(tmp_path, mask, "white").valid_pixels()
    assert valid is not None
    np.testing.assert_array_equal(np.argwhere(~valid), [[5, 1]])


def test_shrunk_pixel_is_valid_where_all_of_its_pixels_are(tmp_path: Path) -> None:
    mask = np.full((HEIGHT, WIDTH), 255, np.uint8)
    mask[3, 5] = 0
    view = _view(tmp_path, mask).downscaled(2)
    valid = view.downscaled(2).valid_pixels()
    assert valid is not None and valid.shape == (2, 3)
    np.testing.assert_array_equal(np.argwhere(~valid), [[0, 1]])
    valid = view.valid_pixels()
    assert valid is not None and valid.shape == (4, 6)
    np.testing.assert_array_equal(np.argwhere(~valid), [[1, 2]])


@pytest.mark.parametrize("factor", [0.5, 2, 3])
def test_mask_of_another_size_is_resampled(tmp_path: Path, factor: float) -> None:
    mask = np.full((int(HEIGHT * factor), int(WIDTH * factor)), 255, np.uint8)
    mask[: mask.shape[0] // 2, : mask.shape[1] // 3] = 0
    valid = _view(tmp_path, mask).valid_pixels()
    assert valid is not None
    expected = np.ones((HEIGHT, WIDTH), bool)
    expected[: HEIGHT // 2, : WIDTH // 3] = False
    np.testing.assert_array_equal(valid, expected)


def test_mask_of_another_aspect_is_named(tmp_path: Path) -> None:
    view = _view(tmp_path, np.zeros((HEIGHT, WIDTH + 4), np.uint8))
    with pytest.raises(DatasetError, match=r"mask.png: the mask is 16x8, its photo 12x8; make a mask"):
        view.valid_pixels()


def test_mask_that_is_no_picture_is_named(tmp_path: Path) -> None:
    view = _view(tmp_path, np.zeros((HEIGHT, WIDTH), np.uint8))
    (tmp_path / "mask.png").write_bytes(b"nothing")
    with pytest.raises(DatasetError, match=r"mask.png: not a readable image"):
        view.valid_pixels()
