"""Photos and views: the box filter against direct means, splits, and what a data set refuses."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from cagefield.cameras.camera import Camera
from cagefield.datasets import Dataset, View
from cagefield.datasets.photos import choose_downscale, find_photo, photo_folders, read_header, read_photo
from cagefield.datasets.views import hold_out, report_missing
from cagefield.errors import DatasetError
from cagefield.images import image_files
from posed_photos import save

RNG = np.random.default_rng(5)


def _view(path: Path, width: int = 8, height: int = 6) -> View:
    return View(path.name, Camera(np.eye(4), width, height, 9.0, 9.0, 4.0, 3.0), path)


@pytest.mark.parametrize("factor", [1, 2, 3])
def test_box_filter_of_rgb(tmp_path, factor):
    pixels = RNG.integers(0, 256, (7, 11, 3), dtype=np.uint8)
    save(tmp_path / "a.png", pixels)
    small = read_photo(tmp_path / "a.png", factor)
    h, w = 7 // factor, 11 // factor
    means = (
        pixels[: h * factor, : w * factor].reshape(h, factor, w, factor, 3).astype(float).mean(axis=(1, 3))
    )
    assert small.dtype == np.uint8 and small.shape == (h, w, 3)
    np.testing.assert_allclose(small, means, atol=0.6)  # whole numbers, rounded in Pillow's fixed point


def test_box_filter_of_rgba_weights_colors_by_alpha(tmp_path):
    pixels = np.zeros((2, 4, 4), dtype=np.uint8)
    pixels[0, 0] = (200, 100, 50, 255)
    pixels[0, 1] = (0, 250, 0, 85)  # a third as opaque, so a third of the weight
    pixels[:, 2:] = (90, 90, 90, 0)
    save(tmp_path / "a.png", pixels)
    small = read_photo(tmp_path / "a.png", 2)
    np.testing.assert_array_equal(
        small[0, 0], [150, 138, 38, 85]
    )  # (3 a + b) / 4 rounded; alpha (255 + 85) / 4
    assert small[0, 1, 3] == 0


def test_composite_of_shrunk_cut_out_is_the_shrunk_composite(tmp_path):
    pixels = RNG.integers(0, 256, (12, 16, 4), dtype=np.uint8)
    save(tmp_path / "a.png", pixels)
    small = read_photo(tmp_path / "a.png", 4).astype(float)

    def on_white(rgba):
        alpha = rgba[..., 3:] / 255
        return rgba[..., :3] * alpha + 255 * (1 - alpha)

    direct = on_white(pixels.astype(float)).reshape(3, 4, 4, 4, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(on_white(small), direct, atol=1.6)  # alpha and color each rounded once


@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("factor", [1, 3])
def test_photos_are_converted_in_tiles(tmp_path, monkeypatch, channels, factor):
    """The same as at once, for sides that no tile divides."""
    save(tmp_path / "a.png", RNG.integers(0, 256, (47, 20, channels), dtype=np.uint8))
    whole = read_photo(tmp_path / "a.png", factor)
    for pixels in (1, 50, 200, 400):
        monkeypatch.setattr(image_files, "_TILE_PIXELS", pixels)
        np.testing.assert_array_equal(read_photo(tmp_path / "a.png", factor), whole)


@pytest.mark.parametrize("shape", [(1000, 1000), (2, 500_000)], ids=["square", "wide"])
@pytest.mark.parametrize("factor", [1, 2])
def test_photos_are_read_with_little_memory(tmp_path, shape, factor):
    save(tmp_path / "a.png", np.zeros((*shape, 4), np.uint8))
    tracemalloc.start()
    try:
        found = read_photo(tmp_path / "a.png", factor)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    # Means of a tile take 40 bytes a pixel: 4 MB with lists and names; 12 to 40 at once. Pillow's own is not
    # counted.
    assert most < found.nbytes + 4_000_000


@pytest.mark.parametrize(
    ("mode", "channels"), [("L", 3), ("P", 3), ("1", 3), ("CMYK", 3), ("LA", 4), ("RGBA", 4), ("RGB", 3)]
)
def test_every_8_bit_mode_becomes_rgb_or_rgba(tmp_path, mode, channels):
    path = tmp_path / ("a.tif" if mode == "CMYK" else "a.png")
    Image.new("RGB", (6, 4), (255, 255, 255)).convert(mode).save(path)
    pixels = read_photo(path)
    assert pixels.shape == (4, 6, channels) and (pixels == 255).all()
    assert read_header(path).alpha == (channels == 4)


def test_photos_smaller_than_the_factor_are_refused(tmp_path):
    path = tmp_path / "a.png"
    save(path, np.zeros((12, 3, 3), np.uint8))
    assert read_photo(path, 3).shape == (4, 1, 3)
    with pytest.raises(DatasetError, match="3x12 pixels are too few to shrink by 4"):
        read_photo(path, 4)


def test_missing_extensions_are_found(tmp_path):
    for name in ("r_0.png", "r_1.JPG", "frame.001.jpeg"):
        (tmp_path / name).write_bytes(b"")
    assert find_photo(tmp_path / "r_0") == tmp_path / "r_0.png"
    assert find_photo(tmp_path / "r_1") == tmp_path / "r_1.JPG"
    assert find_photo(tmp_path / "r_1.JPG") == tmp_path / "r_1.JPG"
    assert find_photo(tmp_path / "frame.001") == tmp_path / "frame.001.jpeg"
    assert find_photo(tmp_path / "r_2") is None and find_photo(tmp_path) is None


@pytest.mark.parametrize(
    ("side", "wanted", "stored", "factor"),
    [
        (800, None, (1,), 1),
        (801, None, (1,), 2),
        (1920, None, (1,), 4),
        (4032, None, (1,), 8),
        (4032, None, (1, 4, 8), 8),
        (400, None, (4, 8), 4),
        (4032, None, (3,), 3),
        (4032, 5, (1, 4), 5),
        (4032, 8, (4,), 8),
    ],
)
def test_choice_of_downscale(side, wanted, stored, factor):
    assert choose_downscale(side, wanted, {f: Path(f"images_{f}") for f in stored}) == factor


def test_downscale_without_a_folder_for_it():
    with pytest.raises(
        DatasetError, match=r"downscale 2 cannot be made from the photos there are \(images_4\)"
    ):
        choose_downscale(4032, 2, {4: Path("images_4")})


def test_photo_folders(tmp_path):
    for name in ("images", "images_4", "images_08", "images_old", "masks"):
        (tmp_path / name).mkdir()
    assert photo_folders(tmp_path) == {1: tmp_path / "images", 4: tmp_path / "images_4"}


def test_view_load_notices_another_size(tmp_path):
    path = tmp_path / "a.png"
    save(path, np.zeros((6, 8, 3), dtype=np.uint8))
    view = _view(path).downscaled(2)
    assert view.load().shape == (3, 4, 3)
    save(path, np.zeros((6, 10, 3), dtype=np.uint8))
    with pytest.raises(DatasetError, match="5x3 pixels after shrinking by 2, the camera has 4x3"):
        view.load()


def test_hold_out_is_every_nth_by_name():
    views = [_view(Path(f"{index:02}.png")) for index in (5, 3, 8, 0, 1, 2, 4, 6, 7)]
    train, test = hold_out(views, 8)
    assert [v.name for v in test] == ["00.png", "08.png"] and [v.name for v in train][:2] == [
        "01.png",
        "02.png",
    ]
    assert hold_out(views[:1], 8) == ((views[0],), ())
    assert len(hold_out(views, 0)[0]) == 9


def test_report_missing_names_a_hundred_at_most():
    with pytest.warns(UserWarning, match=r"120 of 300 frames are left out, .*: 0, 1, .* 99 and 20 more$"):
        report_missing(Path("x"), [str(n) for n in range(120)], 300)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"bounds": np.zeros((3, 2))}, r"bounds must be \[2, 3\] finite numbers"),
        ({"bounds": [[0, 0, 0], [1, 1, np.nan]]}, r"bounds must be \[2, 3\] finite numbers"),
        ({"bounds": [[0, 0, 0], [1, 1, 0]]}, r"bounds must grow"),
        ({"train": ()}, "no training views"),
    ],
)
def test_dataset_rejects(changes, message):
    values = {
        "name": "a", "path": Path("a"), "train": (_view(Path("a.png")),), "test": (), "val": (),
        "unbounded": False, "bounds": [[0, 0, 0], [1, 1, 1]], "white_background": False,
    }  # fmt: skip
    assert not Dataset(**values).bounds.flags.writeable
    with pytest.raises(DatasetError, match=message):
        Dataset(**{**values, **changes})
