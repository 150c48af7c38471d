"""Image and video files, and frames as they are written to them."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from PIL import Image

from cagefield.errors import CagefieldError, DatasetError
from cagefield.images import image_files
from cagefield.images.image_files import read_image, side_by_side, write_png, write_video
from cagefield.images.render_result import RenderResult, background_rgb, to_uint8


def gradient(height: int, width: int, channels: int = 3) -> np.ndarray:
    rng = np.random.default_rng(height * width + channels)
    return rng.integers(0, 256, (height, width, channels), np.uint8)


@pytest.mark.parametrize("channels", [3, 4])
def test_png_round_trip_is_exact(tmp_path, channels):
    image = gradient(7, 5, channels)
    write_png(tmp_path / "deep" / "a.png", image)
    np.testing.assert_array_equal(read_image(tmp_path / "deep" / "a.png"), image)
    assert [path.name for path in (tmp_path / "deep").iterdir()] == ["a.png"]


def test_grey_palette_and_16_bit_files_become_rgb(tmp_path):
    gray = gradient(4, 6, 1)[..., 0]
    Image.fromarray(gray).save(tmp_path / "gray.png")
    Image.fromarray(gray).convert("RGB").quantize(256).save(tmp_path / "palette.png")
    Image.fromarray(gray.astype(np.uint16) * 257).save(tmp_path / "deep.png")
    for name in ("gray", "palette", "deep"):
        np.testing.assert_array_equal(read_image(tmp_path / f"{name}.png"), np.repeat(gray[..., None], 3, -1))


def test_16_bit_values_are_rounded(tmp_path):
    Image.fromarray(np.array([[128, 129, 65535]], np.uint16)).save(tmp_path / "a.png")
    np.testing.assert_array_equal(read_image(tmp_path / "a.png")[0, :, 0], [0, 1, 255])


@pytest.mark.parametrize("mode", ["RGBA", "RGB", "L", "LA", "P", "1", "I;16"])
def test_pictures_are_converted_in_tiles(tmp_path, monkeypatch, mode):
    """The same as at once, with transparency of palettes too, and with little memory."""
    values = np.random.default_rng(1).integers(0, 256, (41, 30, 4), dtype=np.uint8)
    rgba = Image.fromarray(values)
    deep = Image.fromarray(values[..., 0].astype(np.uint16) * 250 + values[..., 1])
    picture = (
        deep if mode == "I;16" else rgba.convert("RGB").convert(mode) if mode == "P" else rgba.convert(mode)
    )
    picture.save(tmp_path / "a.png", **({"transparency": bytes(range(200))} if mode == "P" else {}))
    whole = read_image(tmp_path / "a.png")
    assert whole.shape == (41, 30, 4 if mode in ("RGBA", "LA", "P") else 3)
    for pixels in (1, 100, 300):
        monkeypatch.setattr(image_files, "_TILE_PIXELS", pixels)
        np.testing.assert_array_equal(read_image(tmp_path / "a.png"), whole)
    monkeypatch.undo()
    picture.resize((1000, 1000), Image.Resampling.NEAREST).save(tmp_path / "b.png")
    tracemalloc.start()
    try:
        found = read_image(tmp_path / "b.png")
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < found.nbytes + 3_500_000  # the file, and a tile; all at once took 8 to 24 MB


def test_tiles_cover_a_picture_once():
    for width, height, multiple in ((1, 1, 1), (500_000, 2, 2), (300, 900, 3), (5000, 4000, 8)):
        covered = np.zeros((height, width), np.uint8)
        for x, y, end_x, end_y in image_files.iterate_tiles(width, height, multiple):
            covered[y:end_y, x:end_x] += 1
            assert x % multiple == y % multiple == 0 and (end_x - x) * (end_y - y) <= 1 << 16
        assert (covered == 1).all()


def test_floats_are_rounded_and_clipped(tmp_path):
    write_png(tmp_path / "a.png", np.array([[-0.2, 0.5, 1.7]]).reshape(1, 1, 3))
    np.testing.assert_array_equal(read_image(tmp_path / "a.png")[0, 0], [0, 128, 255])
    np.testing.assert_array_equal(to_uint8(np.array([0.4 / 255, 0.6 / 255])), [0, 1])


def test_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "a.png"
    write_png(path, gradient(3, 3))
    before = path.read_bytes()

    def fail(self, file, **_):
        file.write_bytes(b"half")
        raise OSError("disk full")

    monkeypatch.setattr(Image.Image, "save", fail)
    with pytest.raises(OSError, match="disk full"):
        write_png(path, gradient(3, 3, 4))
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_unreadable_files_are_named(tmp_path):
    (tmp_path / "text.png").write_text("not a picture")
    write_png(tmp_path / "whole.png", gradient(40, 40))
    (tmp_path / "cut.png").write_bytes((tmp_path / "whole.png").read_bytes()[:600])
    with pytest.raises(DatasetError, match=r"none\.png: there is no such image"):
        read_image(tmp_path / "none.png")
    for name, reason in (("text.png", "no picture of a format that Pillow reads"), ("cut.png", "truncated")):
        with pytest.raises(DatasetError, match=rf"{name}: not a readable image \(.*{reason}"):
            read_image(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "image", "message"),
    [
        ("a.jpg", np.zeros((2, 2, 3), np.uint8), "write_png writes .png files"),
        ("a.png", np.zeros((2, 2, 2), np.uint8), r"\[H,W,C\] with C in \[1, 3, 4\], not \[2, 2, 2\]"),
        ("a.png", np.zeros((2, 2, 3), np.int64), "uint8, or floats in .*, not int64"),
    ],
)
def test_png_errors(tmp_path, name, image, message):
    with pytest.raises(CagefieldError, match=message):
        write_png(tmp_path / name, image)


def test_video_of_odd_size_plays_back(tmp_path):
    import imageio_ffmpeg

    colors = [(200, 40, 40), (40, 200, 40), (40, 40, 200)]
    frames = [np.full((35, 51, 3), color, np.uint8) for color in colors for _ in range(4)]
    write_video(tmp_path / "a.mp4", iter(frames), fps=8)
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]
    reader = imageio_ffmpeg.read_frames(str(tmp_path / "a.mp4"))
    info = next(reader)
    assert info["size"] == (52, 36)
    assert info["fps"] == pytest.approx(8)
    assert info["codec"] == "h264"
    assert info["pix_fmt"].startswith("yuv420p")
    played = [np.frombuffer(data, np.uint8).reshape(36, 52, 3) for data in reader]
    assert len(played) == len(frames)
    for index, color in ((1, colors[0]), (6, colors[1]), (10, colors[2])):
        # YUV and compression cost a few levels on flat color
        np.testing.assert_allclose(played[index].mean((0, 1)), color, atol=8)


def test_video_errors_leave_nothing(tmp_path):
    small, large = np.zeros((16, 16, 3), np.uint8), np.zeros((16, 18, 3), np.uint8)
    with pytest.raises(CagefieldError, match="at least one frame"):
        write_video(tmp_path / "a.mp4", [])
    with pytest.raises(CagefieldError, match=r"frame 1 is \[16, 18, 3\]; all frames must be \[16, 16, 3\]"):
        write_video(tmp_path / "a.mp4", [small, large])
    with pytest.raises(CagefieldError, match=r"a video's name ends in \.mp4"):
        write_video(tmp_path / "a.gif", [small])
    with pytest.raises(CagefieldError, match="fps must be positive"):
        write_video(tmp_path / "a.mp4", [small], fps=0)
    assert list(tmp_path.iterdir()) == []


def test_side_by_side_keeps_pictures_and_fills_with_white():
    first, second = gradient(4, 3), gradient(6, 5)
    row = side_by_side(first, second, gap=2)
    assert row.shape == (6, 10, 3)
    np.testing.assert_array_equal(row[:4, :3], first)
    np.testing.assert_array_equal(row[:, 5:], second)
    assert (row[4:, :3] == 255).all()
    assert (row[:, 3:5] == 255).all()
    with pytest.raises(CagefieldError, match="at least one image"):
        side_by_side()


def frame(background):
    rng = np.random.default_rng(0)
    opacity = rng.uniform(size=(4, 5))
    opacity[0, 0] = 0
    straight = rng.uniform(size=(4, 5, 3))
    depth = np.where(opacity > 0, 2.0, np.inf)
    made = RenderResult.from_premultiplied(
        straight * opacity[..., None], opacity, depth, background=background
    )
    return made, straight, opacity


@pytest.mark.parametrize("background", ["white", "black", (0.2, 0.5, 0.1), "none"])
def test_frame_composites_and_gives_back_straight_alpha(background):
    made, straight, opacity = frame(background)
    behind = background_rgb(background)
    if behind is not None:
        expected = straight * opacity[..., None] + (1 - opacity[..., None]) * np.array(behind)
        np.testing.assert_allclose(made.rgb, expected, atol=1e-6)
    rgba = made.rgba8().astype(float) / 255
    np.testing.assert_allclose(rgba[..., 3], opacity, atol=0.51 / 255)
    seen = opacity > 0.1
    # dividing by an opacity of at least .1 magnifies float32 rounding tenfold
    np.testing.assert_allclose(rgba[seen][:, :3], straight[seen], atol=0.51 / 255 + 1e-5)
    assert (rgba[0, 0] == 0).all()


def test_frame_over_another_background():
    white, _, _ = frame("white")
    red, _, _ = frame((1, 0, 0))
    np.testing.assert_allclose(white.over((1, 0, 0)).rgb, red.rgb, atol=1e-6)
    assert white.over("white") is white


def test_frame_is_read_only_and_checked():
    made, _, _ = frame("white")
    with pytest.raises(ValueError, match="read-only"):
        made.rgb[0, 0] = 0
    with pytest.raises(CagefieldError, match=r"depth must be \[4, 5\] like opacity, not \[4, 4\]"):
        RenderResult(made.rgb, made.opacity, made.depth[:, :4])
    with pytest.raises(CagefieldError, match=r'"white", "black", "none" or \(r, g, b\), not "gray"'):
        background_rgb("gray")
    with pytest.raises(CagefieldError, match=r"three numbers in \[0, 1\]"):
        background_rgb((0, 0, 300))
