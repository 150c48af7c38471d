"""Masks found by their names, and what they are left out of."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from cagefield.compute import devices
from cagefield.datasets import load_dataset
from cagefield.datasets.raw_photos import find_raw_photos
from cagefield.errors import DatasetError
from cagefield.images.metrics import psnr, ssim
from cagefield.training.voxels.ray_batches import DevicePhotos
from posed_photos import ring, save

N, WIDTH, HEIGHT = 9, 24, 16


def _capture(folder: Path, masks: str | None = None, white: bool = False, **keys: str) -> Path:
    """Nine photos whose upper left 12 x 4 pixels a mask named `masks` excludes."""
    mask = np.full((HEIGHT, WIDTH), 0 if white else 255, np.uint8)
    mask[:4, :12] = 255 if white else 0
    frames = []
    for i, pose in enumerate(ring(N)):
        save(folder / f"images/{i}.png", np.full((HEIGHT, WIDTH, 3), 20 * i, np.uint8))
        if masks is not None:
            save(folder / masks.format(i), mask)
        frame = {"file_path": f"images/{i}.png", "transform_matrix": pose.tolist()}
        frames.append(frame | {key: value.format(i) for key, value in keys.items()})
    (folder / "transforms.json").write_text(json.dumps({"fl_x": 30.0, "frames": frames}))
    return folder


def _assert_excluded(views) -> None:
    for view in views:
        valid = view.valid_pixels()
        assert valid is not None and not valid[:4, :12].any() and valid.sum() == WIDTH * HEIGHT - 48


@pytest.mark.parametrize(
    ("masks", "white", "keys"),
    [
        ("m/{}.png", False, {"mask_path": "m/{}.png"}),
        ("m/{}.png", False, {"mask_path": "C:\\x\\m\\{}.png"}),
        ("masks/{}.png.png", False, {}),
        ("masks/{}.png", False, {}),
        ("masks/images/{}.png", False, {}),
        ("images/dynamic_mask_{}.png", True, {}),
    ],
)
def test_masks_are_found_and_said(tmp_path, masks, white, keys):
    _capture(tmp_path, masks, white, **keys)
    with pytest.warns(UserWarning, match="9 of 9 photos have masks, which exclude 12.5% of their pixels"):
        data = load_dataset(tmp_path)
    assert (len(data.train), len(data.test)) == (7, 2)
    _assert_excluded((*data.train, *data.test))


def test_a_folder_of_masks_that_is_named(tmp_path):
    _capture(tmp_path / "a", "../given/{}.png")
    save(tmp_path / "given/other.png", np.zeros((2, 2), np.uint8))
    with pytest.warns(UserWarning, match="1 masks are of no photo: other.png"):
        data = load_dataset(tmp_path / "a", masks=tmp_path / "given")
    _assert_excluded(data.train)
    with pytest.raises(DatasetError, match="nowhere is no folder; give the folder of the masks"):
        load_dataset(tmp_path / "a", masks=tmp_path / "nowhere")


def test_missing_and_black_masks_are_named(tmp_path):
    _capture(tmp_path, "m/{}.png", mask_path="m/{}.png")
    (tmp_path / "m/3.png").unlink()
    save(tmp_path / "m/4.png", np.zeros((HEIGHT, WIDTH), np.uint8))
    with pytest.warns(UserWarning) as said:
        data = load_dataset(tmp_path)
    text = " ".join(str(one.message) for one in said)
    assert "1 masks are not used, their files are missing: m/3.png" in text
    assert "1 photos are left out, masks exclude all of them: images/4.png" in text
    assert len(data.train) == 6


@pytest.mark.filterwarnings("ignore:.*have masks")
def test_excluded_pixels_are_no_training_rays(tmp_path):
    data = load_dataset(_capture(tmp_path, "masks/{}.png"))
    devices.start("cpu")
    photos = DevicePhotos.load(data.train)
    assert photos.valid is not None and photos.valid.mean() == 1 - 48 / (WIDTH * HEIGHT)
    tiles = photos.patches(4)
    assert len(tiles) == 7 * (24 - 3) and not ((tiles[:, 1] < 12) & (tiles[:, 2] < 4)).any()


def test_figures_are_over_valid_pixels():
    one, other = np.zeros((20, 20, 3)), np.zeros((20, 20, 3))
    other[:3] = 1.0
    valid = np.ones((20, 20), bool)
    valid[:3] = False
    assert psnr(one, other) < 10 and psnr(one, other, valid) == np.inf
    far = valid & (np.arange(20)[:, None] >= 8)  # whose windows hold valid pixels alone
    assert ssim(one, other, far) == pytest.approx(1.0) and ssim(one, other) < 0.9


def test_masks_are_no_photos(tmp_path):
    _capture(tmp_path, "masks/{}.png")
    save(tmp_path / "images/dynamic_mask_1.png", np.zeros((2, 2), np.uint8))
    assert len(find_raw_photos(tmp_path)) == N
